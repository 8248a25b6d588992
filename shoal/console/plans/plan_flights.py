"""Requests of the page to fly a plan in virtual time before it is stored on a vehicle."""

import math
import re
import time
from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

import imc
from shoal.console.access.users import Role, User
from shoal.console.json_request import Answer, json_object, json_response
from shoal.console.page_job import PageJob, PageJobError
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
        self._worker = PageJob(WORKER)
        self._flown: tuple[User, float] | None = None  # by whom, since when
        self.orders: Mapping[str, Answer] = {"/api/flight": self._fly, "/api/flight-cancel": self._cancel}

    def close(self) -> None:
        """End the flight that runs."""
        self._worker.cancel()

    async def _fly(self, request: Request) -> Response:
        words = await json_object(request)
        text, profile, name = words.get("text"), words.get("profile"), words.get("vehicle")
        if not isinstance(text, str) or len(text) > LONGEST_PLAN:
            return _refusal(f"a plan as text has at most {LONGEST_PLAN} characters")
        if not isinstance(profile, str) or not PROFILE_NAME.fullmatch(profile):
            return _refusal("name the profile that flies the plan, such as lauv-noptilus-1")
        if self._flown is not None:
            user, began = self._flown
            seconds = time.monotonic() - began
            return _refusal(f"{user.name} tries a plan in simulation, for {seconds:.0f} s now: wait until it is over")
        self._flown = request.state.user, time.monotonic()
        try:
            found = await self._worker.run({"text": text, "profile": profile, "place": self._place(name)})
        except PageJobError as error:
            return _refusal(str(error))
        finally:
            self._flown = None
        return json_response({**found, "text": printable(str(found["text"]))})

    async def _cancel(self, request: Request) -> Response:
        user = request.state.user
        if self._flown is not None and user.name != self._flown[0].name and user.role < Role.MAINTAIN:
            return _refusal(f"this is a flight of {self._flown[0].name}, who may cancel it")
        self._worker.cancel()
        return json_response({"ok": True})

    def _place(self, name: object) -> tuple[float, float] | None:
        """The place of the vehicle (degrees); None if it is not known."""
        system = self._network.systems.get(name) if isinstance(name, str) else None
        state = None if system is None else system.latest_message(imc.EstimatedState)
        if state is None:
            return None
        lat, lon, _ = position(state)
        return (math.degrees(lat), math.degrees(lon)) if math.isfinite(lat + lon) else None


def _refusal(text: str) -> Response:
    answer: dict[str, Any] = {"ok": False, "text": text, "rows": []}
    return json_response(answer)
