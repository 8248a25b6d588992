"""Simulates the rest of a running vehicle's plan several times, with drawn currents and sensor errors, for the page."""

import gc
import math
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import imc
from autonomy.plans import sequential_transitions
from imc.coordinates import absolute_position
from runtime.profile import Profile, load_profile
from runtime.vehicle import Vehicle
from shoal.console.page_job import answer_job_in_parts
from shoal.console.plans.plan_flight import GARBAGE, HULL, flight_overrides
from shoal.missions import Mission, Report, prepare
from support.diagnostics import ProfileError
from tasks.navigation.auv.navigation import Navigation
from tasks.simulators.stream_velocity import CONSTANT, StreamVelocity
from tasks.simulators.uav import UAV
from tasks.simulators.vsim import VSIM
from world import WorldError
from world.bodies import UnderwaterVehicle

SHARE = 0.5  # of a core
SLICE = 4.0  # s of vehicle time between two pauses
PATIENCE = 120.0  # s of vehicle time until the plan runs
ROWS = 100  # of a run
LEAST_PERIOD = 1.0  # s between rows
HEADING_ERROR = 2.0  # °, standard deviation of the compass in a run
CLOSE = 0.05  # m above the bottom, where the hull touches it
AIRFRAME = "Simulators.UAV"
FLYING = 1.0  # m above the ground
DIVING = 0.5  # s in which measurements of the depth before come to the navigation
ASCENT = "forecast-ascent"
ASCENT_SPEED = 5.0  # m/s
TROUBLED = (imc.EntityState.State.ERROR, imc.EntityState.State.FAILURE)
EXECUTING = imc.PlanControlState.State.EXECUTING

Row = list[float | None]


class ForecastError(Exception):
    """A forecast that cannot be made; the text is for the operator."""


class CpuShare:
    """Keeps this process at a share of a core: `pause` sleeps for the time that the others are to have."""

    def __init__(self, share: float = SHARE) -> None:
        self._share = share
        self._used, self._seen = time.process_time(), time.monotonic()

    def pause(self) -> None:
        used, now = time.process_time(), time.monotonic()
        wanted = (used - self._used) / self._share - (now - self._seen)
        if wanted > 0.0:
            time.sleep(wanted)
        self._used, self._seen = used, time.monotonic()


class ForecastRun:
    """One simulated vehicle that carries out a plan from a state in the middle of it.

    `job` has the state and the plan, see `forecast`. The vehicle gets ready at the surface, where its navigation
    settles; as the plan begins, it is set to depth, attitude and speed, and the drawn current sets in. The place is
    then drawn around the reported one, as far as the running vehicle does not know it. An aircraft ascends to its
    altitude first, and begins there at rest.
    """

    def __init__(self, job: dict[str, Any], seed: int, folder: Path) -> None:
        self._job = job
        draws = np.random.default_rng(seed)
        spread, toward = job["current_spread"] * math.sqrt(draws.random()), math.tau * draws.random()
        north, east = job["current"]
        self.current: tuple[float, float] = north + spread * math.cos(toward), east + spread * math.sin(toward)
        self._misplaced = tuple(job["uncertainty"] * draws.standard_normal(2))
        folders = list(map(Path, job["folders"]))
        loaded = load_profile(job["profile"], folders, overrides=job["overrides"])
        if not {HULL, AIRFRAME} & loaded.config.sections.keys():
            text = f"the profile {job['profile']} simulates no motion by forces, [{HULL}] or [{AIRFRAME}]"
            raise ForecastError(f"no forecast: {text}")
        self.vehicle: Vehicle = prepare(
            job["profile"],
            config_dir=folders,
            overrides=_overrides(loaded, job),
            log_root=None,
            seed=seed,
            state_folder=folder,
        ).vehicle
        plan = imc.from_json(job["plan"])
        assert isinstance(plan, imc.PlanSpecification)
        if AIRFRAME in loaded.config.sections and job["altitude"] > FLYING:
            plan = _from_the_ground(plan, job)
        self._mission = Mission(
            self.vehicle, plan, patience=PATIENCE, watch=self._note_state, over=self._end, estimated=self._set_limits
        )
        self.rows: list[Row] = []
        self.crossed: dict[str, None] = {}
        self._navigations = [task for task in self.vehicle.tasks if isinstance(task, Navigation)]
        self._period = max(LEAST_PERIOD, job["horizon"] / ROWS)
        self._began = self._next = math.nan
        self._battery: float | None = None
        self._used_before = 0.0  # % for the ascent
        self._is_over = False
        self.vehicle.observe(imc.SimulatedState, self._note_place)
        self.vehicle.observe(imc.EntityState, self._note_trouble)
        self.vehicle.observe(imc.FuelLevel, self._note_battery)

    def fly(self, pause: Callable[[], object]) -> dict[str, Any]:
        """Run to the end of the plan or to the horizon; `pause` is called every few seconds of vehicle time."""
        horizon, kernel = self._job["horizon"], self.vehicle.kernel
        latest = kernel.now_ns * 1e-9 + PATIENCE + horizon
        self._mission.begin()
        try:
            while not self._is_over and not self._elapsed() >= horizon and kernel.now_ns * 1e-9 < latest:
                left = horizon - self._elapsed()
                self.vehicle.run(min(SLICE, left) if left > 0.0 else SLICE)
                pause()
        finally:
            self.vehicle.close()
        return self._result(self._mission.report)

    def _elapsed(self) -> float:
        """Time (s) since the plan runs; NaN before."""
        return self.vehicle.kernel.now_ns * 1e-9 - self._began

    def _result(self, report: Report) -> dict[str, Any]:
        if not report.legs:
            raise ForecastError(f"the simulated vehicle does not carry out the rest of the plan: {report.reason}")
        over = self._is_over
        return {
            "rows": self.rows,
            "seconds": round(self._elapsed(), 1) if over else None,
            "outcome": ("completed" if report.completed else report.reason) if over else "",
            "battery": self._battery,
            "crossed": list(self.crossed),
        }

    def _end(self) -> None:
        self._is_over = True
        self.vehicle.stop()

    def _set_limits(self, _: Report) -> None:
        """Give the vehicle the limits of the running one, which may differ from those of its profile."""
        if self._job["limits"]:
            limits = imc.from_json(self._job["limits"])
            self.vehicle.daemon.publish(limits.replace(dst=self.vehicle.system))

    def _note_state(self, state: imc.PlanControlState) -> None:
        if state.state == EXECUTING and state.man_id != ASCENT and math.isnan(self._began):
            self._began = self._next = state.timestamp
            self._set_state()

    def _set_state(self) -> None:
        job = self._job
        if job["battery"] is not None and self._battery is not None:
            self._used_before = job["battery"] - self._battery
            self._battery = job["battery"]
        for task in self.vehicle.tasks:
            if isinstance(task, UAV):
                task.craft.x, task.craft.y = task.craft.x + self._misplaced[0], task.craft.y + self._misplaced[1]
            elif isinstance(task, VSIM):
                craft = task.craft
                craft.x, craft.y = self._misplaced
                craft.u = job["speed"]
                if isinstance(craft, UnderwaterVehicle):
                    craft.z = job["depth"]
                craft.set_attitude(0.0, math.radians(job["pitch"]), math.radians(job["heading"]))
            elif isinstance(task, StreamVelocity):
                task.default_speed_north, task.default_speed_east = self.current

    def _note_place(self, truth: imc.SimulatedState) -> None:
        if truth.timestamp - self._began < DIVING:
            for navigation in self._navigations:
                navigation.skip_comparison()
        if not truth.timestamp >= self._next:
            return
        self._next += self._period
        lat, lon, _ = absolute_position(truth)
        hull = next((task for task in self.vehicle.tasks if isinstance(task, VSIM)), None)
        if hull is not None and truth.z >= hull.max_depth_at(lat, lon) - CLOSE and truth.z > CLOSE:
            self.crossed["touches the bottom"] = None
        place = round(math.degrees(lat), 6), round(math.degrees(lon), 6)
        self.rows.append([round(truth.timestamp - self._began, 1), *place, round(truth.z, 1), self._battery])

    def _note_trouble(self, state: imc.EntityState) -> None:
        if state.state in TROUBLED and self._elapsed() > 0.0:
            self.crossed[f"{self.vehicle.entities.label(state.src, state.src_ent)}: {state.description}"] = None

    def _note_battery(self, fuel: imc.FuelLevel) -> None:
        self._battery = round(fuel.value + self._used_before, 2) if math.isfinite(fuel.value) else None


def forecast(job: dict[str, Any], give: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
    """Simulate the rest of a plan `least` times, and more within `seconds` (s), at most `most`; `give` gets each run.

    `job`: `profile`, `folders` of --config-dir, and `overrides`, the options that differ from its files; `parameters`
    of the running vehicle by section, as far as they are known; `plan`, its rest as JSON; `place` (degrees),
    `heading`, `pitch` (°), `depth`, `altitude` (m), `speed` (m/s), `battery` (%, or None) and `uncertainty` (m) of the
    running vehicle; `current` (m/s, north and east) and `current_spread` (m/s): in each run another one is drawn
    within this distance of it; `limits`, its OperationalLimits as JSON, or ""; `horizon` (s), `seed`. A run has
    `rows`: time since now (s), latitude and longitude (degrees), depth (m), battery (%); `seconds` and `outcome` of a
    plan that ends; `battery` at the end; `crossed`: the limits.

    Raises ForecastError, ProfileError, WorldError, OSError.
    """
    began, share = time.monotonic(), CpuShare()
    gc.set_threshold(GARBAGE)
    number = 0
    while number < job["least"] or (number < job["most"] and time.monotonic() - began < job["seconds"]):
        with tempfile.TemporaryDirectory() as folder:
            give(ForecastRun(job, job["seed"] + number, Path(folder) / "db").fly(share.pause))
        gc.collect()
        number += 1
    return {"ok": True, "runs": number, "took": round(time.monotonic() - began, 1)}


def _from_the_ground(plan: imc.PlanSpecification, job: dict[str, Any]) -> imc.PlanSpecification:
    """The plan after an ascent to the altitude of the running aircraft."""
    lat, lon = map(math.radians, job["place"])
    up = imc.Takeoff(lat=lat, lon=lon, z=job["altitude"], z_units=imc.ZUnits.ALTITUDE, speed=ASCENT_SPEED)
    return plan.replace(
        start_man_id=ASCENT,
        maneuvers=(imc.PlanManeuver(maneuver_id=ASCENT, data=up), *plan.maneuvers),
        transitions=(*sequential_transitions([ASCENT, plan.start_man_id]), *plan.transitions),
    )


def _overrides(profile: Profile, job: dict[str, Any]) -> list[str]:
    lat, lon = job["place"]
    known: dict[str, dict[str, str]] = job["parameters"]
    found = [*job["overrides"]]
    for section in known.keys() & profile.config.sections.keys():
        found += [f"{section}:{name}={text}" for name, text in known[section].items()]
    found += flight_overrides(profile, (lat, lon))
    for name in profile.config.sections:
        match name.partition("/")[0]:
            case "Simulators.VSIM" | "Simulators.UAV":
                found.append(f"{name}:Initial Heading={job['heading']:.2f}")
            case "Simulators.Battery" | "Monitors.FuelLevel" if job["battery"] is not None:
                found.append(f"{name}:Initial Level={min(100.0, max(0.0, job['battery'])):.3f}")
            case "Simulators.IMU":
                found.append(f"{name}:Standard Deviation - Heading Offset={HEADING_ERROR:g}")
            case "Simulators.StreamVelocity":
                found.append(f"{name}:Stream Velocity Source={CONSTANT}")
                found += [f"{name}:Default Speed {axis}=0" for axis in ("North", "East", "Down")]
            case _:
                pass
    return found


if __name__ == "__main__":
    answer_job_in_parts(forecast, "the forecast", ForecastError, ProfileError, WorldError)
