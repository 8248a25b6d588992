"""The state of tasks as plain values: numbers, texts, bytes and lists, fit for msgpack. Reading them runs no code."""

import functools
import sys
from collections import Counter, deque
from collections.abc import Callable, Collection
from enum import Enum
from pathlib import Path, PurePath
from types import BuiltinFunctionType, FunctionType, MethodType
from typing import Any, cast

import msgspec
import numpy as np

from runtime.snapshot.allowlist import (
    ClassAllowlist,
    SnapshotError,
    allowed_method,
    check_attribute,
    check_dtype,
    check_message,
    check_relative_path,
    has_allowed_instances,
    is_allowed_class_value,
)

LARGEST = 2**63
LONGEST_INT = 4096  # bits
CONTAINERS = (list, set, frozenset, deque)
SEQUENCES: dict[type, str] = {list: "list", tuple: "tuple", set: "set", frozenset: "frozenset"}


class StateWriter:
    """Turns values into plain ones. `name` gives the name of a value that belongs to the vehicle, None for state.

    Writes only what a StateReader of the same vocabulary reads.
    """

    def __init__(self, name: Callable[[object], list[Any] | None], words: ClassAllowlist | None = None):
        self._name = name
        self._words = words or ClassAllowlist()
        self._seen: dict[int, tuple[int, object]] = {}

    def to_plain_value(self, value: Any, where: str) -> Any:
        """The plain form of a value; `where` names it in errors. Raises SnapshotError."""
        if value is None or type(value) in (bool, float, bytes):
            return value
        if type(value) is int:
            if value.bit_length() > LONGEST_INT:
                raise SnapshotError(f"{where} is a number of {value.bit_length()} bits; a snapshot takes {LONGEST_INT}")
            return value if -LARGEST <= value < LARGEST else ["int", str(value)]
        if type(value) is str:
            return value if value.isascii() else ["str", value.encode(errors="surrogatepass")]
        if (named := self._name(value)) is not None:
            return named
        if id(value) in self._seen:
            return ["again", self._seen[id(value)][0]]
        if not isinstance(value, (tuple, frozenset, Enum, type, MethodType)):
            self._seen[id(value)] = len(self._seen), value  # the reference keeps the id from being used again
            return ["new", self._seen[id(value)][0], *self._parts(value, where)]
        return self._parts(value, where)

    def _parts(self, value: Any, where: str) -> list[Any]:
        kind = cast(type[Any], type(value))
        if kind in SEQUENCES:
            return [SEQUENCES[kind], [self.to_plain_value(item, f"{where}[...]") for item in value]]
        if kind in (dict, Counter):
            return [kind.__name__.lower(), self._pairs(value.items(), where)]
        if kind is deque:
            return ["deque", value.maxlen, [self.to_plain_value(item, f"{where}[...]") for item in value]]
        if isinstance(value, Enum):
            return ["enum", self._words.path_of(kind, where), self.to_plain_value(value.value, where)]
        if isinstance(value, type):
            return self._type(cast(type[Any], value), where)
        if isinstance(value, MethodType):
            return self._method(value, where)
        if isinstance(value, FunctionType | BuiltinFunctionType):
            raise SnapshotError(f"{where} is the function {value.__qualname__}, which a snapshot cannot contain")
        if kind is functools.partial:
            if not isinstance(value.func, MethodType):
                raise SnapshotError(f"{where} is a partial of {value.func!r}, which a snapshot cannot contain")
            words = [self.to_plain_value(part, where) for part in (value.func, list(value.args), dict(value.keywords))]
            return ["partial", *words]
        if isinstance(value, tuple):
            return [
                "named",
                self._words.path_of(kind, where),
                [self.to_plain_value(item, where) for item in cast(tuple[Any, ...], value)],
            ]
        if isinstance(value, PurePath):
            return ["path", self._try(check_relative_path, str(value), where=where)]
        return self._object(value, kind, where)

    def _object(self, value: Any, kind: type[Any], where: str) -> list[Any]:
        if isinstance(value, np.ndarray):
            array = cast("np.ndarray[Any, np.dtype[Any]]", value)
            if array.dtype.hasobject:
                raise SnapshotError(f"{where} is an array of objects, which a snapshot cannot contain")
            self._try(check_dtype, array.dtype.str, where=where)
            return ["array", array.dtype.str, list(array.shape), array.tobytes(), bool(array.flags.writeable)]
        if isinstance(value, np.generic):
            scalar = np.asarray(cast(Any, value))
            self._try(check_dtype, scalar.dtype.str, where=where)
            return ["scalar", scalar.dtype.str, scalar.tobytes()]
        if isinstance(value, np.random.Generator):
            if not isinstance(value.bit_generator, np.random.PCG64):
                generator = type(value.bit_generator).__name__
                raise SnapshotError(f"{where} is a random generator {generator}; a snapshot can contain PCG64")
            state = self.to_plain_value(dict(value.bit_generator.state), where)
            return ["random", type(value.bit_generator).__name__, state]
        if isinstance(value, msgspec.Struct):
            names = value.__struct_fields__
            check_message(value, where)
            return ["struct", self._words.path_of(kind, where), self._attributes(value, names, where)]
        if issubclass(kind, dict):
            path = self._words.path_of(cast(type[Any], kind), where)
            return ["mapping", path, self._pairs(value.items(), where), self._of(value, where)]
        if kind.__module__.partition(".")[0] in sys.stdlib_module_names or issubclass(kind, CONTAINERS):
            raise SnapshotError(f"{where} is a {kind.__name__}, which a snapshot cannot contain")
        path = self._words.path_of(kind, where)
        if not has_allowed_instances(kind):
            raise SnapshotError(f"{where} is a {kind.__name__}, which a snapshot cannot contain")
        return ["object", path, self._of(value, where)]

    def _type(self, value: type[Any], where: str) -> list[Any]:
        if not is_allowed_class_value(value):
            raise SnapshotError(f"{where} is the class {value.__qualname__}, which a snapshot cannot contain")
        return ["type", self._words.path_of(value, where)]

    def _method(self, value: MethodType, where: str) -> list[Any]:
        if self._name(value.__self__) is None:
            owner = type(value.__self__).__qualname__
            raise SnapshotError(f"{where} is {value.__name__} of a {owner}, which is no part of the vehicle")
        self._try(allowed_method, value.__self__, value.__name__, where=where)
        return ["method", self.to_plain_value(value.__self__, where), value.__name__]

    def _of(self, value: Any, where: str) -> list[Any]:
        names = attribute_names(value)
        for name in names:
            self._try(check_attribute, type(value), name, where=where)
        return self._attributes(value, names, where)

    def _try(self, check: Callable[..., Any], *args: Any, where: str) -> Any:
        try:
            return check(*args)
        except SnapshotError as error:
            raise SnapshotError(f"{where}: {error}") from None

    def _attributes(self, value: Any, names: Collection[str], where: str) -> list[Any]:
        return [[name, self.to_plain_value(getattr(value, name), f"{where}.{name}")] for name in names]

    def _pairs(self, items: Collection[tuple[Any, Any]], where: str) -> list[Any]:
        return [
            [self.to_plain_value(key, where), self.to_plain_value(item, f"{where}[{key!r}]")] for key, item in items
        ]


class StateReader:
    """Turns plain values back. `find` gives the value that a name of a StateWriter stands for.

    Uses only classes of its vocabulary, and calls only constructors of messages and enumerations. Raises SnapshotError
    for what it rejects, and any exception for input that no StateWriter has written.
    """

    def __init__(self, find: Callable[[list[Any]], Any], words: ClassAllowlist | None = None):
        self._find = find
        self._words = words or ClassAllowlist()
        self._seen: dict[int, Any] = {}

    def from_plain_value(self, plain: Any) -> Any:
        if not isinstance(plain, list):
            return plain
        words = cast(list[Any], plain)
        if words[0] == "again":
            return self._seen[words[1]]
        if words[0] == "new":
            return self._new(words[1], words[2], words[3:])
        return self._value(words)

    def _new(self, number: int, kind: str, words: list[Any]) -> Any:
        """Make a container known before it is filled, because it may contain itself."""
        if kind == "list":
            made: Any = []
            self._seen[number] = made
            made += [self.from_plain_value(item) for item in words[0]]
        elif kind in ("dict", "counter"):
            made = {} if kind == "dict" else Counter[Any]()
            self._seen[number] = made
            for key, item in words[0]:
                made[self.from_plain_value(key)] = self.from_plain_value(item)
        elif kind == "deque":
            made = deque[Any](maxlen=words[0])
            self._seen[number] = made
            made.extend(self.from_plain_value(item) for item in words[1])
        elif kind == "mapping":
            cls: Any = self._words.find(words[0], dict)
            made = self._seen[number] = cls.__new__(cls)
            for key, item in words[1]:
                dict[Any, Any].__setitem__(made, self.from_plain_value(key), self.from_plain_value(item))
            self._fill(made, words[2])
        elif kind == "object":
            cls = self._words.find(words[0])
            if not has_allowed_instances(cls):
                raise SnapshotError(f"a {cls.__name__} is nothing that a snapshot can contain")
            made = self._seen[number] = object.__new__(cls)
            self._fill(made, words[1])
        else:
            made = self._seen[number] = self._value([kind, *words])
        return made

    def _fill(self, made: Any, attributes: list[Any]) -> None:
        for name, item in attributes:
            object.__setattr__(made, check_attribute(cast(type[Any], type(made)), name), self.from_plain_value(item))

    def _value(self, words: list[Any]) -> Any:
        kind, *rest = words
        match kind:
            case "int":
                return int(rest[0])
            case "str":
                return rest[0].decode(errors="surrogatepass")
            case "tuple":
                return tuple(self.from_plain_value(item) for item in rest[0])
            case "set":
                return {self.from_plain_value(item) for item in rest[0]}
            case "frozenset":
                return frozenset(self.from_plain_value(item) for item in rest[0])
            case "named":
                return self._words.find(rest[0], tuple)._make(self.from_plain_value(item) for item in rest[1])
            case "enum":
                return self._words.find(rest[0], Enum)(self.from_plain_value(rest[1]))
            case "type":
                cls = self._words.find(rest[0])
                if not is_allowed_class_value(cls):
                    raise SnapshotError(f"the class {cls.__name__} is nothing that a snapshot can contain")
                return cls
            case "method":
                return allowed_method(self.from_plain_value(rest[0]), rest[1])
            case "partial":
                function, args, keywords = (self.from_plain_value(word) for word in rest)
                if not isinstance(function, MethodType):
                    raise SnapshotError("a partial is not of a method")
                return functools.partial(function, *args, **keywords)
            case "path":
                return Path(check_relative_path(rest[0]))
            case "array":
                array = np.frombuffer(rest[2], check_dtype(rest[0])).reshape(rest[1])
                return array.copy() if rest[3] else array
            case "scalar":
                return np.frombuffer(rest[1], check_dtype(rest[0]))[0]
            case "random":
                return _generator(rest[0], self.from_plain_value(rest[1]))
            case "struct":
                return _struct(
                    self._words.find(rest[0], msgspec.Struct),
                    {name: self.from_plain_value(item) for name, item in rest[1]},
                )
            case _:
                return self._find(words)


def attribute_names(value: object) -> list[str]:
    """The names of the attributes that an object has, including those in slots."""
    declared = (cls.__dict__.get("__slots__", ()) for cls in type(value).__mro__)
    slots = (name for names in declared for name in ([names] if isinstance(names, str) else names))
    names = [*slots, *getattr(value, "__dict__", ())]
    return [name for name in names if name not in ("__dict__", "__weakref__") and hasattr(value, name)]


def _generator(name: str, state: dict[str, Any]) -> np.random.Generator:
    if name != "PCG64":
        raise SnapshotError(f"unknown random generator {name}")
    bits = np.random.PCG64()
    bits.state = cast(Any, state)
    return np.random.Generator(bits)


def _struct(cls: type[Any], values: dict[str, Any]) -> Any:
    surplus = values.pop("surplus", None)
    made = cls(**values)
    if surplus:
        msgspec.structs.force_setattr(made, "surplus", surplus)
    check_message(made, cls.__name__)
    return made
