"""Limits of altitude and speed of a multirotor."""

import math
from dataclasses import dataclass

import imc

Bits = imc.OpLimitsMask


def ground_z(state: imc.EstimatedState) -> float:
    """The ground, m below the reference."""
    return state.z + max(0.0, state.alt)


@dataclass(frozen=True)
class MultirotorLimits:
    """Limits of altitude (m above ground) and the highest speed (m/s); `lowest` 0 is no limit."""

    lowest: float = 0.0
    highest: float = math.inf
    speed: float = math.inf

    @classmethod
    def from_message(cls, limits: imc.OperationalLimits) -> "MultirotorLimits | None":
        """The limits in a message; None if one is negative or not a number."""
        lowest = limits.min_altitude if limits.mask & Bits.MIN_ALT else 0.0
        highest = limits.max_altitude if limits.mask & Bits.MAX_ALT else math.inf
        speed = limits.max_speed if limits.mask & Bits.MAX_SPEED else math.inf
        return cls(lowest, highest, speed) if all(value >= 0.0 for value in (lowest, highest, speed)) else None

    def limit_height(self, down: float, state: imc.EstimatedState, margin: float) -> float:
        """A height (m below the reference), kept `margin` (m) away from the limits of altitude."""
        limited = max(down, ground_z(state) - max(0.0, self.highest - margin))
        return min(limited, ground_z(state) - self.lowest - margin) if self.lowest else limited
