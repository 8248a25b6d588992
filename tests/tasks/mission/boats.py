"""Voyages of simulated boats."""

import math
import tempfile
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from lean import UNLOGGED

import imc
from runtime.kernel import SECOND
from shoal.missions import Mission, Report, prepare
from support.wgs84 import displace
from tests.tasks.mission.underway import note

BOATS = ("otter", "caravel")
LAT, LON = math.radians(41.185), math.radians(-8.7062)
DEPTH, ALTITUDE = imc.ZUnits.DEPTH, imc.ZUnits.ALTITUDE
Mode = imc.VehicleState.OpMode
KINDS = (imc.SimulatedState, imc.VehicleState, imc.PathControlState, imc.SetThrusterActuation, imc.DesiredSpeed)


@dataclass
class Voyage:
    """The result of a mission: the report, and messages of some types with their times from the start (s)."""

    report: Report
    heard: dict[type[imc.Message], list[tuple[float, imc.Message]]] = field(default_factory=dict)
    packets: list[bytes] = field(default_factory=list)

    def of(self, kind, begin=0.0, end=math.inf):
        """Messages of a type between two times."""
        return [message for time, message in self.heard[kind] if begin <= time < end]

    @property
    def modes(self):
        """The modes of the vehicle, in order."""
        modes = [m.op_mode for m in self.of(imc.VehicleState)]
        return modes[:1] + [mode for before, mode in pairwise(modes) if mode != before]

    def since(self, mode):
        """When the vehicle was first in a mode (s)."""
        return next(time for time, m in self.heard[imc.VehicleState] if m.op_mode == mode)

    def distances(self, kind, begin, end, place):
        """Distances (m) of SimulatedStates from a place (m north and east of the start)."""
        return [math.dist((m.x, m.y), place) for m in self.of(kind, begin, end)]


def sail(boat, plan, *overrides, seed=1, happen=None, until=None, keep_all=False):
    """Sail a plan to its end or, whatever happens, `until` a time (s).

    `happen` is a coroutine function that gets the vehicle and a script.
    """
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        places = {"log_root": root / "log", "state_folder": root / "db"}
        vehicle = prepare(boat, overrides=(UNLOGGED, *overrides), seed=seed, **places).vehicle
        voyage = Voyage(Report(), {kind: [] for kind in KINDS})
        note(vehicle, voyage.heard)
        if keep_all:
            vehicle.observe(imc.Message, lambda _, packet: voyage.packets.append(packet), packets=True)
        if happen is not None:
            vehicle.kernel.soon(vehicle.daemon.start_script, lambda script: happen(vehicle, script))
        if until is None:
            voyage.report = Mission(vehicle, plan).fly(2000.0)
            return voyage

        async def command(script):
            await script.receive(imc.PlanControlState, where=lambda m: m.state == imc.PlanControlState.State.READY)
            await script.receive(imc.VehicleState, where=lambda m: m.op_mode == Mode.SERVICE)
            script.publish(imc.PlanControl(plan_id=plan.plan_id, arg=plan, dst=vehicle.system))

        vehicle.start()
        vehicle.kernel.soon(vehicle.daemon.start_script, command)
        try:
            vehicle.run(until)
        finally:
            vehicle.close()
    return voyage


def sail_on(state, *events, until):
    """Sail on from a state, until a time (s); events are times (s) and functions of the vehicle."""
    with tempfile.TemporaryDirectory() as folder:
        vehicle = state.go_on(Path(folder))
        voyage = Voyage(Report(), {kind: list(before) for kind, before in state.heard.items()})
        note(vehicle, voyage.heard)
        for time, event in events:
            vehicle.run(vehicle.start_time + time - vehicle.kernel.now_ns / SECOND)
            event(vehicle)
        vehicle.run(vehicle.start_time + until - vehicle.kernel.now_ns / SECOND)
        vehicle.close()
    return voyage


def at(north, east):
    lat, lon, _ = displace(LAT, LON, 0.0, north, east)
    return {"lat": lat, "lon": lon}


def plan_of(*maneuvers):
    names = [f"m{number}" for number in range(len(maneuvers))]
    items = [imc.PlanManeuver(maneuver_id=name, data=m) for name, m in zip(names, maneuvers, strict=True)]
    links = [imc.PlanTransition(source_man=a, dest_man=b) for a, b in pairwise(names)]
    return imc.PlanSpecification(plan_id="boat", start_man_id="m0", maneuvers=items, transitions=links)


def goto(north, east, speed=1.5, **fields):
    return imc.Goto(**at(north, east), **({"z_units": DEPTH, "speed": speed} | fields))
