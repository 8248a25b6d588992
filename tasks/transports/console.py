"""Serves a page in the browser that shows this vehicle, in a thread of its own."""

import math
import socket
from collections import deque
from collections.abc import Callable, Collection
from functools import partial
from typing import Protocol

import imc
from imc.console_acl import ConsoleAcl
from imc.discovery import LOOPBACK, Service, check_address
from runtime import State, Task, consume, param, periodic
from runtime.bus import Subscription
from runtime.profile import listed_consoles
from runtime.task import ParameterError
from support.file_errors import describe_os_error
from tasks.transports.imc_links.port_search import OpenedServer, listening_socket, start_server

PORTS_TRIED = 5
UNWATCHED = ("Calibration", "EstimatedState", "LogBookEntry")  # kept while nobody looks: they are needed later
MOST_EVENTS = 1024  # packets that wait for the page; the oldest are dropped
MOST_ORDERS = 256  # packets of the page that wait for the kernel
TRACK_PERIOD = 1.0  # s between two positions that are kept


class PageServer(Protocol):
    """A web server of the page. `run` is for a thread of its own; `stop` ends it, from any thread."""

    is_secure: bool
    """Whether the page is reached by https."""

    @property
    def rejected_connections(self) -> int:
        """Connections that were too many."""
        ...

    def run(self) -> None: ...
    def stop(self) -> None: ...


class PageFactory(Protocol):
    """Makes the server of a page that a vehicle's task serves at a socket that listens, which it takes over.

    Raises ValueError with the reason if it must not be served so, OSError for files.
    """

    def __call__(self, task: "Console", listener: socket.socket) -> PageServer: ...


class PagePackets:
    """Packets that wait for the page: the latest of each message, entity and object, positions, and all events.

    `put` is for the kernel's thread, `take` for another one. `console` is the id under which the page sends; `wake` is
    called when an answer to it waits. Positions are the vehicle's of each second. Counted: `dropped` events.
    """

    def __init__(self, console: int, wake: Callable[[], object]) -> None:
        self._console, self._wake = console, wake
        self._latest: dict[tuple[type, int, int], bytes] = {}
        self._events: deque[bytes] = deque(maxlen=MOST_EVENTS)  # which drops in one step: the other thread takes
        self._positions: deque[bytes] = deque(maxlen=MOST_EVENTS)
        self._positioned = -math.inf
        self.dropped: int = 0

    def put(self, message: imc.Message, packet: bytes) -> None:
        is_answer = message.dst == self._console
        if not is_answer and not isinstance(message, imc.LogBookEntry):
            thing = message.id if isinstance(message, imc.EstimatedMugState) else 0  # one entity detects several
            self._latest[type(message), message.src_ent, thing] = packet
            if isinstance(message, imc.EstimatedState) and abs(message.timestamp - self._positioned) >= TRACK_PERIOD:
                self._positioned = message.timestamp
                self._positions.append(packet)
            return
        self.dropped += len(self._events) == MOST_EVENTS
        self._events.append(packet)
        if is_answer:
            self._wake()

    def take(self) -> list[bytes]:
        """All that waits, which waits no longer; events first, then positions."""
        found = [self._events.popleft() for _ in range(len(self._events))]
        positions = [self._positions.popleft() for _ in range(len(self._positions))]
        latest = [self._latest.pop(place) for place in list(self._latest)]
        if positions and positions[-1] in latest:
            del positions[-1]
        return found + positions + latest


class Console(Task):
    """Serves the page of `shoal console` for this vehicle; the program that runs the vehicle brings the server.

    `shoal run` prints a link that logs in once. At another address than 127.0.0.1 the page needs users and a
    certificate. The page gets the latest messages a few times a second while somebody looks, and its orders are those
    of an IMC console. Its threads only leave packets for the kernel, and take those that the kernel has left.
    """

    external = True
    requires = "console"
    optional = True

    make_page: PageFactory | None = None
    """Set by the program that runs the vehicle."""

    address: str = param(
        LOOPBACK,
        "",
        "Address to listen at. Any but 127.0.0.1 needs users (shoal console user) and TLS (shoal console certificate).",
        editable=False,
    )
    port: int = param(
        8080,
        "1",
        "Port to listen at; if it is taken, one of the next four, else any. 0 takes any.",
        minimum=0,
        maximum=65535,
        editable=False,
    )
    access_folder: str = param(
        "",
        "",
        "Folder with the users, certificate.pem and key.pem; empty means that of `shoal console user`.",
        editable=False,
    )
    map_tiles: str = param("", "", "Folder with map tiles, .mbtiles and .pmtiles files.", editable=False)
    panels: str = param("", "", "YAML file with panels of your own: values, plots and buttons.", editable=False)

    forecast: bool = param(
        False,
        "",
        "Let users of the page simulate the rest of the running plan on this computer, which takes half a core.",
        editable=False,
    )

    loopback_internal_messages: bool = param(
        True, "", "Show the messages of this task itself: they name what users do.", editable=False
    )

    def configure(self) -> None:
        try:
            check_address(self.address)
        except ValueError as error:
            raise ParameterError("Address", str(error)) from None
        self.commanders: ConsoleAcl = listed_consoles(self)

    def start(self) -> None:
        self._page: PageServer | None = None
        self._packets: PagePackets | None = None
        self._wanted: dict[str, None] = {}
        self._subscribed: dict[str, Subscription] = {}
        self._is_watched = False
        self._orders: deque[bytes] = deque()
        self._counts: dict[tuple[str, int], tuple[int, float]] = {}
        self._counting: Subscription | None = None
        self._announce: tuple[imc.Announce, bytes] | None = None
        self.lost_orders: int = 0
        self.malformed: int = 0
        if self.make_page is None:
            self.set_entity_state(State.NORMAL, "not served: `shoal run` serves the page")
        else:
            start_server(self, partial(self._open, self.make_page), self.report)

    def stop(self) -> None:
        if self._page is not None:
            self._page.stop()

    @consume(packets=True)
    def on_announce(self, announce: imc.Announce, packet: bytes) -> None:
        """Keep the type of the vehicle for a page that begins later."""
        self._announce = announce, packet

    @periodic(1.0)
    def report(self) -> None:
        if self._page is None:
            return
        lost = self._packets.dropped if self._packets is not None else 0
        counts = {"events dropped": lost, "orders dropped": self.lost_orders, "malformed orders": self.malformed}
        counts["connections rejected"] = self._page.rejected_connections
        counted = "".join(f"; {number} {what}" for what, number in counts.items() if number)
        self.set_entity_state(State.NORMAL, f"port {self._open_port}{counted}")

    def _open(self, make_page: PageFactory) -> OpenedServer:
        try:
            listener = listening_socket(self.address, self.port, PORTS_TRIED)
            self._open_port: int = listener.getsockname()[1]
            try:
                self._page = make_page(self, listener)
            except Exception:
                listener.close()
                raise
        except OSError as error:
            raise ValueError(f"no page: {describe_os_error(error)}") from None
        service = Service("https" if self._page.is_secure else "http", self.address, self._open_port)
        return OpenedServer(self._page.run, service, self.port)

    # Called from the page's thread

    def connect_page(self, console: int, wake: Callable[[], object]) -> PagePackets:
        """Keep packets for the page, which sends as a console with this id; `wake` is called in the kernel's thread."""
        self._packets = PagePackets(console, wake)
        return self._packets

    def request_messages(self, names: Collection[str]) -> None:
        """Keep messages of some types of this vehicle, from now on while somebody looks; without any, all."""
        self._kernel.post(self._want, tuple(names))

    def release_messages(self, names: Collection[str]) -> None:
        """Keep messages no longer that were requested in the same words."""
        self._kernel.post(self._release, tuple(names))

    def set_watched(self, is_watched: bool) -> None:
        """Keep the messages that were requested, or only those that cost nothing to keep."""
        self._kernel.post(self._watch, is_watched)

    def take_order(self, packet: bytes) -> None:
        """Put a packet of the page on the bus."""
        if len(self._orders) >= MOST_ORDERS:
            self.lost_orders += 1
            return
        self._orders.append(packet)
        self._kernel.post(self._relay_order)

    def note(self, text: str) -> None:
        """Write what a user does into the log book."""
        self._kernel.post(self.log.info, text)

    def set_counting(self, is_counting: bool) -> None:
        """Count all messages of this vehicle from now on, or no longer."""
        self._kernel.post(self._count, is_counting)

    def message_counts(self) -> dict[tuple[str, int], tuple[int, float]]:
        """Number of messages that were counted, and the time of the last one (s), by message and id of the entity."""
        return dict(self._counts)

    # Called by those

    def _count(self, is_counting: bool) -> None:
        if self._counting is not None:
            self.vehicle.bus.remove_subscription(self._counting)
            self._counting = None
        if is_counting:
            self._counts = {}
            self._counting = Subscription(imc.Message, self._count_message, self)
            self.vehicle.bus.subscribe(self._counting)

    def _count_message(self, message: imc.Message) -> None:
        place = type(message).__name__, message.src_ent
        self._counts[place] = self._counts.get(place, (0, 0.0))[0] + 1, message.timestamp

    def _want(self, names: Collection[str]) -> None:
        self._wanted |= dict.fromkeys(names or ("",))
        self._subscribe()

    def _release(self, names: Collection[str]) -> None:
        for name in names or ("",):
            self._wanted.pop(name, None)
        self._subscribe()

    def _watch(self, is_watched: bool) -> None:
        self._is_watched = is_watched
        self._subscribe()
        if is_watched and self._announce is not None and self._packets is not None:
            self._packets.put(*self._announce)

    def _subscribe(self) -> None:
        """Subscribe what is wanted now, and nothing else; all messages include each."""
        packets, bus = self._packets, self.vehicle.bus
        if packets is None:
            return
        names = [name for name in self._wanted if self._is_watched or name in UNWATCHED]
        if self._is_watched and "" in self._wanted:
            names = [""]
        for name in [name for name in self._subscribed if name not in names]:
            bus.remove_subscription(self._subscribed.pop(name))
        for name in names:
            if name in self._subscribed or (name and name not in bus.messages.types):
                continue
            kind = bus.messages[name] if name else imc.Message
            subscription = self._subscribed[name] = Subscription(kind, packets.put, self, packets=True)
            bus.subscribe(subscription)

    def _relay_order(self) -> None:
        try:
            self.relay(self._orders.popleft())
        except imc.DecodeError:
            self.malformed += 1
