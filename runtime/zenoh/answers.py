"""Answers zenoh queries: the last message of each type and entity, and what the vehicle replies to a request.

imc/<system>/@q/<Message> is the last message of a type, imc/<system>/@q/<Message>/<entity> that of one entity. With the
packet of a request as its payload a query is a command of its source, and gets the vehicle's first reply to it.
"""

import struct
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import imc
from imc.addresses import UNKNOWN_SYSTEM
from imc.layout import LARGEST_PACKET
from runtime.zenoh.keys import PREFIX, chunk, query_key
from runtime.zenoh.outbox import Outbox
from runtime.zenoh.presence import Part
from runtime.zenoh.publishers import ENCODING

if TYPE_CHECKING:
    import zenoh

MOST_OPEN = 64
PATIENCE = 10.0  # s that a request waits for its reply; zenoh's own timeout is as long

REPLIES: Mapping[str, str] = {
    "GetOperationalLimits": "OperationalLimits",
    "QueryEntityInfo": "EntityInfo",
    "QueryEntityParameters": "EntityParameters",
    "QueryEntityState": "EntityState",
    "SetEntityParameters": "EntityParameters",
}
"""The reply to a request, if it is not of the same type."""


@dataclass(frozen=True, slots=True)
class _Open:
    """A query that waits for the reply to its request."""

    query: "zenoh.Query"
    request: imc.Message
    until: float

    def is_answered_by(self, message: imc.Message) -> bool:
        """Whether `message`, of the right type and for the right system, is the reply to this request."""
        for field in ("request_id", "name"):
            asked = getattr(self.request, field, None)
            if asked is not None and getattr(message, field, asked) != asked:
                return False
        kinds = getattr(type(message), "Type", None)
        return kinds is None or getattr(message, "type", None) != getattr(kinds, "IN_PROGRESS", object())


class Answers:
    """Answers queries for what a session has published, and for replies to requests.

    `last` gives the last packets by message, source and entity. `part` is the vehicle of the session, None for a relay.
    `take` gets the packets of requests, as if they had arrived at @cmd; `concerns` says whether the tasks that answer a
    request run here.
    """

    def __init__(
        self,
        session: "zenoh.Session",
        part: Part | None,
        outbox: Outbox,
        last: Callable[[], Iterable[tuple[tuple[str, ...], bytes]]],
        take: Callable[[bytes], object],
        concerns: Callable[[imc.Message], bool],
    ) -> None:
        import zenoh

        self._part = part
        self._outbox = outbox
        self._last = last
        self._take = take
        self._concerns = concerns
        self._open: dict[tuple[int, str], list[_Open]] = {}
        self._lock = threading.Lock()
        expression = f"{PREFIX}/{'*' if part is None else chunk(part.vehicle)}/@q/**"
        # Not indirect: that is a thread for which an interpreter waits at its end.
        handler = zenoh.handlers.Callback(self._answer, indirect=False)
        self._queryable: Any = cast(Any, session.declare_queryable)(expression, handler)

    def reply(self, message: imc.Message, packet: bytes) -> None:
        """Answer the query that a message for one system replies to, if there is one."""
        if not self._open:
            return
        place = message.dst, type(message).__name__
        with self._lock:
            waiting = self._open.get(place, [])
            found = next((one for one in waiting if one.is_answered_by(message)), None)
            if found is None:
                return
            waiting.remove(found)
            if not waiting:
                del self._open[place]
        self._send(found.query, {str(found.query.key_expr): packet})

    def close(self) -> None:
        self._queryable.undeclare()
        with self._lock:
            self._open.clear()

    def _answer(self, query: "zenoh.Query") -> None:
        """Called from zenoh's thread; it must not wait."""
        payload = query.payload
        if payload is None or not len(payload):
            self._answer_last(query)
        elif len(payload) > LARGEST_PACKET:
            self._refuse(query, "the request is larger than any packet")
        else:
            self._ask(query, payload.to_bytes())

    def _answer_last(self, query: "zenoh.Query") -> None:
        asked = query.key_expr
        answers: dict[str, bytes] = {}
        latest: dict[str, tuple[float, bytes]] = {}
        for (message, source, entity), packet in self._last():
            if asked.intersects(place := cast(Any, query_key(message, source, entity))):
                answers[place] = packet
            elif asked.intersects(place := cast(Any, query_key(message, source))):
                latest[place] = max(latest.get(place, (0.0, b"")), (time_of(packet), packet))
        answers.update((place, packet) for place, (_, packet) in latest.items())
        self._send(query, answers)

    def _ask(self, query: "zenoh.Query", packet: bytes) -> None:
        try:
            request = imc.decode(packet)
        except imc.DecodeError as error:
            self._refuse(query, str(error))
            return
        name = type(request).__name__
        place = str(query.key_expr).split("/@q/")[-1]
        if place != name:
            self._refuse(query, f"a {name} belongs to .../@q/{name}, not to .../@q/{place}")
        elif request.src == UNKNOWN_SYSTEM or (self._part is not None and request.src == self._part.system):
            self._refuse(query, "the source of the request (src) must be the system that asks")
        elif not self._concerns(request):
            return  # its tasks run in another process of the vehicle
        elif not self._expect(query, request, REPLIES.get(name, name)):
            self._refuse(query, f"{MOST_OPEN} requests wait for their replies already")
        else:
            self._take(packet)

    def _expect(self, query: "zenoh.Query", request: imc.Message, reply: str) -> bool:
        now = time.monotonic()
        with self._lock:
            self._open = {
                place: left for place, all_ in self._open.items() if (left := [one for one in all_ if one.until > now])
            }
            if sum(map(len, self._open.values())) >= MOST_OPEN:
                return False
            self._open.setdefault((request.src, reply), []).append(_Open(query, request, now + PATIENCE))
            return True

    def _send(self, query: "zenoh.Query", answers: Mapping[str, bytes]) -> None:
        def send() -> None:
            for place, packet in answers.items():
                cast(Any, query).reply(place, packet, encoding=ENCODING)
            cast(Any, query).drop()

        self._outbox.put(f"reply to {query.key_expr}", send)

    def _refuse(self, query: "zenoh.Query", why: str) -> None:
        def send() -> None:
            cast(Any, query).reply_err(why)
            cast(Any, query).drop()  # else the other side waits for more

        self._outbox.put(f"refusal: {why}", send)


def time_of(packet: bytes) -> float:
    """The time stamp in the header of a packet, in s since 1970."""
    return struct.unpack_from("<d" if packet[:1] == b"\x54" else ">d", packet, 6)[0]
