"""The web application: page, frames, orders, plans, parameters and tiles."""

import asyncio
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from contextlib import suppress
from typing import Any, cast

from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.types import ASGIApp, Scope
from starlette.websockets import WebSocket, WebSocketDisconnect

import imc
from shoal.console.access.account_routes import AccountRoutes
from shoal.console.access.authority import Authority, AuthorityError
from shoal.console.access.page_sessions import Access, PageSession
from shoal.console.access.request_guard import RequestGuard
from shoal.console.access.request_limit import RequestLimit
from shoal.console.access.users import Role
from shoal.console.charts.tiles import TileSets
from shoal.console.foxglove import FoxgloveRoutes, Playback, ViewerAccess
from shoal.console.json_request import Answer, json_object, json_response, read_object, refusal_response
from shoal.console.page_feed import PageFeed, Viewer
from shoal.console.page_files import PageFiles
from shoal.console.page_part import PagePart
from shoal.console.panels.panel_routes import PanelRoutes
from shoal.console.panels.user_panels import PRESS, UserPanel
from shoal.console.parameters.parameter_routes import ParameterRoutes
from shoal.console.parameters.profile_settings import ProfileSettings
from shoal.console.plans.plan_path import plan_path
from shoal.console.steering.steering_routes import SteeringRoutes
from shoal.console.vehicle_orders import OrderError
from shoal.network import AsyncRemoteVehicle, Network, NetworkError
from support.number_parsing import natural_number
from support.terminal_text import printable

REJECTED = "this page shows a log: nothing in it can be commanded"
COOKIE = "shoal-console-{port}"  # cookies do not distinguish ports
MOST_VIEWERS, MOST_WATCHING = 32, 24  # pages; those of users who may watch only leave some to the others
CLOSING = 1.0  # s
UNREAD = 5.0  # s in which a page has to take a frame
MOST_WORDS = 4096  # bytes of a message of the page
WORDS_PAUSE = 0.1  # s between two of them: more often nobody draws other fields
SERVICE: dict[str, str | bool] = {  # for the menu of BlueOS, which asks each port of its computer
    "name": "Shoal",
    "description": "The vehicle on a map, its health, plans and log book",
    "icon": "mdi-submarine",
    "company": "Shoal",
    "version": "1",
    "webpage": "",
    "api": "",
    "new_page": True,
    "avoid_iframes": True,
}


class ConsoleApplication:
    """An ASGI application over a network whose event loop runs it.

    `hosts` are the names, with port, under which a browser reaches it; `libraries` the files of Leaflet and uPlot;
    `parts` are its views. `viewer_access` says which Foxglove may connect. `playback` is the log that is shown: then
    orders are rejected. `settings` are those of a profile, for the view of parameters, `panels` those of the user.
    """

    def __init__(
        self,
        network: Network,
        feed: PageFeed,
        access: Access,
        authority: Authority,
        tiles: TileSets,
        libraries: Mapping[str, bytes],
        hosts: Collection[str],
        port: int,
        parts: Sequence[PagePart] = (),
        viewer_access: ViewerAccess | None = None,
        playback: Playback | None = None,
        settings: ProfileSettings | None = None,
        panels: tuple[UserPanel, ...] = (),
    ) -> None:
        self._network, self._feed, self._access, self._tiles = network, feed, access, tiles
        self._authority = authority
        self._cookie = COOKIE.format(port=port)
        self._accounts = AccountRoutes(access, authority, self._cookie, self._has_vehicle)
        self._parameters = ParameterRoutes(self._vehicle, settings)
        self._panels = PanelRoutes(panels)
        self._viewers = 0
        self._known_fields: Response | None = None
        self._plays_log = playback is not None
        foxglove = FoxgloveRoutes(
            network,
            self._vehicle,
            lambda connection: access.is_logged_in(connection.cookies.get(self._cookie)),
            viewer_access or ViewerAccess(),
            authority,
            feed.watching,
            playback,
        )
        logged_in, instead = self._logged_in, self._reject if self._plays_log else None
        routes = [
            *PageFiles(libraries).routes,
            Route("/healthz", self._health),
            Route("/register_service", self._register_service),
            *self._accounts.routes,
            *SteeringRoutes(access, authority, self._cookie, lambda name: self._vehicle(name, "steer")).routes,
            Route("/api/order", logged_in(instead or self._order), methods=["POST"]),
            Route("/api/plans", logged_in(instead or self._plans)),
            Route("/api/parameters", logged_in(instead or self._parameters.values)),
            Route("/api/parameter-details", logged_in(instead or self._parameters.details)),
            Route("/api/panels", logged_in(self._panels.panels)),
            Route("/api/fields", logged_in(self._fields)),
            Route("/api/tiles", logged_in(self._tile_sets)),
            Route("/tiles/{name}/{zoom}/{column}/{row}", logged_in(self._tile)),
            WebSocketRoute("/frames", self._frames),
            *foxglove.routes,
        ]
        for part in parts:
            routes.extend(Route(path, logged_in(answer)) for path, answer in part.questions.items())
            for role, posted in (
                (Role.WATCH, part.posted),
                (Role.OPERATE, part.orders),
                (Role.MAINTAIN, part.maintenance),
            ):
                routes.extend(
                    Route(path, logged_in(self._for_role(role, answer)), methods=["POST"])
                    for path, answer in posted.items()
                )
        limited = RequestLimit(Starlette(routes=routes), self._client)
        self.asgi: ASGIApp = RequestGuard(limited, hosts, foxglove.own_origins)

    def _client(self, scope: Scope) -> Hashable:
        """The session of a request, or the address without one."""
        connection = HTTPConnection(scope)
        session = self._accounts.session(connection)
        return session.number if session is not None else connection.client and connection.client.host

    def _logged_in(self, answer: Answer) -> Answer:
        async def checked(request: Request) -> Response:
            if not self._access.is_logged_in(request.cookies.get(self._cookie)):
                return PlainTextResponse("log in first", 401)
            return await answer(request)

        return checked

    def _for_role(self, role: Role, answer: Answer) -> Answer:
        async def checked(request: Request) -> Response:
            session = self._accounts.session(request)
            assert session is not None
            refusal = self._authority.refusal(session.user, max(role, Role.OPERATE))
            if refusal and role > Role.WATCH:
                return refusal_response(refusal)
            request.state.user, request.state.refusal = session.user, refusal
            return await answer(request)

        return checked

    async def _health(self, _: Request) -> Response:
        return PlainTextResponse("ok")

    async def _register_service(self, _: Request) -> Response:
        return json_response(SERVICE)

    async def _reject(self, _: Request) -> Response:
        """The answer to all orders and questions to a vehicle of a log."""
        return PlainTextResponse(REJECTED, 403)

    async def _order(self, request: Request) -> Response:
        words, session = await json_object(request), self._accounts.session(request)
        if session is None:  # it has ended while the words came
            return PlainTextResponse("log in first", 401)
        if words.get("order") != "abort-all":
            return json_response(await self._answer(session, words.get("vehicle"), words))
        names = [system.name for system in self._network.systems.values() if system.is_vehicle]
        answers = await asyncio.gather(*(self._answer(session, name, {"order": "abort"}) for name in names))
        found = [{"vehicle": name, **answer} for name, answer in zip(names, answers, strict=True)]
        return json_response({"ok": all(answer["ok"] for answer in answers), "answers": found})

    async def _answer(self, session: PageSession, name: object, words: Mapping[str, object]) -> dict[str, Any]:
        """Carry out an order: whether the vehicle obeys, and a sentence for the operator."""
        order = str(words.get("order"))
        try:
            vehicle = self._vehicle(name, order)
            words = self._parameters.complete(vehicle.system.name, words) if order == "undo" else words
            self._authority.permit(session, vehicle.system.name, order, words)
            room = self._panels if order.startswith(PRESS) else self._parameters
            text = await room.carry_out(session.user.name, vehicle, order, words)
        except (AuthorityError, OrderError, NetworkError, ValueError) as error:
            return {"ok": False, "text": printable(self._feed.senders.named(str(name), str(error)))}
        return {"ok": True, "text": printable(text)}

    async def _plans(self, request: Request) -> Response:
        try:
            vehicle = self._vehicle(request.query_params.get("vehicle"))
            name = request.query_params.get("plan")
            if name is None:
                return json_response({"ok": True, "plans": await vehicle.plan.list()})
            plan = await vehicle.plan.get(name)
        except NetworkError as error:
            return refusal_response(error)
        return json_response({"ok": True, "path": plan_path(plan)})

    async def _fields(self, _: Request) -> Response:
        """Each number that can be drawn, as Message.field, with its unit."""
        if self._known_fields is not None:
            return self._known_fields
        found: dict[str, str] = {}
        for name in self._network.messages.types:
            for info in imc.fields(self._network.messages[name]):
                if info.type.startswith(("fp", "int", "uint")):
                    found[f"{name}.{info.name}"] = info.unit
        self._known_fields = json_response(found)
        return self._known_fields

    async def _tile_sets(self, _: Request) -> Response:
        return json_response({"sets": self._tiles.zooms, "troubles": list(map(printable, self._tiles.troubles))})

    async def _tile(self, request: Request) -> Response:
        place = request.path_params
        numbers = [natural_number(place[name]) for name in ("zoom", "column", "row")]
        known = [number for number in numbers if number is not None]
        found = self._tiles.tile(place["name"], *known) if len(known) == len(numbers) else None
        if found is None:
            return PlainTextResponse("no such tile", 404)
        return Response(found[0], media_type=found[1], headers={"Cache-Control": "max-age=3600"})

    async def _frames(self, socket: WebSocket) -> None:
        secret = socket.cookies.get(self._cookie)
        session = self._access.session(secret)
        if session is None:
            await socket.close(1008, "log in first")
            return
        if self._viewers >= (MOST_WATCHING if session.user.role < Role.OPERATE else MOST_VIEWERS):
            await socket.close(1013, f"{self._viewers} pages are open")
            return
        self._viewers += 1  # before the first await: of many at once no more are accepted
        try:
            await socket.accept()
            await self._serve_frames(socket, secret)
        finally:
            self._viewers -= 1

    async def _serve_frames(self, socket: WebSocket, secret: str | None) -> None:
        viewer = Viewer()
        self._feed.add(viewer)
        sender = asyncio.create_task(_send_frames(socket, viewer, lambda: self._is_present(secret)))
        reader = asyncio.create_task(self._read_words(socket, viewer))
        try:
            await asyncio.wait((sender, reader), return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._feed.remove(viewer)
            for task in (sender, reader):
                task.cancel()
            await asyncio.gather(sender, reader, return_exceptions=True)
            with suppress(RuntimeError, WebSocketDisconnect, TimeoutError):
                async with asyncio.timeout(CLOSING):
                    await socket.close()

    async def _read_words(self, socket: WebSocket, viewer: Viewer) -> None:
        """The fields that the page draws, whenever it draws others."""
        while True:
            text = await socket.receive_text()
            words = read_object(text) if len(text) <= MOST_WORDS else {}
            fields = words.get("fields")
            if isinstance(fields, list):
                self._feed.set_fields(viewer, [each for each in cast(list[object], fields) if isinstance(each, str)])
            await asyncio.sleep(WORDS_PAUSE)

    def _is_present(self, secret: str | None) -> bool:
        """Whether a session lasts, whose page is open: it keeps its leases."""
        session = self._access.session(secret)
        if session is not None:
            self._authority.leases.see(session.number)
        return session is not None

    def _has_vehicle(self, name: str) -> bool:
        system = self._network.systems.get(name)
        return system is not None and system.is_vehicle

    def _vehicle(self, name: object, order: str = "") -> AsyncRemoteVehicle:
        """Raises NetworkError if there is none of this name, or several, or it is gone; Abort is tried all the same.

        Also for those of a log.
        """
        if self._plays_log:
            raise NetworkError(REJECTED)
        system = self._network.systems.get(name) if isinstance(name, str) else None
        if system is None or not system.is_vehicle:
            raise NetworkError("there is no such vehicle")
        if order != "abort":
            self._network.check_is_there(system)
        if order not in ("", "abort") and system.conflict_text:
            raise NetworkError(f"{system.conflict_text}: neither is commanded")
        return AsyncRemoteVehicle(self._network, system)


async def _send_frames(socket: WebSocket, viewer: Viewer, is_logged_in: Callable[[], bool]) -> None:
    """Send frames while the session lasts, which each frame that is read renews."""
    while is_logged_in():
        frame = await viewer.next()
        async with asyncio.timeout(UNREAD):
            await socket.send_text(frame.decode())
