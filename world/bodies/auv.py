"""Dynamics of an underwater vehicle in six degrees: rigid body, added mass, drag, lift, buoyancy, fins, thrusters."""

import functools
import math
from collections.abc import Callable

from support.number_parsing import clamp_magnitude
from support.rotations import (
    Matrix,
    Quaternion,
    Vector,
    cross,
    euler_from_quaternion,
    quaternion_from_euler,
    rotation,
    to_body,
    to_ned,
)
from world.bodies.auv_model import FULL_DEFLECTION, MAXIMUM_TORQUE, Thruster, UnderwaterModel

GRAVITY = 9.80665
WATER = 1000.0  # kg/m³
LIMIT = 1e3  # m/s and rad/s; beyond it, the motion has diverged

Rates = tuple[float, float, float, float, float, float]
Lever = tuple[float, tuple[float, float, float, float, float] | None]
Thrust = tuple[float, float, float, tuple[float, float, float, float, float] | None]
Acceleration = Callable[[float, Quaternion, Rates, Rates, tuple[Thrust, ...]], Rates]


class DivergedError(ArithmeticError):
    """The motion diverged, so the numbers of the model must be wrong."""


class UnderwaterVehicle:
    """A vehicle in the water. All attributes belong to the same instant; `step` advances them.

    `x`, `y`, `z` are m north, east and down; `u`, `v`, `w` m/s through the water and `p`, `q`, `r` rad/s in the body
    frame; `stream` is the velocity of the water in m/s north, east and down. Attitude is a quaternion, so no pitch is
    singular. Integrated with the midpoint rule; at steps of 10 ms, the difference from fourth-order Runge-Kutta is
    below the resolution of any sensor.

    The equations are Fossen's (Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, ch. 6-8) with the
    simplifications under which the coefficients of the LAUV were identified: a diagonal inertia that may differ from
    mass plus added mass, a center of gravity as far below the origin as the center of buoyancy is above it, no surge
    force from buoyancy, a hull that surfaces as a level box, and fins and thrusters whose inflow is the total speed of
    the vehicle.
    """

    def __init__(self, model: UnderwaterModel):
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
        self.deflections: list[float] = [0.0] * len(model.fins)
        self.actuations: list[float] = [0.0] * len(model.engines)
        self._attitude: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._shares: list[Rates] = [(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)] * len(model.fins)  # of each fin in `_fins`
        self._fins: Rates | None = None  # the sum of these, until one moves
        self._thrusts: tuple[Thrust, ...] = ()
        self._levers = [_lever(engine) for engine in model.engines]

    def set_attitude(self, phi: float, theta: float, psi: float) -> None:
        """Set the attitude to these Euler angles (rad)."""
        self._attitude = quaternion_from_euler(phi, theta, psi)

    def euler_angles(self) -> Vector:
        """Roll, pitch and yaw (rad)."""
        return euler_from_quaternion(self._attitude)

    def set_deflection(self, fin: int, angle: float) -> None:
        """Set a fin to an angle (rad), limited to 25 degrees. Raises IndexError if there is no such fin."""
        deflection = self.deflections[fin] = clamp_magnitude(angle, FULL_DEFLECTION)
        part, share = self.model.fins[fin], 0.5 * deflection / FULL_DEFLECTION
        x, y, z = part.force
        force = x, y, z = share * x, share * y, share * z
        roll, pitch, yaw = cross(part.position, force)
        self._shares[fin] = x, y, z, roll if self.model.fins_roll else 0.0, pitch, yaw
        self._fins = None

    def _sum_of_fins(self) -> Rates:
        x = y = z = k = m = n = 0.0
        for fx, fy, fz, fk, fm, fn in self._shares:
            x, y, z, k, m, n = x + fx, y + fy, z + fz, k + fk, m + fm, n + fn
        self._fins = x, y, z, k, m, n
        return self._fins

    def set_actuation(self, engine: int, actuation: float) -> None:
        """Set an engine to a share of its full speed, -1 to 1. Raises IndexError if there is no such engine."""
        self.actuations[engine] = max(-1.0, min(1.0, actuation))
        thrusts: list[Thrust] = []
        for part, lever, share in zip(self.model.engines, self._levers, self.actuations, strict=True):
            n = share * part.full_speed
            if n:
                thrusts.append((part.gain * n * abs(n), part.loss * abs(n), *lever))
        self._thrusts = tuple(thrusts)

    @property
    def draft(self) -> float:
        """Depth of the lowest point of the hull below `z` (m)."""
        return 0.5 * self.model.volume[2]

    @property
    def ground_velocity(self) -> Vector:
        """Velocity over ground (m/s; north, east, down)."""
        (n, e, d), (north, east, down) = to_ned(self._rotation, (self.u, self.v, self.w)), self.stream
        return n + north, e + east, d + down

    @ground_velocity.setter
    def ground_velocity(self, velocity: Vector) -> None:
        (n, e, d), (north, east, down) = velocity, self.stream
        self.u, self.v, self.w = to_body(self._rotation, (n - north, e - east, d - down))

    @property
    def _rotation(self) -> Matrix:
        return rotation(*self.euler_angles())

    def accelerations(self) -> Rates:
        """Derivatives of u, v, w (m/s²) and p, q, r (rad/s²) at this instant."""
        velocity = self.u, self.v, self.w, self.p, self.q, self.r
        return _accelerations(self.model)(self.z, self._attitude, velocity, self._sum_of_fins(), self._thrusts)

    def step(self, h: float) -> None:
        """Advance by `h` s. Raises DivergedError."""
        a, b, c, d = attitude = self._attitude
        u, v, w, p, q, r = velocity = self.u, self.v, self.w, self.p, self.q, self.r
        north, east, down = self.stream
        fins = self._fins or self._sum_of_fins()
        accelerate, thrusts, half = _accelerations(self.model), self._thrusts, 0.5 * h
        du, dv, dw, dp, dq, dr = accelerate(self.z, attitude, velocity, fins, thrusts)
        um, vm, wm = u + half * du, v + half * dv, w + half * dw
        pm, qm, rm = p + half * dp, q + half * dq, r + half * dr
        z = self.z + half * (
            down + 2.0 * ((b * d - a * c) * u + (c * d + a * b) * v) + (1.0 - 2.0 * (b * b + c * c)) * w
        )
        k = 0.5 * half
        am, bm = a - k * (b * p + c * q + d * r), b + k * (a * p + c * r - d * q)
        cm, dm = c + k * (a * q + d * p - b * r), d + k * (a * r + b * q - c * p)
        du, dv, dw, dp, dq, dr = accelerate(z, (am, bm, cm, dm), (um, vm, wm, pm, qm, rm), fins, thrusts)
        self.u, self.v, self.w = u + h * du, v + h * dv, w + h * dw
        self.p, self.q, self.r = p + h * dp, q + h * dq, r + h * dr
        if not abs(self.u) + abs(self.v) + abs(self.w) + abs(self.p) + abs(self.q) + abs(self.r) < LIMIT:
            raise DivergedError(f"at {u:.3g}, {v:.3g}, {w:.3g} m/s, {p:.3g}, {q:.3g}, {r:.3g} rad/s")
        k, pm, qm, rm = half, p + half * dp, q + half * dq, r + half * dr  # the mean rates, as gyroscopes measure them
        an, bn = a - k * (bm * pm + cm * qm + dm * rm), b + k * (am * pm + cm * rm - dm * qm)
        cn, dn = c + k * (am * qm + dm * pm - bm * rm), d + k * (am * rm + bm * qm - cm * pm)
        # Approximates 1/|q|, which is close to 1, without a root.
        k = 1.5 - 0.5 * (an * an + bn * bn + cn * cn + dn * dn)
        self._attitude = an * k, bn * k, cn * k, dn * k
        aa, bb, cc, dd = am * am, bm * bm, cm * cm, dm * dm
        k = h / (aa + bb + cc + dd)
        self.x += h * north + k * (
            (aa + bb - cc - dd) * um + 2.0 * ((bm * cm - am * dm) * vm + (bm * dm + am * cm) * wm)
        )
        self.y += h * east + k * (
            (aa - bb + cc - dd) * vm + 2.0 * ((bm * cm + am * dm) * um + (cm * dm - am * bm) * wm)
        )
        sinking = (aa - bb - cc + dd) * wm + 2.0 * ((bm * dm - am * cm) * um + (cm * dm + am * bm) * vm)
        z = self.z + h * down + k * sinking
        self.z = z if z > 0.0 else 0.0


@functools.lru_cache(maxsize=64)
def _accelerations(model: UnderwaterModel) -> Acceleration:
    """A function of depth, attitude, velocities and actuators that returns the six accelerations in the body frame.

    It binds all numbers of the model as closure variables, which Python reads as fast as local ones.
    """
    mass, weight = model.mass, model.mass * GRAVITY
    length, width, height = model.volume
    half_height, lift_per_meter = 0.5 * height, GRAVITY * WATER * length * width
    xu, yv, zw, kp, mq, nr, yr, zq, m_w, n_v = model.linear
    xuu, yvv, zww, kpp, mqq, nrr, yrr, zqq, mww, nvv = model.quadratic
    yuv, yur, zuw, zuq, muw, muq, nuv, nur = model.lift
    mu, mv, mw = (mass - added for added in model.added_mass[:3])
    ix, iy, iz = (moment - added for moment, added in zip(model.rotational_inertia, model.added_mass[3:], strict=True))
    zb = model.buoyancy[2]
    mzg, restoring = -zb * mass, zb * weight
    yur, zuq, muw, nuv = yur - mu, zuq + mu, muw + mw - mu, nuv + mu - mv  # lift and added mass have the same form
    bu, bv, bw, bp, bq, br = (1.0 / moment for moment in model.inertia)
    strongest, sqrt = model.maximum_force, math.sqrt

    def accelerate(z: float, attitude: Quaternion, velocity: Rates, fins: Rates, thrusts: tuple[Thrust, ...]) -> Rates:
        a, b, c, d = attitude
        u, v, w, p, q, r = velocity
        rising, side, up = 2.0 * (a * c - b * d), 2.0 * (c * d + a * b), 1.0 - 2.0 * (b * b + c * c)
        sv, sw, sp, sq, sr = abs(v), abs(w), abs(p), abs(q), abs(r)
        square = u * u + v * v + w * w
        fx, fy, fz, fk, fm, fn = fins
        x, y, lower, k, m, n = fx * square, fy * square, fz * square, fk * square, fm * square, fn * square
        if thrusts:
            speed = sqrt(square)
            for gain, loss, ahead, others in thrusts:
                force = gain - loss * speed
                push = ahead * force
                x += -strongest if push < -strongest else strongest if push > strongest else push
                if others is not None:
                    ty, tz, tk, tm, tn = others
                    y += clamp_magnitude(ty * force, strongest)
                    lower += clamp_magnitude(tz * force, strongest)
                    k += clamp_magnitude(tk * force, MAXIMUM_TORQUE)
                    m += clamp_magnitude(tm * force, MAXIMUM_TORQUE)
                    n += clamp_magnitude(tn * force, MAXIMUM_TORQUE)
        if z <= 0.0:
            lower = 0.0
        immersed = z + half_height
        heavy = weight - lift_per_meter * (0.0 if immersed < 0.0 else height if immersed > height else immersed)
        x += (xu + xuu * abs(u)) * u - mzg * r * p - mw * w * q + mv * v * r
        y += heavy * side + (yv + yvv * sv + yuv * u) * v + (yr + yrr * sr + yur * u - mzg * q) * r + mw * w * p
        lower += heavy * up + (zw + zww * sw + zuw * u) * w + (zq + zqq * sq + zuq * u) * q
        lower += mzg * (p * p + q * q) - mv * v * p
        k += restoring * side + (kp + kpp * sp - mzg * w) * p + mzg * r * u + (mv - mw) * v * w + (iy - iz) * q * r
        m += restoring * rising + (mq + mqq * sq + muq * u - mzg * w) * q + (m_w + mww * sw + muw * u) * w
        m += mzg * r * v + (iz - ix) * r * p
        n += (nr + nrr * sr + nur * u) * r + (n_v + nvv * sv + nuv * u) * v + (ix - iy) * p * q
        return bu * x, bv * y, bw * lower, bp * k, bq * m, br * n

    return accelerate


def _lever(engine: Thruster) -> Lever:
    """The share of a thrust that pushes ahead, and those for the other forces and the torques; None without them."""
    x, *rest = *engine.direction, *cross(engine.position, engine.direction)
    y, z, k, m, n = (0.0 if abs(share) < 1e-12 else share for share in rest)
    return x, (y, z, k, m, n) if y or z or k or m or n else None
