"""What cannot be restored is refused at the save, by name."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import imc
from runtime.bus import Subscription
from runtime.snapshot import SnapshotError, take_snapshot
from runtime.vehicle import Vehicle
from tests.runtime.snapshot.adversary import outcome, running

TEXT: Any = "x"  # where the types promise a number


class Watcher:
    """An observer of a user's own."""

    def __init__(self) -> None:
        self.seen = 0

    def see(self, *_: object) -> None:
        self.seen += 1


class Whistler(Watcher):
    """An observer whose calls a continued run does not need."""

    transient = True


@pytest.fixture
def vehicle(tmp_path: Path) -> Iterator[Vehicle]:
    made = running("lauv-noptilus-1", tmp_path, 0.5)
    yield made
    made.close()


def refused(vehicle: Vehicle) -> str:
    with pytest.raises(SnapshotError) as caught:
        take_snapshot(vehicle)
    assert " at 0x" not in str(caught.value)
    return str(caught.value)


def test_an_observer_that_cannot_be_restored_is_refused_at_the_save(vehicle: Vehicle) -> None:
    watcher = Watcher()
    vehicle.observe(imc.EstimatedState, watcher.see)
    take_snapshot(vehicle)  # it only watches
    vehicle.kernel.after(9.0, watcher.see)
    assert re.match(r"the observer Watcher has a pending call", refused(vehicle))


def test_an_observer_that_the_run_does_not_need_may_have_calls(vehicle: Vehicle, tmp_path: Path) -> None:
    whistler = Whistler()
    vehicle.observe(imc.EstimatedState, whistler.see)
    vehicle.kernel.after(9.0, whistler.see)
    assert outcome(take_snapshot(vehicle), tmp_path) == ""


def whistle() -> None:
    """A function that is no method."""


STRANGERS: list[tuple[Callable[[Vehicle], object], str]] = [
    (lambda v: v.kernel.after(9.0, Watcher().see), r"Watcher has a pending call and is no task"),
    (lambda v: v.kernel.after(9.0, whistle), r"whistle has a pending call and is no task"),
    (
        lambda v: v.bus.subscribe(Subscription(imc.Goto, Watcher().see)),
        r"Watcher receives Goto and is no task",
    ),
    (lambda v: setattr(v.task("Daemon"), "spy", Watcher()), r"Daemon: spy is a Watcher of module tests\."),
    (lambda v: setattr(v.task("Daemon"), "spy", Watcher), r"Daemon: spy is the class Watcher"),
    (lambda v: setattr(v.task("Daemon"), "spy", Watcher().see), r"Daemon: spy is see of a Watcher"),
    (lambda v: setattr(v.task("Daemon"), "spy", [Path("/etc/x")]), r"Daemon: spy\[\.\.\.\]: the path '/etc/x'"),
    (lambda v: setattr(v.task("Daemon"), "spy", 1 << 99_999), r"Daemon: spy is a number of 100000 bits"),
    (lambda v: setattr(v.task("Daemon"), "spy", np.zeros(2, "i4,i4")), r"Daemon: spy: an array of '\|V8'"),
    (lambda v: setattr(v.task("Daemon"), "spy", imc.GpsFix(lat=TEXT)), r"Daemon: spy is a message .* GpsFix\.lat"),
    (
        lambda v: setattr(v.task("Daemon"), "publish_heartbeat_and_entities", v.daemon.publish),
        r"Daemon: a Daemon cannot have an attribute 'publish_heartbeat_and_entities'",
    ),
    (lambda v: setattr(v.task("Daemon"), "spy", [0.5] * 1_000_001), r"the state of .* more than 1000000 values"),
    (
        lambda v: v.daemon.offload(len, "x", then=lambda _: None, latency=9.0),
        r"Daemon: a pending call\[?.*function",
    ),
]


@pytest.mark.parametrize(("trouble", "reason"), STRANGERS)
def test_what_cannot_be_restored_is_refused_at_the_save(
    vehicle: Vehicle, trouble: Callable[[Vehicle], object], reason: str
) -> None:
    trouble(vehicle)
    assert re.match(reason, refused(vehicle))


@pytest.mark.parametrize("depth", [200, 5000])
def test_what_is_nested_deeper_than_a_reader_goes_is_refused_at_the_save(vehicle: Vehicle, depth: int) -> None:
    spy: Any = None
    for _ in range(depth):
        spy = [spy]
    vars(vehicle.task("Daemon"))["spy"] = spy
    assert "nested too deep" in refused(vehicle)
