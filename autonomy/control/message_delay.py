"""The delay of messages whose sender has a clock of its own."""

import math


class MessageDelay:
    """The delays of messages of one sender, beyond that of the fastest one."""

    def __init__(self) -> None:
        self._least = math.inf

    def receive(self, now: float, sent: float) -> float:
        """The delay (s) of a message that was sent at a time (s) of the sender's clock, beyond the least delay.

        A sender that is set back by an hour is an hour late until it begins anew.
        """
        difference = now - sent
        self._least = min(self._least, difference)
        return difference - self._least
