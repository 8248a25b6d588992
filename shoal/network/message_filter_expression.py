"""Filters of messages to show: depth > 2 m, EstimatedState.depth > 2 and not u < 1 kn, state == EXECUTING.

A word is a field, with or without the name of its message; a field of a message inside is `arg.plan_id`. The fields
of the header are src, src_ent, dst, dst_ent and timestamp. Everything else is the grammar of conditions: units,
functions, names of enumerated values, texts in quotes, and `~`, which means *contains*. A comparison is false for a
message without the field, or whose field has another unit, or no such value.
"""

import math
from collections.abc import Callable, Iterable
from typing import Any

import imc
from imc.expressions import HEADER, ExpressionCompiler, FieldPlace, NameScope, RobustnessFunction, is_special
from support.expressions import Comparison, ExpressionError, Name, parse_tree
from support.terminal_text import suggestion

MessageTest = Callable[[imc.Message], bool]
MESSAGES = "`shoal message NAME` lists them"


def parse_message_filter(
    text: str, kinds: Iterable[type[imc.Message]] = (), schema: imc.Schema | None = None
) -> MessageTest:
    """The test of an expression for messages of these types, without any for all of a schema, by default ours.

    Raises ValueError with the reason, and with the place of the mistake.
    """
    schema = schema or imc.builtin()
    known = list(kinds) or [schema[name] for name in schema.types]
    if not text.strip():
        return lambda _: True
    tree, asked, scopes = parse_tree(text), _Fields(known, schema), list[_OneMessage]()
    tests: dict[type[imc.Message], RobustnessFunction] = {}
    for kind in known:
        scope = _OneMessage(kind, asked)
        scopes.append(scope)
        tests[kind] = ExpressionCompiler(scope).test(tree)
    _check_that_each_applies(scopes, asked)

    def test(message: imc.Message) -> bool:
        meaning = tests.get(type(message))
        if meaning is None:  # of another schema, or with an id that is not known
            try:
                meaning = ExpressionCompiler(_OneMessage(type(message), asked)).test(tree)
            except ExpressionError:
                return False
            tests[type(message)] = meaning
        return meaning((message,), -math.inf) > 0.0

    return test


def field_value(message: imc.Message, path: str) -> Any:
    """The value of a field such as depth or arg.plan_id. Raises AttributeError if the message has none."""
    value: Any = message
    for name in path.split("."):
        if not isinstance(value, imc.Message) or name not in value.__struct_fields__:
            raise AttributeError(path)
        value = getattr(value, name)
    return value


class _FieldMissingError(ExpressionError):
    """A message of this kind has no such field; another one may have it."""


class _OneMessage(NameScope):
    """Names are fields of messages of one kind. Of comparisons, it keeps which cannot be made, and why."""

    accepts_nan = False

    def __init__(self, kind: type[imc.Message], asked: "_Fields"):
        self.wrong: dict[int, tuple[Comparison, ExpressionError]] = {}
        self._kind = kind
        self._kinds, self._schema, self._all_fields = asked.kinds, asked.schema, asked.names
        self._fields = {info.name: info for info in imc.fields(kind)}

    def place(self, node: Name) -> FieldPlace | None:
        if node.vehicle or node.receiver or node.entity is not None:
            raise node.error(f"{node.text!r}: write the field alone; VEHICLE and --entities choose whose it is")
        if node.name == self._kind.__name__:
            self._check_field(node, node.path)
            return FieldPlace(self._kind, 0, node.path)
        path = f"{node.name}.{node.path}" if node.path else node.name
        if node.name in self._fields or node.name in HEADER:
            self._check_field(node, path)
            return FieldPlace(self._kind, 0, path)
        if node.name in self._schema and self._schema[node.name] not in self._kinds:
            raise node.error(f"{node.name} is not among the messages asked for")
        if node.path or node.name in self._schema or node.name in self._all_fields:
            raise _FieldMissingError(node.text, node.at)
        return None

    def wrong_comparison(self, node: Comparison, error: ExpressionError) -> RobustnessFunction:
        self.wrong[node.at] = node, error
        return lambda _, __: -math.inf

    def _check_field(self, node: Name, path: str) -> None:
        """Reject a field of what is no message, or that the message does not have."""
        first, _, rest = path.partition(".")
        info = self._fields.get(first)
        if (path and info is None and path not in HEADER) or (rest and (info is None or info.type != "message")):
            raise _FieldMissingError(node.text, node.at)


class _Fields:
    """The fields of all kinds of messages that are asked for, for the words of errors."""

    def __init__(self, kinds: list[type[imc.Message]], schema: imc.Schema):
        self.kinds = kinds
        self.schema = schema
        self._infos = [info for kind in kinds for info in imc.fields(kind)]
        self.names = {info.name for info in self._infos}
        self._has = f"{kinds[0].__name__} has no field" if len(kinds) == 1 else "none of these messages has a field"

    def error(self, node: Comparison) -> ExpressionError | None:
        """The fault of a comparison that no kind of message can make; None if each name is known."""
        for side, other in ((node.left, node.right), (node.right, node.left)):
            if not isinstance(side, Name) or self._is_known(side) or is_special(side.name):
                continue
            is_value = side.is_bare and isinstance(other, Name) and self._is_known(other)
            return side.error(self._value_reason(side, other.text) if is_value else self._field_reason(side))
        return None

    def _is_known(self, node: Name) -> bool:
        if node.name in self.schema:
            return node.path in {info.name for info in imc.fields(self.schema[node.name])}
        return (node.name in self.names or node.name in HEADER) and not node.path

    def _value_reason(self, side: Name, field: str) -> str:
        last = field.rpartition(".")[2]
        enums = [info.enum for info in self._infos if info.name == last and info.enum is not None]
        values = sorted({name for enum in enums for name in enum.__members__})
        hint = (suggestion(side.text, values) or MESSAGES) if values else "write a number, or a text in quotes"
        return f"{field}: {side.text!r} is not a value of it; {hint}"

    def _field_reason(self, side: Name) -> str:
        names, has, word = self.names, self._has, side.text
        if side.name in self.schema:
            names, has, word = (
                {i.name for i in imc.fields(self.schema[side.name])},
                f"{side.name} has no field",
                side.path,
            )
        name, _, inner = word.partition(".")
        if inner and (name in names or name in HEADER):
            return f"{name} has no fields, so there is no {word}"
        return f"{has} {name!r}; {suggestion(name, names) or MESSAGES}"


def _check_that_each_applies(scopes: list[_OneMessage], fields: _Fields) -> None:
    """Raise the error of a comparison that no kind of message can make."""
    for at, (node, first) in scopes[0].wrong.items():
        if not all(at in scope.wrong for scope in scopes):
            continue
        errors = [scope.wrong[at][1] for scope in scopes]
        known = next(
            (
                error
                for error in errors
                if "neither a number" not in error.reason and not isinstance(error, _FieldMissingError)
            ),
            None,
        )
        raise fields.error(node) or known or first
