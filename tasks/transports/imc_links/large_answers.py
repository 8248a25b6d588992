"""Answers that only who has asked for them needs, and that are too large for all consoles on a slow link."""

from collections.abc import Collection

import imc
from tasks.transports.imc_links.message_list import EVERYBODY

ASKED = 5.0  # s for which cameras obey a request for pictures
MOST_REQUESTS = 32  # of systems, to vehicles, that are kept of a peer
MOST_PEERS = 64


class LargeAnswers:
    """Decides which systems get pictures and log books: those that have asked. Times in s of the network.

    Systems are what a peer claims them to be, so that each peer has a limit of its own.
    """

    ids: frozenset[int] = frozenset({imc.CompressedImage.ID, imc.LogBookControl.ID})
    """The types of messages that it decides about."""

    def __init__(self) -> None:
        self._requests: dict[str, dict[tuple[int, int], float]] = {}  # the one that has asked last at the end, in both

    def on_request(self, request: imc.ImageTxSettings, now: float, peer: str = "") -> None:
        """Note a request for pictures, for five seconds; it came from the address `peer`, or over the bus."""
        requests = self._requests.pop(peer, {})
        if len(self._requests) >= MOST_PEERS:
            del self._requests[next(iter(self._requests))]
        self._requests[peer] = requests
        requests.pop((request.src, request.dst), None)
        if len(requests) >= MOST_REQUESTS:
            del requests[next(iter(requests))]
        requests[request.src, request.dst] = now

    def receivers(self, answer: imc.Message, now: float) -> Collection[int] | None:
        """The systems that get a message of `ids`; None if all do."""
        if answer.dst not in EVERYBODY:
            return (answer.dst,)
        if not isinstance(answer, imc.CompressedImage):
            return None
        pairs = (item for requests in self._requests.values() for item in requests.items())
        return {system for (system, vehicle), at in pairs if vehicle == answer.src and 0.0 <= now - at <= ASKED}
