"""A call that is due at a time or when a source can be read, and its owner."""

import functools
from collections.abc import Callable
from typing import Any, Protocol


class Readable(Protocol):
    """An object that the kernel can wait for: a socket, or anything with a file descriptor."""

    def fileno(self) -> int: ...


def owner_of(function: Callable[..., object]) -> object:
    """The object whose method `function` is, else `function` itself; reports name it."""
    while isinstance(function, functools.partial):
        function = function.func
    return getattr(function, "__self__", function)


def handler_name(function: Callable[..., object], args: tuple[Any, ...] = ()) -> str:
    """The name of the handler that a call ends in, such as VSIM.move."""
    if args and isinstance(timer := args[0], Timer) and timer.function is not None:
        function = timer.function
    while isinstance(function, functools.partial):
        function = function.func
    inner = getattr(getattr(function, "__self__", None), "handler", function)  # of a periodic method
    return getattr(inner, "__qualname__", type(inner).__name__).replace("<locals>.", "")


def owner_title(owner: object) -> str:
    """A name for people: that of a task or a function, else the type; never an address."""
    if type(owner).__repr__ is not object.__repr__ and not callable(owner):
        return repr(owner)
    return getattr(owner, "__qualname__", type(owner).__name__).replace("<locals>.", "")


class Timer:
    """A call that is due at a time, or whenever a source can be read; after `cancel()` it does not happen.

    If it waits for a span of time, which a stall of the process extends, `stalled` is how long the process had stalled
    before (ns); None if it is due at a time.
    """

    __slots__ = ("args", "function", "owner", "queued", "stalled", "time")

    def __init__(self, at: int, function: Callable[..., object], args: tuple[Any, ...]):
        self.time: int = at
        owner = getattr(function, "__self__", None)
        self.owner: object = owner_of(function) if owner is None else owner
        self.function: Callable[..., object] | None = function
        self.args: tuple[Any, ...] = args
        self.queued: bool = False
        self.stalled: int | None = None

    def cancel(self) -> None:
        self.function = None
        self.args = ()
