"""How two motors share what drives and what turns a boat."""

import math

Forces = tuple[float, float]  # at port and at starboard, shares of the full force of a motor ahead


def share_out(ahead: float, turning: float, highest: float, lowest: float, *, turn_first: bool = True) -> Forces:
    """Forces of both motors for a mean force and half of their difference, positive to starboard.

    No force is above `highest` or below minus `lowest`. Where one would be, the other side gives way with
    `turn_first`, so that the difference stays as far as it can; else the one is cut.
    """
    if turn_first:
        turning = max(-0.5 * (highest + lowest), min(0.5 * (highest + lowest), turning))
        ahead = max(abs(turning) - lowest, min(highest - abs(turning), ahead))
    port, starboard = (max(-lowest, min(highest, ahead + side * turning)) for side in (1.0, -1.0))
    return port, starboard


def actuations(forces: Forces, reverse: float) -> Forces:
    """Actuations of motors whose force grows with the square of their speed, and is `reverse` times as large astern."""
    port, starboard = (
        math.copysign(min(1.0, math.sqrt(abs(force) / (reverse if force < 0.0 else 1.0))), force) for force in forces
    )
    return port, starboard
