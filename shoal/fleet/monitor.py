"""The bus of a fleet, and the reports of its vehicles there."""

import contextlib
import math
import time
from collections import deque
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any

import imc
from runtime.zenoh import (
    ListenEndpointFailover,
    SessionFactory,
    ZenohConfig,
    describe_local_host,
    error_text,
    parse_token,
)
from support.positions import format_position
from support.text_length import list_first

ANSWERS = (imc.VehicleState, imc.EstimatedState, imc.FuelLevel, imc.PlanControlState)
REPORTED = (imc.LogBookEntry.Type.ERROR, imc.LogBookEntry.Type.CRITICAL)
MOST_ENTRIES = 32  # that wait to be reported
PATIENCE = 1.0  # s for the answers of all vehicles
ENDING = 1.0  # s in which vehicles end whose fleet has been killed
MOMENT = 0.1  # s
MOST_NAMED = 3
OPENING = 3000  # ms for the session to open


@dataclass
class VehicleSummary:
    """Last reports of a vehicle, as text for people. `age` is that of its state, in s."""

    mode: str = ""
    plan: str = ""
    position: str = ""
    battery: str = ""
    errors: int = 0
    age: float = math.inf


class FleetMonitor:
    """The router that all vehicles of a fleet connect to, and a session that asks them.

    `options` are those of [Zenoh]: where else to listen, certificates and so on. Raises ValueError, ConnectionError.
    """

    def __init__(self, options: dict[str, str]) -> None:
        import zenoh

        config = ZenohConfig.from_options({"Mode": "router", "Scouting": "none", **options})
        self._opener = SessionFactory()
        self._meeting = ListenEndpointFailover(config, self._opener)
        self._meeting.open()
        client = ZenohConfig.from_options({**_own(options), "Mode": "client", "Scouting": "none"})
        joined: Any = client.build().config
        joined.insert_json5("transport/unicast/open_timeout", str(OPENING))
        try:
            self._session: Any = self._opener.open(joined)
        except zenoh.ZError as error:
            self._opener.stop_link_timeout()
            self._meeting.close()
            words = f"no zenoh at port {client.local_port} of this computer: {error_text(error)}"
            hint = "another program has it, or it needs a password: see Local Port and User under zenoh: in the file"
            raise ConnectionError(f"{words} ({hint})") from None
        self._entries: deque[tuple[str, bytes]] = deque(maxlen=MOST_ENTRIES)
        self._last_errors: dict[str, str] = {}
        self._log_books = self._session.declare_subscriber(
            "imc/*/LogBookEntry/*", zenoh.handlers.Callback(self._on_log_book_entry, indirect=False)
        )

    def running_vehicles(self) -> set[str]:
        """The names (as in keys) of the vehicles that run."""
        replies = self._session.liveliness().get("imc/*/@alive/*/main", timeout=PATIENCE)
        return {str(reply.ok.key_expr).split("/")[1] for reply in replies if reply.ok is not None}

    def check_names_free(self, names: Collection[str], fleets: Collection[str]) -> None:
        """Raise ConnectionError if vehicles of these names (as in keys) run; some time passes for those that just end.

        `fleets` are the other ones of this computer, which may be theirs.
        """
        deadline = time.monotonic() + ENDING
        while taken := self._find_running(names):
            if time.monotonic() < deadline:
                time.sleep(MOMENT)
                continue
            each = list_first(
                [f"{name} already runs {place}" for name, place in sorted(taken.items())], MOST_NAMED, "; "
            )
            end = " or ".join(f"shoal fleet stop {name}" for name in fleets)
            raise ConnectionError(
                f"{each}; this is {describe_local_host()}: end what runs{f' ({end})' if end else ''}, "
                "or give this fleet other names, or a network of its own (Local Port under zenoh: in its file)"
            )

    def _find_running(self, names: Collection[str]) -> dict[str, str]:
        """Running ones of these vehicles, and their places."""
        replies = self._session.liveliness().get("imc/*/@run/running/**", timeout=PATIENCE)
        keys = [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]
        found = {key.split("/")[1]: parse_token(key) for key in keys}
        return {name: other.place_and_start for name, other in found.items() if name in names and other is not None}

    def query_summaries(self) -> dict[str, VehicleSummary]:
        """Query the present report of each vehicle."""
        found: dict[str, VehicleSummary] = {}
        now = time.time()
        asked = [self._session.get(f"imc/*/@q/{kind.__name__}", timeout=PATIENCE) for kind in ANSWERS]
        for replies in asked:
            for reply in replies:
                if reply.ok is None:
                    continue
                try:
                    message = imc.decode(reply.ok.payload.to_bytes())
                except imc.DecodeError:
                    continue
                _update_summary(found.setdefault(str(reply.ok.key_expr).split("/")[1], VehicleSummary()), message, now)
        return found

    def new_errors(self) -> Iterator[tuple[str, str]]:
        """Errors since the last call: vehicles (names as in keys), and the entries of their log books."""
        while self._entries:
            vehicle, packet = self._entries.popleft()
            with contextlib.suppress(imc.DecodeError):
                entry = imc.decode(packet)
                if isinstance(entry, imc.LogBookEntry) and entry.type in REPORTED:
                    words = f"{entry.context}: {entry.text}"
                    if words != self._last_errors.get(vehicle):
                        self._last_errors[vehicle] = words
                        yield vehicle, words

    def _on_log_book_entry(self, sample: Any) -> None:
        """Called from zenoh's thread."""
        self._entries.append((str(sample.key_expr).split("/")[1], sample.payload.to_bytes()))

    def close(self) -> None:
        self._opener.stop_link_timeout()
        self._log_books.undeclare()
        self._session.close()
        self._meeting.close()


def _own(options: dict[str, str]) -> dict[str, str]:
    """Configuration of a session that reaches the router on this computer."""
    return {name: text for name, text in options.items() if name in ("Local Port", "User", "Password File")}


def _update_summary(summary: VehicleSummary, message: imc.Message, now: float) -> None:
    if isinstance(message, imc.VehicleState):
        summary.mode = next((mode.name for mode in imc.VehicleState.OpMode if mode == message.op_mode), "unknown")
        summary.errors = message.error_count
    elif isinstance(message, imc.EstimatedState):
        summary.age = max(0.0, now - message.timestamp)
        values = (message.lat, message.lon, message.height, message.x, message.y, message.z)
        if all(map(math.isfinite, values)):
            lat, lon, height = imc.coordinates.absolute_position(message)
            depth = f"{message.depth:.1f} m deep" if message.depth >= 0.0 else f"{height:.1f} m high"
            summary.position = f"{format_position(lat, lon)}  {depth}"
    elif isinstance(message, imc.FuelLevel):
        summary.battery = f"{message.value:.0f} %"
    elif isinstance(message, imc.PlanControlState):
        flying = message.state == imc.PlanControlState.State.EXECUTING
        progress = f" {message.plan_progress:.0f} %" if message.plan_progress >= 0.0 else ""
        summary.plan = f"{message.plan_id}{progress}" if flying else ""
