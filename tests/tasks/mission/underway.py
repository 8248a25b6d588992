"""A shipped vehicle that flies a plan, saved at a moment from which several tests go on."""

import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from flying import CCU, control
from lean import UNLOGGED

import imc
from runtime.kernel import SECOND, VirtualClock
from runtime.snapshot import InputJournals, Snapshot, load, restore, take_snapshot
from runtime.vehicle import Vehicle
from shoal.missions import prepare

START = 10.0  # s, when the plan begins


@dataclass(frozen=True)
class Underway:
    """The state of a vehicle, and what it published before, with times from the start (s).

    What goes on from it is equal to a run from the start: test_snapshot_missions.py.
    """

    profile: str
    overrides: tuple[str, ...]
    state: Snapshot
    heard: dict[type[imc.Message], list[tuple[float, imc.Message]]]

    def go_on(self, folder: Path) -> Vehicle:
        """A vehicle in this state; its tasks may fail."""
        vehicle = _vehicle(self.profile, self.overrides, folder, VirtualClock(self.state.time))
        restore(vehicle, self.state)
        return vehicle


def note(vehicle: Vehicle, heard: dict[type[imc.Message], list[tuple[float, imc.Message]]]) -> None:
    """Keep what a vehicle publishes of some types."""
    for kind, found in heard.items():
        vehicle.observe(kind, lambda m, found=found: found.append((m.timestamp - vehicle.start_time, m)))


def underway(
    profile: str,
    plan: imc.PlanSpecification,
    moment: float,
    *overrides: str,
    kinds: Iterable[type[imc.Message]] = (),
) -> Underway:
    """How a vehicle is at a moment (s) of a plan, without a log; messages of `kinds` are kept."""
    overrides = (UNLOGGED, *overrides)
    with tempfile.TemporaryDirectory() as folder:
        vehicle = _vehicle(profile, overrides, Path(folder))
        InputJournals(vehicle)
        heard = {kind: list[tuple[float, imc.Message]]() for kind in kinds}
        note(vehicle, heard)
        vehicle.start()
        vehicle.run(START)
        say(vehicle, control(imc.PlanControl.Op.START, -1.0, plan.plan_id, 1, arg=plan, dst=vehicle.system))
        vehicle.run(moment - START)
        state = load(take_snapshot(vehicle))
        vehicle.close()
    return Underway(profile, overrides, state, heard)


def say(vehicle: Vehicle, message: imc.Message) -> None:
    """Publish a message as one of a console."""
    packet = imc.encode_with_header(message, vehicle.kernel.now_ns / SECOND, CCU, 3, message.dst, message.dst_ent)
    vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)


def _vehicle(profile: str, overrides: tuple[str, ...], folder: Path, clock: VirtualClock | None = None) -> Vehicle:
    places = {"log_root": folder / "log", "state_folder": folder / "db"}
    made = prepare(profile, overrides=overrides, **places, **({} if clock is None else {"clock": clock}))
    made.vehicle.keep_going = True
    return made.vehicle
