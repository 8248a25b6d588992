"""Objects that cameras of a vehicle detect, for the map, while a page asks for them."""

import asyncio
import math
import time
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

import imc
from shoal.console.json_request import json_response
from shoal.console.vehicle_view import position
from shoal.network import MessageListener, Network, NetworkSystem
from support.terminal_text import printable
from support.wgs84 import displace, is_on_earth

KINDS = (imc.EstimatedState, imc.EstimatedMugState, imc.Target)
UNWATCHED = 10.0  # s without a question, after which no more are kept
MOST = 200  # objects of a vehicle
LONGEST_LABEL = 40  # characters


class Detections:
    """Answers with the latest place of each object: by the id of the glider, or the label of the target.

    Offsets count from the position of the vehicle at the time of the detection; those that come before a position are
    left out. A glider without a number is the one of number 0.
    """

    def __init__(self, network: Network) -> None:
        self._network = network
        self._listener: MessageListener | None = None
        self._end: asyncio.TimerHandle | None = None
        self._places: dict[str, tuple[float, float]] = {}
        self._found: dict[str, dict[str, dict[str, Any]]] = {}

    async def answer(self, request: Request) -> Response:
        """`objects`: label, lat, lon (degrees), age (s)."""
        if self._listener is None:
            self._listener = self._network.listen(None, KINDS)
        if self._end is not None:
            self._end.cancel()
        self._end = asyncio.get_running_loop().call_later(UNWATCHED, self.close)
        for system, message in self._listener.take_all():
            self._take(system, message)
        name, now = request.query_params.get("vehicle", ""), time.monotonic()
        objects = [
            {"label": label, "lat": found["lat"], "lon": found["lon"], "age": round(now - found["time"], 1)}
            for label, found in self._found.get(name, {}).items()
        ]
        return json_response({"ok": True, "objects": objects})

    def close(self) -> None:
        """Keep no more of them."""
        if self._listener is not None:
            self._network.close_listener(self._listener)
            self._listener = None
        if self._end is not None:
            self._end.cancel()
        self._places.clear()
        self._found.clear()

    def _take(self, system: NetworkSystem, message: imc.Message) -> None:
        if isinstance(message, imc.EstimatedState):
            lat, lon, _ = position(message)
            if math.isfinite(lat + lon):
                self._places[system.name] = lat, lon
        elif isinstance(message, imc.EstimatedMugState):
            here = self._places.get(system.name)
            if here is not None and math.isfinite(message.x + message.y):
                lat, lon, _ = displace(*here, 0.0, message.x, message.y)
                self._note(system, f"glider {message.id}", lat, lon)
        elif isinstance(message, imc.Target) and is_on_earth(message.lat, message.lon):
            self._note(system, printable(message.label)[:LONGEST_LABEL], message.lat, message.lon)

    def _note(self, system: NetworkSystem, label: str, lat: float, lon: float) -> None:
        objects = self._found.setdefault(system.name, {})
        objects.pop(label, None)
        if len(objects) >= MOST:
            del objects[next(iter(objects))]
        degrees = round(math.degrees(lat), 7), round(math.degrees(lon), 7)
        objects[label] = {"lat": degrees[0], "lon": degrees[1], "time": time.monotonic()}
