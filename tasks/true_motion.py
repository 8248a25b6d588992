"""The true motion of a simulated body as a message."""

import imc
from imc.reserved_ids import UNADDRESSED
from support.rotations import Vector


def simulated_state(
    place: Vector,
    velocity: Vector,
    angles: Vector,
    rates: Vector,
    stream: Vector = (0.0, 0.0, 0.0),
    start: Vector = (0.0, 0.0, 0.0),
    timestamp: float = -1.0,
) -> imc.SimulatedState:
    """The true state of a body: place (m; north, east, down), velocity through the medium (m/s) and rates (rad/s) in
    the body frame, Euler angles (rad), the velocity of the medium (m/s; north, east, down),
    and the start, from which the place is measured (rad, rad, m).
    """
    return imc.SimulatedState(timestamp, *UNADDRESSED, *start, *place, *angles, *velocity, *rates, *stream)
