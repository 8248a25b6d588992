"""Controls heading, pitch and roll of an underwater vehicle by torques."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import imc
from autonomy.control.fin_allocation import Torques
from autonomy.control.pid import PID, PIDGains
from support.rotations import wrap

STEEPEST = 0.1  # least cosine of pitch; Euler rates are singular at 90°


@dataclass(frozen=True)
class AttitudeGains:
    """Gains of AttitudeController."""

    heading: PIDGains  # rad/s of heading rate per rad
    heading_rate: PIDGains  # N m per rad/s
    pitch: PIDGains  # N m per rad
    roll: PIDGains  # N m per rad
    levels: bool = True  # whether roll is controlled


class AttitudeReference(NamedTuple):
    """Desired pitch (rad), and a heading (rad) or a heading rate (rad/s), which comes first; None is not controlled."""

    pitch: float = 0.0
    heading: float | None = None
    heading_rate: float | None = None


class AttitudeController:
    """PIDs of roll and pitch, and a cascade: heading to heading rate, heading rate to torque.

    `rate` is the last commanded heading rate (rad/s).
    """

    def __init__(self, gains: AttitudeGains):
        self.rate: float = 0.0
        self._pitch_before: float | None = None
        self.set_gains(gains)

    def set_gains(self, gains: AttitudeGains) -> None:
        """Use other gains; the integrals start over."""
        self._levels = gains.levels
        self.heading: PID = PID.from_gains(gains.heading)
        self.heading_rate: PID = PID.from_gains(gains.heading_rate)
        self.pitch: PID = PID.from_gains(gains.pitch)
        self.roll: PID = PID.from_gains(gains.roll)

    def reset_pitch(self) -> None:
        """Forget the history of the pitch."""
        self._pitch_before = None
        self.pitch.reset()

    def reset_heading(self) -> None:
        """Forget the history of heading and roll."""
        for law in (self.heading, self.heading_rate, self.roll):
            law.reset()

    def step(self, state: imc.EstimatedState, reference: AttitudeReference, dt: float) -> Torques:
        """Torques about roll, pitch, yaw (N m); `dt` is the time since the last step (s)."""
        sr, cr = math.sin(state.phi), math.cos(state.phi)
        turning = (sr * state.q + cr * state.r) / max(STEEPEST, math.cos(state.theta))
        pitching = cr * state.q - sr * state.r
        before, self._pitch_before = self._pitch_before, reference.pitch
        change = (reference.pitch - before) / dt if dt and before is not None else 0.0
        m = self.pitch.step(dt, reference.pitch - state.theta, change - pitching)
        rate, n = reference.heading_rate, 0.0
        if rate is None and reference.heading is not None:
            rate = self.heading.step(dt, wrap(reference.heading - state.psi), -turning)
        if rate is not None:
            self.rate, n = rate, self.heading_rate.step(dt, rate - state.r)
        k = self.roll.step(dt, -state.phi, -(state.p + math.sin(state.theta) * turning)) if self._levels else 0.0
        return k, m, n
