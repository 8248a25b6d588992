"""Dynamics of a boat in surge, sway and yaw: propellers, rudders, drag, current and wind."""

import functools
import math
from collections.abc import Callable, Sequence

from support.rotations import Vector, wrap
from world.bodies.auv import LIMIT, DivergedError
from world.bodies.boat_model import BoatModel

WATER = 1025.0  # kg/m³
AIR = 1.225  # kg/m³
FULL_RUDDER = 0.7854  # rad, 45 degrees
STALL = 0.5736  # sine of 35 degrees
# Nodes and weights of Gauss-Legendre quadrature with four points on -1 to 1.
GAUSS = (
    (-0.8611363115940526, 0.3478548451374538),
    (-0.3399810435848563, 0.6521451548625461),
    (0.3399810435848563, 0.6521451548625461),
    (0.8611363115940526, 0.3478548451374538),
)

Rates = tuple[float, float, float]
Acceleration = Callable[[float, float, float, Sequence[float], Sequence[float], float, float], Rates]


class Boat:
    """A boat on the water. All attributes belong to the same instant; `step` advances them.

    `x`, `y` are m north and east; `u`, `v` m/s through the water and `r` rad/s in the body frame; `stream` is the
    velocity of the water and `wind` that of the air in m/s north and east. There is no heave, roll or pitch: `z`, `w`,
    `p` and `q` stay 0; `motion_in_waves` adds those of waves. Integrated with the midpoint rule.

    The equations are Fossen's maneuvering model with cross-flow drag and wind (Handbook of Marine Craft Hydrodynamics
    and Motion Control, 2011, ch. 6.4, 6.5 and 8.1). The normal force of a rudder is that of the MMG model with Fujii's
    slope (Yasukawa and Yoshimura, J. Mar. Sci. Technol. 20, 2015); its inflow follows from the propeller's thrust by
    momentum theory. Hull and rudder do not interact.
    """

    def __init__(self, model: BoatModel):
        self.model = model
        self.x: float = 0.0
        self.y: float = 0.0
        self.z: float = 0.0
        self.u: float = 0.0
        self.v: float = 0.0
        self.w: float = 0.0
        self.p: float = 0.0
        self.q: float = 0.0
        self.r: float = 0.0
        self.stream: Vector = (0.0, 0.0, 0.0)
        self.wind: tuple[float, float] = (0.0, 0.0)
        self.deflections: list[float] = [0.0] * len(model.rudders)
        self.actuations: list[float] = [0.0] * len(model.engines)
        self._speeds = [0.0] * len(model.engines)
        self._psi = 0.0

    def set_attitude(self, phi: float, theta: float, psi: float) -> None:
        """Set the heading (rad); roll and pitch stay 0."""
        self._psi = wrap(psi)

    def euler_angles(self) -> Vector:
        """Roll, pitch and yaw (rad)."""
        return 0.0, 0.0, self._psi

    def set_deflection(self, fin: int, angle: float) -> None:
        """Set a rudder to an angle (rad), limited to 45 degrees; a positive one turns the boat to port.

        Raises IndexError if there is no such rudder.
        """
        self.deflections[fin] = max(-FULL_RUDDER, min(FULL_RUDDER, angle))

    def set_actuation(self, engine: int, actuation: float) -> None:
        """Set an engine to a share of its full speed, -1 to 1. Raises IndexError if there is no such engine."""
        self.actuations[engine] = max(-1.0, min(1.0, actuation))

    @property
    def draft(self) -> float:
        """Depth of the lowest point of the hull (m)."""
        return self.model.cross_flow[1]

    @property
    def ground_velocity(self) -> Vector:
        """Velocity over ground (m/s; north, east, down)."""
        c, s, (north, east, _) = math.cos(self._psi), math.sin(self._psi), self.stream
        return c * self.u - s * self.v + north, s * self.u + c * self.v + east, 0.0

    @ground_velocity.setter
    def ground_velocity(self, velocity: Vector) -> None:
        c, s = math.cos(self._psi), math.sin(self._psi)
        north, east = velocity[0] - self.stream[0], velocity[1] - self.stream[1]
        self.u, self.v = c * north + s * east, c * east - s * north

    def step(self, h: float) -> None:
        """Advance by `h` s. Raises DivergedError."""
        half, psi = 0.5 * h, self._psi
        u, v, r = self.u, self.v, self.r
        north, east, _ = self.stream
        air_north, air_east = self.wind[0] - north, self.wind[1] - east
        self._spin(half)
        accelerate, rudders, speeds = _accelerations(self.model), self.deflections, self._speeds
        c, s = math.cos(psi), math.sin(psi)
        ahead, aside = c * air_north + s * air_east, c * air_east - s * air_north
        du, dv, dr = accelerate(u, v, r, rudders, speeds, ahead, aside)
        um, vm, rm = u + half * du, v + half * dv, r + half * dr
        middle = psi + half * r
        c, s = math.cos(middle), math.sin(middle)
        ahead, aside = c * air_north + s * air_east, c * air_east - s * air_north
        du, dv, dr = accelerate(um, vm, rm, rudders, speeds, ahead, aside)
        self._spin(half)
        self.u, self.v, self.r = u + h * du, v + h * dv, r + h * dr
        if not abs(self.u) + abs(self.v) + abs(self.r) < LIMIT:
            raise DivergedError(f"at {u:.3g}, {v:.3g} m/s, {r:.3g} rad/s")
        self.x += h * (c * um - s * vm + north)
        self.y += h * (s * um + c * vm + east)
        self._psi = wrap(psi + half * (r + self.r))

    def _spin(self, h: float) -> None:
        """Let the engines follow their actuations for `h` s."""
        for i, engine in enumerate(self.model.engines):
            wanted = self.actuations[i] * engine.full_speed
            left = math.exp(-h / engine.lag) if engine.lag else 0.0
            self._speeds[i] = wanted + (self._speeds[i] - wanted) * left


@functools.lru_cache(maxsize=64)
def _accelerations(model: BoatModel) -> Acceleration:
    """A function of velocities, rudders, engine speeds and air that returns the accelerations of surge, sway and yaw.

    It binds all numbers of the model as closure variables, which Python reads as fast as local ones.
    """
    mass, center = model.mass, model.center
    xud, yvd, nrd, yrd = model.added_mass
    m_u, m_v, m_r, m_vr = mass - xud, mass - yvd, model.inertia - nrd, mass * center - yrd
    determinant = m_v * m_r - m_vr * m_vr
    xu, yv, nr, yr, nv = model.linear
    xuu, yvv, nrr, yrr, nvv = model.quadratic
    yuv, yur, nuv, nur = model.lift
    yur -= m_u
    nur -= mass * center
    if model.munk:
        nuv, nur = nuv + yvd - xud, nur + yrd
    length, draft, drag = model.cross_flow
    strips = tuple(
        (0.5 * length * at, 0.25 * WATER * draft * drag * length * weight) for at, weight in GAUSS if drag * length
    )
    frontal, lateral, long, cx, cy, cn = model.wind
    wind_x, wind_y, wind_n = 0.5 * AIR * cx * frontal, 0.5 * AIR * cy * lateral, AIR * cn * lateral * long
    engines = tuple(
        (
            engine.gain,
            engine.loss,
            engine.reverse_factor,
            math.cos(engine.angle),
            math.sin(engine.angle),
            engine.x * math.sin(engine.angle) - engine.y * math.cos(engine.angle),
        )
        for engine in model.engines
    )
    rudders = tuple(
        (
            0.5 * WATER * part.area * 6.13 * part.aspect_ratio / (part.aspect_ratio + 2.25),
            part.x,
            part.y,
            8.0 * part.slipstream_share / (math.pi * WATER * part.propeller_diameter**2),
        )
        for part in model.rudders
    )
    aired = any(model.wind)

    def accelerate(
        u: float, v: float, r: float, angles: Sequence[float], speeds: Sequence[float], ahead: float, aside: float
    ) -> Rates:
        su, sv, sr = abs(u), abs(v), abs(r)
        x = (xu + xuu * su) * u + (m_v * v + m_vr * r) * r
        y = (yv + yvv * sv + yuv * u) * v + (yr + yrr * sr + yur * u) * r
        n = (nr + nrr * sr + nur * u) * r + (nv + nvv * sv + nuv * u) * v
        for at, factor in strips:
            across = v + at * r
            force = factor * across * abs(across)
            y -= force
            n -= at * force
        thrusts: list[float] = []
        for speed, (gain, loss, reverse, fx, fy, arm) in zip(speeds, engines, strict=True):
            force = (gain * speed - loss * u) * abs(speed)
            force *= reverse if speed < 0.0 else 1.0
            thrusts.append(force)
            x += fx * force
            y += fy * force
            n += arm * force
        for i, (factor, at, offset, stream) in enumerate(rudders):
            along, across = u - r * offset, v + r * at
            if stream and along >= 0.0 and thrusts[i] > 0.0:
                along = math.sqrt(along * along + stream * thrusts[i])
            speed = math.hypot(along, across)
            sine, cosine = math.sin(angles[i]), math.cos(angles[i])
            attack = sine * along - cosine * across  # its sine, times the speed
            limit = STALL * speed
            force = factor * speed * (-limit if attack < -limit else limit if attack > limit else attack)
            x -= force * sine
            y += force * cosine
            n += force * (at * cosine + offset * sine)
        if aired:
            forward, sideways = u - ahead, v - aside
            total = math.hypot(forward, sideways)
            x -= wind_x * total * forward
            y -= wind_y * total * sideways
            n -= wind_n * forward * sideways
        return x / m_u, (m_r * y - m_vr * n) / determinant, (m_v * n - m_vr * y) / determinant

    return accelerate
