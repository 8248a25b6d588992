"""Counts of lost and repeated frames of each sender, by their sequence numbers."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

from mavlink import ReceivedMessage
from support.duplicate_filter import DuplicateFilter

LATE = 128  # a number so far ahead, of 256, is one that is behind: a datagram was overtaken
MOST_SENDERS = 16
COPY_TIME = 0.5  # s in which the copy of a datagram may come
MOST_COPIED = 16
ONCE = frozenset(
    {
        *("COMMAND_LONG", "COMMAND_INT", "SET_MODE", "PARAM_SET", "PARAM_EXT_SET"),
        *("MISSION_COUNT", "MISSION_WRITE_PARTIAL_LIST", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT", "MISSION_ACK"),
    }
)
"""Messages that must not be obeyed twice: a copy of an older order could come after a newer one."""


class SenderLoss(NamedTuple):
    """A sender, and how many of its frames were lost, of how many."""

    system: int
    component: int
    lost: int
    sent: int


@dataclass(slots=True)
class _Sender:
    """The last number, the one of a frame that came late (-1: none), and the counts."""

    last: int
    late: int = -1
    received: int = 1
    lost: int = 0

    def count(self, number: int) -> None:
        ahead = (number - self.last) % 256
        if ahead == 0:
            return  # a copy
        self.received += 1
        if ahead < LATE:
            self.lost += ahead - 1
        elif number != (self.late + 1) % 256 or self.late < 0:
            self.late, self.lost = number, max(0, self.lost - 1)
            return
        self.last, self.late = number, -1  # two in a row that are late: the sender has begun anew


class SequenceTracker:
    """Received frames of one peer, behind which several senders may be.

    Frames of messages that the dialect lacks, and those that were dropped unread, count as lost. `speed` s pass here in
    one of the peer.
    """

    def __init__(self, speed: float = 1.0) -> None:
        self._senders: dict[tuple[int, int], _Sender] = {}
        self._orders = DuplicateFilter(MOST_COPIED, COPY_TIME * speed)

    def is_duplicate_order(self, message: ReceivedMessage, now: float) -> bool:
        """Whether the network has doubled a datagram with an order; who repeats an order counts on."""
        if message.name not in ONCE:
            return False
        what = message.system, message.component, message.sequence, message.name, message.content
        return self._orders.is_duplicate(what, now)

    def receive(self, message: ReceivedMessage) -> None:
        place = message.system, message.component
        sender = self._senders.get(place)
        if sender is not None:
            sender.count(message.sequence)
        elif len(self._senders) < MOST_SENDERS:
            self._senders[place] = _Sender(message.sequence)

    def has_losses(self, system: int, component: int) -> bool:
        """Whether frames of a sender have been lost."""
        sender = self._senders.get((system, component))
        return sender is not None and sender.lost > 0

    def sender_losses(self) -> Iterator[SenderLoss]:
        """The senders of which frames were lost."""
        for (system, component), sender in self._senders.items():
            if sender.lost:
                yield SenderLoss(system, component, sender.lost, sender.lost + sender.received)
