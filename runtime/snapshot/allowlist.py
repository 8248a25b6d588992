"""Permitted content of a snapshot: classes, attributes, methods, arrays, paths. Writer and reader keep the same rules.

A snapshot is a file, and may come from others. What the reader would reject, the writer rejects already.
"""

import functools
import sys
from collections.abc import Collection
from enum import Enum
from pathlib import PurePath
from types import FunctionType
from typing import Any, cast

import msgspec
import numpy as np

import imc
from runtime.bus import Bus, Frame, Subscription
from runtime.kernel import Kernel, Timer
from runtime.task import Activation, Entity, EntityTable, Script, SystemTable, Task, Ticker
from runtime.vehicle import Vehicle
from support.terminal_text import quoted
from support.top_level_packages import PACKAGES

OWN = frozenset(PACKAGES) - {"shoal"}
PARTS = (Task, Ticker, Script, Activation, Entity, EntityTable, SystemTable, Bus, Subscription, Kernel, Timer, Vehicle)
"""Objects that a snapshot can name, but not contain."""
OF_TASK = frozenset(
    {
        "publish",
        "reply",
        "relay",
        "publish_frame",
        "set_entity_state",
        "activate",
        "deactivate",
        "reconfigured",
        "_offloaded",
    }
)
"""Methods of every task that a pending call may call; not those that take functions, such as `offload`."""
OF_BUS = frozenset({"dispatch", "deliver", "publish_frame"})
MOST_VALUES = 1_000_000
DEEPEST = 250
LARGEST = 1 << 26  # bytes of a file, and of a journal's packed entries
MADE = "imc.schema.classes"  # the module of message classes from definitions of a user's own
MISSING = object()


class SnapshotError(ValueError):
    """State that cannot be saved or restored; the text names it and the reason."""


class ClassAllowlist:
    """The classes that snapshots of one vehicle may name: of Shoal, of packages in `trusted`, and its messages."""

    def __init__(self, trusted: Collection[str] = (), messages: imc.Schema | None = None):
        self._trusted = OWN.union(trusted)
        self._messages = messages

    def path_of(self, cls: type[Any], where: str) -> str:
        """ "module:name" of a class. Raises SnapshotError if the reader could not find it; `where` names the value."""
        if "<" in cls.__qualname__:
            raise SnapshotError(f"{where} is {cls.__qualname__}, a local class, which a snapshot cannot contain")
        path = f"{cls.__module__}:{cls.__qualname__}"
        if self._resolve(path) is not cls:
            raise SnapshotError(
                f"{where} is a {cls.__name__} of module {cls.__module__}, which a snapshot cannot contain: it contains "
                "only classes of Shoal, and of the packages of the vehicle's tasks"
            )
        return path

    def find(self, path: Any, kind: type = object) -> type[Any]:
        """The class of a path, if it is a subclass of `kind`. Raises SnapshotError."""
        found = self._resolve(path) if isinstance(path, str) else None
        if not isinstance(found, type) or not issubclass(found, kind):
            raise SnapshotError(f"{short_repr(path)} is no class that a snapshot may contain")
        return cast(type[Any], found)

    def _resolve(self, path: str) -> object:
        module, _, name = path.partition(":")
        if module == MADE and self._messages is not None and name in self._messages:
            return self._messages[name]
        found: object = sys.modules.get(module) if module.partition(".")[0] in self._trusted else None
        for part in name.split("."):
            found = getattr(found, part, None)
        return found if getattr(found, "__module__", "") == module else None


def short_repr(value: object) -> str:
    """A value of a snapshot as errors show it: short, and safe for a terminal."""
    return quoted(value) if isinstance(value, str) else f"a {type(value).__name__}"


@functools.cache
def has_allowed_instances(cls: type) -> bool:
    """Whether objects of a class may be in a snapshot, made without a call of their constructor.

    Not what the vehicle owns: a forged task, kernel or bus would have methods that tasks call with all rights.
    """
    if issubclass(cls, PARTS) or any("__del__" in vars(base) for base in cls.__mro__):
        return False
    try:
        object.__new__(cast(type[object], cls))
    except TypeError:
        return False
    return True


def is_allowed_class_value(value: type) -> bool:
    """Whether a class itself may be a value: a snapshot could otherwise have any constructor called."""
    return issubclass(value, (imc.Message, Frame, Enum))


def check_attribute(cls: type, name: Any) -> str:
    """The name of an attribute that an object of a class may have. Raises SnapshotError."""
    inherited = next((vars(base)[name] for base in cls.__mro__ if name in vars(base)), MISSING)
    fits = isinstance(name, str) and name.isidentifier() and not (name.startswith("__") and name.endswith("__"))
    if not fits or callable(inherited) or isinstance(inherited, (property, classmethod, staticmethod)):
        raise SnapshotError(f"a {cls.__name__} cannot have an attribute {short_repr(name)} in a snapshot")
    return name


def allowed_method(owner: Any, name: Any) -> Any:
    """A method that a snapshot may name, since the kernel calls it with arguments in it. Raises SnapshotError."""
    cls = cast(type[Any], type(owner))
    inherited = next((vars(base)[name] for base in cls.__mro__ if name in vars(base)), None)
    if isinstance(owner, Task):
        fits = name in OF_TASK or (name not in vars(Task) and isinstance(inherited, FunctionType))
    elif isinstance(owner, Ticker):
        fits = name == "_tick"
    else:
        fits = isinstance(owner, Bus) and name in OF_BUS
    if not fits or name.startswith("__"):
        raise SnapshotError(f"{short_repr(name)} of a {cls.__name__} cannot be called from a snapshot")
    return getattr(owner, name)


def check_relative_path(text: Any) -> str:
    """A path within the folder in which it is used. Raises SnapshotError."""
    path = PurePath(text)
    if path.is_absolute() or ".." in path.parts or "\0" in text:
        raise SnapshotError(
            f"the path {short_repr(text)} leads out of the vehicle's folders, which a snapshot cannot contain"
        )
    return text


def check_dtype(text: Any) -> "np.dtype[Any]":
    """The type of an array of numbers or texts. Raises SnapshotError."""
    dtype = np.dtype(text) if isinstance(text, str) else None
    if dtype is None or dtype.kind not in "biufcmMSU" or not dtype.itemsize:
        raise SnapshotError(f"an array of {short_repr(text)} is nothing that a snapshot can contain")
    return dtype


def check_msgpack_size(data: bytes, what: str = "a snapshot") -> None:
    """Raise SnapshotError if msgpack data has more values, or is nested deeper, than a reader should make objects of.

    A byte of msgpack can become 60 bytes of memory.
    """
    if len(data) > LARGEST:
        raise SnapshotError(f"{what} has {len(data) >> 20} MiB; {LARGEST >> 20} are allowed")
    open_values = [1]  # values that are still to come, in each container that has begun
    place, count, size = 0, 0, len(data)
    while open_values:
        if not open_values[-1]:
            open_values.pop()
            continue
        if place >= size:
            raise SnapshotError(f"not a valid snapshot: {what} is cut off")
        open_values[-1] -= 1
        count += 1
        byte = data[place]
        place += 1
        inner = 0
        if byte < 0x80 or byte >= 0xE0:
            continue
        if byte < 0x90:
            inner = 2 * (byte & 0x0F)
        elif byte < 0xA0:
            inner = byte & 0x0F
        elif byte < 0xC0:
            place += byte & 0x1F
        elif byte in LENGTHS:
            width, more = LENGTHS[byte]
            place += int.from_bytes(data[place : place + width]) + width + more
        elif byte in CONTAINERS:
            width, times = CONTAINERS[byte]
            inner = times * int.from_bytes(data[place : place + width])
            place += width
        else:
            place += FIXED.get(byte, 0)
        if inner:
            open_values.append(inner)
        if count + inner > MOST_VALUES:
            raise SnapshotError(f"{what} has more than {MOST_VALUES} values")
        if len(open_values) > DEEPEST:
            raise SnapshotError(f"{what} is nested too deep")


# msgpack: bytes of the length, and bytes besides the content (bin, ext, str) or values per item (array, map)
_OF_BYTES = {0xC4: (1, 0), 0xC5: (2, 0), 0xC6: (4, 0), 0xC7: (1, 1), 0xC8: (2, 1), 0xC9: (4, 1)}
LENGTHS = {**_OF_BYTES, 0xD9: (1, 0), 0xDA: (2, 0), 0xDB: (4, 0)}
CONTAINERS = {0xDC: (2, 1), 0xDD: (4, 1), 0xDE: (2, 2), 0xDF: (4, 2)}
_NUMBERS = {0xCA: 4, 0xCB: 8, 0xCC: 1, 0xCD: 2, 0xCE: 4, 0xCF: 8, 0xD0: 1, 0xD1: 2, 0xD2: 4, 0xD3: 8}
FIXED = {**_NUMBERS, 0xD4: 2, 0xD5: 3, 0xD6: 5, 0xD7: 9, 0xD8: 17}


def check_message(value: msgspec.Struct, where: str) -> None:
    """Raise SnapshotError for a message with fields of a wrong type: constructors do not check them."""
    try:
        if isinstance(value, imc.Message):
            imc.encode(value)
    except Exception as error:
        raise SnapshotError(f"{where} is a message that cannot be encoded: {error}") from None
