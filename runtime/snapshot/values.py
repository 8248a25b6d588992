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

LARGEST = 2**63
OWN = frozenset({"imc", "mavlink", "runtime", "tasks", "world"})
CONTAINERS = (list, set, frozenset, deque)
SEQUENCES: dict[type, str] = {list: "list", tuple: "tuple", set: "set", frozenset: "frozenset"}


class SnapshotError(ValueError):
    """State that cannot be saved or restored; the text names it and the reason."""


class StateWriter:
    """Turns values into plain ones. `name` gives the name of a value that belongs to the vehicle, None for state."""

    def __init__(self, name: Callable[[object], list[Any] | None]):
        self._name = name
        self._seen: dict[int, tuple[int, object]] = {}

    def write(self, value: Any, where: str) -> Any:
        """The plain form of a value; `where` names it in errors. Raises SnapshotError."""
        if value is None or type(value) in (bool, float, bytes):
            return value
        if type(value) is int:
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
            return [SEQUENCES[kind], [self.write(item, f"{where}[...]") for item in value]]
        if kind in (dict, Counter):
            return [kind.__name__.lower(), self._pairs(value.items(), where)]
        if kind is deque:
            return ["deque", value.maxlen, [self.write(item, f"{where}[...]") for item in value]]
        if isinstance(value, Enum):
            return ["enum", _path(kind, where), self.write(value.value, where)]
        if isinstance(value, type):
            return ["type", _path(cast(type[Any], value), where)]
        if isinstance(value, MethodType):
            return ["method", self.write(value.__self__, where), value.__name__]
        if isinstance(value, FunctionType | BuiltinFunctionType):
            raise SnapshotError(f"{where} is the function {value.__qualname__}, which a snapshot cannot contain")
        if kind is functools.partial:
            words = [self.write(part, where) for part in (value.func, list(value.args), dict(value.keywords))]
            return ["partial", *words]
        if isinstance(value, tuple):
            return ["named", _path(kind, where), [self.write(item, where) for item in cast(tuple[Any, ...], value)]]
        if isinstance(value, PurePath):
            return ["path", str(value)]
        return self._object(value, kind, where)

    def _object(self, value: Any, kind: type[Any], where: str) -> list[Any]:
        if isinstance(value, np.ndarray):
            array = cast("np.ndarray[Any, np.dtype[Any]]", value)
            if array.dtype.hasobject:
                raise SnapshotError(f"{where} is an array of objects, which a snapshot cannot contain")
            return ["array", array.dtype.str, list(array.shape), array.tobytes(), bool(array.flags.writeable)]
        if isinstance(value, np.generic):
            scalar = np.asarray(cast(Any, value))
            return ["scalar", scalar.dtype.str, scalar.tobytes()]
        if isinstance(value, np.random.Generator):
            state = self.write(dict(value.bit_generator.state), where)
            return ["random", type(value.bit_generator).__name__, state]
        if isinstance(value, msgspec.Struct):
            names = value.__struct_fields__
            return ["struct", _path(kind, where), self._attributes(value, names, where)]
        if issubclass(kind, dict):
            return ["mapping", _path(kind, where), self._pairs(value.items(), where), self._of(value, where)]
        if kind.__module__.partition(".")[0] in sys.stdlib_module_names or issubclass(kind, CONTAINERS):
            raise SnapshotError(f"{where} is a {kind.__name__}, which a snapshot cannot contain")
        return ["object", _path(kind, where), self._of(value, where)]

    def _of(self, value: Any, where: str) -> list[Any]:
        return self._attributes(value, attributes(value), where)

    def _attributes(self, value: Any, names: Collection[str], where: str) -> list[Any]:
        return [[name, self.write(getattr(value, name), f"{where}.{name}")] for name in names]

    def _pairs(self, items: Collection[tuple[Any, Any]], where: str) -> list[Any]:
        return [[self.write(key, where), self.write(item, f"{where}[{key!r}]")] for key, item in items]


class StateReader:
    """Turns plain values back. `find` gives the value that a name of a StateWriter stands for.

    Uses only imported classes of Shoal and of the packages in `trusted`, and calls only constructors of messages and
    enumerations. Methods, which may be called later, must belong to objects of the `callable` classes. Raises
    SnapshotError for anything else.
    """

    def __init__(self, find: Callable[[list[Any]], Any], trusted: Collection[str], callable: tuple[type, ...]):
        self._find = find
        self._callable = callable
        self._trusted = OWN.union(trusted)
        self._seen: dict[int, Any] = {}

    def read(self, plain: Any) -> Any:
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
            made += [self.read(item) for item in words[0]]
        elif kind in ("dict", "counter"):
            made = {} if kind == "dict" else Counter[Any]()
            self._seen[number] = made
            for key, item in words[0]:
                made[self.read(key)] = self.read(item)
        elif kind == "deque":
            made = deque[Any](maxlen=words[0])
            self._seen[number] = made
            made.extend(self.read(item) for item in words[1])
        elif kind == "mapping":
            cls: Any = self._class(words[0], dict)
            made = self._seen[number] = cls.__new__(cls)
            for key, item in words[1]:
                dict[Any, Any].__setitem__(made, self.read(key), self.read(item))
            for name, item in words[2]:
                object.__setattr__(made, name, self.read(item))
        elif kind == "object":
            made = object.__new__(self._class(words[0]))
            self._seen[number] = made
            for name, item in words[1]:
                object.__setattr__(made, name, self.read(item))
        else:
            made = self._seen[number] = self._value([kind, *words])
        return made

    def _value(self, words: list[Any]) -> Any:
        kind, *rest = words
        match kind:
            case "int":
                return int(rest[0])
            case "str":
                return rest[0].decode(errors="surrogatepass")
            case "tuple":
                return tuple(self.read(item) for item in rest[0])
            case "set":
                return {self.read(item) for item in rest[0]}
            case "frozenset":
                return frozenset(self.read(item) for item in rest[0])
            case "named":
                return self._class(rest[0], tuple)._make(self.read(item) for item in rest[1])
            case "enum":
                return self._class(rest[0], Enum)(self.read(rest[1]))
            case "type":
                return self._class(rest[0])
            case "method":
                return self._method(self.read(rest[0]), rest[1])
            case "partial":
                function, args, keywords = (self.read(word) for word in rest)
                return functools.partial(function, *args, **keywords)
            case "path":
                return Path(rest[0])
            case "array":
                array = np.frombuffer(rest[2], np.dtype(rest[0])).reshape(rest[1])
                return array.copy() if rest[3] else array
            case "scalar":
                return np.frombuffer(rest[1], np.dtype(rest[0]))[0]
            case "random":
                return _generator(rest[0], self.read(rest[1]))
            case "struct":
                return _struct(self._class(rest[0], msgspec.Struct), {name: self.read(item) for name, item in rest[1]})
            case _:
                return self._find(words)

    def _class(self, path: str, kind: type = object) -> type[Any]:
        found = self._resolve(path)
        if not isinstance(found, type) or not issubclass(found, kind):
            raise SnapshotError(f"{path} is not a class of the expected kind")
        return cast(type[Any], found)

    def _method(self, owner: Any, name: str) -> Any:
        cls = cast(type[Any], type(owner))
        if not isinstance(owner, self._callable) or not callable(getattr(cls, name, None)):
            raise SnapshotError(f"{name!r} of a {cls.__name__} cannot be called from a snapshot")
        return getattr(owner, name)

    def _resolve(self, path: str) -> object:
        module, _, name = path.partition(":")
        found: object = sys.modules.get(module) if module.partition(".")[0] in self._trusted else None
        for part in name.split("."):
            found = getattr(found, part, None)
        if found is None or getattr(found, "__module__", "") != module:
            raise SnapshotError(f"{path}: unknown class or function")
        return found


def attributes(value: object) -> list[str]:
    """The names of the attributes that an object has, including those in slots."""
    declared = (cls.__dict__.get("__slots__", ()) for cls in type(value).__mro__)
    slots = (name for names in declared for name in ([names] if isinstance(names, str) else names))
    names = [*slots, *getattr(value, "__dict__", ())]
    return [name for name in names if name not in ("__dict__", "__weakref__") and hasattr(value, name)]


def _path(value: Any, where: str) -> str:
    if "<" in value.__qualname__:
        raise SnapshotError(f"{where} is {value.__qualname__}, a local class, which a snapshot cannot contain")
    return f"{value.__module__}:{value.__qualname__}"


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
    return made
