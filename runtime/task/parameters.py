"""Task parameters: one declaration for parsing the profile, answering IMC requests, and documentation."""

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, Protocol, get_args, get_origin, get_type_hints

from support.number_parsing import NUMBER, leading_number

Visibility = Literal["user", "developer"]
Scope = Literal["global", "idle", "plan", "maneuver"]
LONGEST_INTEGER = 64  # digits
Kind = type[bool] | type[int] | type[float] | type[str]

_INTEGER = re.compile(r"([+-]?)(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9]\d*)")


class ParameterError(ValueError):
    """The value of a parameter is invalid: `name` is the parameter's, `reason` is the cause."""

    def __init__(self, name: str, reason: str):
        super().__init__(f"{name}: {reason}")
        self.name = name
        self.reason = reason


class SharedOption(Protocol):
    """An option of a section that several tasks read; the sections that its items name begin with `section_prefix`."""

    @property
    def unit(self) -> str: ...

    @property
    def meaning(self) -> str: ...

    @property
    def default(self) -> str: ...

    @property
    def section_prefix(self) -> str: ...


def _text(word: str) -> str:
    return word


def _bool(word: str) -> bool:
    if word in ("true", "True", "1"):
        return True
    if word in ("false", "False", "0"):
        return False
    raise ValueError("is not true or false")


def _int(word: str) -> int:
    match = _INTEGER.match(word)
    if match is None:
        raise ValueError("is not an integer")
    sign, digits = match.groups()
    base = 16 if digits[:2] in ("0x", "0X") else 8 if digits.startswith("0") and len(digits) > 1 else 10
    value = int(sign + digits, base) if len(digits) < LONGEST_INTEGER else 1 << 64
    if not -(1 << 63) <= value < 1 << 63:
        raise ValueError("is not an integer of 64 bits")
    return value


def _float(word: str) -> float:
    try:
        return leading_number(word)
    except ValueError:
        raise ValueError("is not a number") from None


_PARSERS: Mapping[Kind, Callable[[str], Any]] = {str: _text, bool: _bool, int: _int, float: _float}
_IMC_TYPES: Mapping[Kind, str] = {str: "string", bool: "boolean", int: "integer", float: "real"}


@dataclass(slots=True)
class Parameter:
    """The declaration of a parameter: name in the ini, type, default, unit, description and limits.

    `type` is bool, int, float or str; with `is_list` a list of them. `size` is the allowed number of items of a list.
    `scope` and `visibility` are IMC's: when it may change, and who sees it. `usable` raises ValueError for an item of
    text that is valid but has no effect.
    """

    default: Any
    unit: str
    description: str
    name: str = ""
    attribute: str = ""
    type: Kind = str
    is_list: bool = False
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[Any, ...] = ()
    size: tuple[int, int] | None = None
    aliases: tuple[str, ...] = ()
    visibility: Visibility = "developer"
    scope: Scope = "global"
    editable: bool = True
    usable: Callable[[str], object] | None = None

    def __get__(self, instance: object, owner: object = None) -> Any:
        return self

    def parse(self, text: str) -> Any:
        """The checked value of `text`. An empty text gives the default. Raises ValueError with the reason.

        Numbers are read as in DUNE: the leading number counts, the rest is ignored (see `ignored_suffix`).
        """
        words = [word.strip() for word in text.split(",")] if self.is_list else [text.strip()]
        if not text.strip():
            return list(self.default) if self.is_list else self.default
        parse = _PARSERS[self.type]
        values: list[Any] = []
        for word in words:
            try:
                values.append(parse(word))
            except ValueError as error:
                raise ValueError(f"{word!r} {error}{self._limits()}") from None
        return self.check(values if self.is_list else values[0])

    def ignored_suffix(self, text: str) -> str:
        """The text that `parse` ignores at the end of a number: "rad" of "1.5 rad"."""
        if self.type not in (int, float):
            return ""
        pattern = _INTEGER if self.type is int else NUMBER
        for word in text.split(",") if self.is_list else [text]:
            match = pattern.match(word.strip())
            if match and word.strip()[match.end() :]:
                return word.strip()[match.end() :]
        return ""

    def parse_strict(self, text: str) -> Any:
        """The checked value of a text that was sent while the vehicle runs. Raises ValueError with the reason.

        A profile of DUNE may have "12 cm" for 12; in a message that, or an empty text, is a mistake. Only a whole
        number may be sent with decimals, as consoles do: "3.0".
        """
        value = self.parse(text)
        is_number = self.type in (int, float)
        if is_number and not self.is_list and not text.strip():
            raise ValueError(f"'' is not a number{self._limits()}")
        if (rest := self.ignored_suffix(text).strip()) and (self.type is not int or rest.strip("0") != "."):
            words = text.split(",") if self.is_list else [text]
            is_decimal = all(NUMBER.fullmatch(word.strip()) for word in words)
            why = "is not an integer" if is_decimal else f"is not a number because of {rest!r}"
            raise ValueError(f"{text.strip()!r} {why}{self._limits()}")
        return value

    def warnings(self, text: str) -> list[str]:
        """Reasons why items of `text` have no effect."""
        found: list[str] = []
        for word in filter(None, map(str.strip, text.split(",") if self.is_list else [text])):
            try:
                if self.usable is not None:
                    self.usable(word)
            except ValueError as error:
                found.append(str(error))
        return found

    def check(self, value: Any) -> Any:
        """`value`, if its type and its limits allow it. Raises ValueError with the reason."""
        values: list[Any] = list(value) if self.is_list else [value]
        if self.is_list and self.size and not self.size[0] <= len(values) <= self.size[1]:
            raise ValueError(f"has {len(values)} items{self._limits()}")
        for index, item in enumerate(values):
            if self.type is float and isinstance(item, int) and not isinstance(item, bool):
                values[index] = item = float(item)
            if not isinstance(item, self.type) or (self.type is int and isinstance(item, bool)):
                raise ValueError(f"{item!r} is not {_IMC_TYPES[self.type]}{self._limits()}")
            if self.choices:
                values[index] = item = self._choice(item)
            if not isinstance(item, str):
                self._check_range(item)
        return values if self.is_list else values[0]

    def format(self, value: Any) -> str:
        """`value` as written in an ini file."""
        if self.is_list:
            return ", ".join(map(_word, value))
        return _word(value)

    @property
    def xml_type_name(self) -> str:
        """The type's name in DUNE's parameter XML: real, list:integer ..."""
        name = _IMC_TYPES[self.type]
        return f"list:{name}" if self.is_list else name

    def _choice(self, item: Any) -> Any:
        """The choice that `item` is; of texts, DUNE's tasks ignore the letter case."""
        if item in self.choices:
            return item
        same = [choice for choice in self.choices if str(choice).casefold() == str(item).casefold()]
        if len(same) != 1:
            raise ValueError(f"{item!r} is not one of {', '.join(map(str, self.choices))}")
        return same[0]

    def _check_range(self, item: float) -> None:
        if not math.isfinite(item):
            raise ValueError(f"{item:g} is not a value{self._limits()}")
        if self.minimum is not None and item < self.minimum:
            raise ValueError(f"{item:g} is below the minimum{self._limits()}")
        if self.maximum is not None and item > self.maximum:
            raise ValueError(f"{item:g} is above the maximum{self._limits()}")

    def _limits(self) -> str:
        parts = [self.xml_type_name]
        if self.choices:
            parts.append("one of " + ", ".join(map(str, self.choices)))
        if self.minimum is not None and self.maximum is not None:
            parts.append(f"{self.minimum:g} to {self.maximum:g}")
        elif self.minimum is not None:
            parts.append(f"{self.minimum:g} or more")
        elif self.maximum is not None:
            parts.append(f"{self.maximum:g} or less")
        if self.unit not in ("", "1"):
            parts.append(self.unit)
        if self.size:
            low, high = self.size
            parts.append(f"{low} items" if low == high else f"{low} to {high} items")
        return f" (expects {', '.join(parts)})"


def param(
    default: Any,
    unit: str,
    description: str,
    *,
    name: str = "",
    minimum: float | None = None,
    maximum: float | None = None,
    choices: Iterable[Any] = (),
    size: int | tuple[int, int] | None = None,
    aliases: Iterable[str] = (),
    visibility: Visibility = "developer",
    scope: Scope = "global",
    editable: bool = True,
    usable: Callable[[str], object] | None = None,
) -> Any:
    """Declares a parameter of a task; its type is the attribute's annotation.

    Its ini name is `name`, by default the attribute in title case; `aliases` are accepted too.
    `unit` is empty for texts, booleans and choices. `size` limits the number of items of a list. `usable` raises
    ValueError for a text, or an item of a list, that has no effect, so that `shoal check` warns of it.
    """
    return Parameter(
        default,
        unit,
        description,
        name=name,
        minimum=minimum,
        maximum=maximum,
        choices=tuple(choices),
        size=(size, size) if isinstance(size, int) else size,
        aliases=tuple(aliases),
        visibility=visibility,
        scope=scope,
        editable=editable,
        usable=usable,
    )


def find_parameter(parameters: Mapping[str, Parameter], name: str) -> Parameter | None:
    """The parameter of this ini name or alias."""
    return parameters.get(name) or next((p for p in parameters.values() if name in p.aliases), None)


def declared_parameters(cls: type) -> dict[str, Parameter]:
    """The parameters of a class by ini name in the order of declaration, then those of its bases.

    Raises TypeError if an annotation is missing or unsupported, or a default is invalid for its parameter.
    """
    found: dict[str, Parameter] = {}
    for base in cls.__mro__:
        hints: dict[str, Any] = {}
        for attribute, value in list(vars(base).items()):  # since Python 3.14, annotations are added when first read
            if not isinstance(value, Parameter):
                continue
            effective = getattr(cls, attribute)
            if not isinstance(effective, Parameter):
                raise TypeError(f"{cls.__module__}.{cls.__name__}.{attribute} is a parameter: write param(...)")
            if effective is not value:
                continue
            hints = hints or get_type_hints(base)
            if not value.attribute:
                _complete(base, attribute, value, hints.get(attribute))
            first = found.setdefault(value.name, value)
            if first is not value and first.attribute in vars(base):
                raise TypeError(f"{cls.__module__}.{cls.__name__}: two parameters have the name {value.name!r}")
    return found


def _complete(cls: type, attribute: str, parameter: Parameter, hint: Any) -> None:
    where = f"{cls.__module__}.{cls.__name__}.{attribute}"
    parameter.is_list = get_origin(hint) is list
    kind: Any = get_args(hint)[0] if parameter.is_list else hint
    if hint is None:
        raise TypeError(f"{where} has no type: write {attribute}: float = param(...)")
    if kind not in _PARSERS:
        raise TypeError(f"{where}: a parameter is a bool, int, float, str or a list of them, not {hint!r}")
    for word, known in ((parameter.visibility, get_args(Visibility)), (parameter.scope, get_args(Scope))):
        if word not in known:
            raise TypeError(f"{where}: {word!r} is not one of {', '.join(known)}")
    parameter.type = kind
    parameter.name = parameter.name or _title(attribute)
    try:
        parameter.default = parameter.check(parameter.default)
    except ValueError as error:
        raise TypeError(f"{where}: the default {error}") from None
    except TypeError as error:
        raise TypeError(f"{where}: minimum, maximum or choices do not fit its type: {error}") from None
    parameter.attribute = attribute


def _title(attribute: str) -> str:
    return " ".join(word if word == "of" else word[:1].upper() + word[1:] for word in attribute.split("_"))


def _word(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value) if isinstance(value, float) else str(value)
