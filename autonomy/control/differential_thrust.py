"""Splits thrust and turning between two motors of a boat."""

import math

Forces = tuple[float, float]  # port and starboard, as fractions of the full force ahead of one motor


def allocate_thrust(ahead: float, turning: float, highest: float, lowest: float, *, turn_first: bool = True) -> Forces:
    """Forces of both motors from their mean `ahead` and half of their difference `turning`, positive to starboard.

    Forces stay between -`lowest` and `highest`. At a limit, `turn_first` gives up mean force to keep the difference;
    without it the force at the limit is cut.
    """
    if turn_first:
        turning = max(-0.5 * (highest + lowest), min(0.5 * (highest + lowest), turning))
        ahead = max(abs(turning) - lowest, min(highest - abs(turning), ahead))
    port, starboard = (max(-lowest, min(highest, ahead + side * turning)) for side in (1.0, -1.0))
    return port, starboard


def forces_to_actuations(forces: Forces, reverse: float) -> Forces:
    """Actuations of motors whose force grows with the square of their speed, and is `reverse` times as large astern."""
    port, starboard = (
        math.copysign(min(1.0, math.sqrt(abs(force) / (reverse if force < 0.0 else 1.0))), force) for force in forces
    )
    return port, starboard
