"""Requests of the page for the checks before a dive; those of an operator have the vehicle check a plan."""

import asyncio
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict

from starlette.requests import Request
from starlette.responses import Response

import imc
from shoal.console.health.dive_checks import KINDS, DiveChecks, PlanChoice
from shoal.console.json_request import Answer, json_object, json_response, refusal_response
from shoal.console.page_part import PagePart
from shoal.network import AsyncRemoteVehicle, Network, NetworkError, NetworkSystem
from support.terminal_text import printable

PATIENCE = 1.5  # s for the first messages of a kind, since the vehicle is followed
LATER = 0.3  # s for the answer about limits after that to a later question: the vehicle answers in order
LOOK = 0.1  # s
DOUBTS = {"red": "not ready", "yellow": "to look at"}  # the words for checks of a color


class DiveCheckRoutes(PagePart):
    """Answers about the vehicles of a network.

    `now` is the time that is shown (s since 1970 UTC); `is_live` is whether the vehicles are there now, and not in a
    log. `followed_for(system)` is for how long (s) the messages of `KINDS` have been received of a system, if it has
    sent them.
    """

    def __init__(
        self,
        network: Network,
        now: Callable[[], float] = time.time,
        *,
        is_live: bool = True,
        followed_for: Callable[[NetworkSystem], float] = lambda _: 0.0,
    ) -> None:
        self._network, self._now, self._is_live = network, now, is_live
        self._followed_for = followed_for
        self.posted: Mapping[str, Answer] = {"/api/checks": self._answer}

    async def _answer(self, request: Request) -> Response:
        words = await json_object(request)
        name, plan_name = (str(words.get(word, "")) for word in ("vehicle", "plan"))
        system = self._network.systems.get(name)
        if system is None or not system.is_vehicle:
            return refusal_response("there is no such vehicle")
        plan = PlanChoice()
        with self._network.subscribe(system, KINDS):
            if self._is_live and system.id is not None and system.is_there:
                deadline = time.monotonic() + PATIENCE - self._followed_for(system)
                plan = await self._ask(system, plan_name, request.state.refusal)
                await self._receive(system, deadline)
            checks = DiveChecks(system, plan, is_live=self._is_live).rows()
        rows = [asdict(check) for check in checks]
        counts = {words: sum(check.color == color for check in checks) for color, words in DOUBTS.items()}
        found = ", ".join(f"{count} {words}" for words, count in counts.items() if count)
        text = f"NOT READY: {found}" if found else "READY"
        text += f" ({time.strftime('%H:%M:%S', time.gmtime(self._now()))} UTC)"
        return json_response({"ok": True, "checks": rows, "plans": plan.stored or [], "text": text})

    async def _ask(self, system: NetworkSystem, plan: str, refusal: str) -> PlanChoice:
        """Ask for limits, if none are known, and for a plan; wait for the limits."""
        began, limits = time.monotonic(), imc.OperationalLimits
        if system.latest_message(limits) is None:
            self._network.send(system, imc.GetOperationalLimits())
        found = await self._choose(AsyncRemoteVehicle(self._network, system), plan, refusal)
        deadline = began + PATIENCE if found.stored is None else time.monotonic() + LATER
        while system.latest_message(limits) is None and time.monotonic() < deadline:
            await asyncio.sleep(LOOK)
        return found

    async def _receive(self, system: NetworkSystem, deadline: float) -> None:
        """Wait for what is sent by itself. A vehicle that is followed for longer than the patience does not have it."""
        wanted = [kind for kind in KINDS if kind not in (imc.Calibration, imc.OperationalLimits)]
        while any(system.latest_message(kind) is None for kind in wanted) and time.monotonic() < deadline:
            await asyncio.sleep(LOOK)

    async def _choose(self, vehicle: AsyncRemoteVehicle, name: str, refusal: str) -> PlanChoice:
        """The plan of a name, as the vehicle judges it, or only the names of those that are stored.

        The vehicle loads a plan to check it, which it does for nobody with a `refusal`.
        """
        try:
            stored = [plan.name for plan in await vehicle.plan.list()]
        except NetworkError as error:
            return PlanChoice(name, trouble=printable(str(error)))
        if not name:
            return PlanChoice(stored=stored)
        if refusal:
            return PlanChoice(name, trouble=f"not checked by the vehicle: {refusal}", stored=stored)
        try:
            return PlanChoice(name, await vehicle.plan.estimate(name), stored=stored)
        except NetworkError as error:
            return PlanChoice(name, trouble=printable(str(error)), stored=stored)
