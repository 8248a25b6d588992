"""A task that keeps what a test gives it, and its way through a snapshot."""

from typing import Any, NamedTuple

import imc
from runtime import State, Task, periodic
from runtime.kernel import VirtualClock
from runtime.snapshot import load, restore, take_snapshot
from runtime.testing import NoProfile
from runtime.vehicle import Vehicle


class Keeper(Task):
    """Holds all kinds of state that tasks hold."""

    def start(self) -> None:
        self.count = 0
        self.items: Any = None
        self.later = self.after(2.0, self.say, "late", 3)
        self.over = self.after(0.5, self.say, "soon", 1)
        self.set_entity_state(State.NORMAL, "keeping")

    def say(self, text: str, number: int) -> None:
        self.publish(imc.LogBookEntry(text=f"{text} {number} {self.random.integers(1000)}"))

    @periodic(3.0)
    def tick(self) -> None:
        self.count += 1


class Pair(NamedTuple):
    """A named tuple."""

    left: int
    right: str


class Box:
    """An object with slots, and a reference to itself."""

    __slots__ = ("me", "value")

    def __init__(self, value: object):
        self.value = value
        self.me = self


def keeper(time: int = 0) -> Vehicle:
    vehicle = Vehicle("kept", 0x1A, clock=VirtualClock(time), profile=NoProfile(), seed=3)
    vehicle.add(Keeper, "Keeper")
    return vehicle


def through(items: object) -> Any:
    """Attributes after saving and restoring a snapshot."""
    vehicle = keeper()
    vehicle.start()
    vehicle.run(1.0)
    task: Any = vehicle.task("Keeper")
    task.items = items
    again = keeper(vehicle.kernel.now_ns)
    restore(again, load(take_snapshot(vehicle)))
    vehicle.close()
    again.close()
    return again.task("Keeper")
