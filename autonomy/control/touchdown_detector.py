"""Detects that a multirotor stands on the ground."""

import math

from autonomy.control.multirotor_tilt_and_thrust import GRAVITY
from autonomy.control.power_dips import IDLE, SUPPORT, PowerDips

DESCENDS = 0.05  # m/s; a slower descent is none
STILL, UNLOADED, RESTS = 0.3, 0.75, 1.0  # share of the descent, share of the weight, s: what counts as a touchdown
BRIEFLY = 0.4  # s, between two losses of power
LEVEL, WAIT = 1.0, 1.5  # m, s: see `lies`
SPEED_NOISE, FASTEST = 0.05, 0.25  # m/s; what is slower stands, what is faster does not


class TouchdownDetector:
    """The vehicle should descend but does not, and its rotors carry less than three quarters of the weight for 1 s.

    Where its power fails again and again (`dips`), 0.4 s are enough, or that it feels its weight while its rotors do
    not carry it.
    """

    def __init__(self, dips: PowerDips) -> None:
        self._dips = dips
        self.reset()

    def reset(self) -> None:
        """Start over."""
        self._unloaded = self._idle = math.inf
        self._level: float | None = None

    def update(self, now: float, descent: float, vz: float | None, share: float, force: float | None = None) -> bool:
        """Whether the vehicle stands at a time (s).

        Desired and measured descent are in m/s, the thrust is a `share` of the weight, `force` (m/s²) is the specific
        force upward in the last tenth of a second; None is what is not measured.
        """
        still = vz is not None and abs(vz) < min(FASTEST, max(SPEED_NOISE, STILL * descent))
        rests = descent > DESCENDS and still and share < UNLOADED
        self._unloaded = min(self._unloaded, now) if rests else math.inf
        carried = self._dips.stands(now, force, share)
        return carried or now - self._unloaded >= (BRIEFLY if self._dips.has_repeated(now) else RESTS)

    def lies(self, now: float, share: float, height: float | None, force: float | None) -> bool:
        """Whether something else carries it: rotors that carry a smaller `share` of the weight would let it fall.

        Then the `height` (m) stays for a while, and the specific `force` (m/s²) upward is that of gravity. None is what
        is not measured; one of both is needed.
        """
        known = height is not None or force is not None
        carried = force is None or abs(force - GRAVITY) < SUPPORT * GRAVITY
        if not (share < IDLE and known and carried):
            self._idle = math.inf
            return False
        moved = height is not None and self._level is not None and abs(height - self._level) > LEVEL
        if moved or not self._idle < math.inf:
            self._idle, self._level = now, height
        return now - self._idle >= WAIT
