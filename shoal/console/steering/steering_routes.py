"""The WebSocket by which a page steers a vehicle: open while it steers, and what stops the vehicle if it closes."""

import asyncio
import time
from collections.abc import Callable
from contextlib import suppress

from starlette.routing import WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from shoal.console.access.authority import Authority, AuthorityError
from shoal.console.access.page_sessions import Access, PageSession
from shoal.console.access.users import Role
from shoal.console.json_request import read_object
from shoal.console.page_feed import encode
from shoal.console.steering.remote_steering import NEUTRAL, RemoteSteering, SteeringError, StickPosition
from shoal.console.vehicle_orders import OrderError
from shoal.network import AsyncRemoteVehicle, NetworkError
from support.terminal_text import printable
from support.token_bucket import TokenBucket, TokenBuckets

PERIOD = 0.2  # s between two commands
SHORTEST_PERIOD = 0.04  # s; commands that come faster are dropped, except the first one that lets go
RATE, BURST = 50.0, 100.0  # commands of a session: in a second, and at once; more end the steering
MOST_SESSIONS = 256
SILENCE = 0.6  # s without a command, after which the vehicle is neutral
LONGEST_SILENCE = 3.0  # s, after which the page steers no longer
MOST_DELAY = 1.5  # s from the send of a tick to a command that names it
FIRST_WORDS = 5.0  # s
MOST_WORDS = 1024  # characters of a command
CLOSING = 1.0  # s


class SteeringRoutes:
    """The routes; `cookie` is the name of the cookie with the secret of a session.

    `find_vehicle(name)` raises NetworkError if there is none that may be commanded. The page sends a command five
    times a second, also while the dead-man switch is released. Each names the newest tick that the page has received:
    one whose tick is old has been on the way for too long, and is not obeyed.
    """

    def __init__(
        self, access: Access, authority: Authority, cookie: str, find_vehicle: Callable[[object], AsyncRemoteVehicle]
    ) -> None:
        self._access, self._authority, self._cookie = access, authority, cookie
        self._find_vehicle = find_vehicle
        self._steered: set[str] = set()
        self._commands = TokenBuckets(RATE, BURST, MOST_SESSIONS)
        self.routes: list[WebSocketRoute] = [WebSocketRoute("/steering", self._steer)]

    async def _steer(self, socket: WebSocket) -> None:
        secret = socket.cookies.get(self._cookie)
        session = self._access.session(secret)
        if session is None:
            await socket.close(1008, "log in first")
            return
        await socket.accept()
        with suppress(RuntimeError, WebSocketDisconnect, TimeoutError):
            async with asyncio.timeout(FIRST_WORDS):
                words = read_object((await _read_text(socket))[:MOST_WORDS])
            text = await self._steer_vehicle(socket, session, secret, words.get("vehicle"))
            async with asyncio.timeout(CLOSING):
                await socket.send_text(encode({"state": "ended", "text": printable(text)}).decode())
                await socket.close()

    async def _steer_vehicle(self, socket: WebSocket, session: PageSession, secret: str | None, named: object) -> str:
        """Steer until something ends it; returns what."""
        try:
            vehicle = self._find_vehicle(named)
            name = vehicle.system.name
            self._authority.require_role(session.user, Role.OPERATE)
            if name in self._steered:
                raise AuthorityError("another page steers this vehicle")
            self._authority.require_operator(session, name)
        except (AuthorityError, NetworkError) as error:
            return str(error)
        self._authority.note(name, f"{session.user.name}: steering begins")
        self._steered.add(name)
        steering = RemoteSteering(vehicle)
        reason = "its page is closed"
        try:
            await steering.begin()
            commands = self._commands[session.number]
            link = _StickLink(socket, steering, commands, lambda: self._require(session, secret, name))
            reason = await link.run()
        except (AuthorityError, OrderError, NetworkError, SteeringError) as error:
            reason = str(error)
        finally:
            try:
                self._authority.note(name, printable(f"{session.user.name}: steering ends: {reason}"))
                await steering.end()
            finally:
                self._steered.discard(name)
        return reason

    def _require(self, session: PageSession, secret: str | None, vehicle: str) -> None:
        """Raises AuthorityError if the session has ended, or may not command the vehicle any more."""
        present = self._access.session(secret)
        if present is None or present.number != session.number:
            raise AuthorityError("the session has ended")
        self._authority.require_operator(present, vehicle)


async def _read_text(socket: WebSocket) -> str:
    """The next message; empty for bytes."""
    try:
        return await socket.receive_text()
    except KeyError:
        return ""


class _StickLink:
    """Takes the commands of a page, and gives it ticks.

    `commands` limits those of the session. `require()` raises AuthorityError if commands are no longer taken.
    """

    def __init__(
        self, socket: WebSocket, steering: RemoteSteering, commands: TokenBucket, require: Callable[[], object]
    ) -> None:
        self._socket, self._steering, self._commands, self._require = socket, steering, commands, require
        self._is_neutral = True
        self._ticks: dict[int, float] = {}
        self._tick = 0
        self._received = time.monotonic()
        self._text = ""

    async def run(self) -> str:
        """Steer until the page lets go for good; returns why. Raises AuthorityError, SteeringError."""
        reader, ticker = asyncio.create_task(self._read()), asyncio.create_task(self._send_ticks())
        try:
            done, _ = await asyncio.wait((reader, ticker), return_when=asyncio.FIRST_COMPLETED)
            return next(iter(done)).result()
        finally:
            self._steering.send(NEUTRAL)
            for task in (reader, ticker):
                task.cancel()
            await asyncio.gather(reader, ticker, return_exceptions=True)

    async def _read(self) -> str:
        while True:
            try:
                text = await self._socket.receive_text()
            except (WebSocketDisconnect, RuntimeError, KeyError):
                return "its page is closed"
            if not self._commands.try_acquire(time.monotonic()):
                return f"its page sends more than {RATE:g} commands a second"
            words = read_object(text) if len(text) <= MOST_WORDS else {}
            if words.get("end") is True:
                return "the operator has ended it"
            self._require()
            self._take(words)

    def _take(self, words: dict[str, object]) -> None:
        now, is_held = time.monotonic(), words.get("held") is True
        if now - self._received < SHORTEST_PERIOD and (is_held or self._is_neutral):
            return
        self._received = now
        tick = words.get("tick")
        age = now - self._ticks.get(tick, now - MOST_DELAY) if isinstance(tick, int) else MOST_DELAY
        is_late = age >= MOST_DELAY
        self._text = "commands come too late: not obeyed" if is_held and is_late else ""
        self._is_neutral = is_late or not is_held
        self._steering.send(NEUTRAL if self._is_neutral else StickPosition.parse(words))

    async def _send_ticks(self) -> str:
        while True:
            silent = time.monotonic() - self._received
            if silent > LONGEST_SILENCE:
                return f"its page has been silent for {LONGEST_SILENCE:g} s"
            if silent > SILENCE:
                self._steering.send(NEUTRAL)
            self._steering.check()
            self._tick += 1
            self._ticks[self._tick] = time.monotonic()
            self._ticks.pop(self._tick - 50, None)
            news = {"state": "steered", "tick": self._tick, "axes": sorted(self._steering.offer), "text": self._text}
            try:
                async with asyncio.timeout(LONGEST_SILENCE):
                    await self._socket.send_text(encode(news).decode())
            except (TimeoutError, RuntimeError, WebSocketDisconnect):
                return "its page does not read"
            await asyncio.sleep(PERIOD)
