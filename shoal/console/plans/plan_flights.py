"""Requests of the page to fly a plan in virtual time before it is stored on a vehicle."""

import math
import re
from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

import imc
from shoal.console.json_request import Answer, json_object, json_response, refusal_response
from shoal.console.owned_job import OwnedJob
from shoal.console.page_job import PageJobError
from shoal.console.page_part import PagePart
from shoal.console.vehicle_orders import LONGEST_PLAN
from shoal.console.vehicle_view import position
from shoal.network import Network
from support.terminal_text import printable

WORKER = "shoal.console.plans.plan_flight"
PROFILE_NAME = re.compile(r"\w[\w.-]*", re.ASCII)  # a name, no path


class PlanFlights(PagePart):
    """Answers to the page. One plan is flown at a time: others are refused with the name of who flies.

    Who flies may cancel it, and who may maintain.
    """

    def __init__(self, network: Network) -> None:
        self._network = network
        self._worker = OwnedJob(WORKER, "tries a plan in simulation")
        self._progress: dict[str, Any] = {}  # of the flight that runs
        self.questions: Mapping[str, Answer] = {"/api/flight": self._watch}
        self.orders: Mapping[str, Answer] = {"/api/flight": self._fly, "/api/flight-cancel": self._cancel}

    def close(self) -> None:
        """End the flight that runs."""
        self._worker.close()

    async def _fly(self, request: Request) -> Response:
        words = await json_object(request)
        text, profile, name = words.get("text"), words.get("profile"), words.get("vehicle")
        if not isinstance(text, str) or len(text) > LONGEST_PLAN:
            return _refusal(f"a plan as text has at most {LONGEST_PLAN} characters")
        if not isinstance(profile, str) or not PROFILE_NAME.fullmatch(profile):
            return _refusal("name the profile that flies the plan, such as lauv-noptilus-1")
        if not self._worker.is_busy:
            self._progress = {"seconds": 0, "percent": 0}
        job = {"text": text, "profile": profile, "place": self._place(name)}
        try:
            found = await self._worker.run(request.state.user, job, self._progress.update)
        except PageJobError as error:
            return _refusal(str(error))
        return json_response({**found, "text": printable(str(found["text"]))})

    async def _watch(self, _: Request) -> Response:
        """Progress of the flight; without numbers if there is none."""
        return json_response({"ok": True, **(self._progress if self._worker.is_busy else {})})

    async def _cancel(self, request: Request) -> Response:
        refusal = self._worker.cancel(request.state.user)
        return _refusal(refusal) if refusal else json_response({"ok": True})

    def _place(self, name: object) -> tuple[float, float] | None:
        """The place of the vehicle (degrees); None if it is not known."""
        system = self._network.systems.get(name) if isinstance(name, str) else None
        state = None if system is None else system.latest_message(imc.EstimatedState)
        if state is None:
            return None
        lat, lon, _ = position(state)
        return (math.degrees(lat), math.degrees(lon)) if math.isfinite(lat + lon) else None


def _refusal(text: str) -> Response:
    return refusal_response(text, rows=[])
