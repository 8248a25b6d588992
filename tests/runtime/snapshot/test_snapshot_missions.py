"""Snapshots of the full vehicle: during and between maneuvers, and during calibration."""

import hashlib
import random
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import pytest

import imc
from runtime.kernel import SECOND
from runtime.snapshot import InputJournals, Snapshot, load, take_snapshot
from shoal.missions import Mission, load_plan, prepare
from shoal.rerun import resume_snapshot

PLAN = """
plan: all of it
origin: 41.185°, -8.7062°
speed: 1.3 m/s
depth: 1
on_start: {DVL: {Active: true}}
maneuvers:
  - goto: {north: 6}
  - loiter: {north: 16, east: 5, radius: 8, duration: 4s}
    id: Circle
    then: [{to: Home, when: Depth.value > 90}, Waves]
  - yo_yo: {north: 28, depth: 1, amplitude: 0.5, pitch: 15°}
    id: Waves
    on_start: {Loiter Maneuver: {Debug Level: Debug}, YoYo Maneuver: {Debug Level: Debug}}
  - elevator: {north: 28, start_z: 0, end_z: 1, radius: 8}
    id: Lift
  - station_keeping: {north: 20, depth: 0, radius: 15, duration: 4}
    id: Home
"""
AHEAD = 3 * SECOND
Heard = list[tuple[int, bytes]]


class Flight(NamedTuple):
    """Packets on the bus, times (ns) of changes, snapshots, and the outcome."""

    heard: Heard
    changes: list[int]
    saved: list[Snapshot]
    outcome: str


def digest(heard: Iterable[tuple[int, bytes]]) -> str:
    return hashlib.sha256(b"".join(packet for _, packet in heard)).hexdigest()


def fly(folder: Path, times: Iterable[int] = ()) -> Flight:
    (folder / "plan.yaml").write_text(PLAN)
    vehicle = prepare("lauv-noptilus-1", log_root=folder / "log").vehicle
    mission = Mission(vehicle, load_plan(folder / "plan.yaml"), calibrate=True)
    heard, changes, seen, saved = Heard(), list[int](), dict[type, object](), list[Snapshot]()

    def hear(message: imc.Message, packet: bytes) -> None:
        heard.append((vehicle.kernel.now_ns, packet))
        if isinstance(message, imc.PlanControlState | imc.VehicleState):
            state = message.man_id if isinstance(message, imc.PlanControlState) else (message.op_mode, message.flags)
            if seen.get(type(message)) != state:
                changes.append(vehicle.kernel.now_ns)
            seen[type(message)] = state

    vehicle.observe(imc.Message, hear, packets=True)
    if times:
        InputJournals(vehicle)
    mission.begin()
    for time in times:
        vehicle.kernel.run(until=time)
        saved.append(load(take_snapshot(vehicle)))
    vehicle.run(200.0)
    vehicle.close()
    return Flight(heard, changes, saved, mission.report.outcome)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Flight:
    return fly(tmp_path_factory.mktemp("whole"))


@pytest.fixture(scope="module")
def saved(uninterrupted: Flight, tmp_path_factory: pytest.TempPathFactory) -> Flight:
    return fly(tmp_path_factory.mktemp("saved"), list(moments(uninterrupted)))


def moments(flight: Flight) -> Iterator[int]:
    """Times after the request for the plan, in order: at each change, just after it, and one before the next."""
    numbers = random.Random(1)
    asked = next(time for time, packet in flight.heard if imc.header(packet).id == imc.PlanControl.ID)
    last = flight.heard[-1][0]
    changes = sorted({time for time in flight.changes if asked < time < last})
    exact = [time + step for time in changes for step in (0, 1)]
    spans = [(a, b) for a, b in pairwise((asked, *changes, last)) if b - a > SECOND]
    between = [numbers.randint(a + 2, b - 1) for a, b in spans]
    yield from sorted({asked + 1, *exact, *between})


@pytest.mark.heavy
def test_saving_changes_nothing(uninterrupted: Flight, saved: Flight) -> None:
    assert uninterrupted.outcome == saved.outcome == "SUCCESS"
    assert digest(uninterrupted.heard) == digest(saved.heard)
    scripted = {name for snapshot in saved.saved for name in snapshot.journals}
    assert {"Plan.Engine", "Maneuver.Loiter", "Maneuver.YoYo", "Maneuver.StationKeeping"} <= scripted
    calibration = imc.VehicleState.OpMode.CALIBRATION
    states = [imc.decode(packet) for _, packet in saved.heard if imc.header(packet).id == imc.VehicleState.ID]
    times = [s.timestamp for s in states if isinstance(s, imc.VehicleState) and s.op_mode == calibration]
    assert any(times[0] < snapshot.time / SECOND < times[-1] for snapshot in saved.saved)


@pytest.mark.heavy
@pytest.mark.computing
def test_a_mission_goes_on_from_any_moment(saved: Flight, tmp_path: Path) -> None:
    assert len(saved.saved) > 10
    for snapshot in saved.saved:
        vehicle = resume_snapshot(snapshot, tmp_path)
        heard = Heard()
        end = min(snapshot.time + AHEAD, saved.heard[-1][0])
        vehicle.observe(imc.Message, lambda _, p, h=heard, v=vehicle: h.append((v.kernel.now_ns, p)), packets=True)
        vehicle.kernel.run(until=end)
        heard = list(heard)
        vehicle.close()
        expected = [item for item in saved.heard if snapshot.time <= item[0] < end]
        at = snapshot.time / SECOND - snapshot.start_time
        assert digest(heard) == digest(expected), f"from {at:.9f} s, within {', '.join(snapshot.journals)}"
