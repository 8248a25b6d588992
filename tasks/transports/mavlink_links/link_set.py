"""All links of a vehicle: made from the profile, supervised, and summed up."""

from collections import Counter
from collections.abc import Iterable

from mavlink import parse_link_url
from mavlink.vehicle import DATAGRAMS_PER_SECOND, Session
from runtime import State
from support.log_limit import ReportLimit
from tasks.transports.mavlink_links.base_link import Link, LinkHost
from tasks.transports.mavlink_links.stream_links import StreamLink, TcpListenerLink
from tasks.transports.mavlink_links.udp_links import UdpLink

EXCESS_PERIOD = 10.0  # s
KINDS: dict[str, type[TcpListenerLink | StreamLink]] = {
    "tcpin": TcpListenerLink,
    "tcpout": StreamLink,
    "serial": StreamLink,
}


class LinkSet:
    """The links in `items`, which are opened when they are looked after. What is wrong with an item is logged."""

    def __init__(self, items: Iterable[str], host: LinkHost):
        self.links: list[Link] = []
        self._host = host
        self._wrong: list[str] = []
        self._excess = ReportLimit(EXCESS_PERIOD)
        for number, item in enumerate(dict.fromkeys(items)):
            try:
                url = parse_link_url(item)
            except ValueError as error:
                self._wrong.append(str(error))
                host.log.error(str(error))
            else:
                self.links.append(KINDS.get(url.scheme, UdpLink)(url, number, host))

    def sessions(self) -> list[Session]:
        """All sessions; a new list, since sending may end one."""
        return [session for link in self.links for session in link.sessions.values()]

    @property
    def drop_counts(self) -> Counter[str]:
        """Number of dropped packets, received or to be sent, by reason."""
        found: Counter[str] = Counter()
        for link in self.links:
            found.update(link.counts)
        return found

    def maintain_links(self, peer_timeout: float) -> None:
        """Forget peers silent for longer than a timeout (s), open what is not open, and name who sends too much."""
        for link in self.links:
            link.forget_silent(peer_timeout)
            link.maintain_link()
        if any(link.dropped for link in self.links) and self._excess.is_due(now=self._host.now):
            excess = ", ".join(words for link in self.links if (words := link.summarize_excess_senders()))
            limit = f"a station may send {DATAGRAMS_PER_SECOND:g} per second"
            self._host.log.warning(f"frames dropped, {limit}: {excess}")

    def state(self, trouble: str = "") -> tuple[State, str]:
        """State with faults, peers in contact, and counters; `trouble` is another fault of the links."""
        troubles = [*self._wrong, *filter(None, (link.trouble.reason for link in self.links))]
        works = len(troubles) < len(self._wrong) + len(self.links)
        troubles = [trouble, *troubles] if trouble else troubles
        peers = sum(session.contact for session in self.sessions())  # integers
        statistics = filter(None, (link.statistics_text() for link in self.links))
        state = State.NORMAL if not troubles else State.FAULT if works else State.ERROR
        return state, "; ".join([*troubles, f"{peers} in contact", *statistics])

    def close(self) -> None:
        for link in self.links:
            link.close()
        self.links = []
