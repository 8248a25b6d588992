"""All networks at once: systems there, their messages, and requests to them."""

import asyncio
import math
import random
import time
from collections import deque
from collections.abc import AsyncGenerator, Callable, Collection, Sequence
from contextlib import suppress
from typing import Self, TypeVar

import imc
from imc import console_acl
from imc.reserved_ids import OPERATORS
from shoal.network.link import (
    EVERYBODY,
    ConsoleIdentity,
    NetworkError,
    NetworkLink,
    NoAnswer,
    ReceivedPacket,
    Unlisted,
    VehicleLost,
    size_warning,
)
from shoal.network.message_listener import MessageListener, check_message_type, damage_kind
from shoal.network.message_requests import MessageRequests, MessageUse
from shoal.network.query_messages import is_query
from shoal.network.search_report import SearchReport
from shoal.network.system_table import MOST_SYSTEMS, NetworkSystem, NetworkSystemTable
from support.terminal_text import printable

M = TypeVar("M", bound=imc.Message)
A = TypeVar("A")
MOST_REPLIES = 64  # remembered, since they may come by several ways
REPEAT = 0.4  # s between copies of a request that is not answered
ABORT_REPEAT = 2.0  # s between those of an Abort to who obeys each: it confirms one within a second, if it arrives
GRACE = 1.0  # s in which a system that vanished may come back by another way
COMPANY = 0.15  # s in which a second vehicle of the same name answers our first Announce, too
LABELS = 1  # our entity that asks for the labels of others, so that nobody takes the answer for his
BASIC = ("Heartbeat", "VehicleState", "PlanControlState")
"""Messages of a system that was found, so that its silence is noticed, and its plan is known at once."""


class Network:
    """Receives from all links; `systems` by name. An asynchronous context manager.

    Systems with one name and several ids are two vehicles: neither is commanded, see
    `NetworkSystem.systems_with_same_id`. `expects_all`: that a link does not work is reported also if others
    do. `report` gets a sentence when a search takes long.
    """

    def __init__(
        self,
        links: Sequence[NetworkLink],
        console: ConsoleIdentity | None = None,
        messages: imc.Schema | None = None,
        *,
        expects_all: bool = False,
        report: Callable[[str], object] = lambda _: None,
    ) -> None:
        number = random.SystemRandom().choice(range(OPERATORS.start + 0x1000, OPERATORS.stop - 1))
        self.console: ConsoleIdentity = console or ConsoleIdentity.of_this_program(number)
        self.links: tuple[NetworkLink, ...] = tuple(links)
        self.expects_all = expects_all
        self.messages: imc.Schema = messages or imc.builtin()
        self.systems: NetworkSystemTable = NetworkSystemTable()
        self._requests = MessageRequests(self.links, self.systems)
        self.unknown_drops: dict[tuple[str, str], int] = {}
        self._listeners: list[MessageListener] = []
        self._replies: deque[imc.Message] = deque(maxlen=MOST_REPLIES)
        self._opened = 0.0
        self.search: SearchReport = SearchReport(self.links, report, expects_all=expects_all)
        self._request = random.SystemRandom().randrange(1, 0xFFFF)

    async def __aenter__(self) -> Self:
        await asyncio.gather(*(link.open(self, self.console) for link in self.links))
        self._opened = time.monotonic()  # not before: the import of zenoh may take long, and we announce after it
        return self

    async def __aexit__(self, *_: object) -> None:
        self._requests.close()
        await asyncio.gather(*(link.close() for link in self.links))

    # Called by links

    def on_packet(self, link: NetworkLink, arrival: ReceivedPacket) -> None:
        try:
            message = self.messages.decode(arrival.packet)
        except imc.DecodeError as error:
            self.on_dropped(link, arrival.system or arrival.place, damage_kind(str(error)))
            return
        if message.src == self.console.id:
            return
        system = self.systems.sender_of(arrival, message.src)
        if system is None:
            self.on_dropped(link, arrival.place or arrival.system or f"0x{message.src:04X}", "not announced")
            return
        if not arrival.is_old:
            system.count_packet(link, message)
            takes = system.accepts_link(link)
            if not self._is_first(message, takes):
                return
            system.update(link, message, arrival.entity, is_received=takes)
            if (message.dst, message.dst_ent) == (self.console.id, LABELS):
                return
        system.store_latest(message)
        for listener in tuple(self._listeners):
            if listener.takes_old or not arrival.is_old:
                listener.put(system, message, arrival.packet)

    def _is_first(self, message: imc.Message, takes: bool) -> bool:
        """Whether a packet is no copy of one that came by another way; what is for us counts by any way, but once."""
        if message.dst != self.console.id:
            return takes
        if message in self._replies:
            return False
        self._replies.append(message)
        return True

    def on_appeared(self, link: NetworkLink, system: str, part: str, place: str, number: int | None = None) -> None:
        self.systems.add_process(link, system, part, place, number)

    def on_vanished(self, link: NetworkLink, system: str, part: str, *, is_reported: bool) -> None:
        self.systems.remove_process(link, system, part, is_reported=is_reported)

    def on_dropped(self, link: NetworkLink, peer: str, reason: str, number: int = 1) -> None:
        known = self.systems.get(peer)
        if known is not None:
            known.missed[reason] += number
        elif len(self.unknown_drops) < MOST_SYSTEMS or (peer, reason) in self.unknown_drops:
            place = peer or link.name, reason
            self.unknown_drops[place] = self.unknown_drops.get(place, 0) + number

    # Questions

    def listen(
        self, system: NetworkSystem | None = None, kinds: Collection[type[imc.Message]] = (), *, takes_old: bool = False
    ) -> MessageListener:
        """The messages from and to a system, or from all systems. To be ended with `close_listener`."""
        listener = MessageListener(system, kinds, self.subscribe(system, kinds), takes_old=takes_old)
        self._listeners.append(listener)
        return listener

    def subscribe(self, system: NetworkSystem | None, kinds: Collection[type[imc.Message]] = ()) -> MessageUse:
        """Let `NetworkSystem.latest_message` follow messages of some types, or all, until the use is closed.

        Raises TypeError for what is no type of them.
        """
        names = frozenset(check_message_type(kind).__name__ for kind in kinds)
        return MessageUse(self._requests, EVERYBODY if system is None else system.name, names)

    def close_listener(self, listener: MessageListener) -> None:
        """End a listener; a while after the last use of a message, links are no longer asked for it."""
        if listener in self._listeners:
            self._listeners.remove(listener)
            listener.use.close()

    async def stream(
        self, system: NetworkSystem, kinds: Collection[type[imc.Message]] = ()
    ) -> AsyncGenerator[imc.Message]:
        """Messages of a system for ever. Raises VehicleLost when it ends or falls silent."""
        listener = self.listen(system, kinds)
        try:
            while True:
                try:
                    _, message = await listener.next(GRACE)
                except TimeoutError:
                    self.check_is_there(system)
                    continue
                if message.src in system.ids:
                    yield message
        finally:
            self.close_listener(listener)

    async def next_message(
        self,
        system: NetworkSystem,
        kind: type[M],
        timeout: float | None = None,
        entity: str = "",
        *,
        takes_old: bool = False,
    ) -> M:
        """The next message of a type, of one entity (label) if it is named. Raises NoAnswer, VehicleLost."""
        timeout = system.answer_timeout if timeout is None else timeout
        listener = self.listen(system, (kind,), takes_old=takes_old)
        deadline = time.monotonic() + timeout
        try:
            while (left := deadline - time.monotonic()) > 0.0:
                with suppress(TimeoutError):
                    _, message = await listener.next(min(left, GRACE))
                    ours = message.src == system.id and system.matches_label(message.src_ent, entity)
                    if isinstance(message, kind) and ours:
                        return message
                self.check_is_there(system)
        finally:
            self.close_listener(listener)
        raise NoAnswer(f"no {kind.__name__} from {system.name}{entity and f' ({entity})'} within {timeout:g} s")

    async def find_system(self, name: str, timeout: float | None = None, *, takes_clash: bool = False) -> NetworkSystem:
        """The system of a name, as soon as its id is known; without a time-out, as long as there is hope.

        A DUNE is waited for until its first data: then it is known to receive us. `takes_clash` does without.

        Raises NetworkError that names others there; and, without `takes_clash`, if several vehicles have the
        name or its id.
        """
        if not name.strip() or any(sign in name for sign in "*?$#/"):
            raise NetworkError(f"{printable(name)!r} is not the name of one vehicle")
        name = "_".join(name.split())
        self._requests.begin(name, BASIC)
        began = time.monotonic()
        while (left := self.search.time_left(self.systems.get(name), began, timeout, time.monotonic())) > 0.0:
            system = self.systems.get(name)
            alone = time.monotonic() > self._opened + COMPANY
            if system is not None and system.id is not None and system.is_there and (alone or system.conflict_text):
                if system.conflict_text and not takes_clash:
                    break
                if takes_clash or not system.awaits_contact:
                    self.request_labels(system)
                    return system
            self.search.explain(time.monotonic() - began, [] if system is None else [system])
            await self.wait_for_change(min(left, 0.05))
        raise NetworkError(self.search.not_found_text(name, self.systems.get(name), self.vehicles()))

    def request_labels(self, system: NetworkSystem) -> None:
        """Ask a system for the labels of its entities, which `NetworkSystem.label` then returns."""
        query = self.with_header(system, imc.EntityList(op=imc.EntityList.Op.QUERY)).replace(src_ent=LABELS)
        self._send(system, query, imc.encode(query))

    async def wait_for_change(self, timeout: float) -> None:
        """Wait until a system appears, vanishes, or gets known, but not longer than `timeout` s."""
        with suppress(TimeoutError):
            async with asyncio.timeout(timeout):
                await self.systems.changed.wait()
        self.systems.changed.clear()

    def vehicles(self) -> list[NetworkSystem]:
        """All systems that are no consoles and are there, by name."""
        there = (system for system in self.systems.values() if system.is_there and system.is_vehicle)
        return sorted(there, key=lambda system: system.name)

    def check_is_there(self, system: NetworkSystem) -> None:
        """Raise VehicleLost if a system is not there any more."""
        if not system.is_there:
            raise VehicleLost(self.search.absence_text(system))

    def next_request_id(self) -> int:
        """The number of the next request."""
        self._request = self._request % 0xFFFE + 1
        return self._request

    def send(self, system: NetworkSystem, message: imc.Message, entity: int = 0) -> bytes:
        """Send a message to a system in the name of this console, or of an entity of it; returns the packet."""
        packet = imc.encode(self.with_header(system, message).replace(src_ent=entity))
        self._send(system, message, packet)
        return packet

    def with_header(self, system: NetworkSystem, message: imc.Message, number: int | None = None) -> imc.Message:
        """The message with our header; raises EncodeError if it does not fit a packet."""
        destination = system.id if number is None else number
        header = {"src": self.console.id, "src_ent": 0, "dst": destination, "timestamp": time.time()}
        return message.replace(**header)

    async def request(
        self,
        system: NetworkSystem,
        request: imc.Message,
        kinds: Collection[type[imc.Message]],
        answer: Callable[[imc.Message], A | None],
        *,
        timeout: float | None = None,
        repeat: float = REPEAT,
        number: int | None = None,
    ) -> A:
        """Send a request, and again every `repeat` s, until `answer` finds what it needs in a message of these types.

        Copies are equal to the last byte, so Shoal detects them. A DUNE would carry out each: it gets an order once,
        and an Abort every 2 s. `number` is the id of the one that is meant, of several with one name. Raises NoAnswer,
        Unlisted, VehicleLost, and what `answer` raises.
        """
        timeout = system.answer_timeout if timeout is None else timeout
        listener = self.listen(system, {*kinds, imc.LogBookEntry})
        number = system.id if number is None else number
        packet = imc.encode(self.with_header(system, request, number))
        if not (system.is_shoal or is_query(request)):
            repeat = ABORT_REPEAT if isinstance(request, imc.Abort) else math.inf
        began = time.monotonic()
        deadline, next_copy, copies = began + timeout, began, 0
        try:
            while (left := deadline - time.monotonic()) > 0.0:
                if time.monotonic() >= next_copy and self._send(system, request, packet, copies):
                    copies += 1
                    next_copy = time.monotonic() + repeat
                self.search.explain(time.monotonic() - began, [system])
                again = time.monotonic() + min(repeat, left, GRACE)
                while (wait := again - time.monotonic()) > 0.0:
                    try:
                        _, message = await listener.next(wait)
                    except TimeoutError:
                        break
                    if message.src == number:
                        self.raise_if_unlisted(message)
                    is_wanted = message.src == number and isinstance(message, tuple(kinds))
                    found = answer(message) if is_wanted else None
                    if found is not None:
                        return found
                self.check_is_there(system)
        finally:
            self.close_listener(listener)
        what = self.search.no_answer_text(
            system, type(request).__name__, timeout, copies, is_repeated=repeat < math.inf
        )
        guess = size_warning(self._ways(system), len(packet)) or f"`shoal link {system.name}` shows why"
        raise NoAnswer(f"{what}; {self.search.log_book_reason(system, self.console.id) or printable(guess)}")

    def raise_if_unlisted(self, message: imc.Message) -> None:
        """Raise Unlisted if a vehicle answers with this message that it does not obey this console."""
        if not isinstance(message, imc.LogBookEntry) or message.dst != self.console.id:
            return
        if message.context == console_acl.CONTEXT:
            raise Unlisted(printable(f"{message.text}; SHOAL_CONSOLE gives this program the id of one that is"))

    def _send(self, system: NetworkSystem, message: imc.Message, packet: bytes, attempt: int = 0) -> bool:
        """Send by the link that received last; further attempts take the others, too. Whether there is a way."""
        links = self._ways(system)
        if links:
            links[attempt % len(links)].send(system.name, message, packet)
        return bool(links)

    def _ways(self, system: NetworkSystem) -> list[NetworkLink]:
        return sorted(system.links.values(), key=lambda link: -system.last.get(link.name, 0.0))
