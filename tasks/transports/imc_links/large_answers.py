"""Answers that only who has asked for them needs, and that are too large for all consoles on a slow link."""

from collections.abc import Collection

import imc
from tasks.transports.imc_links.message_list import EVERYBODY

ASKED = 5.0  # s for which cameras obey a request for pictures
MOST_REQUESTS = 256  # of systems, to vehicles, that are kept


class LargeAnswers:
    """Decides which systems get pictures and log books: those that have asked. Times in s of the network."""

    ids: frozenset[int] = frozenset({imc.CompressedImage.ID, imc.LogBookControl.ID})
    """The types of messages that it decides about."""

    def __init__(self) -> None:
        self._requests: dict[tuple[int, int], float] = {}

    def on_request(self, request: imc.ImageTxSettings, now: float) -> None:
        """Note a request for pictures, for five seconds."""
        if len(self._requests) >= MOST_REQUESTS:
            self._requests = {pair: at for pair, at in self._requests.items() if 0.0 <= now - at <= ASKED}
        if len(self._requests) < MOST_REQUESTS or (request.src, request.dst) in self._requests:
            self._requests[request.src, request.dst] = now

    def receivers(self, answer: imc.Message, now: float) -> Collection[int] | None:
        """The systems that get a message of `ids`; None if all do."""
        if answer.dst not in EVERYBODY:
            return (answer.dst,)
        if not isinstance(answer, imc.CompressedImage):
            return None
        alive = [pair for pair, at in self._requests.items() if 0.0 <= now - at <= ASKED]
        return {system for system, vehicle in alive if vehicle == answer.src}
