"""What stands on the sides of a comparison: fields, numbers with units, names, texts, sums and functions of these."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import IntEnum, IntFlag
from typing import Any, NamedTuple

import imc
from autonomy.plans import GrammarParser
from autonomy.plans.yaml import UNITS, parse_quantity
from imc.layout import NUMBERS
from shoal.scenarios.expression_functions import FUNCTIONS, POSITION_FUNCTIONS, WorldBottom, has_position
from shoal.scenarios.robustness import LatestMessages, RobustnessFunction
from support.terminal_text import with_suggestion

_PARTS = re.compile(r"(\w+)(?:\[([^\]]*)\])?(?:\.(\w+))?(?:@(.+))?")
_SPECIAL = ("inf", "infinity", "nan")
_ENUMERATIONS = ("Enumerated", "Bitfield")


class MessageSelector(NamedTuple):
    """The messages of a kind that a vehicle publishes, of the entity with this label only if one is given.

    The kind WorldBottom stands for the bottom in its world.
    """

    kind: type[imc.Message] | type[WorldBottom]
    vehicle: str
    entity: str = ""


@dataclass(frozen=True)
class Operand:
    """`value` is a function of the latest messages; it `needs` those with these numbers.

    `unit` is empty if it is not known, `enum` has the names of its values. A `name` is not understood by itself:
    `known` is what it might mean.
    """

    text: str
    value: Callable[[LatestMessages], Any]
    needs: frozenset[int] = frozenset()
    unit: str = ""
    enum: type[IntEnum] | type[IntFlag] | None = None
    is_text: bool = False
    name: str = ""
    known: tuple[str, ...] = ()

    def check_is_number(self) -> None:
        if self.name:
            raise ValueError(
                with_suggestion(f"{self.name!r} is neither a number nor Message.field", self.name, self.known)
            )
        if self.is_text:
            raise ValueError(f"{self.text} is a text, not a number")

    def check_units(self, other: "Operand") -> str:
        """The unit of both. Raises ValueError if they differ."""
        if self.unit and other.unit and self.unit != other.unit:
            raise ValueError(f"{self.text} is in {self.unit}, but {other.text} in {other.unit}")
        return self.unit or other.unit


class OperandParser:
    """Reads operands from the words of a text, and collects the messages that they use."""

    def __init__(self, vehicles: Mapping[str, imc.Schema], vehicle: str):
        self.selectors: dict[MessageSelector, int] = {}
        self._vehicles = vehicles
        self._vehicle = vehicle

    def parse_sum(self, logic: GrammarParser[RobustnessFunction]) -> Operand:
        found = self._parse_product(logic)
        while logic.lookahead_word in ("+", "-"):
            sign = logic.expect_word("a sign")
            other = self._parse_product(logic)
            found.check_is_number()
            other.check_is_number()
            unit = found.check_units(other)
            found = _combine(
                f"{found.text} {sign} {other.text}", _add if sign == "+" else _subtract, found, other, unit
            )
        return found

    def _parse_product(self, logic: GrammarParser[RobustnessFunction]) -> Operand:
        found = logic.parse_with_nesting_limit(lambda: self._parse_factor(logic))
        while logic.lookahead_word in ("*", "/"):
            sign = logic.expect_word("a sign")
            other = logic.parse_with_nesting_limit(lambda: self._parse_factor(logic))
            found.check_is_number()
            other.check_is_number()
            plain = other if not other.needs and not other.unit else found if sign == "*" else None
            kept = (found if plain is other else other).unit if plain and not plain.unit and not plain.needs else ""
            found = _combine(
                f"{found.text} {sign} {other.text}", _multiply if sign == "*" else _divide, found, other, kept
            )
        return found

    def _parse_factor(self, logic: GrammarParser[RobustnessFunction]) -> Operand:
        if logic.accept("-"):
            inner = logic.parse_with_nesting_limit(lambda: self._parse_factor(logic))
            inner.check_is_number()
            value = inner.value

            def negative(latest: LatestMessages) -> float:
                return -value(latest)

            return replace(inner, text=f"-{inner.text}", value=negative, enum=None)
        if logic.accept("+"):
            return logic.parse_with_nesting_limit(lambda: self._parse_factor(logic))
        if logic.accept("("):
            inner = self.parse_sum(logic)
            logic.close_group()
            return replace(inner, text=f"({inner.text})")
        word = logic.expect_word("a number or Message.field")
        if word[0].isdigit() or word[0] == ".":
            return _number(word)
        if word[0] in "\"'":
            return Operand(word, lambda _: word[1:-1], is_text=True)
        if not (word[0].isalpha() or word[0] == "_"):
            raise ValueError(f"{word!r} is not expected")
        return self._parse_call(word, logic) if logic.lookahead_word == "(" else self._parse_name(word)

    def _parse_call(self, word: str, logic: GrammarParser[RobustnessFunction]) -> Operand:
        logic.accept("(")
        if word in POSITION_FUNCTIONS:
            return self._parse_position_call(word, logic)
        if word not in FUNCTIONS:
            raise ValueError(with_suggestion(f"there is no function {word!r}", word, [*FUNCTIONS, *POSITION_FUNCTIONS]))
        function, given = FUNCTIONS[word], [self.parse_sum(logic)]
        while logic.accept(","):
            given.append(self.parse_sum(logic))
        logic.close_group()
        if not function.least <= len(given) <= function.most:
            raise ValueError(f"{word} takes {function.least} value{'s' * (function.least > 1)}, not {len(given)}")
        first = next((operand for operand in given if operand.unit), given[0])
        for operand in given:
            operand.check_is_number()
            first.check_units(operand)
        call, values = function.call, [operand.value for operand in given]
        needs = frozenset[int]().union(*(operand.needs for operand in given))
        text = f"{word}({', '.join(operand.text for operand in given)})"
        unit = first.unit if function.keeps_unit else ""
        if len(values) == 1:
            (only,) = values
            return Operand(text, lambda latest: call(only(latest)), needs, unit)
        return Operand(text, lambda latest: call(*[value(latest) for value in values]), needs, unit)

    def _parse_position_call(self, word: str, logic: GrammarParser[RobustnessFunction]) -> Operand:
        call, is_deep = POSITION_FUNCTIONS[word], word == "altitude"
        first, name, vehicle = self._parse_position(word, logic, deep=is_deep)
        if is_deep:
            second = self._index(MessageSelector(WorldBottom, vehicle))
        elif not logic.accept(","):
            raise ValueError(f"{word} takes two messages, such as {word}(SimulatedState, EstimatedState)")
        else:
            second, other, _ = self._parse_position(word, logic)
            name = f"{name}, {other}"
        logic.close_group()
        needs = frozenset((first, second))
        return Operand(f"{word}({name})", lambda latest: call(latest[first], latest[second]), needs, "m")

    def _parse_position(
        self, function: str, logic: GrammarParser[RobustnessFunction], *, deep: bool = False
    ) -> tuple[int, str, str]:
        """The number of a message that tells a place, the message as it is written, and its vehicle."""
        word = logic.expect_word("a message")
        selector, field = self._selector(word)
        if selector is None or field or issubclass(selector.kind, WorldBottom):
            raise ValueError(f"{function} takes messages, such as SimulatedState, not {word!r}")
        if not has_position(selector.kind, deep=deep):
            raise ValueError(f"{selector.kind.__name__} has no position" + (" of a vehicle" if deep else ""))
        return self._index(selector), word, selector.vehicle

    def _parse_name(self, word: str) -> Operand:
        if word.lower() in _SPECIAL:
            number = float(word)
            return Operand(word, lambda _: number)
        selector, field = self._selector(word)
        if selector is None or issubclass(selector.kind, WorldBottom):
            return Operand(word, lambda _: math.nan, name=word, known=tuple(FUNCTIONS))
        if not field:
            raise ValueError(f"{word!r} is a message: write which field, such as {_example(selector.kind, word)}")
        infos = {info.name: info for info in imc.fields(selector.kind)}
        usable = [name for name, info in infos.items() if info.type in NUMBERS or info.type == "plaintext"]
        if field not in usable:
            raise ValueError(with_suggestion(f"{selector.kind.__name__} has no numeric field {field!r}", field, usable))
        info, index = infos[field], self._index(selector)
        unit = "" if info.unit in _ENUMERATIONS else info.unit
        return Operand(
            word,
            lambda latest: getattr(latest[index], field),
            frozenset((index,)),
            unit,
            info.enum,
            info.type == "plaintext",
        )

    def _selector(self, word: str) -> tuple[MessageSelector | None, str]:
        """What a word such as Message[Entity].field@vehicle selectors, None if it is a plain name; and the field."""
        parts = _PARTS.fullmatch(word)
        if parts is None:
            raise ValueError(f"{word!r} is not understood")
        name, entity, field, vehicle = parts.groups(default="")
        vehicle = vehicle or self._vehicle
        if vehicle not in self._vehicles and "@" in word:
            raise ValueError(with_suggestion(f"there is no vehicle {vehicle!r}", vehicle, self._vehicles))
        schema = self._vehicles.get(vehicle, imc.builtin())
        if name not in schema:
            if not field and "@" not in word and "[" not in word:
                return None, ""
            messages = [kind.abbrev for kind in schema.types_by_id.values()]
            raise ValueError(with_suggestion(f"there is no message {name!r}", name, messages))
        if vehicle not in self._vehicles:
            raise ValueError(f"{word!r}: there are several vehicles; write @NAME behind it, or vehicle: NAME")
        return MessageSelector(schema[name], vehicle, entity.strip()), field

    def _index(self, selector: MessageSelector) -> int:
        return self.selectors.setdefault(selector, len(self.selectors))


def _number(word: str) -> Operand:
    suffix = word.lstrip("0123456789.eE+-").strip()
    number = parse_quantity(word) if suffix else float(word)
    return Operand(word, lambda _: number, unit=UNITS.get(suffix, ""))


def _example(kind: type[imc.Message], word: str) -> str:
    name = next((info.name for info in imc.fields(kind) if info.type in NUMBERS), "field")
    message, at, vehicle = word.partition("@")
    return f"{message}.{name}{at}{vehicle}"


def _combine(text: str, join: Callable[[float, float], float], a: Operand, b: Operand, unit: str) -> Operand:
    first, second = a.value, b.value
    return Operand(text, lambda latest: join(first(latest), second(latest)), a.needs | b.needs, unit)


def _add(a: float, b: float) -> float:
    return a + b


def _subtract(a: float, b: float) -> float:
    return a - b


def _multiply(a: float, b: float) -> float:
    return a * b


def _divide(a: float, b: float) -> float:
    return a / b if b else math.nan
