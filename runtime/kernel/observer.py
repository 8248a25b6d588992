"""Observers of a kernel."""

from collections.abc import Callable
from typing import Any, Protocol


class KernelObserver(Protocol):
    """Observes the calls that a kernel makes on a virtual clock; it must not change anything."""

    def before_call(self, function: Callable[..., object], args: tuple[Any, ...]) -> None:
        """A call is about to be made. The argument of a timer's call is the timer."""
        ...
