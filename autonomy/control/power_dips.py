"""Losses of a multirotor's power that last a moment, as in brown-outs: how long, and when the next may be."""

import math
from collections import deque

from autonomy.control.blind_descent import DESCENT
from autonomy.control.multirotor_tilt_and_thrust import GRAVITY

MEMORY = 30.0  # s; losses farther apart are not one fault
REMEMBERED = 4  # intervals between losses, of which the shortest counts
SETTLES = 15.0  # s after the last loss, in which a vehicle that nothing measures comes down from where it was
MISSED = 2.0  # intervals without a loss, after which none is expected
FORGOTTEN = MISSED * MEMORY  # s after the last loss, in which the fault counts: a later flight is one as usual
SPIN_UP = 0.05  # s of lift that the rotors need when power is back, more than they keep when it fails
GENTLE = 2.0  # m/s; the descent at the end of a loss, at most
FASTEST_RISE = 3.0  # m/s before a loss; what a longer one needs is more than rotors give in time
CHANGE, SPARE = 0.5 * GRAVITY, 0.2  # m/s², s: how fast the descent changes before a loss, and how much earlier
BRIEF = 0.15  # s; a command that gets as old may be that of a moment before a loss, with little thrust
LEAST_DESCENT = 0.4  # s between two losses in which it descends; with less it would never arrive
IDLE, SUPPORT = 0.6, 0.15  # share of the weight, of gravity: rotors that do not carry it, a force that the ground makes
SHOWS, SHOWS_UNPOWERED = 0.3, 0.15  # s; what is still carried after so long stands on the ground


class PowerDips:
    """Counts the fall without power, and expects the next loss after the shortest interval of the last ones.

    A loss of 0.3 s adds 3 m/s to the descent, so that the vehicle has to rise before one to be gentle at its end.
    """

    def __init__(self) -> None:
        self.powered: bool = True
        self._begins: deque[float] = deque(maxlen=REMEMBERED + 1)
        self._since = self._lost = self._longest = 0.0
        self._carried = math.inf

    def receive(self, now: float, *, powered: bool) -> bool:
        """Note whether there is power at a time (s); returns whether this has changed."""
        if powered == self.powered:
            return False
        self.powered = powered
        if powered:
            self._longest = max(self._longest, now - self._begins[-1])
            self._lost += now - self._since + SPIN_UP
        else:
            if self._begins and now - self._begins[-1] > MEMORY:
                self._begins.clear()
                self._longest = 0.0
            self._begins.append(now)
            self._carried = math.inf
        self._since = now
        return True

    def take_lost_time(self, now: float) -> float:
        """The time (s) without lift since the last call, until now (s)."""
        if not self.powered:
            self._lost += now - self._since
            self._since = now
        lost, self._lost = self._lost, 0.0
        return lost

    def has_repeated(self, now: float) -> bool:
        """Whether power has failed twice in half a minute, and this was not long ago."""
        return len(self._begins) > 1 and now - self._begins[-1] <= FORGOTTEN

    def state_timeout(self, now: float, usual: float) -> float:
        """Time (s) after which a state is missing and the vehicle descends without one; `usual` without losses."""
        return min(usual, BRIEF) if self.has_repeated(now) else usual

    def is_settled(self, now: float) -> bool:
        """Whether the last loss of power was long ago, so that the vehicle no longer falls and rises."""
        expects = MISSED * self._interval if self.has_repeated(now) else 0.0
        return not self._begins or now - self._begins[-1] > expects + SETTLES

    @property
    def _interval(self) -> float:
        """The shortest interval (s) of the last ones."""
        return min(after - before for before, after in zip(self._begins, list(self._begins)[1:], strict=False))

    def stands(self, now: float, force: float | None, share: float = 0.0) -> bool:
        """Whether something else carries it while the rotors do not: it still feels its weight (`force`, m/s²).

        The rotors do not without power and, where losses repeat, if their thrust is a small `share` of the weight.
        """
        lifts = self.powered and not (share < IDLE and self.has_repeated(now))
        if lifts or force is None or abs(force - GRAVITY) > SUPPORT * GRAVITY:
            self._carried = math.inf
            return False
        self._carried = min(self._carried, now)
        return now - self._carried >= (SHOWS if self.powered else SHOWS_UNPOWERED)

    def descent(self, now: float, usual: float = DESCENT) -> float:
        """The speed downward (m/s) to aim for at a time (s) in a descent, without losses the `usual` one."""
        urgent = self.urgent_descent(now)
        return usual if urgent is None else urgent

    def urgent_descent(self, now: float) -> float | None:
        """The same where the power fails again and again, else None.

        Before a loss that is expected it rises, if the rotors can change its speed so far in time.
        """
        if not self.has_repeated(now):
            return None
        interval, since = self._interval, now - self._begins[-1]
        least = GENTLE - GRAVITY * (self._longest + SPIN_UP)
        lead = (DESCENT - least) / CHANGE + SPARE
        possible = least >= -FASTEST_RISE and interval - self._longest - lead >= LEAST_DESCENT
        rests = self._carried < math.inf  # perhaps: it would lift off
        if rests or not possible or since > MISSED * interval:  # two losses at the same time have no interval
            return DESCENT
        return least if interval - since % interval < lead else DESCENT
