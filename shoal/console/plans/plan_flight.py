"""A plan flown by the simulated vehicle of a profile in virtual time, for the page: track, bottom, battery, time."""

import gc
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import imc
from autonomy.plans.yaml import PlanFileError, parse_plan
from imc.coordinates import NOWHERE, absolute_position
from runtime.profile import Profile, load_profile
from runtime.vehicle import Vehicle
from shoal.console.page_job import answer_job_in_parts
from shoal.missions import Mission, Report, prepare
from support.diagnostics import ProfileError
from support.wgs84 import offset
from world import WorldError, read_world
from world.sea import Bathymetry

ROW_PERIOD = 1.0  # s
MOST_ROWS = 2000
LONGEST = 6 * 3600.0  # s of vehicle time
GARBAGE = 50_000  # objects; fewer searches for garbage in a short run
START = "Initial Position"
HULL = "Simulators.VSIM"
COARSER = {HULL: ("Execution Frequency", "40"), "Simulators.IMU": ("Sampling Rate", "20")}
"""Options for a hull that shorten the computation of a flight, and move its track by less than 0.1 m."""
NEVER = "Enabled=Never"

Row = list[float | None]
Progress = dict[str, float]
"""`seconds` of vehicle time since the begin, and `percent` of the plan."""


class FlightRecorder:
    """Rows of the flight, one a second: time (s), latitude and longitude (degrees), depth, depth of the bottom (m),
    battery (%)."""

    def __init__(self, vehicle: Vehicle, seabed: Bathymetry | None) -> None:
        self.rows: list[Row] = []
        self._vehicle, self._seabed = vehicle, seabed
        self._fuel = math.nan
        self._next = -math.inf
        vehicle.observe(imc.FuelLevel, self._note_fuel)
        vehicle.observe(imc.EstimatedState, self._add_row)

    def _note_fuel(self, fuel: imc.FuelLevel) -> None:
        self._fuel = fuel.value

    def _add_row(self, state: imc.EstimatedState) -> None:
        if state.src != self._vehicle.system or state.timestamp < self._next or (state.lat, state.lon) == NOWHERE:
            return
        self._next = state.timestamp + ROW_PERIOD
        lat, lon, _ = absolute_position(state)
        bottom = math.nan if self._seabed is None else self._seabed.depth(*offset(*self._seabed.reference, lat, lon))
        degrees = round(math.degrees(lat), 7), round(math.degrees(lon), 7)
        numbers = state.timestamp, *degrees, round(state.depth, 2), round(bottom, 2), round(self._fuel, 3)
        self.rows.append([number if math.isfinite(number) else None for number in numbers])


def fly_plan(
    text: str,
    profile: str,
    place: tuple[float, float] | None = None,
    on_progress: Callable[[Progress], object] = lambda _: None,
) -> dict[str, Any]:
    """Fly a plan, written as YAML, with the simulated vehicle of a profile, from a place (degrees) if one is given.

    The answer has `ok`: whether the plan was completed; `text`: a sentence; `rows`: see `FlightRecorder`, their time
    since the first maneuver. `on_progress` gets each percentage of the plan.
    Raises PlanFileError, ProfileError, WorldError, OSError.
    """
    plan = parse_plan(text)
    loaded = load_profile(profile)
    with tempfile.TemporaryDirectory() as folder:
        options = flight_overrides(loaded, place)
        made = prepare(profile, overrides=options, log_root=None, state_folder=Path(folder) / "db")
        seabed = read_world(loaded.value, offset, loaded.find_file).seabed
        recorder = FlightRecorder(made.vehicle, seabed)
        gc.freeze()
        gc.set_threshold(GARBAGE)
        report = Mission(made.vehicle, plan, watch=_progress_watch(on_progress)).fly(LONGEST)
    began = report.legs[0].began if report.legs else math.inf
    rows = [row for row in recorder.rows if (row[0] or 0.0) >= began]
    for row in rows:
        row[0] = round((row[0] or 0.0) - began, 1)
    return {"ok": report.completed, "text": _describe(plan.plan_id, report, rows), "rows": _thinned(rows)}


def _progress_watch(on_progress: Callable[[Progress], object]) -> Callable[[imc.PlanControlState], None]:
    """A function of the states of a plan that reports each percentage once."""
    began, latest = math.nan, -1.0

    def watch(state: imc.PlanControlState) -> None:
        nonlocal began, latest
        began = state.timestamp if math.isnan(began) else began
        if (percent := round(state.plan_progress)) > latest:  # -1: unknown
            latest = percent
            on_progress({"seconds": round(state.timestamp - began), "percent": percent})

    return watch


def flight_overrides(profile: Profile, place: tuple[float, float] | None) -> list[str]:
    """Options that leave out what the flight does not need, and begin it at a place."""
    found: list[str] = []
    has_hull = any(name.partition("/")[0] == HULL for name in profile.config.sections)
    for name, section in profile.config.sections.items():
        kind = name.partition("/")[0]
        if kind.startswith("Simulators.") and kind.endswith("Camera"):
            found.append(f"{name}:{NEVER}")
        elif has_hull and kind in COARSER:
            option, value = COARSER[kind]
            if _is_finer(section.value(option), value):
                found.append(f"{name}:{option}={value}")
        if place is not None and section.value(START):
            found.append(f"{name}:{START}={place[0]:.7f}, {place[1]:.7f}")
    return found


def _is_finer(text: str, rate: str) -> bool:
    """Whether a rate in a profile, or the default without one, is higher than another."""
    try:
        return not text or float(text) > float(rate)
    except ValueError:  # which is reported as a mistake of the profile
        return False


def _describe(name: str, report: Report, rows: list[Row]) -> str:
    if not report.legs:
        return f"{name} would be rejected: {report.reason}"
    words = [f"{name}: {report.reason}", f"{report.seconds:.0f} s", f"{report.distance:.0f} m"]
    used = report.battery_before - report.battery_after
    if math.isfinite(used):
        words.append(f"{used:.1f} % of the battery")
    over = [bottom - depth for _, _, _, depth, bottom, _ in rows if depth is not None and bottom is not None]
    if over:
        words.append(f"deepest {report.deepest:.1f} m, at least {min(over):.1f} m above the bottom")
    return ", ".join(words)


def _thinned(rows: list[Row]) -> list[Row]:
    step = max(1, math.ceil(len(rows) / MOST_ROWS))
    return [*rows[::step], *(rows[-1:] if (len(rows) - 1) % step else [])]


def _work(job: dict[str, Any], on_progress: Callable[[Progress], object]) -> dict[str, Any]:
    place = job.get("place")
    return fly_plan(job["text"], job["profile"], tuple(place) if place else None, on_progress)


if __name__ == "__main__":
    answer_job_in_parts(_work, "the flight", PlanFileError, ProfileError, WorldError)
