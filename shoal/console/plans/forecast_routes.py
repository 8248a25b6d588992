"""Requests of the page for a forecast: the rest of the running plan of a vehicle, simulated again and again."""

import asyncio
import math
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, TypeGuard

from starlette.requests import Request
from starlette.responses import Response

import imc
from autonomy.plans import remaining_plan_at
from shoal.console.access.users import User
from shoal.console.json_request import Answer, json_object, json_response, refusal_response
from shoal.console.owned_job import may_end
from shoal.console.page_job import PageJob, PageJobError
from shoal.console.page_part import PagePart
from shoal.console.parameters.profile_settings import ProfileSettings
from shoal.console.plans.forecast_summary import ForecastResult, describe_runs, enclosing_circles
from shoal.console.plans.plan_flights import PROFILE_NAME
from shoal.console.vehicle_view import RUNNING, position
from shoal.network import AsyncRemoteVehicle, Network, NetworkError, NetworkSystem
from support.terminal_text import printable

WORKER = "shoal.console.plans.forecast_worker"
PERIOD = 30.0  # s between the begins of two forecasts
RETRY = 3.0  # s until a vehicle without a running plan is looked at again
LOOK = 0.5  # s between two looks whether somebody still asks
UNWATCHED = 10.0  # s without a question, after which nobody looks
LEAST_RUNS, MOST_RUNS = 5, 20
SHORTEST, LONGEST = 10.0, 3600.0  # s of a horizon
FASTEST_CURRENT = 3.0  # m/s
CURRENT_AGE = 60.0  # s
SILENT = 3.0  # s
OFF = "off on the page of this vehicle: it takes half a core, and [Transports.Console] Forecast = true allows it"
IMPOSSIBLE = "the vehicle has not reported where it is"


@dataclass
class ForecastView:
    """A finished forecast: its runs, their horizon (s) and the time (s, monotonic) that it begins at."""

    number: int
    runs: Sequence[ForecastResult]
    horizon: float
    since: float

    def describe(self, *, whole: bool) -> dict[str, Any]:
        """The page's data; `whole` with the tracks."""
        found: dict[str, Any] = {
            "number": self.number,
            "age": round(time.monotonic() - self.since),
            "summary": printable(describe_runs(self.runs, self.horizon)),
        }
        if whole:
            found["tracks"] = [[row[1:3] for row in run["rows"]] for run in self.runs]
            found["circles"] = enclosing_circles(self.runs, self.horizon)
        return found


class ForecastRoutes(PagePart):
    """Answers to the page about one vehicle at a time.

    A forecast is made again every 30 s, or as soon as the one before is finished, while a page asks for it. Who has
    started it may replace it by another one, and who may maintain. `settings` are those of the profile, where the
    vehicle runs in this process; others are asked for their parameters as the first one begins.
    """

    def __init__(self, network: Network, settings: ProfileSettings | None = None, *, is_allowed: bool = True) -> None:
        self._network, self._settings, self._is_allowed = network, settings, is_allowed
        self._worker = PageJob(WORKER)
        self._starting = asyncio.Lock()  # of two at once, the second one replaces the first
        self._loop: asyncio.Task[None] | None = None
        self._owner: User | None = None
        self._wanted = "", 0.0, 0.0  # vehicle, horizon and spread of the current
        self._asked = -math.inf
        self._number = 0
        self._runs_done = 0
        self._trouble = ""
        self._latest: ForecastView | None = None
        self._pause = PERIOD
        self._parameters: Mapping[str, Mapping[str, str]] | None = None
        self.questions: Mapping[str, Answer] = {"/api/forecast": self._answer}
        self.orders: Mapping[str, Answer] = {"/api/forecast": self._start}

    def close(self) -> None:
        """End the forecast that is being made."""
        self._asked = -math.inf
        self._worker.cancel()
        if self._loop is not None:
            self._loop.cancel()
            self._loop = None

    async def _answer(self, request: Request) -> Response:
        name, known = request.query_params.get("vehicle", ""), request.query_params.get("known", "")
        if not self._is_allowed:
            return json_response({"ok": True, "on": False, "allowed": False, "text": OFF})
        if self._loop is None or name != self._wanted[0]:
            return json_response({"ok": True, "on": False, "allowed": True, "text": ""})
        self._asked = time.monotonic()
        found: dict[str, Any] = {"ok": True, "on": True, "allowed": True, "text": printable(self._trouble)}
        if not self._trouble and self._worker.is_busy:
            found["text"] = f"run {self._runs_done + 1} is simulated"
        system = self._network.systems.get(name)
        if system is not None and system.age > SILENT:
            found["text"] = f"no message of the vehicle for {system.age:.0f} s"
        if self._latest is not None:
            found |= self._latest.describe(whole=known != str(self._latest.number))
        return json_response(found)

    async def _start(self, request: Request) -> Response:
        words = await json_object(request)
        name, horizon, spread = words.get("vehicle"), words.get("horizon", 300.0), words.get("current", 0.2)
        system = self._network.systems.get(name) if isinstance(name, str) else None
        if not self._is_allowed:
            return refusal_response(OFF)
        if system is None or not system.is_vehicle:
            return refusal_response("there is no such vehicle")
        if not _is_number(horizon, SHORTEST, LONGEST):
            return refusal_response(f"the horizon is a number from {SHORTEST:g} to {LONGEST:g} s")
        if not _is_number(spread, 0.0, FASTEST_CURRENT):
            return refusal_response(f"the current is a number from 0 to {FASTEST_CURRENT:g} m/s")
        if self._settings is None and not PROFILE_NAME.fullmatch(system.name):
            return refusal_response(f"{printable(system.name)} is no name of a profile")
        wanted = system.name, float(horizon), float(spread)
        user = request.state.user
        async with self._starting:
            if self._loop is None or wanted != self._wanted:
                owner = self._owner
                if self._loop is not None and owner is not None and not may_end(user, owner):
                    text = f"{owner.name} has another forecast made, of {printable(self._wanted[0])}"
                    return refusal_response(f"{text}: wait until nobody looks at it")
                await self._end()
                self._owner = user
                self._wanted, self._asked, self._trouble = wanted, time.monotonic(), ""
                self._loop = asyncio.create_task(self._repeat(system, *wanted[1:]))
        return json_response({"ok": True, "text": ""})

    async def _end(self) -> None:
        loop = self._loop
        self.close()
        self._latest = None
        if loop is not None:
            with suppress(asyncio.CancelledError):
                await loop

    async def _repeat(self, system: NetworkSystem, horizon: float, spread: float) -> None:
        """Make forecasts until nobody looks."""
        self._parameters = None
        use = self._network.subscribe(system, (imc.EstimatedStreamVelocity, imc.NavigationUncertainty))
        try:
            while self._is_watched():
                began = time.monotonic()
                making = asyncio.create_task(self._make(system, horizon, spread))
                try:
                    while self._is_watched() and (not making.done() or time.monotonic() - began < self._pause):
                        await asyncio.sleep(LOOK)
                finally:
                    self._worker.cancel()
                    making.cancel()
                    await asyncio.gather(making, return_exceptions=True)
        finally:
            use.close()
            if self._loop is asyncio.current_task():
                self._loop, self._latest = None, None

    def _is_watched(self) -> bool:
        return time.monotonic() - self._asked < UNWATCHED

    async def _make(self, system: NetworkSystem, horizon: float, spread: float) -> None:
        runs: list[ForecastResult] = []
        self._runs_done, self._pause = 0, PERIOD

        def take(run: ForecastResult) -> None:
            runs.append(run)
            self._runs_done = len(runs)
            if self._latest is None or self._latest.runs is runs:  # the first one is shown as it grows
                self._number += 1
                self._latest = ForecastView(self._number, runs, horizon, since)

        since = time.monotonic()
        try:
            job = await self._job(system)
            since = time.monotonic()
            answer = await self._worker.run({**job, "horizon": horizon, "current_spread": spread}, take)
            trouble = "" if answer["ok"] else str(answer["text"])
        except PageJobError as error:
            trouble = str(error)
        except (NetworkError, ValueError) as error:
            trouble, self._pause = str(error), RETRY
        if trouble:
            self._latest = None
        elif self._latest is None or self._latest.runs is not runs:
            self._number += 1
            self._latest = ForecastView(self._number, runs, horizon, since)
        self._trouble = trouble

    def _running(self, system: NetworkSystem) -> imc.PlanControlState | None:
        """The state of the plan that is carried out; None if there is none."""
        state = system.latest_message(imc.PlanControlState)
        return state if state is not None and state.state in RUNNING and state.plan_id and state.man_id else None

    async def _job(self, system: NetworkSystem) -> dict[str, Any]:
        """The state of the vehicle and the rest of its plan. Raises ValueError with the reason, NetworkError."""
        self._network.check_is_there(system)
        running = self._running(system)
        if running is None:
            raise ValueError("no plan is running")
        vehicle = AsyncRemoteVehicle(self._network, system)
        plan = await vehicle.plan.get(running.plan_id)
        running = self._running(system) or running
        state = system.latest_message(imc.EstimatedState)
        lat, lon, _ = position(state) if state is not None else (math.nan, math.nan, math.nan)
        if state is None or not math.isfinite(lat + lon):
            raise ValueError(IMPOSSIBLE)
        left = float(running.man_eta) if running.man_eta >= 0 else math.nan
        fuel, doubt = system.latest_message(imc.FuelLevel), system.latest_message(imc.NavigationUncertainty)
        return {
            **await self._options(vehicle),
            "plan": remaining_plan_at(plan, running.man_id, (lat, lon), left).to_json(),
            "place": [math.degrees(lat), math.degrees(lon)],
            "heading": _finite(math.degrees(state.psi)) % 360.0,
            "pitch": _finite(math.degrees(state.theta)),
            "depth": max(0.0, _finite(state.depth)),
            "altitude": max(0.0, _finite(state.alt)),
            "speed": _finite(state.u),
            "battery": fuel.value if fuel is not None and math.isfinite(fuel.value) else None,
            "uncertainty": _finite(math.sqrt(max(0.0, doubt.x, doubt.y))) if doubt is not None else 0.0,
            "current": self._current(system, state),
            "limits": await _limits(vehicle),
            "least": LEAST_RUNS,
            "most": MOST_RUNS,
            "seconds": PERIOD,
            "seed": self._number,
        }

    async def _options(self, vehicle: AsyncRemoteVehicle) -> dict[str, Any]:
        """The profile and the options that the vehicle has. Raises NetworkError if it does not answer."""
        present = None if self._settings is None else self._settings.present_options()
        if present is not None:
            return {**present._asdict(), "parameters": {}}
        if self._parameters is None:
            self._parameters = await _parameters(vehicle) if vehicle.system.is_shoal else {}
        return {"profile": vehicle.name, "folders": [], "overrides": [], "parameters": self._parameters}

    def _current(self, system: NetworkSystem, state: imc.EstimatedState) -> list[float]:
        """The velocity of the water (m/s, north and east) that the vehicle has reported lately; else 0."""
        stream = system.latest_message(imc.EstimatedStreamVelocity)
        if stream is None or abs(stream.timestamp - state.timestamp) > CURRENT_AGE:
            return [0.0, 0.0]
        return [_finite(stream.x), _finite(stream.y)]


async def _parameters(vehicle: AsyncRemoteVehicle) -> dict[str, dict[str, str]]:
    """The parameters of all tasks by section. Raises NetworkError."""
    labels = await vehicle.param.entity_ids()
    values = await vehicle.param.read(labels)
    tasks = await vehicle.param.components({label: labels[label] for label in values})
    return {tasks[label]: values[label] for label in values if label in tasks}


async def _limits(vehicle: AsyncRemoteVehicle) -> str:
    """The vehicle's operational limits as JSON; empty if it does not answer."""
    try:
        found = await vehicle.request(imc.GetOperationalLimits(), imc.OperationalLimits, timeout=2.0)
    except NetworkError:
        return ""
    return found.to_json()


def _finite(number: float) -> float:
    return number if math.isfinite(number) else 0.0


def _is_number(value: object, least: float, most: float) -> TypeGuard[float]:
    return not isinstance(value, bool) and isinstance(value, int | float) and least <= value <= most
