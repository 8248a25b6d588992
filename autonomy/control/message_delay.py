"""The delay of messages whose sender has a clock of its own."""

import math

DRIFT = 1e-4  # s/s, by which the clocks of two computers may differ in rate


class MessageDelay:
    """The delays of messages of one sender, beyond that of the fastest one."""

    def __init__(self) -> None:
        self._least, self._received_at = math.inf, -math.inf

    def receive(self, now: float, sent: float) -> float:
        """The delay (s) of a message that was sent at a time (s) of the sender's clock, beyond the least delay.

        A sender that is set back by an hour is an hour late until it begins anew.
        """
        difference = now - sent
        self._least = min(self._least + DRIFT * (now - self._received_at), difference)
        self._received_at = now
        return difference - self._least
