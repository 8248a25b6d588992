"""Requests of a page that shows a log: play, pause, speed, seek, whole plots, resume from here."""

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
from starlette.requests import Request
from starlette.responses import Response

import imc
from shoal.console.json_request import Answer, json_object, json_response, refusal_response
from shoal.console.logs.log_link import LogLink
from shoal.console.owned_job import OwnedJob
from shoal.console.page_job import PageJobError
from shoal.console.page_part import PagePart
from support.terminal_text import printable

WORKER = "shoal.console.logs.log_resume"
MOST_POINTS = 4000  # of a plot
RESUMED, LONGEST = 60.0, 6 * 3600.0  # s


class ReplayAnswers(PagePart):
    """Answers to the page of a player. `log_root` is for the logs of resumed runs."""

    def __init__(self, player: LogLink, log_root: Path) -> None:
        self._player, self._log_root = player, log_root
        self._worker = OwnedJob(WORKER, "has a run resumed")
        self._log: imc.Log | None = None
        self._reading = asyncio.Lock()
        self.questions: Mapping[str, Answer] = {"/api/series": self._series}
        self.orders: Mapping[str, Answer] = {"/api/replay": self._control}
        self.maintenance: Mapping[str, Answer] = {"/api/resume": self._resume}

    def close(self) -> None:
        """End the run that is being resumed."""
        self._worker.close()

    async def _control(self, request: Request) -> Response:
        try:
            await self._player.control(await json_object(request))
        except ValueError as error:
            return refusal_response(error)
        return json_response({"ok": True, **self._player.describe()})

    async def _series(self, request: Request) -> Response:
        """Times (s since 1970 UTC) and values of a field, SYSTEM/Message.field:entity, over the whole log."""
        path = request.query_params.get("path", "")
        async with self._reading:
            try:
                times, values = await asyncio.to_thread(self._read_series, path)
            except (KeyError, ValueError, OSError) as error:
                return refusal_response(f"{path} is not in this log: {error}")
        return json_response({"ok": True, "times": times, "values": values})

    def _read_series(self, path: str) -> tuple[list[float], list[float | None]]:
        system, _, rest = path.partition("/")
        name, _, field = rest.partition(".")
        field, _, entity = field.partition(":")
        self._log = self._log or imc.Log(self._player.states.path)
        source = next(
            (number for number in self._player.states.systems if self._player.system_name(number) == system), None
        )
        if source is None:
            raise KeyError(system)
        rows = self._log.array(name, src=source, entity=entity or None)
        if field not in (rows.dtype.names or ()):
            raise KeyError(field)
        rows = rows[np.argsort(rows["timestamp"], kind="stable")]
        rows = rows[:: max(1, -(-rows.size // MOST_POINTS))]
        numbers = cast(list[float], rows[field].astype(float).tolist())
        return rows["timestamp"].tolist(), [number if np.isfinite(number) else None for number in numbers]

    async def _resume(self, request: Request) -> Response:
        words = await json_object(request)
        change, seconds = words.get("change"), words.get("seconds", RESUMED)
        position = words.get("position", self._player.position)
        if not isinstance(position, int | float) or not isinstance(seconds, int | float):
            return refusal_response("position and seconds are numbers")
        if not (0.0 <= position <= self._player.states.duration and 0.0 < seconds <= LONGEST):
            return refusal_response(f"position is within the log, and seconds at most {LONGEST:.0f}")
        job: dict[str, Any] = {
            "log": str(self._player.logs[-1]),
            "time": self._player.states.start + position,
            "seconds": seconds,
            "changes": [change] if isinstance(change, str) and change.strip() else [],
            "log_root": str(self._log_root),
        }
        try:
            found = await self._worker.run(request.state.user, job)
        except PageJobError as error:
            return refusal_response(error)
        return json_response({**found, "text": printable(str(found["text"]))})
