"""The paths of the console for Foxglove and Lichtblick: the WebSocket, a layout, and what went wrong."""

import asyncio
import math
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from functools import partial

from starlette.requests import HTTPConnection, Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from shoal.console.access.authority import Authority
from shoal.console.access.page_sessions import PageSession
from shoal.console.access.users import Role, User
from shoal.console.foxglove.layout import make_layout
from shoal.console.foxglove.live_feed import LiveFeed
from shoal.console.foxglove.parameters import ParameterAccess
from shoal.console.foxglove.playback import Playback
from shoal.console.foxglove.protocol import SUBPROTOCOLS
from shoal.console.foxglove.vehicle_services import VehicleServices
from shoal.console.foxglove.viewer_access import ViewerAccess, is_own_origin
from shoal.console.foxglove.viewer_session import ViewerSession
from shoal.network import AsyncRemoteVehicle, Network
from support.token_bucket import TokenBucket, TokenBuckets

PATH = "/foxglove"
MOST_VIEWERS = 16
RATE, BURST = 200.0, 2000.0  # frames of the viewers of an address: in a second, and at once, as by a large layout
FRAME = 1024  # characters that count as one frame
UNREAD = 30.0  # s in which a viewer has to take a frame
CLOSING = 1.0  # s
ACCESS_CHECK = 1.0  # s between looks whether a session lasts
OPERATOR = User("foxglove", Role.MAINTAIN)
"""The user of all who have the token to operate."""
LABELS = 1.0  # s for the labels of the entities that a layout names


class FoxgloveRoutes:
    """Serves viewers from a network.

    find_vehicle: the vehicle of a name for an order; raises NetworkError. is_logged_in: whether a request has the
    cookie of a session of the page, which may watch only. `authority` decides on each order;
    `watching()` lasts while a viewer is connected. `playback` is the log that is played.
    """

    own_origins: tuple[str, ...] = (PATH,)

    def __init__(
        self,
        network: Network,
        find_vehicle: Callable[[object, str], AsyncRemoteVehicle],
        is_logged_in: Callable[[HTTPConnection], bool],
        access: ViewerAccess,
        authority: Authority,
        watching: Callable[[], AbstractContextManager[None]],
        playback: Playback | None = None,
    ) -> None:
        self._network, self._find, self._is_logged_in, self._access = network, find_vehicle, is_logged_in, access
        self._feed, self._authority, self._watching = LiveFeed(network, playback=playback), authority, watching
        self._parameters = ParameterAccess(network, lambda name: find_vehicle(name, ""))
        self._services = VehicleServices()
        self._viewers = 0
        self._number = 0
        self._frames = TokenBuckets(RATE, BURST, MOST_VIEWERS)

    @property
    def routes(self) -> list[BaseRoute]:
        return [
            WebSocketRoute(PATH, self._connect),
            Route("/layout.json", self._layout),
            Route(f"{PATH}/counts.json", self._counts),
        ]

    def _role(self, connection: HTTPConnection) -> bool | None:
        """Whether who connects may operate; None if he may not even watch."""
        token = connection.query_params.get("token")
        if token is not None:
            return self._access.may_operate(token)
        origin, host = (connection.headers.get(name, "") for name in ("origin", "host"))
        own = not origin or is_own_origin(origin, host)
        return False if own and self._is_logged_in(connection) else None

    async def _layout(self, request: Request) -> Response:
        if self._role(request) is None:
            return PlainTextResponse("log in first, or give a token", 401)
        for system in self._network.vehicles():
            if not system.labels and system.id is not None:
                self._network.request_labels(system)
        with suppress(TimeoutError):
            async with asyncio.timeout(LABELS):
                while not all(system.labels for system in self._network.vehicles()):
                    await asyncio.sleep(0.05)
        origin, host = (request.headers.get(name, "") for name in ("origin", "host"))
        allowed = origin and self._access.allows_origin(origin, host)
        headers = {"Access-Control-Allow-Origin": origin, "Vary": "Origin"} if allowed else {}
        return JSONResponse(make_layout(self._network.vehicles()), headers=headers)

    async def _counts(self, request: Request) -> Response:
        if self._role(request) is None:
            return PlainTextResponse("log in first, or give a token", 401)
        return JSONResponse(dict(self._feed.counts))

    async def _connect(self, socket: WebSocket) -> None:
        role = self._role(socket)
        offered = socket.scope.get("subprotocols", [])
        chosen = next((name for name in offered if name in SUBPROTOCOLS), None)
        if not self._access.allows_origin(socket.headers.get("origin", ""), socket.headers.get("host", "")):
            refusal = "this page is not among those of --foxglove-origin", 403
        elif role is None:
            refusal = "the address has no valid token", 401
        elif chosen is None:
            refusal = f"a viewer has to offer a subprotocol: {' or '.join(SUBPROTOCOLS)}", 400
        elif self._viewers >= MOST_VIEWERS:
            refusal = f"{MOST_VIEWERS} viewers are connected", 503
        else:
            self._viewers += 1  # before the first await: of many at once no more are accepted
            try:
                await socket.accept(chosen)
                with self._watching():
                    await self._serve(socket, role)
            finally:
                self._viewers -= 1
            return
        self._feed.counts[f"connections rejected: {refusal[0]}"] += 1
        await socket.send_denial_response(PlainTextResponse(*refusal))

    async def _serve(self, socket: WebSocket, may_operate: bool) -> None:
        self._number -= 1  # sessions of pages have positive numbers
        person = PageSession(self._number, OPERATOR)
        permit = partial(self._authority.permit, person)
        session = ViewerSession(
            self._feed, self._parameters, self._services, self._find, permit, may_operate=may_operate
        )
        feeding = session.start()
        frames = self._frames[socket.client and socket.client.host, may_operate]
        talking = [
            asyncio.create_task(self._send(socket, session, person)),
            asyncio.create_task(_read(socket, session, frames)),
        ]
        working = [asyncio.create_task(session.keep_house()), feeding]
        code = 1011
        try:
            done, _ = await asyncio.wait((*talking, *working), return_when=asyncio.FIRST_COMPLETED)
            for task in done.intersection(working):
                task.result()
            code = 1000
        finally:
            session.end()
            for task in (*talking, working[0]):
                task.cancel()
            self._authority.leases.leave(person.number)
            await asyncio.gather(*talking, working[0], return_exceptions=True)
            with suppress(RuntimeError, WebSocketDisconnect, TimeoutError):
                async with asyncio.timeout(CLOSING):
                    await socket.close(code)

    async def _send(self, socket: WebSocket, session: ViewerSession, person: PageSession) -> None:
        """Send what waits while the access lasts, which a viewer that takes frames renews."""
        checked = -math.inf
        while True:
            frame = await session.queue.next()
            if time.monotonic() - checked > ACCESS_CHECK:
                checked = time.monotonic()
                if self._role(socket) is None:
                    return
                self._authority.leases.see(person.number)
            if frame is None:
                self._feed.counts["viewers disconnected: they did not take their answers"] += 1
                return
            async with asyncio.timeout(UNREAD):
                await (socket.send_bytes(frame) if isinstance(frame, bytes) else socket.send_text(frame))


async def _read(socket: WebSocket, session: ViewerSession, frames: TokenBucket) -> None:
    """Carry out requests; who sends too many waits, and nothing is lost."""
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            return
        text = message.get("text")
        frame: str | bytes = message["bytes"] if text is None else text
        session.take(frame)
        pause = frames.spend(time.monotonic(), 1.0 + len(frame) / FRAME)
        if pause:
            await asyncio.sleep(pause)
