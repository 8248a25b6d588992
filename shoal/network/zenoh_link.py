"""Systems on a zenoh bus: a client of the processes of this computer, or of an endpoint elsewhere."""

import asyncio
from collections import deque
from collections.abc import Callable, Collection
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast
from urllib.parse import unquote

import imc
from imc.discovery import PERIOD
from imc.layout import SMALLEST_PACKET
from imc.reserved_ids import OPERATORS
from runtime.zenoh import LOCAL_PORT, ZenohConfig, error_text, is_loopback_endpoint, key_chunk, message_key, parse_token
from shoal.network.link import EVERYBODY, FAR, NEAR, ConsoleIdentity, LinkListener, ReceivedPacket
from shoal.network.zenoh_connection_failure import connection_failure
from shoal.network.zenoh_key_expressions import includes_expression, key_expressions
from shoal.network.zenoh_session_thread import ZenohSessionThread

if TYPE_CHECKING:
    import zenoh

LOCAL = f"tcp/127.0.0.1:{LOCAL_PORT}"
TOKENS = ("@run", "@alive")  # of processes: where they are, and the id of their vehicle
RETRY = 0.5  # s
FIRST_TRY = 0.5  # s that a first connection may take
ANSWER = 1.0  # s for the last messages that vehicles keep
BRIDGE = 0.9  # s in which another process takes over for one that has ended, and we connect to it
MOST_WAITING = 1 << 16  # packets between zenoh's threads and ours
AT_ONCE = 512
MOST_PUBLISHERS = 4096
CLOSING = 1.0  # s
SETTLING = 0.02  # s until zenoh has named all who are there


class _Sample(NamedTuple):
    key: str
    packet: bytes
    source: "zenoh.SourceInfo | None"
    is_old: bool = False


class ZenohLink:
    """The systems that publish below imc/ on a zenoh bus.

    `connect` are the endpoints of which the first that answers is joined; `config_file` is zenoh's own configuration,
    for TLS and passwords.
    Each packet is taken once, however many ways lead here; the numbers in packets of Shoal show which were lost.
    """

    delivers_all = True
    fragment_size = 0

    def __init__(
        self, connect: Collection[str] = (LOCAL,), config_file: Path | None = None, name: str = "zenoh"
    ) -> None:
        self.name = name
        self._connect = tuple(connect)
        self.trouble: str = f"{', '.join(self._connect)} has not answered yet"
        self.is_far: bool = not all(map(is_loopback_endpoint, connect))
        self._config = ZenohConfig(
            mode="client", local_port=0, listen=(), connect=self._connect, scouting="none", config_file=config_file
        )
        self._opener = ZenohSessionThread(self._config)
        self._wanted: dict[str, Callable[[], object] | None] = {}  # key expression: its end
        self._requested: dict[str, None] = {}
        self._announcing: asyncio.TimerHandle | None = None
        self._answers: dict[str, Callable[[], object]] = {}  # by vehicle
        self._asked: dict[str, None] = {}
        self._waiting: deque[_Sample] = deque()
        self._tokens: deque[tuple[str, bool]] = deque()
        self._present: set[str] = set()
        self._numbers: dict[tuple[object, int], int] = {}
        self._overflow = 0
        self._is_awake = False
        self._session: zenoh.Session | None = None
        self._retrying: asyncio.Task[None] | None = None
        self._liveliness: list[Any] = []

    @property
    def discovery_timeout(self) -> float:
        return FAR if self.is_far else NEAR

    @property
    def awaits_answers(self) -> bool:
        return False

    async def open(self, listener: LinkListener, console: ConsoleIdentity) -> None:
        self._listener, self._console = listener, console
        self._loop = asyncio.get_running_loop()
        for name in (console.name, f"0x{console.id:04X}"):
            self._wanted.setdefault(f"imc/{key_chunk(name)}/@cmd/**", None)
        try:
            self._config.build()
        except ModuleNotFoundError:
            self.trouble = "zenoh is not installed: pip install 'shoal[zenoh]'"
            return
        except ValueError as error:
            self.trouble = f"zenoh: {error}"
            return
        opened = asyncio.Event()
        self._retrying = asyncio.create_task(self._keep_trying(opened))
        with suppress(TimeoutError):
            async with asyncio.timeout(FIRST_TRY):
                await opened.wait()

    def subscribe(self, system: str, messages: Collection[str]) -> None:
        system = EVERYBODY if system == EVERYBODY else key_chunk(system)
        self._requested |= dict.fromkeys(key_expressions(system, messages))
        self._subscribe_requested()
        for message in messages:
            self._asked[f"imc/{system}/@q/{key_chunk(message)}/*"] = None
        self._ask()

    def unsubscribe(self, system: str, messages: Collection[str]) -> bool:
        """Receive no more; what else was requested, and was part of it, begins before it ends."""
        ended = key_expressions(EVERYBODY if system == EVERYBODY else key_chunk(system), messages)
        undeclare = [self._wanted.pop(expression, None) for expression in ended]
        for expression in ended:
            self._requested.pop(expression, None)
        self._subscribe_requested()
        for end in filter(None, undeclare):
            end()
        return True

    def _subscribe_requested(self) -> None:
        """Subscribe what was requested and is no part of another subscription."""
        for expression in self._requested:
            if not any(includes_expression(other, expression) for other in self._wanted):
                self._wanted[expression] = None
                self._subscribe(expression)

    def _announce_soon(self) -> None:
        """Announce us to those who have appeared, and from then on to all at intervals."""
        if self._announcing is not None:
            self._announcing.cancel()
        self._announcing = self._loop.call_later(SETTLING, self._announce)

    def _announce(self) -> None:
        packet = self._console.naming_packet("zenoh")
        self.send(EVERYBODY, imc.Announce(), packet)
        self._announcing = self._loop.call_later(PERIOD, self._announce)

    def send(self, system: str, message: imc.Message, packet: bytes) -> None:
        if self._session is None:
            return
        import zenoh

        name = type(message).__name__ if not isinstance(message, imc.Unknown) else str(message.id)
        put: Callable[..., object] = cast(Any, self._session).put
        try:
            put(
                message_key(name, self._console.name, self._console.name, "" if system == EVERYBODY else system),
                packet,
                encoding="application/octet-stream;imc/5.4.31",
                congestion_control=zenoh.CongestionControl.DROP,
                priority=zenoh.Priority.REAL_TIME,
            )
        except Exception as error:
            self._listener.on_dropped(self, system, f"zenoh did not send it: {error_text(error)}")

    async def close(self) -> None:
        if self._announcing is not None:
            self._announcing.cancel()
        if self._retrying is not None:
            self._retrying.cancel()
            with suppress(asyncio.CancelledError):
                await self._retrying
        await self._opener.close()
        session, self._session = self._session, None
        if session is not None:
            with suppress(TimeoutError):
                async with asyncio.timeout(CLOSING):
                    await asyncio.to_thread(self._leave, session)

    async def _keep_trying(self, opened: asyncio.Event) -> None:
        """Join as soon as somebody listens; from then on zenoh reconnects by itself."""
        import zenoh

        while self._session is None:
            try:
                session = await self._opener.open()
            except Exception as error:
                trouble = f"zenoh: {error_text(error)}"
                if isinstance(error, zenoh.ZError) and "connect" in str(error).lower():
                    trouble = await asyncio.to_thread(connection_failure, self._connect)
                self.trouble = trouble
                opened.set()
                await asyncio.sleep(RETRY)
                continue
            self._session, self.trouble = session, ""
            callback: Any = zenoh.handlers.Callback(self._note, indirect=False)
            listen: Any = session.liveliness().declare_subscriber
            self._liveliness = [listen(f"imc/*/{kind}/**", callback, history=True) for kind in TOKENS]
            for expression in self._wanted:
                self._subscribe(expression)
            self._ask()
            opened.set()

    def _subscribe(self, expression: str) -> None:
        if self._session is None:
            return
        import zenoh

        # Called in a thread of zenoh: it only puts aside. A thread of Python per subscriber would cost more.
        callback: Any = zenoh.handlers.Callback(self._put_aside, indirect=False)
        declare: Any = self._session.declare_subscriber
        self._wanted[expression] = declare(expression, callback).undeclare

    def _take_answers_of(self, chunk: str) -> None:
        """Take packets of a vehicle to the name that its profile gives our id, which is unknown here."""
        if self._session is not None and chunk not in self._answers and len(self._answers) < MOST_PUBLISHERS:
            import zenoh

            callback: Any = zenoh.handlers.Callback(self._put_answer_to_us_aside, indirect=False)
            declare: Any = self._session.declare_subscriber
            self._answers[chunk] = declare(f"imc/*/@cmd/*/{chunk}", callback).undeclare

    def _put_answer_to_us_aside(self, sample: "zenoh.Sample") -> None:
        packet = sample.payload.to_bytes()
        if len(packet) >= SMALLEST_PACKET and imc.header(packet).dst == self._console.id:
            self._put_aside(sample)

    def _ask(self) -> None:
        """Ask for the last messages that vehicles have kept, of the types that are received from now on."""
        while self._session is not None and self._asked:
            expression = next(iter(self._asked))
            del self._asked[expression]
            import zenoh

            callback: Any = zenoh.handlers.Callback(self._put_answer_aside, indirect=False)
            get: Any = self._session.get
            get(expression, callback, timeout=ANSWER)

    def _put_answer_aside(self, reply: "zenoh.Reply") -> None:
        sample = reply.ok
        if sample is not None and len(self._waiting) < MOST_WAITING:
            # imc/<system>/@q/<Message>/<entity>
            chunks = str(sample.key_expr).split("/")
            if len(chunks) == 5:
                place = f"imc/{chunks[1]}/{chunks[3]}/{chunks[4]}"
                self._waiting.append(_Sample(place, sample.payload.to_bytes(), None, True))
                self._wake()

    def _leave(self, session: "zenoh.Session") -> None:
        """Subscribers first: a session that closes before them may wait for them."""
        for subscriber in self._liveliness:
            subscriber.undeclare()
        for undeclare in (*self._wanted.values(), *self._answers.values()):
            if undeclare is not None:
                undeclare()
        cast(Any, session).close()

    def _put_aside(self, sample: "zenoh.Sample") -> None:
        if len(self._waiting) >= MOST_WAITING:
            self._overflow += 1
            return
        self._waiting.append(_Sample(str(sample.key_expr), sample.payload.to_bytes(), sample.source_info))
        self._wake()

    def _note(self, sample: "zenoh.Sample") -> None:
        import zenoh

        self._tokens.append((str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT))
        self._wake()

    def _wake(self) -> None:
        if not self._is_awake:
            self._is_awake = True
            with suppress(RuntimeError):  # the loop has ended
                self._loop.call_soon_threadsafe(self._take)

    def _take(self) -> None:
        """Pass on what waits, a part at a time, so that the rest of the program comes to its turn."""
        self._is_awake = False
        if self._session is None:
            return
        while self._tokens:
            self._report_token(*self._tokens.popleft())
        for _ in range(min(AT_ONCE, len(self._waiting))):
            self._arrive(self._waiting.popleft())
        if self._overflow:
            number, self._overflow = self._overflow, 0
            self._listener.on_dropped(self, "", "this program is too slow for what it asked for", number)
        if self._waiting:
            self._wake()

    def _report_token(self, expression: str, is_there: bool) -> None:
        chunks, other = expression.split("/"), parse_token(expression)
        system, part, place, number = unquote(chunks[1]), "", "", None
        if chunks[2] == "@alive" and len(chunks) == 5:  # imc/<system>/@alive/<id>/<process>
            part = chunks[4]
            with suppress(ValueError):
                number = int(chunks[3], 16)
        elif other is not None and other.phase == "running":
            part, place = other.zid, other.place
        if not part:
            return
        if is_there:
            self._take_answers_of(chunks[1])
            self._announce_soon()
            self._present.add(expression)
            self._listener.on_appeared(self, system, part, place, number)
            return
        self._present.discard(expression)
        # The process that we are connected to has ended, and with it the way to all others.
        is_cut = self._session is not None and not self._session.info.links()
        if is_cut:
            self._loop.call_later(BRIDGE, self._lose, expression, system, part)
        else:
            self._lose(expression, system, part)

    def _lose(self, expression: str, system: str, part: str) -> None:
        if expression not in self._present and self._session is not None:
            self._listener.on_vanished(self, system, part, is_reported=True)

    def _arrive(self, sample: _Sample) -> None:
        chunks = sample.key.split("/")
        if len(chunks) < 4 or (chunks[2] == "@cmd" and len(chunks) < 5):
            return
        if chunks[2] == "@cmd":
            system, entity = unquote(chunks[4]), ""
        else:
            system, entity = unquote(chunks[1]), unquote(chunks[3])
        if system == self._console.name or not self._is_new(sample, system) or _is_of_console(sample.packet):
            return
        self._listener.on_packet(self, ReceivedPacket(sample.packet, system, entity, "", sample.is_old))

    def _is_new(self, sample: _Sample, system: str) -> bool:
        """Whether a packet did not come before by another way; counts those that are missing before it."""
        if sample.source is None:
            return True
        publisher = sample.source.source_id.zid, sample.source.source_id.eid
        number, last = sample.source.source_sn, self._numbers.get(publisher)
        ahead = 1 if last is None else (number - last) & 0xFFFFFFFF
        if not 0 < ahead < 0x80000000:
            return False
        if ahead > 1:
            self._listener.on_dropped(self, system, "lost on the way", ahead - 1)
        if last is None and len(self._numbers) >= MOST_PUBLISHERS:
            self._numbers.clear()
        self._numbers[publisher] = number
        return True


def _is_of_console(packet: bytes) -> bool:
    """Whether a packet is the Announce of another console, which only vehicles need."""
    is_whole = len(packet) >= SMALLEST_PACKET
    return is_whole and imc.packet_id(packet) == imc.Announce.ID and imc.packet_source(packet) in OPERATORS
