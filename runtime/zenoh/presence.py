"""Tokens of the processes that run the parts of a vehicle: one name, one vehicle on a network.

Each process declares a liveliness token that names vehicle, host, process and entities; zenoh withdraws it when the
process ends or crashes, in any state of Python. The key is documented in docs/zenoh.md.
"""

import contextlib
import logging
import os
import socket
import threading
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, cast

from runtime.network_interfaces import interfaces
from runtime.udp_sockets import source_address
from runtime.zenoh.error_counter import REPORT_PERIOD
from runtime.zenoh.key_expressions import PREFIX, alive_key, key_chunk
from support.log_limit import ReportLimit

if TYPE_CHECKING:
    import zenoh

PATIENCE = 0.5  # s to detect others that start at the same moment
MEETING = 5.0  # s to meet the processes of this computer, which takes longer where the computer is busy
SILENT = 1.0  # s after which the reason for waiting is reported
MOMENT = 0.01  # s
DAEMON = 1  # the bit of entity 0
STARTING, RUNNING = "starting", "running"
MOST_OTHERS = 256
ELSEWHERE = "192.0.2.1", 9  # an unassigned address (RFC 5737)

logger: logging.Logger = logging.getLogger("shoal.zenoh")


@dataclass(frozen=True, slots=True)
class ProcessPart:
    """The part of a vehicle that a process runs: its entities as the bits of a number.

    `process` names the process: "main", or the one of a section's `Process`. Each has a Daemon, but the main one speaks
    for the vehicle: only its number has the bit DAEMON.
    """

    vehicle: str
    system: int
    entities: int
    process: str = "main"


@dataclass(frozen=True, slots=True)
class SiblingProcess:
    """Another process of the same vehicle, by its token."""

    phase: str
    began: int  # ns since 1970
    host: str
    process: str
    zid: str
    entities: int

    @property
    def place(self) -> str:
        """The computer and the process in which it runs, for people."""
        return f"on {_computer(self.host)}, process {self.process}"

    @property
    def place_and_start(self) -> str:
        """The computer on which it runs, and the start."""
        try:
            began = datetime.fromtimestamp(self.began / 1e9, UTC).strftime("%Y-%m-%d %H:%M:%S")
        except (OverflowError, ValueError, OSError):
            began = "an unknown time"
        return f"{self.place}, since {began} UTC"


def siblings_expression(vehicle: str) -> str:
    return f"{PREFIX}/{key_chunk(vehicle)}/@run/**"


def liveliness_token(part: ProcessPart, phase: str, began: int, zid: str) -> str:
    place = f"{phase}/{began:x}/{key_chunk(local_host_identifier())}/{os.getpid()}/{zid}/{part.entities:x}"
    return f"{PREFIX}/{key_chunk(part.vehicle)}/@run/{place}"


def local_host_identifier() -> str:
    """The name of this computer, and after a ~ its address on the network, if it has one."""
    return "~".join(filter(None, [socket.gethostname(), _address()]))


def describe_local_host() -> str:
    """This computer, as people read it."""
    return _computer(key_chunk(local_host_identifier()))


def _address() -> str:
    """Address of the interface with a default route, else of the first one that is up."""
    first = (each.address for each in interfaces() if not each.is_loopback)
    return source_address(*ELSEWHERE) or next(first, "")


def parse_token(key: str) -> SiblingProcess | None:
    """The process of a token; None if it is none of ours."""
    try:
        phase, began, host, process, zid, entities = key.split("/@run/")[1].split("/")
        return SiblingProcess(phase, int(began, 16), host, process, zid, int(entities, 16))
    except (IndexError, ValueError):
        return None


class Presence:
    """Announces a part of a vehicle, and tracks the other processes of this vehicle.

    `siblings` are the sessions (zenoh ids) that run other parts. `warn` gets a warning if a process with the same part
    appears later, for example because two networks were joined. `note` gets the name of a process of the vehicle, and
    whether it has appeared or gone.
    """

    def __init__(
        self,
        session: "zenoh.Session",
        part: ProcessPart,
        warn: Callable[[str], None],
        note: Callable[[str, bool], None] | None,
    ) -> None:
        import zenoh

        self._part = part
        self._zid = str(session.info.zid())
        self._began = time.time_ns()
        self._warn = warn
        self._session = session
        self._others: dict[str, SiblingProcess] = {}
        self._changed = threading.Condition()
        self._accepted = self._has_reported = False
        self._twins = ReportLimit(REPORT_PERIOD)
        self._on_process = note
        self._watching: Any = None
        self._alive: Any = None
        self.siblings: frozenset[str] = frozenset()
        liveliness = session.liveliness()
        self._token: Any = liveliness.declare_token(liveliness_token(part, STARTING, self._began, self._zid))
        listen: Any = liveliness.declare_subscriber
        handler = zenoh.handlers.Callback(self._note, indirect=False)
        self._subscriber: Any = listen(siblings_expression(part.vehicle), handler, history=True)

    def check_unique(self, neighbors: Collection[str]) -> None:
        """Raise ConnectionError if another process runs this part; else it is ours from now on.

        Of two that start at the same moment the one that began first stays. `neighbors` are the endpoints of the
        processes of this computer, which have to be asked.
        """
        import zenoh

        self._ask(neighbors)
        with self._changed:
            self._changed.wait_for(lambda: self._elder() is not None, PATIENCE)
            elder = self._elder()
            self._accepted = elder is None
        if elder is not None:
            advice = "end one, or give it another name (-V)"
            if elder.entities & self._part.entities == DAEMON:
                advice = "tasks beside it need a Process in their sections, and --process"
            raise ConnectionError(
                f"{self._part.vehicle} already runs on this network: {elder.place_and_start}; "
                f"this is {describe_local_host()}: {advice}"
            )
        starting = self._token
        liveliness = self._session.liveliness()
        self._token = liveliness.declare_token(liveliness_token(self._part, RUNNING, self._began, self._zid))
        starting.undeclare()
        self._alive = liveliness.declare_token(alive_key(self._part.vehicle, self._part.system, self._part.process))
        if self._on_process is not None:
            listen: Any = liveliness.declare_subscriber
            processes = alive_key(self._part.vehicle, self._part.system, "*")
            self._watching = listen(
                processes, zenoh.handlers.Callback(self._note_process, indirect=False), history=True
            )

    def close(self) -> None:
        if self._alive is not None:
            self._alive.undeclare()
        self._subscriber.undeclare()
        if self._watching is not None:
            self._watching.undeclare()
        self._token.undeclare()

    def _ask(self, neighbors: Collection[str]) -> None:
        """Take the tokens of those who are there, as soon as we are connected to all neighbors."""
        import zenoh

        deadline = time.monotonic() + MEETING
        while self._unmet(neighbors) and self._wait(deadline):
            pass
        replies: Any = self._session.liveliness().get(siblings_expression(self._part.vehicle), timeout=MEETING)
        with contextlib.suppress(zenoh.ZError):  # all have answered
            while (reply := replies.try_recv()) is not None or self._wait(deadline):
                if reply is not None and reply.ok is not None:
                    self._note(reply.ok)

    def _unmet(self, neighbors: Collection[str]) -> bool:
        session: Any = self._session
        return not {str(link.dst) for link in session.info.links()}.issuperset(neighbors)

    def _wait(self, deadline: float) -> bool:
        """Wait a moment, and report the reason once; whether the deadline is still to come."""
        left = deadline - time.monotonic()
        if left < MEETING - SILENT and not self._has_reported:
            self._has_reported = True
            logger.warning(
                "zenoh: a process on this computer's bus does not answer (stopped, or very busy); "
                "waiting up to %g s for it, in case it already runs %s",
                MEETING,
                self._part.vehicle,
            )
        time.sleep(MOMENT)
        return left > 0.0

    def _elder(self) -> SiblingProcess | None:
        mine = self._began, self._zid
        for other in self._others.values():
            if other.entities & self._part.entities and (other.phase == RUNNING or (other.began, other.zid) < mine):
                return other
        return None

    def _note_process(self, sample: "zenoh.Sample") -> None:
        import zenoh

        name = str(sample.key_expr).rpartition("/")[2]
        if self._on_process is not None and name != self._part.process:
            self._on_process(name, cast(Any, sample).kind == zenoh.SampleKind.PUT)

    def _note(self, sample: "zenoh.Sample") -> None:
        """A token has appeared or gone; called from zenoh's thread."""
        import zenoh

        key = str(sample.key_expr)
        other = parse_token(key)
        if other is None or other.zid == self._zid:
            return
        with self._changed:
            if sample.kind == zenoh.SampleKind.DELETE:
                self._others.pop(key, None)
            elif len(self._others) < MOST_OTHERS:
                self._others[key] = other
            parts = [o for o in self._others.values() if not o.entities & self._part.entities]
            self.siblings = frozenset(o.zid for o in parts)
            self._changed.notify_all()
            is_twin = cast(Any, sample).kind == zenoh.SampleKind.PUT and other.entities & self._part.entities
            twins = sum(o.phase == RUNNING and bool(o.entities & self._part.entities) for o in self._others.values())
        if self._accepted and is_twin and other.phase == RUNNING and self._twins.is_due(now=time.monotonic()):
            more = f", and in {twins - 1} more processes" if twins > 1 else ""
            self._warn(
                f"{self._part.vehicle} also runs {other.place_and_start}{more}; its packets are ignored here. "
                "End one of them"
            )


def _computer(host: str) -> str:
    """A computer as people read it, of the chunk of a token."""
    name, _, address = host.partition("~")
    return f"{name} ({address})" if address else name
