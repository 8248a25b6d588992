"""The page's view of one vehicle: its latest messages as numbers with units and words."""

import math
import time
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import imc
from imc.discovery import displayable_name
from shoal.console.health.health_advice import advice
from shoal.network import NetworkSystem
from support.terminal_text import printable
from support.wgs84 import is_on_earth

KINDS = (
    imc.Announce,
    imc.Calibration,
    imc.EntityInfo,
    imc.EntityList,
    imc.EntityState,
    imc.EstimatedState,
    imc.FuelLevel,
    imc.GpsFix,
    imc.Heartbeat,
    imc.LogBookEntry,
    imc.NavigationUncertainty,
    imc.OperationalLimits,
    imc.PlanControlState,
    imc.PlanDBState,
    imc.Rpm,
    imc.StorageUsage,
    imc.VehicleMedium,
    imc.VehicleState,
)
"""The messages that a view is made of, and those that come seldom and are needed by another view later."""
AT_REST = 1.0  # rpm
OLDEST_SPEED = 3.0  # s before the newest VehicleState
RUNNING = (imc.PlanControlState.State.EXECUTING, imc.PlanControlState.State.INITIALIZING)
TYPES = {kind.value: kind.name.lower() for kind in imc.SystemType}

View = dict[str, Any]
Item = TypeVar("Item")


class ArrivalTimes:
    """Times at which positions and states of entities of the vehicles came, by the console's clock (s since 1970).

    A vehicle's own clock may be set otherwise, or run at another speed.
    """

    def __init__(self, clock: Callable[[], float] = time.time) -> None:
        self._clock = clock
        self._states: dict[tuple[str, int], tuple[int, float]] = {}
        self._positions: dict[str, tuple[imc.EstimatedState, float]] = {}

    def position_time(self, system: NetworkSystem, state: imc.EstimatedState) -> float:
        """Time at which the newest position of a vehicle came."""
        known = self._positions.get(system.name)
        if known is None or known[0] is not state:
            known = self._positions[system.name] = state, self._clock()
        return known[1]

    def since(self, system: NetworkSystem, state: imc.EntityState) -> float:
        """Time at which the entity of a newest state was seen in it first."""
        place = system.name, state.src_ent
        known = self._states.get(place)
        if known is None or known[0] != state.state:
            known = self._states[place] = state.state, self._clock()
        return known[1]


def vehicle_view(
    system: NetworkSystem, times: ArrivalTimes, named: Callable[[str], str] = lambda text: text
) -> dict[str, View]:
    """The page's data of a vehicle, in sections that are sent when they change.

    `named(text)` is the text of an error with names of systems.
    Angles are in degrees, lengths in m, speeds in m/s, times in s; unknown values are null.
    """
    return {
        "system": _identity(system),
        "state": _state(system, times),
        "plan": _plan(system, named),
        "health": {"entities": _entities(system, times)},
    }


def _identity(system: NetworkSystem) -> View:
    announce, fuel = system.latest_message(imc.Announce), system.latest_message(imc.FuelLevel)
    return {
        "name": displayable_name(system.name),
        "id": None if system.id is None else f"0x{system.id:04X}",
        "type": None if announce is None else TYPES.get(announce.sys_type, "vehicle"),
        "networks": sorted(system.links),
        "places": system.addresses,
        "conflict": printable(system.conflict_text) or None,
        "there": system.is_there,
        "battery": None if fuel is None else round(fuel.value, 1),
    }


def _state(system: NetworkSystem, times: ArrivalTimes) -> View:
    state, medium = system.latest_message(imc.EstimatedState), system.latest_message(imc.VehicleMedium)
    if state is None:
        return {}
    lat, lon, height = position(state)
    doubt = system.latest_message(imc.NavigationUncertainty)
    spread = math.sqrt(max(doubt.x, doubt.y, 0.0)) if doubt is not None else math.nan
    return {
        "time": round(times.position_time(system, state), 2),
        "lat": _rounded(math.degrees(lat), 7),
        "lon": _rounded(math.degrees(lon), 7),
        "height": _rounded(height, 1),
        "depth": _rounded(state.depth, 2) if state.depth >= 0.0 else None,
        "altitude": _rounded(state.alt, 1) if state.alt >= 0.0 else None,
        "heading": _rounded(math.degrees(state.psi) % 360.0, 1),
        "roll": _rounded(math.degrees(state.phi), 1),
        "pitch": _rounded(math.degrees(state.theta), 1),
        "speed": _rounded(math.hypot(state.vx, state.vy), 2),
        "climb": _rounded(-state.vz, 2),
        "uncertainty": _rounded(spread, 1),
        "medium": None if medium is None else word(imc.VehicleMedium.Medium, medium.medium),
    }


def position(state: imc.EstimatedState) -> tuple[float, float, float]:
    """Latitude and longitude (rad) and height (m); NaN where the vehicle does not know its place."""
    numbers = state.lat, state.lon, state.height, state.x, state.y, state.z
    known = all(map(math.isfinite, numbers)) and is_on_earth(*numbers[:2]) and numbers[:2] != imc.coordinates.NOWHERE
    return imc.coordinates.absolute_position(state) if known else (math.nan, math.nan, math.nan)


def _plan(system: NetworkSystem, named: Callable[[str], str]) -> View:
    vehicle, plan = system.latest_message(imc.VehicleState), system.latest_message(imc.PlanControlState)
    stored = system.latest_message(imc.PlanDBState)
    view: View = {
        "mode": None if vehicle is None else word(imc.VehicleState.OpMode, vehicle.op_mode),
        "error": printable(named(vehicle.last_error)) if vehicle is not None and vehicle.last_error else None,
        "motors": motors(system),
        "stored": None if stored is None else stored.md5.hex(),
        **dict.fromkeys(("state", "outcome", "name", "maneuver", "progress", "eta")),
    }
    if plan is None:
        return view
    view["state"] = word(imc.PlanControlState.State, plan.state)
    view["outcome"] = word(imc.PlanControlState.LastOutcome, plan.last_outcome)
    if plan.state in RUNNING:
        view["name"], view["maneuver"] = displayable_name(plan.plan_id), printable(plan.man_id) or None
        view["progress"] = round(plan.plan_progress, 1) if plan.plan_progress >= 0.0 else None
        view["eta"] = plan.plan_eta if plan.plan_eta >= 0 else None
    return view


def motors(system: NetworkSystem) -> str | None:
    """Whether the motors are at rest or turn, by their speeds; None where the vehicle has not reported these lately."""
    vehicle = system.latest_message(imc.VehicleState)
    newest = -math.inf if vehicle is None else vehicle.timestamp - OLDEST_SPEED
    speeds = [abs(rpm.value) for rpm in system.latest_entity_messages(imc.Rpm) if rpm.timestamp >= newest]
    if not speeds:
        return None
    return "at rest" if max(speeds) < AT_REST else "turning"


def _entities(system: NetworkSystem, times: ArrivalTimes) -> list[View]:
    """The states of the entities, the worst first, then by label."""
    states = sorted(
        system.latest_entity_messages(imc.EntityState),
        key=lambda state: (-_severity(state.state), system.label(state.src_ent)),
    )
    return [
        {
            "entity": printable(system.label(state.src_ent)),
            "state": word(imc.EntityState.State, state.state),
            "text": printable(state.description),
            "advice": advice(state.state, state.description),
            "since": round(times.since(system, state)),
        }
        for state in states
    ]


def _severity(state: int) -> int:
    """0 for an entity that works, rising to a failure."""
    kinds = imc.EntityState.State
    return (
        {kinds.BOOT: 1, kinds.FAULT: 2, kinds.ERROR: 3, kinds.FAILURE: 4}.get(kinds(state), 0)
        if state in set(kinds)
        else 1
    )


def word(names: Any, value: int) -> str:
    """The name of a value, in small letters; the number if it has none."""
    return str(names(value).name).lower() if value in set(names) else str(value)


def _rounded(value: float, digits: int) -> float | None:
    return round(value, digits) if math.isfinite(value) else None


def changed_items(before: Mapping[str, Item], now: Mapping[str, Item]) -> dict[str, Item]:
    """The items, such as sections of a view, that differ from those before."""
    return {name: item for name, item in now.items() if before.get(name) != item}
