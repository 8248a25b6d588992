"""Links: what datagrams and streams of bytes have in common, from the frames that arrive to the sessions."""

import errno
import os
from collections import Counter
from collections.abc import Callable
from typing import Any, Protocol

from imc.console_acl import ConsoleAcl
from mavlink import UNSIGNED, LinkUrl, ReceivedMessage, Signing, StreamSplitter, split
from mavlink.vehicle import DATAGRAM_BURST, DATAGRAMS_PER_SECOND, Session, VehicleEndpoint
from runtime.bus import DropCounter
from runtime.devices import DeviceOwner
from support.log_limit import ReportLimit, Trouble
from support.token_bucket import TokenBucket
from tasks.transports.mavlink_links.signing_keys import SigningKeys

Peer = tuple[Any, ...]
"""The address of a peer: of a socket, or the device of a serial line."""

LARGE = 256.0  # bytes that cost as much as a message
OTHERS = ("others", 0)
PORTS_TRIED = 10  # from that of a link on
SILENCE = 5.0  # s after which a station may have to make room for another


class LinkHost(DeviceOwner, Protocol):
    """Interface of a task for its links; `clock_speed` is that of its clock."""

    maximum_peers: int
    clock_speed: float
    endpoint: VehicleEndpoint
    commanders: ConsoleAcl
    keys: SigningKeys

    @property
    def now(self) -> float: ...

    def age(self, time: float) -> float:
        """Seconds since a time (s since 1970) in which the process could receive something."""
        ...

    def connect_peer(
        self, link: "Link", transmit: Callable[[bytes], object], takes_more: Callable[[], bool]
    ) -> Session:
        """A session with a new peer."""
        ...

    def receive(self, link: "Link", peer: Peer, message: ReceivedMessage) -> None:
        """Obey a message."""
        ...


class Link:
    """A way to ground stations, and the sessions on it. Subclasses open it, pass on what arrives, and send frames.

    `number` counts the links of the vehicle. What is not taken is counted in `counts`; `dropped` has those who send too
    much. While the link cannot be used, `trouble` has the reason.
    """

    def __init__(self, url: LinkUrl, number: int, host: LinkHost):
        self.url = url
        self.sessions: dict[Peer, Session] = {}
        self.counts: Counter[str] = Counter()
        self.dropped: DropCounter[Peer] = DropCounter[Peer](OTHERS)
        self.trouble: Trouble = Trouble()
        self.signing: Signing | None = None
        self.is_open = False
        self._number = number
        self._host = host
        self._warned = False
        self._named = ReportLimit()
        self._strangers = TokenBucket(DATAGRAMS_PER_SECOND / host.clock_speed, DATAGRAM_BURST)

    def open(self) -> None:
        """Open it; if that fails, the reason is logged once, and it may be called again."""
        url = self.url
        try:
            self.signing = self._host.keys.signing(url.key) if url.key else None
            self._open()
        except (ValueError, OSError) as error:
            self.log_failure(error)
            return
        self.is_open: bool = True
        if not (self._warned or url.is_local or url.requires_signing):
            self._warned = True
            unsigned = "unsigned frames are accepted here" if url.key else "MAVLink is not signed here"
            self._host.log.warning(f"{self.url.text}: {unsigned}; {self._host.commanders.risk}")

    def _open(self) -> None:
        """Open what is below. Raises OSError."""
        raise NotImplementedError

    def close(self) -> None:
        raise NotImplementedError

    def send(self, frame: bytes, peer: Peer) -> None:
        """Send a frame, without waiting; what cannot be sent is counted."""
        raise NotImplementedError

    def maintain_link(self) -> None:
        """Called once a second."""
        if not self.is_open:
            self.open()

    def listen(self, bind: Callable[[int], None]) -> None:
        """Bind to the port of the link or, if it is taken, as by another vehicle, to the next free one. Raises OSError.

        `url` then has this port.
        """
        wanted = self.url
        for port in range(wanted.port, min(wanted.port + PORTS_TRIED, 65536)):
            try:
                bind(port)
            except OSError as error:
                if error.errno != errno.EADDRINUSE:
                    raise
                continue
            if port != wanted.port:
                self.url: LinkUrl = wanted.at_port(port)
                self._host.log.warning(f"{wanted.text} is taken: ground stations connect to {self.url.text}")
            return
        raise OSError(errno.EADDRINUSE, os.strerror(errno.EADDRINUSE))

    def log_failure(self, error: Exception) -> None:
        reason = f"{self.url.text}: {getattr(error, 'strerror', '') or error}"
        if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
            reason += f", as are the next {PORTS_TRIED - 1} ports; tried again, or change the port in Links"
        self.trouble.report(reason, self._host.log.error)

    def receive(self, peer: Peer, data: bytes, splitter: StreamSplitter | None = None) -> int | None:
        """Take a datagram, or what `splitter` has to split; returns the number of good messages.

        What exceeds the limit is not read: None. All who have no session share one limit.
        """
        session = self.sessions.get(peer)
        tap = self._strangers if session is None else session.bucket
        if not tap.try_acquire(self._host.now, max(1.0, len(data) / LARGE)):
            self._drop(peer, 1)
            return None
        found, damages = split(data, self._host.endpoint.dialect) if splitter is None else splitter.feed(data)
        self.counts["malformed"] += damages + (not data)
        return self.handle_messages(peer, found, tap)

    def handle_messages(self, peer: Peer, messages: list[ReceivedMessage], tap: TokenBucket) -> int:
        """Obey messages, except those that are not signed as they should be; returns how many there were."""
        good = 0
        for place, message in enumerate(messages):
            if not self.reaches(peer):
                break  # it went while it was answered
            if place and not tap.try_acquire(self._host.now):
                self._drop(peer, len(messages) - place)
                break
            fault = self.signing.reject_reason(message) if self.signing is not None else ""
            if fault and not (self.url.accepts_unsigned and fault == UNSIGNED):
                self.counts[fault] += 1
                continue
            good += 1
            self._host.receive(self, peer, message)
        return good

    def open_session(self, peer: Peer) -> Session | None:
        """The session with a peer, a new one if needed; None if the link is full."""
        found = self.sessions.get(peer)
        if found is None and (self.has_session_capacity() or self.make_room()):
            found = self._host.connect_peer(self, lambda frame: self.send(frame, peer), lambda: self.takes_more(peer))
            self.sessions[peer] = found
        return found

    def reaches(self, peer: Peer) -> bool:
        """Whether something can be sent to a peer."""
        return True

    def takes_more(self, peer: Peer) -> bool:
        """Whether what is sent to a peer now does not wait for what was sent before."""
        return True

    def has_session_capacity(self) -> bool:
        return len(self.sessions) < self._host.maximum_peers

    def make_room(self) -> bool:
        """Drop the peer that has been silent longest; False if all have sent lately."""
        peer, session = min(self.sessions.items(), key=lambda item: item[1].received_at)
        if self._host.age(session.received_at) < SILENCE * self._host.clock_speed:
            return False
        self.end_session(peer)
        return True

    def end_session(self, peer: Peer) -> None:
        """End the session with a peer."""
        session = self.sessions.pop(peer, None)
        if session is not None:
            self._host.endpoint.disconnect(session)

    def keeps_session(self, peer: Peer) -> bool:
        """Whether a peer that has been silent for long keeps its session."""
        return True

    def forget_silent(self, timeout: float) -> None:
        """End the contact with peers that have been silent for longer than a timeout (s)."""
        for peer, session in list(self.sessions.items()):
            if self._host.age(session.received_at) > timeout:
                if not self.keeps_session(peer):
                    self.end_session(peer)
                elif session.contact:
                    self._host.endpoint.end_contact(session)

    def reject(self, peer: Peer) -> None:
        """Count a rejected peer when the table is full, and log each computer once."""
        self.counts["rejected"] += 1
        full = f"has its {self._host.maximum_peers} stations"
        self.warn_once(str(peer[0]), f"{full}: {peer[0]} was rejected")

    def warn_once(self, who: str, words: str) -> None:
        if self._named.is_due(who):
            self._host.log.warning(f"{self.url.text} {words}")

    def summarize_excess_senders(self) -> str:
        """Senders of too much since the last call, for people; empty without any."""
        dropped = self.dropped.drain()
        worst = dropped.most_common(3)
        rest = len(dropped) - len(worst)
        named = ", ".join(f"{number} of {peer_name(peer)}" for peer, number in worst)
        return named + (f" and those of {rest} more" if rest else "")

    def statistics_text(self) -> str:
        """Counters, for people; empty if all are 0."""
        losses = sorted(
            (loss for session in self.sessions.values() for loss in session.received.sender_losses()),
            key=lambda loss: -loss.lost,
        )
        words = [f"{name} {count}" for name, count in sorted(self.counts.items()) if count]
        words += [f"lost {lost} of {sent} from {system}/{part}" for system, part, lost, sent in losses[:3]]
        return f"{self.url.text}: {', '.join(words)}" if words else ""

    @property
    def signer(self) -> Callable[[bytes], bytes] | None:
        return self.signing.signer(self._number) if self.signing is not None else None

    def _drop(self, peer: Peer, count: int) -> None:
        self.counts["dropped"] += count
        self.dropped.count(peer, count)


def peer_name(peer: Peer) -> str:
    """A peer, for people."""
    host, *port = peer[:2]
    return ":".join((f"[{host}]" if port and ":" in host else host, *map(str, port)))
