"""Which messages somebody wants to see: depth > 2, EstimatedState.depth > 2 and not u < 0.5, state == EXECUTING.

A word is a field, with or without the name of its message; a field of a message inside is `arg.plan_id`. The fields
of the header are src, src_ent, dst, dst_ent and timestamp. A value is a number (also 15deg, for a field in rad), the
name of an enumerated value, or a text in quotes. `~` is *contains*: a text in a text, a bit in a bit field. A message
without the field does not match.
"""

import math
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, cast

import imc
from autonomy.plans import NUMBER_PATTERN, SIGN_PATTERN, GrammarParser, predicate_connectives
from support.terminal_text import suggestion

MessageTest = Callable[[imc.Message], bool]
Named = Mapping[type[imc.Message], int]
HEADER = ("src", "src_ent", "dst", "dst_ent", "timestamp")
DEGREES = ("deg", "°")
MESSAGES = "`shoal message NAME` lists them"
_WORD = re.compile(rf"\s*(?:{NUMBER_PATTERN}|[A-Za-z_]\w*(?:\.\w+)*|\"[^\"]*\"|'[^']*'|°|~|{SIGN_PATTERN})")


class _Wanted(NamedTuple):
    value: float | str
    named: Named | None = None


def parse_message_filter(
    text: str, kinds: Iterable[type[imc.Message]] = (), schema: imc.Schema | None = None
) -> MessageTest:
    """The test of an expression for messages of these types, without any for all of a schema, by default ours.

    Raises ValueError with the reason.
    """
    schema = schema or imc.builtin()
    known = list(kinds) or [schema[name] for name in schema.types]
    if not text.strip():
        return lambda _: True
    return GrammarParser[MessageTest](
        text, _WORD, lambda logic: _comparison(logic, known, schema), predicate_connectives()
    ).parse()


def field_value(message: imc.Message, path: str) -> Any:
    """The value of a field such as depth or arg.plan_id. Raises AttributeError if the message has none."""
    value: Any = message
    for name in path.split("."):
        if not isinstance(value, imc.Message) or name not in value.__struct_fields__:
            raise AttributeError(path)
        value = getattr(value, name)
    return value


def field_infos(kind: type[imc.Message]) -> dict[str, imc.FieldInfo]:
    return {info.name: info for info in imc.fields(kind)}


def _comparison(logic: GrammarParser[MessageTest], kinds: list[type[imc.Message]], schema: imc.Schema) -> MessageTest:
    word = logic.expect_word("a field")
    if not (word[0].isalpha() or word[0] == "_"):
        raise ValueError(f"{word!r} is no field; the field comes first, as in depth > 2")
    path, kinds = _split(word, kinds, schema)
    infos = {kind: info for kind in kinds if (info := field_infos(kind).get(path))}
    compare = _contains if logic.accept("~") else logic.expect_comparison()
    only = frozenset(kinds) if word != path else None
    wanted, named = _value(logic, word, infos)

    def test(message: imc.Message) -> bool:
        if (named and type(message) not in named) or (only is not None and type(message) not in only):
            return False
        try:
            value = field_value(message, path)
        except AttributeError:
            return False
        right = named[type(message)] if named else wanted
        return _comparable(value, right) and compare(value, right)

    return test


def _split(word: str, kinds: list[type[imc.Message]], schema: imc.Schema) -> tuple[str, list[type[imc.Message]]]:
    """The path of a field, and the types that it may be in. Raises ValueError if no type has it."""
    first, _, rest = word.partition(".")
    if rest and first in schema:
        kinds, word = [kind for kind in kinds if kind.__name__ == first], rest
        if not kinds:
            raise ValueError(f"{first} is not among the messages asked for")
    name = word.partition(".")[0]
    names = {name for kind in kinds for name in field_infos(kind)}
    if name not in names and name not in HEADER:
        of = kinds[0].__name__ if len(kinds) == 1 else "none of these messages"
        has = "has no field" if len(kinds) == 1 else "has a field"
        raise ValueError(f"{of} {has} {name!r}; {suggestion(name, names) or MESSAGES}")
    if name != word and not any(name in (f.name for f in imc.fields(k) if f.type == "message") for k in kinds):
        raise ValueError(f"{name} has no fields, so there is no {word}")
    return word, kinds


def _value(logic: GrammarParser[MessageTest], word: str, infos: Mapping[type[imc.Message], imc.FieldInfo]) -> _Wanted:
    """The value of a comparison; the name of an enumerated one has a number for each type of message."""
    text = logic.expect_word("a value")
    if text[0] in "\"'":
        return _Wanted(text[1:-1])
    try:
        number = float(text)
    except ValueError:
        pass
    else:
        if math.isnan(number):
            raise ValueError(f"{word}: nothing compares with {text}")
        return _Wanted(math.radians(number) if logic.accept(*DEGREES) else number)
    members = {kind: info.enum.__members__ for kind, info in infos.items() if info.enum is not None}
    found = {kind: int(names[text]) for kind, names in members.items() if text in names}
    if not found:
        names = sorted({name for mapping in members.values() for name in mapping})
        hint = (suggestion(text, names) or MESSAGES) if names else "write a number, or a text in quotes"
        raise ValueError(f"{word}: {text!r} is not a value of it; {hint}")
    return _Wanted(0.0, found)


def _comparable(value: Any, wanted: Any) -> bool:
    return isinstance(value, str) if isinstance(wanted, str) else isinstance(value, (int, float))


def _contains(value: Any, wanted: Any) -> bool:
    if isinstance(wanted, str):
        return wanted.lower() in cast(str, value).lower()
    return bool(int(value) & int(wanted))
