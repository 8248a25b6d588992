"""Requests of the page for what its map shows beside vehicles: overlays of charts, and the limits of a vehicle."""

import math
from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response

import imc
from imc.coordinates import area_corners
from shoal.console.charts.detections import Detections
from shoal.console.charts.tiles import TileSets
from shoal.console.json_request import Answer, json_response, refusal_response
from shoal.console.page_part import PagePart
from shoal.network import AsyncRemoteVehicle, Network, NetworkError
from support.terminal_text import printable

PATIENCE = 3.0  # s for the limits of a vehicle
MOST_TROUBLES = 8  # files that are named
LIMITS = {
    "max_depth": imc.OpLimitsMask.MAX_DEPTH,
    "min_altitude": imc.OpLimitsMask.MIN_ALT,
    "max_altitude": imc.OpLimitsMask.MAX_ALT,
    "max_speed": imc.OpLimitsMask.MAX_SPEED,
}
LABELS = {
    "max_depth": ("depth to", "m"),
    "min_altitude": ("altitude from", "m"),
    "max_altitude": ("altitude to", "m"),
    "max_speed": ("speed to", "m/s"),
}


class MapRoutes(PagePart):
    """Answers to the page. Nothing is asked of the vehicles of a log."""

    def __init__(self, network: Network, tiles: TileSets, *, plays_log: bool) -> None:
        self._network, self._tiles, self._overlays, self._plays_log = network, tiles, tiles.overlays, plays_log
        self._detections = Detections(network)
        self.questions: Mapping[str, Answer] = {
            "/api/overlays": self._list_overlays,
            "/api/overlay": self._overlay,
            "/api/limits": self._limits,
            "/api/detections": self._detections.answer,
        }

    def close(self) -> None:
        """Listen to no vehicle any more, and remove the files of overlays."""
        self._detections.close()
        self._overlays.close()

    async def _list_overlays(self, _: Request) -> Response:
        """The sizes of overlays, and a sentence for each of the first files of the folder that cannot be drawn."""
        overlays = self._overlays
        await overlays.read()
        troubles = [*self._tiles.troubles, *overlays.troubles]
        more = len(troubles) - MOST_TROUBLES
        named = [*troubles[:MOST_TROUBLES], *([f"{more} more files cannot be drawn"] if more > 0 else [])]
        return json_response({"sizes": dict(overlays.sizes), "troubles": list(map(printable, named))})

    async def _overlay(self, request: Request) -> Response:
        path = self._overlays.path(request.query_params.get("name", ""))
        if path is None:
            return PlainTextResponse("no such overlay", 404)
        return FileResponse(path, media_type="application/json")

    async def _limits(self, request: Request) -> Response:
        """`area`: corners (degrees), and the limits that are set; `text` is the reason where unknown."""
        system = self._network.systems.get(request.query_params.get("vehicle", ""))
        if system is None or not system.is_vehicle:
            return refusal_response("there is no such vehicle")
        limits = system.latest_message(imc.OperationalLimits)
        if not self._plays_log:
            try:
                vehicle = AsyncRemoteVehicle(self._network, system)
                limits = await vehicle.request(imc.GetOperationalLimits(), imc.OperationalLimits, timeout=PATIENCE)
            except NetworkError as error:
                return refusal_response(error)
        found = {} if limits is None else limits_view(limits)
        return json_response({"ok": True, **found, "text": limits_text(found)})


def limits_text(limits: Mapping[str, Any]) -> str:
    """A line with limits as `limits_view` gives them; empty without any."""
    words = ["operating area dashed"] if "area" in limits else []
    words += [f"{label} {limits[name]:g} {unit}" for name, (label, unit) in LABELS.items() if name in limits]
    return f"Limits: {', '.join(words)}" if words else ""


def limits_view(limits: imc.OperationalLimits) -> dict[str, Any]:
    """The limits that are set: `area`, its corners in degrees, and depths, altitudes (m) and the speed (m/s)."""
    found: dict[str, Any] = {}
    for name, mask in LIMITS.items():
        value = getattr(limits, name)
        if limits.mask & mask and math.isfinite(value):
            found[name] = round(value, 1)
    if limits.mask & imc.OpLimitsMask.AREA:
        corners = [(math.degrees(lat), math.degrees(lon)) for lat, lon in area_corners(limits)]
        if all(math.isfinite(lat) and math.isfinite(lon) for lat, lon in corners):
            found["area"] = [[round(lat, 7), round(lon, 7)] for lat, lon in corners]
    return found
