"""Dynamics of a multirotor: thrust along its mast, tilt, gravity, drag in moving air, and the ground."""

import math
from dataclasses import dataclass

from support.rotations import IDENTITY, Matrix, Vector, body_rates, rotation, to_body, wrap

GRAVITY = 9.80665
LIMIT = 1e3  # m/s; beyond it, the motion has diverged


@dataclass(frozen=True)
class Airframe:
    """Parameters of a multirotor: kg, N at full rotor speed, s, rad/s; drag in N s/m and N s²/m², `max_tilt` in rad."""

    mass: float = 3.0
    thrust: float = 60.0
    rotor_lag: float = 0.05
    bandwidth: float = 12.0
    damping: float = 0.8
    max_tilt: float = math.radians(45.0)
    yaw_lag: float = 0.2
    max_yaw_rate: float = math.radians(120.0)
    linear_drag: float = 0.35
    quadratic_drag: float = 0.02

    @property
    def hover_speed(self) -> float:
        """The rotor speed that carries the weight, as a share of full speed."""
        return math.sqrt(self.mass * GRAVITY / self.thrust)


class Multirotor:
    """A multirotor over flat ground. All attributes belong to the same instant; `step` advances them.

    `x`, `y`, `z` are m north, east and down from its start, `vn`, `ve`, `vd` m/s over ground, `p`, `q`, `r` rad/s in
    the body frame, `wind` m/s north, east and down. Thrust acts along the mast, with the square of the rotor speed, and
    m dv/dt = m g e3 - T R e3 - (k1 + k2 |v - w|) (v - w), with drag of the rotors and of the body (Mahony, Kumar and
    Corke, Multirotor Aerial Vehicles, IEEE Robotics & Automation Magazine 19(3), 2012). Roll and pitch follow their
    commands like a damped oscillator, as under an attitude controller; rotors and yaw rate follow as first-order lags.

    On the ground it stands until thrust exceeds weight; `touchdown_speed` is the speed (m/s) of the last touchdown.
    """

    def __init__(self, airframe: Airframe):
        self.airframe = airframe
        self.x: float = 0.0
        self.y: float = 0.0
        self.z: float = 0.0
        self.vn: float = 0.0
        self.ve: float = 0.0
        self.vd: float = 0.0
        self.phi: float = 0.0
        self.theta: float = 0.0
        self.psi: float = 0.0
        self.p: float = 0.0
        self.q: float = 0.0
        self.r: float = 0.0
        self.wind: Vector = (0.0, 0.0, 0.0)
        self.rotor_speed: float = 0.0
        self.touchdown_speed: float = 0.0
        self.on_ground: bool = True
        self._roll = self._pitch = self._turn = self._rotors = 0.0
        self._phi_rate = self._theta_rate = self._psi_rate = 0.0
        self._angles: Vector = (0.0, 0.0, 0.0)  # of the last rotation, which step and air_velocity share
        self._rotation: Matrix = IDENTITY
        self._seconds = math.nan  # of the steps that the responses are for

    def command_roll(self, angle: float) -> None:
        """Command a roll (rad)."""
        limit = self.airframe.max_tilt
        self._roll = max(-limit, min(limit, angle))

    def command_pitch(self, angle: float) -> None:
        """Command a pitch (rad)."""
        limit = self.airframe.max_tilt
        self._pitch = max(-limit, min(limit, angle))

    def command_yaw_rate(self, rate: float) -> None:
        """Command a heading rate (rad/s)."""
        limit = self.airframe.max_yaw_rate
        self._turn = max(-limit, min(limit, rate))

    def command_rotor_speed(self, share: float) -> None:
        """Command a rotor speed as a share of full speed."""
        self._rotors = max(0.0, min(1.0, share))

    @property
    def air_velocity(self) -> Vector:
        """Velocity through the air in the body frame (m/s)."""
        north, east, down = self.wind
        return to_body(self._attitude, (self.vn - north, self.ve - east, self.vd - down))

    @property
    def _attitude(self) -> Matrix:
        angles = self.phi, self.theta, self.psi
        if angles != self._angles:
            self._angles, self._rotation = angles, rotation(*angles)
        return self._rotation

    def step(self, h: float) -> None:
        """Advance by `h` s. Raises ArithmeticError if the motion diverges."""
        a = self.airframe
        if h != self._seconds:
            self._respond_in(h)
        self._incline(h)
        self.rotor_speed += (self._rotors - self.rotor_speed) * self._rotor_response
        rotors, (x, y, z) = self.rotor_speed, self.wind
        lift = a.thrust * rotors * rotors / a.mass
        (_, _, north), (_, _, east), (_, _, down) = self._attitude  # of the body's z axis
        if self.on_ground and lift * down <= GRAVITY:
            self.vn = self.ve = self.vd = 0.0
            return
        self.on_ground = False
        before_n, before_e, before_d = self.vn, self.ve, self.vd
        wn, we, wd = before_n - x, before_e - y, before_d - z
        drag = (a.linear_drag + a.quadratic_drag * math.sqrt(wn * wn + we * we + wd * wd)) / a.mass
        vn = before_n + h * (-lift * north - drag * wn)
        ve = before_e + h * (-lift * east - drag * we)
        vd = before_d + h * (GRAVITY - lift * down - drag * wd)
        if not abs(vn) + abs(ve) + abs(vd) < LIMIT:
            raise ArithmeticError(f"at {vn:.3g}, {ve:.3g}, {vd:.3g} m/s")
        half = 0.5 * h
        self.x += half * (before_n + vn)
        self.y += half * (before_e + ve)
        self.z += half * (before_d + vd)
        self.vn, self.ve, self.vd = vn, ve, vd
        if self.z >= 0.0 and vd >= 0.0:
            self.touchdown_speed, self.on_ground = vd, True
            self.z = self.vn = self.ve = self.vd = 0.0

    def _respond_in(self, h: float) -> None:
        """Compute how rotors, yaw and tilt respond in steps of `h` s."""
        a, half = self.airframe, 0.5 * h
        self._seconds = h
        self._rotor_response, self._yaw_kept = -math.expm1(-h / a.rotor_lag), math.exp(-h / a.yaw_lag)
        self._stiffness, self._damping = a.bandwidth**2, 2.0 * a.damping * a.bandwidth
        self._resistance = 1.0 + half * (self._damping + half * self._stiffness)

    def _incline(self, h: float) -> None:
        """Tilt and turn toward the commands; on the ground the legs keep it level and hold its heading.

        Roll and pitch are damped oscillators with the acceleration of the middle of the step: so the rate changes
        evenly, and its mean over the step is that of the angle, which gyroscopes measure.
        """
        stands, half = self.on_ground, 0.5 * h
        roll, pitch, turn = (0.0, 0.0, 0.0) if stands else (self._roll, self._pitch, self._turn)
        stiffness, damping, resistance = self._stiffness, self._damping, self._resistance
        angle, rate = self.phi, self._phi_rate
        change = h * (stiffness * (roll - angle - half * rate) - damping * rate) / resistance
        phi, phi_rate = angle + h * (rate + 0.5 * change), rate + change
        angle, rate = self.theta, self._theta_rate
        change = h * (stiffness * (pitch - angle - half * rate) - damping * rate) / resistance
        theta, theta_rate = angle + h * (rate + 0.5 * change), rate + change
        before = 0.0 if stands else self._psi_rate
        psi_rate = turn + (before - turn) * self._yaw_kept
        self.phi, self.theta, self.psi = phi, theta, wrap(self.psi + half * (before + psi_rate))
        self._phi_rate, self._theta_rate, self._psi_rate = phi_rate, theta_rate, psi_rate
        self.p, self.q, self.r = body_rates(phi, theta, phi_rate, theta_rate, psi_rate)
