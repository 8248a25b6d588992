"""Requests of the page to read and write plans as files of Shoal and of other programs."""

import asyncio
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

import imc
from mavlink.missions import ConversionContext
from shoal.console.json_request import Answer, json_object, json_response, refusal_response
from shoal.console.page_part import PagePart
from shoal.console.plans.drawn_plan import drawn_plan_text
from shoal.console.plans.plan_path import plan_path
from shoal.console.vehicle_orders import LONGEST_PLAN
from shoal.missions import (
    PLAN_SUFFIXES,
    PlanFileError,
    announced_context,
    load_plan,
    parse_plan,
    plan_file_text,
    plan_text,
)
from shoal.network import AsyncRemoteVehicle, Network, NetworkError
from support.file_names import file_name_of
from support.terminal_text import printable

LONGEST_FILE = 900_000  # characters; a request has at most 1 MiB
ERRORS = (PlanFileError, imc.DecodeError, imc.EncodeError, ValueError, RecursionError)


class PlanFiles(PagePart):
    """Answers to the page. Nothing is stored on a vehicle."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._working = asyncio.Lock()  # one file at a time: a long one takes a second of a core
        self.questions: Mapping[str, Answer] = {"/api/plan-text": self._text}
        self.orders: Mapping[str, Answer] = {
            "/api/plan-import": self._import,
            "/api/plan-export": self._export,
            "/api/plan-draw": self._draw,
        }

    async def _text(self, request: Request) -> Response:
        """A stored plan as YAML."""
        system = self._network.systems.get(request.query_params.get("vehicle", ""))
        if system is None or not system.is_vehicle:
            return refusal_response("there is no such vehicle")
        try:
            plan = await AsyncRemoteVehicle(self._network, system).plan.get(request.query_params.get("plan", ""))
            return json_response({"ok": True, "text": await asyncio.to_thread(plan_text, plan)})
        except (NetworkError, *ERRORS) as error:
            return refusal_response(str(error))

    async def _import(self, request: Request) -> Response:
        """The plan in the text of a file with a name, as YAML, its path for the map, and remarks."""
        words = await json_object(request)
        name, text = words.get("name"), words.get("text")
        if not isinstance(name, str) or not isinstance(text, str) or len(text) > LONGEST_FILE:
            return refusal_response(f"a file has a name, and at most {LONGEST_FILE} characters")
        suffix = Path(name).suffix.lower()
        if suffix not in PLAN_SUFFIXES:
            return refusal_response(f"{name}: files of plans end in {', '.join(PLAN_SUFFIXES)}")
        return await self._answer(_read_file, file_name_of(name), text, self._context(words.get("vehicle")))

    async def _export(self, request: Request) -> Response:
        """The text of a file for a plan in YAML, its name, and remarks on what the file lacks."""
        words = await json_object(request)
        text, suffix = words.get("text"), words.get("suffix")
        if not isinstance(text, str) or len(text) > LONGEST_PLAN or not isinstance(suffix, str):
            return refusal_response(f"a plan as text has at most {LONGEST_PLAN} characters")
        if suffix not in PLAN_SUFFIXES:
            return refusal_response(f"files of plans end in {', '.join(PLAN_SUFFIXES)}")
        return await self._answer(_write_file, suffix, text, self._context(words.get("vehicle")))

    async def _draw(self, request: Request) -> Response:
        """A plan of shapes, see `drawn_plan_text`, as YAML, and its path for the map."""
        words = await json_object(request)
        return await self._answer(_draw_plan, words.get("name"), words.get("shapes"))

    async def _answer(self, work: Any, *given: object) -> Response:
        try:
            async with self._working:
                return json_response({"ok": True, **await asyncio.to_thread(work, *given)})
        except ERRORS as error:
            return refusal_response(str(error))

    def _context(self, name: object) -> ConversionContext | None:
        """The kind of vehicle for which missions are converted; None if it has not announced itself."""
        system = self._network.systems.get(name) if isinstance(name, str) else None
        return None if system is None else announced_context(system.latest_message(imc.Announce))


def _read_file(name: str, text: str, context: ConversionContext | None) -> dict[str, Any]:
    remarks: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_text(text, encoding="utf-8", errors="replace")
        try:
            plan = load_plan(path, context, remark=remarks.append)
        except PlanFileError as error:
            raise ValueError(str(error).replace(f"{folder}/", "")) from None
    return {"text": plan_text(plan), "path": plan_path(plan), "remarks": list(map(printable, remarks))}


def _draw_plan(name: object, shapes: object) -> dict[str, Any]:
    text = drawn_plan_text(name, shapes)
    return {"text": text, "path": plan_path(parse_plan(text)) if shapes else []}


def _write_file(suffix: str, text: str, context: ConversionContext | None) -> dict[str, Any]:
    plan = parse_plan(text)
    name = file_name_of(plan.plan_id) + suffix
    found = plan_file_text(plan, Path(name), context)
    missing = [f"without {', '.join(found.missing)}"] if found.missing else []
    return {"name": name, "text": found.text, "remarks": list(map(printable, [*found.remarks, *missing]))}
