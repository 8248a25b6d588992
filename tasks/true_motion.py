"""The true motion of a simulated body as a message."""

import imc
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
    x, y, z = place
    u, v, w = velocity
    phi, theta, psi = angles
    p, q, r = rates
    svx, svy, svz = stream
    lat, lon, height = start
    return imc.SimulatedState(
        lat=lat, lon=lon, height=height, x=x, y=y, z=z, phi=phi, theta=theta, psi=psi, u=u, v=v, w=w, p=p, q=q, r=r,
        svx=svx, svy=svy, svz=svz, timestamp=timestamp,
    )  # fmt: skip
