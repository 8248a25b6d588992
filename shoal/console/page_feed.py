"""Frames for the pages: changes of all vehicles five times a second, made once for all viewers, while there are any."""

import asyncio
import json
import math
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, cast

import msgspec

import imc
from shoal.console.abort_senders import AbortSenders
from shoal.console.vehicle_view import KINDS, ArrivalTimes, View, changed_items, position, vehicle_view, word
from shoal.network import MessageListener, MessageUse, Network, NetworkSystem, field_value
from support.terminal_text import printable

PERIOD = 0.2  # s between frames
IDLE_PERIOD = 10.0  # s between two looks at the network while there is no viewer
TRACK_PERIOD = 1.0  # s between points of a track
TRACK_POINTS = 3600
LOG_ENTRIES = 400
REPEATED = 64  # entries among which a copy is looked for
MOST_WAITING = 2  # frames in front of a slow page; the oldest is dropped
MOST_FIELDS = 32  # of a page, in plots and panels


class Viewer:
    """A page: frames that wait for it, and the fields that it draws.

    One that has missed a frame gets everything but the tracks anew, since frames have only changes.
    """

    def __init__(self) -> None:
        self.fields: tuple[str, ...] = ()
        self.uses: list[MessageUse] = []
        self.dropped: int = 0
        self._waiting: deque[bytes] = deque()
        self._news = asyncio.Event()
        self.needs_all: bool = True
        self.needs_tracks: bool = True

    def put(self, frame: bytes) -> None:
        if len(self._waiting) >= MOST_WAITING:
            self.dropped += len(self._waiting)
            self._waiting.clear()
            self.needs_all = True
            return
        self._waiting.append(frame)
        self._news.set()

    async def next(self) -> bytes:
        while not self._waiting:
            self._news.clear()
            await self._news.wait()
        return self._waiting.popleft()


class PageFeed:
    """Reads a network, and gives each page its frames. Calls are made in the event loop of the network.

    `leases()` is who commands each vehicle, for all pages; `on_viewer()` is called when a page or another viewer opens.
    `aborter(vehicle)` is the user who has aborted a vehicle last.
    """

    def __init__(
        self,
        network: Network,
        leases: Callable[[], Mapping[str, object]] = dict,
        on_viewer: Callable[[], object] = lambda: None,
        aborter: Callable[[str], str] = lambda _: "",
    ) -> None:
        self._network, self._leases, self._on_viewer = network, leases, on_viewer
        self._viewers: set[Viewer] = set()
        self.senders: AbortSenders = AbortSenders(network, aborter)
        self._watchers = 0
        self._watched_since = math.inf
        self._sent: dict[str, dict[str, View]] = {}
        self._known: set[str] = set()
        self._tracks: dict[str, deque[list[float | None]]] = {}
        self._drawn: dict[str, float] = {}
        self._log: deque[list[object]] = deque(maxlen=LOG_ENTRIES)
        self._notes: list[list[object]] = []
        self._newest_entries: deque[imc.LogBookEntry] = deque(maxlen=REPEATED)
        self._listener: MessageListener | None = None
        self._woken = asyncio.Event()
        self._asked: dict[str, float] = {}
        self._times = ArrivalTimes()

    @property
    def is_watched(self) -> bool:
        """Whether somebody looks."""
        return bool(self._viewers or self._watchers)

    def followed_for(self, system: NetworkSystem) -> float:
        """Time (s) for which the messages of `KINDS` have been received of a system; 0 while nobody looks."""
        return max(0.0, time.monotonic() - max(self._watched_since, system.appeared_at))

    @contextmanager
    def watching(self) -> Generator[None]:
        """Note that a viewer other than a page is connected."""
        self._begin_watch()
        self._watchers += 1
        self._on_viewer()
        try:
            yield
        finally:
            self._watchers -= 1
            self._end_watch()

    def _begin_watch(self) -> None:
        if not self.is_watched:
            self._watched_since = time.monotonic()

    def _end_watch(self) -> None:
        if not self.is_watched:
            self._watched_since = math.inf

    def note(self, vehicle: str, context: str, text: str) -> None:
        """Show a text in the log book of the pages."""
        self._notes.append([round(time.time(), 1), vehicle, "info", context, printable(text), ""])

    def add(self, viewer: Viewer) -> None:
        self._begin_watch()
        self._viewers.add(viewer)
        self._on_viewer()  # first, so that what waits at a vehicle is in the first frame
        self._woken.set()

    def remove(self, viewer: Viewer) -> None:
        self._viewers.discard(viewer)
        self._end_watch()
        self.set_fields(viewer, ())

    async def run(self) -> None:
        """Make frames until it is cancelled."""
        network = self._network
        self._listener = network.listen(None, (imc.EstimatedState, imc.LogBookEntry))
        try:
            network.subscribe(None, KINDS)
            while True:
                now = time.monotonic()
                self._ask_for_states(now)
                entries = self._read_messages()
                if self._viewers:
                    self._send_frames(entries)
                    await asyncio.sleep(PERIOD)
                else:
                    self._sent.clear()
                    await self._wait_for_viewer()
        finally:
            network.close_listener(self._listener)

    async def _wait_for_viewer(self) -> None:
        self._woken.clear()
        with suppress(TimeoutError):
            async with asyncio.timeout(IDLE_PERIOD):
                await self._woken.wait()

    def _ask_for_states(self, now: float) -> None:
        """Ask each new vehicle for labels and states once in 5 s, until it has sent them."""
        for system in self._network.vehicles():
            known = system.labels and system.latest_message(imc.EntityState) is not None
            if system.id is None or known or now - self._asked.get(system.name, -math.inf) < 5.0:
                continue
            self._asked[system.name] = now
            self._network.request_labels(system)
            self._network.send(system, imc.QueryEntityState())

    def _read_messages(self) -> list[list[object]]:
        """Extend the tracks; the new entries of the log book."""
        assert self._listener is not None
        found, self._notes = self._notes, []
        for system, message in self._listener.take_all():
            if isinstance(message, imc.EstimatedState):
                self._extend_track(system, message)
            elif isinstance(message, imc.LogBookEntry) and message not in self._newest_entries:  # others are copies
                self._newest_entries.append(message)
                kind = word(imc.LogBookEntry.Type, message.type)
                text = self.senders.named(system.name, message.text)
                words = map(printable, (message.context, text, system.label(message.src_ent)))
                found.append([round(message.htime, 1), system.name, kind, *words])
        self._log.extend(found)
        return found

    def _extend_track(self, system: NetworkSystem, state: imc.EstimatedState) -> None:
        if not system.is_vehicle or abs(state.timestamp - self._drawn.get(system.name, -math.inf)) < TRACK_PERIOD:
            return
        self._drawn[system.name] = state.timestamp
        lat, lon, _ = position(state)
        point = [round(math.degrees(lat), 6), round(math.degrees(lon), 6), round(state.depth, 1)]
        track = self._tracks.setdefault(system.name, deque(maxlen=TRACK_POINTS))
        if all(map(math.isfinite, point)) and (not track or track[-1] != point):
            track.append([*point])

    def _send_frames(self, entries: Iterable[list[object]]) -> None:
        named = self.senders.named
        views = {each.name: vehicle_view(each, self._times, partial(named, each.name)) for each in self._systems()}
        changes = {name: changed_items(self._sent.get(name, {}), view) for name, view in views.items()}
        gone = [name for name in self._sent if name not in views]
        values = self._values()
        self._sent = views
        frame = {**self._frame_head(), "values": values}
        news = {
            **frame,
            "vehicles": {name: change for name, change in changes.items() if change},
            "gone": gone,
            "log": list(entries),
        }
        small = encode(news)
        whole = {**frame, "all": True, "gone": [], "vehicles": views, "log": list(self._log)}
        made: dict[bool, bytes] = {}
        for viewer in self._viewers:
            if not viewer.needs_all:
                viewer.put(small)
                continue
            first, viewer.needs_all, viewer.needs_tracks = viewer.needs_tracks, False, False
            if first not in made:
                tracks = {name: list(track) for name, track in self._tracks.items()}
                made[first] = encode({**whole, "tracks": tracks} if first else whole)
            viewer.put(made[first])

    def _now(self) -> float:
        """The time of the page (s since 1970)."""
        return time.time()

    def _frame_head(self) -> dict[str, Any]:
        return {"now": round(self._now(), 2), "leases": self._leases()}

    def _systems(self) -> list[NetworkSystem]:
        """The vehicles that are there, and those that were there before: a page has to show that one is lost."""
        self._known.update(system.name for system in self._network.vehicles())
        systems = self._network.systems
        return [systems[name] for name in sorted(self._known) if name in systems and systems[name].is_vehicle]

    def _values(self) -> dict[str, list[float | None]]:
        """Time and value of each field that a page draws."""
        found: dict[str, list[float | None]] = {}
        for path in {path for viewer in self._viewers for path in viewer.fields}:
            name, _, rest = path.partition("/")
            message_name, _, field = rest.partition(".")
            field, _, entity = field.partition(":")
            system = self._network.systems.get(name)
            kind = self._kind(message_name)
            if system is None or kind is None:
                continue
            message = system.latest_message(kind, entity)
            value = field_value(message, field) if message is not None and field in message.__struct_fields__ else None
            if message is not None and isinstance(value, int | float):
                found[path] = [round(message.timestamp, 3), value if math.isfinite(value) else None]
        return found

    def _kind(self, name: str) -> type[imc.Message] | None:
        messages = self._network.messages
        return messages[name] if name in messages.types else None

    def set_fields(self, viewer: Viewer, paths: Iterable[str]) -> None:
        """Draw some fields: VEHICLE/Message.field or VEHICLE/Message.field:entity."""
        viewer.fields, before, viewer.uses = tuple(paths)[:MOST_FIELDS], viewer.uses, []
        for path in viewer.fields:
            name, _, rest = path.partition("/")
            kind = self._kind(rest.partition(".")[0])
            system = self._network.systems.get(name)
            if kind is not None and system is not None:
                viewer.uses.append(self._network.subscribe(system, (kind,)))
        for use in before:
            use.close()


def encode(value: object) -> bytes:
    """JSON, with null for numbers that it does not have, and escapes for text that UTF-8 does not have."""
    try:
        return msgspec.json.encode(value)
    except UnicodeEncodeError:
        return json.dumps(_finite(msgspec.to_builtins(value, str_keys=True)), allow_nan=False).encode()


def _finite(value: object) -> object:
    """The same tree with None for numbers that JSON does not have."""
    match value:
        case float():
            return value if math.isfinite(value) else None
        case dict():
            return {name: _finite(item) for name, item in cast(dict[str, object], value).items()}
        case list():
            return [_finite(item) for item in cast(list[object], value)]
        case _:
            return value
