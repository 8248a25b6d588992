"""Detects that a multirotor stands on the ground."""

import math

DESCENDS = 0.05  # m/s; a slower descent is none
STILL, UNLOADED, RESTS = 0.3, 0.75, 1.0  # share of the descent, share of the weight, s: what counts as a touchdown
SPEED_NOISE, FASTEST = 0.05, 0.25  # m/s; what is slower stands, what is faster does not


class TouchdownDetector:
    """The vehicle should descend but does not, and its rotors carry less than three quarters of the weight for 1 s."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start over."""
        self._unloaded = math.inf

    def update(self, now: float, descent: float, vz: float, share: float) -> bool:
        """Whether it stands at a time (s).

        Desired and measured descent are in m/s, the thrust is a `share` of the weight.
        """
        still = abs(vz) < min(FASTEST, max(SPEED_NOISE, STILL * descent))
        rests = descent > DESCENDS and still and share < UNLOADED
        self._unloaded = min(self._unloaded, now) if rests else math.inf
        return now - self._unloaded >= RESTS
