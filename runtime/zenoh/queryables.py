"""Answers zenoh queries: the last message of each type and entity, and what the vehicle replies to a request.

imc/<system>/@q/<Message> is the last message of a type, imc/<system>/@q/<Message>/<entity> that of one entity. With the
packet of a request as its payload a query is a command of its source, and gets the vehicle's first reply to it.
"""

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import imc
from imc.layout import LARGEST_PACKET
from imc.reserved_ids import ANNOUNCED, BROADCAST, UNKNOWN_SYSTEM
from runtime.bus import Request
from runtime.zenoh.key_expressions import PREFIX, key_chunk, query_key
from runtime.zenoh.last_value_cache import CachedPacket, LastValueCache
from runtime.zenoh.presence import ProcessPart
from runtime.zenoh.publishers import ENCODING
from runtime.zenoh.reliable_queue import ReliableQueue
from runtime.zenoh.unlisted_consoles import UnlistedConsoles

if TYPE_CHECKING:
    import zenoh

MOST_OPEN = 512
MOST_OF_ONE = 64  # open requests of one source
PATIENCE = 10.0  # s that a request waits for its reply; zenoh's own timeout is as long
TO_ALL = UNKNOWN_SYSTEM, ANNOUNCED, BROADCAST

REPLIES: Mapping[str, str] = {
    "GetOperationalLimits": "OperationalLimits",
    "QueryEntityInfo": "EntityInfo",
    "QueryEntityParameters": "EntityParameters",
    "QueryEntityState": "EntityState",
    "SetEntityParameters": "EntityParameters",
}
"""The reply to a request, if it is not of the same type."""
AT_ONCE = frozenset({*REPLIES, "EntityList", "QueryTypedEntityParameters"})
"""Requests that are answered by those who receive them, or never: other requests may take time."""
WITHOUT_REPLY = frozenset({"Abort", "PopEntityParameters", "PushEntityParameters", "SaveEntityParameters"})
"""Commands that IMC has no reply for: who asks gets the command back when it has been obeyed."""
OF_REQUESTS = ("op", "type", "command", "request_id")
"""Fields of messages that ask for something, beside those named above; others have none of them."""
IDENTITY = ("request_id", "name", "plan_id")
"""Fields by which a reply that comes later is known; an empty name or id stands for any."""
BAD = (imc.LogBookEntry.Type.WARNING, imc.LogBookEntry.Type.ERROR, imc.LogBookEntry.Type.CRITICAL)


@dataclass(slots=True, eq=False)
class _Open:
    """A query that waits for the reply to its request. `remarks` is what the vehicle has logged meanwhile."""

    query: "zenoh.Query"
    request: imc.Message
    until: float
    was_handled: bool = False
    remarks: list[str] = field(default_factory=list[str])

    @property
    def name(self) -> str:
        return type(self.request).__name__

    def is_answered_by(self, message: imc.Message) -> bool:
        """Whether `message` is the reply to this request, if one of the right type and system."""
        if type(message).__name__ != REPLIES.get(self.name, self.name) or message.dst != self.request.src:
            return False
        kinds = getattr(type(message), "Type", None)
        for name in IDENTITY if kinds is None else (*IDENTITY, "op"):  # else op itself marks replies
            asked, answered = (getattr(each, name, "") for each in (self.request, message))
            if asked != answered and asked != "" and answered != "":
                return False
        return kinds is None or getattr(message, "type", None) != getattr(kinds, "IN_PROGRESS", object())

    def is_like(self, other: imc.Message) -> bool:
        """Whether the reply to another request could not be distinguished from the one to this."""
        if type(other) is not type(self.request):
            return False
        return all(getattr(other, name, "") == getattr(self.request, name, "") for name in (*IDENTITY, "op"))


class Queryables:
    """Answers queries for what a session has published, and for replies to requests.

    `last` has the last packets. `part` is the vehicle of the session, None for a relay. `take` gets the packets of
    requests, as if they had arrived at @cmd; `concerns` returns whether the tasks that answer a request run here, or
    raises LookupError with the reason why there is no answer. `consoles` rejects requests of systems that are not
    listed.

    A reply to a request that is answered at once comes while its handlers run, so it cannot be mistaken for another
    one's; when they have run without one, the query is rejected, with what they have logged.
    """

    def __init__(
        self,
        session: "zenoh.Session",
        part: ProcessPart | None,
        outbox: ReliableQueue,
        last: LastValueCache,
        take: Callable[[bytes], object],
        concerns: Callable[[imc.Message], bool],
        consoles: UnlistedConsoles,
    ) -> None:
        import zenoh

        self._part = part
        self._reliable_queue = outbox
        self._last = last
        self._take = take
        self._concerns = concerns
        self._consoles = consoles
        self._open: dict[int, list[_Open]] = {}  # by source
        self._handling: _Open | None = None
        self._lock = threading.Lock()
        expression = f"{PREFIX}/{'*' if part is None else key_chunk(part.vehicle)}/@q/**"
        # Not indirect: that is a thread for which an interpreter waits at its end.
        handler = zenoh.handlers.Callback(self._answer, indirect=False)
        self._queryable: Any = cast(Any, session.declare_queryable)(expression, handler)

    @property
    def is_handling(self) -> bool:
        """Whether handlers of a request run now."""
        return self._handling is not None

    def add_remark(self, entry: imc.LogBookEntry) -> None:
        """Note what is logged while a request is handled; called from the kernel's thread, as `reply`."""
        if self._handling is not None and entry.type in BAD:
            self._handling.remarks.append(entry.text)

    def forward_reply(self, message: imc.Message, packet: bytes) -> None:
        """Answer the query that a message for one system replies to, if there is one."""
        if not self._open:
            return
        handling = self._handling
        with self._lock:
            waiting = self._open.get(message.dst, ())
            later = [one for one in waiting if one.name not in AT_ONCE]
            found = next((one for one in (handling, *later) if one and one.is_answered_by(message)), None)
        if found is not None and self._settle(found):
            self._reply(found, packet)

    def close(self) -> None:
        self._queryable.undeclare()
        with self._lock:
            self._open.clear()

    def _answer(self, query: "zenoh.Query") -> None:
        """Called from zenoh's thread; it must not wait."""
        payload = query.payload
        if payload is None or not len(payload):
            answers, name = self._last.answers(query.key_expr), str(query.key_expr).split("/@q/")[-1]
            if not answers and name in imc.builtin() and _asks(imc.builtin()[name]):
                self._decline(query, f"there was no {name} yet; to ask with one, send its packet as the payload")
            else:
                self._send(query, answers)
        elif len(payload) > LARGEST_PACKET:
            self._decline(query, "the request is larger than any packet")
        else:
            self._ask(query, payload.to_bytes())

    def _ask(self, query: "zenoh.Query", packet: bytes) -> None:
        try:
            request = imc.decode(packet)
        except imc.DecodeError as error:
            self._decline(query, str(error))
            return
        if not self._is_for_us(query, request):
            return
        why = self._wrong(query, request)
        if not why and not self._consoles.may_send(packet):
            why = self._consoles.reject(packet, "")
        if why:
            self._decline(query, why)
            return
        try:
            if not self._concerns(request):
                return  # its tasks run in another process of the vehicle
        except LookupError as error:
            self._decline(query, str(error))
            return
        one = _Open(query, request, time.monotonic() + PATIENCE)
        if why := self._expect(one):
            self._refuse(query, why)
            return
        asked = Request(packet)
        asked.handled = partial(self._handled, one)
        self._take(asked)

    def _is_for_us(self, query: "zenoh.Query", request: imc.Message) -> bool:
        """Whether this vehicle is meant by a query to several: those have all the same request."""
        to_several = str(query.key_expr).startswith(f"{PREFIX}/*")
        return not to_several or self._part is None or request.dst in (self._part.system, *TO_ALL)

    def _wrong(self, query: "zenoh.Query", request: imc.Message) -> str:
        """The fault of a request itself, if there is one."""
        name = type(request).__name__
        place = str(query.key_expr).split("/@q/")[-1]
        if place != name:
            return f"a {name} belongs to .../@q/{name}, not to .../@q/{place}"
        own = None if self._part is None else self._part.system
        if request.src in (UNKNOWN_SYSTEM, own):
            return "the source of the request (src) must be the system that asks"
        if own is not None and request.dst not in (own, *TO_ALL):
            return f"the request is addressed (dst) to 0x{request.dst:04X}; this is 0x{own:04X}"
        if not _asks(type(request)):
            return f"{name} is no request: nothing answers it"
        asks = getattr(getattr(type(request), "Type", None), "REQUEST", None)
        if asks is not None and getattr(request, "type", asks) != asks:
            return f"the type of a {name} that asks is REQUEST ({asks:d})"
        return ""

    def _expect(self, one: _Open) -> str:
        """Keep a request until it is answered; returns why not. Those that it makes ambiguous are given up."""
        now, source = time.monotonic(), one.request.src
        with self._lock:
            for system, kept in list(self._open.items()):
                kept[:] = [other for other in kept if other.until > now]
                if not kept:
                    del self._open[system]
            mine = self._open.setdefault(source, [])
            if len(mine) >= MOST_OF_ONE:
                return f"{MOST_OF_ONE} requests of 0x{source:04X} wait for their replies already"
            given_up = [other for other in mine if other.was_handled and other.is_like(one.request)]
            mine[:] = [other for other in mine if other not in given_up]
            mine.append(one)
            if sum(map(len, self._open.values())) > MOST_OPEN:
                given_up.append(max(self._open.values(), key=len).pop(0))
        for other in given_up:
            self._refuse(other.query, "given up for a later request: give each its own request_id")
        return ""

    def _handled(self, one: _Open, begins: bool) -> None:
        """The handlers of a request begin, or have run; called from the kernel's thread."""
        self._handling = one if begins else None
        if begins:
            return
        one.was_handled = True
        vehicle = "the vehicle" if self._part is None else self._part.vehicle
        if one.name in WITHOUT_REPLY and (one.name == "Abort" or not one.remarks) and self._settle(one):
            self._reply(one, imc.encode(one.request))
        elif one.name in AT_ONCE | WITHOUT_REPLY and self._settle(one):
            self._refuse(one.query, "; ".join(one.remarks) or f"{vehicle} has no answer to this {one.name}")

    def _settle(self, one: _Open) -> bool:
        """Take a request out of those that wait; whether it was there."""
        with self._lock:
            waiting = self._open.get(one.request.src, [])
            if one not in waiting:
                return False
            waiting.remove(one)
            if not waiting:
                del self._open[one.request.src]
            return True

    def _reply(self, one: _Open, packet: bytes) -> None:
        place = str(one.query.key_expr) if self._part is None else query_key(one.name, self._part.vehicle)
        self._send(one.query, {place: CachedPacket(packet)})

    def _send(self, query: "zenoh.Query", answers: Mapping[str, CachedPacket]) -> None:
        def send() -> None:
            for place, (packet, stamp) in answers.items():
                cast(Any, query).reply(place, packet, encoding=ENCODING, timestamp=stamp)
            cast(Any, query).drop()

        self._reliable_queue.put(f"reply to {query.key_expr}", send)

    def _decline(self, query: "zenoh.Query", why: str) -> None:
        """Reject requests that no process of the vehicle answers; one of them replies."""
        if self._part is None or self._part.process == "main":
            self._refuse(query, why)

    def _refuse(self, query: "zenoh.Query", why: str) -> None:
        def send() -> None:
            cast(Any, query).reply_err(why)
            cast(Any, query).drop()  # else the other side waits for more

        self._reliable_queue.put(f"refusal: {why}", send)


def _asks(kind: type[imc.Message]) -> bool:
    """Whether messages of a type ask for something."""
    named = kind.__name__ in AT_ONCE or kind.__name__ in WITHOUT_REPLY
    return named or any(hasattr(kind, field) for field in OF_REQUESTS)
