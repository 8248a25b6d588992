"""Detects that a multirotor stands on the ground."""

import math

from autonomy.control.multirotor_tilt_and_thrust import GRAVITY

DESCENDS = 0.05  # m/s; a slower descent is none
STILL, UNLOADED, RESTS = 0.25, 0.75, 1.0  # m/s, fraction of the weight, s: what counts as a touchdown


class TouchdownDetector:
    """The vehicle should descend but does not, and its rotors carry less than three quarters of the weight for 1 s."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start over."""
        self._unloaded = math.inf

    def update(self, now: float, descent: float, vz: float, thrust: float) -> bool:
        """Whether it stands at a time (s): desired and measured descent are in m/s, the specific thrust in m/s²."""
        rests = descent > DESCENDS and abs(vz) < STILL and thrust < UNLOADED * GRAVITY
        self._unloaded = min(self._unloaded, now) if rests else math.inf
        return now - self._unloaded >= RESTS
