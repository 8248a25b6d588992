"""UDP links to ground stations, which the vehicle calls or waits for."""

import ipaddress
import socket
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from mavlink import FLAVOURS, LONGEST_DATAGRAM, Flavour, text
from runtime.problem import suggestion
from tasks.transports.mavlink_protocol.session import DATAGRAM_BURST, DATAGRAMS_PER_SECOND, Session

Address = tuple[str, int]
AT_ONCE = 32
SCHEMES = ("udpout", "udpin")
MOST_NAMED = 64
OTHERS = ("others", 0)


@dataclass(frozen=True, slots=True)
class Route:
    """One link in a profile: if `listens`, the vehicle waits for ground stations, else it calls one."""

    text: str
    listens: bool
    address: Address
    flavour: Flavour

    @property
    def is_local(self) -> bool:
        """Whether only programs of this computer can use the link."""
        return ipaddress.IPv4Address(self.address[0]).is_loopback


def parse_route(text: str) -> Route:
    """Parses a link such as "udpout:127.0.0.1:14550:ardupilot". Raises ValueError with the reason."""
    parts = text.strip().split(":")
    if len(parts) == 4 and parts[0] not in SCHEMES:
        raise ValueError(f"{text!r}: {parts[0]!r} is not a scheme; {suggestion(parts[0], SCHEMES)}")
    if len(parts) != 4:
        raise ValueError(f"{text!r} is not udpout:ADDRESS:PORT:FLAVOR or udpin:ADDRESS:PORT:FLAVOR")
    scheme, host, port, flavour = parts
    host = "127.0.0.1" if host == "localhost" else host
    try:
        ipaddress.IPv4Address(host)
    except ValueError:
        raise ValueError(f"{text!r}: {host!r} is not an IPv4 address") from None
    if not (port.isascii() and port.isdecimal() and 0 < int(port) < 65536):
        raise ValueError(f"{text!r}: {port!r} is not a port (1 to 65535)")
    if flavour not in FLAVOURS:
        raise ValueError(f"{text!r}: {flavour!r} is not a flavor; {suggestion(flavour, FLAVOURS)}")
    return Route(text.strip(), scheme == "udpin", (host, int(port)), FLAVOURS[flavour])


class Link:
    """An open link and the sessions on it; `meet(flavour, transmit)` makes a new one.

    A link that listens has at most `peers` sessions. Frames that cannot be sent are counted in `counts`, datagrams of
    those who send too many in `dropped`. `speed` is that of the vehicle's clock. Raises OSError if the address cannot
    be used.
    """

    def __init__(
        self,
        route: Route,
        meet: Callable[[Flavour, Callable[[bytes], object]], Session],
        *,
        peers: int,
        counts: Counter[str],
        speed: float = 1.0,
    ):
        self.route = route
        self.sessions: dict[Address, Session] = {}
        self.dropped: Counter[Address] = Counter()
        self._strangers = text.Tap(DATAGRAMS_PER_SECOND / speed, DATAGRAM_BURST, 0.0)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._meet = meet
        self._peers = peers
        self._counts = counts
        try:
            self.socket.setblocking(False)
            if route.listens:
                self.socket.bind(route.address)
            else:
                self.socket.connect(route.address)
                self.session(route.address)
        except OSError:
            self.socket.close()
            raise

    def datagrams(self) -> Iterator[tuple[Address, bytes]]:
        """The datagrams that have arrived, AT_ONCE at most, and their sources."""
        for _ in range(AT_ONCE):
            try:
                data, source = self.socket.recvfrom(LONGEST_DATAGRAM)
            except BlockingIOError:
                return
            except OSError:
                continue  # an earlier frame was refused: nobody listens there
            yield source, data

    def admits(self, peer: Address, now: float) -> bool:
        """Whether to read a datagram of a peer; all who have no session share one limit."""
        session = self.sessions.get(peer)
        if (session.admit if session is not None else self._strangers).take(now):
            return True
        self.dropped[peer if peer in self.dropped or len(self.dropped) < MOST_NAMED else OTHERS] += 1
        return False

    def excess(self) -> str:
        """Who has sent too much since the last call, for people; empty if nobody."""
        worst = self.dropped.most_common(3)
        rest = len(self.dropped) - len(worst)
        self.dropped.clear()
        named = ", ".join(f"{number} of {host}:{port}" for (host, port), number in worst)
        return named + (f" and those of {rest} more" if rest else "")

    def session(self, peer: Address) -> Session | None:
        """The session with a peer, a new one if needed; None if the link is full."""
        found = self.sessions.get(peer)
        if found is None and (not self.route.listens or len(self.sessions) < self._peers):
            found = self.sessions[peer] = self._meet(self.route.flavour, lambda frame: self._send(frame, peer))
        return found

    def forget_silent(self, since: float) -> None:
        """Forget peers that have been silent since a time (s since 1970); the peer of a udpout link is kept."""
        for peer, session in list(self.sessions.items()):
            if session.heard_at < since:
                session.lose()
                if self.route.listens:
                    del self.sessions[peer]

    def close(self) -> None:
        self.socket.close()

    def _send(self, frame: bytes, peer: Address) -> None:
        try:
            if self.route.listens:
                self.socket.sendto(frame, peer)
            else:
                self.socket.send(frame)
        except ConnectionRefusedError:
            pass  # no ground station yet
        except OSError:
            self._counts["unsent"] += 1
