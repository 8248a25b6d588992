"""Controls the depth, altitude or pitch of an underwater vehicle by its pitch."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import imc
from autonomy.control.bottom_depth_filter import BottomEstimator
from autonomy.control.pid import PID, PIDGains
from autonomy.limits import FLOOR_MARGIN, REFERENCE_MARGIN, OperatingLimits

Units = imc.ZUnits
SURFACE = 0.3  # m


@dataclass(frozen=True)
class DepthGains:
    """Gains of DepthController. The limits of both PIDs are pitches; that of depth applies to all corrections."""

    depth: PIDGains  # rad of pitch per m
    altitude: PIDGains | None = None  # rad of pitch per m; None controls altitude with the gains of depth
    altitude_margin: float = 0.0  # m between the minimum altitude and the lowest reference
    surface_pitch: float | None = None  # rad, held at the surface instead of a depth


class DepthController:
    """Turns a depth, altitude or pitch into a pitch that stays above the bottom and the maximum depth.

    Without altitude, the bottom seen last counts. `bottom` is to be updated with each state. After a step, `held` names
    what the vehicle was held off, and `lacks_altitude` is True if altitude was needed but unknown.
    """

    def __init__(self, gains: DepthGains, weights: Sequence[float] = ()):
        self.bottom: BottomEstimator = BottomEstimator(weights)
        self.limits: OperatingLimits = OperatingLimits()
        self._kept: float | None = None
        self.set_gains(gains)
        self.reset()

    def set_gains(self, gains: DepthGains) -> None:
        """Use other gains; the integrals start over."""
        self.gains = gains
        self.depth: PID = PID.from_gains(gains.depth)
        self.altitude: PID = PID.from_gains(gains.altitude or gains.depth)

    def reset(self) -> None:
        """Forget the integrals, and the depth kept while altitude is unknown."""
        self.held: str = ""
        self.lacks_altitude: bool = False
        self._kept = None
        self.depth.reset()
        self.altitude.reset()

    def clamp_to_limits(self, desired: imc.DesiredZ) -> float:
        """The value of a desired depth or altitude within the limits (m)."""
        if desired.z_units == Units.ALTITUDE:
            return max(desired.value, self.limits.lowest + self.gains.altitude_margin)
        return max(0.0, min(desired.value, self.limits.deepest - REFERENCE_MARGIN))

    def step(self, state: imc.EstimatedState, desired: imc.DesiredZ | float | None, dt: float) -> float:
        """The pitch (rad) for a depth or altitude, or for a desired pitch (rad); without either, level.

        `dt` is the time since the last step (s).
        """
        sp, cp, sr, cr = math.sin(state.theta), math.cos(state.theta), math.sin(state.phi), math.cos(state.phi)
        sinking = -sp * state.u + cp * (sr * state.v + cr * state.w)
        self.lacks_altitude = False
        wanted = self._pitch_for(desired, state, sinking, dt) if isinstance(desired, imc.DesiredZ) else desired
        return self._keep_off(wanted or 0.0, state.depth, sinking)

    def _pitch_for(self, desired: imc.DesiredZ, state: imc.EstimatedState, sinking: float, dt: float) -> float:
        if desired.z_units == Units.ALTITUDE:
            bottom = self.bottom
            if bottom.is_known:
                wanted, rate, self._kept = bottom.depth - desired.value, bottom.rate, None
            else:
                self.lacks_altitude = True
                self._kept = state.depth if self._kept is None else self._kept
                wanted, rate = self._kept, 0.0
            wanted = max(0.0, min(wanted, self.limits.deepest - REFERENCE_MARGIN))
            law = self.altitude if self.gains.altitude is not None else self.depth
            return -law.step(dt, wanted - state.depth, rate - sinking)
        error, at_surface = desired.value - state.depth, self.gains.surface_pitch
        if at_surface is not None and desired.value < SURFACE and abs(error) < SURFACE:
            self.depth.reset()
            return at_surface
        return -self.depth.step(dt, error, -sinking)

    def _keep_off(self, command: float, depth: float, sinking: float) -> float:
        """The pitch (rad), raised as far as needed to stay above the bottom and the maximum depth.

        Both are held with the gains of depth, and the larger pitch is taken, so the change is smooth (override control;
        Åström & Hägglund, Advanced PID Control, 2006, ch. 13.3).
        """
        floor, rate, self.held = self.limits.deepest - FLOOR_MARGIN, 0.0, ""
        lowest = self.bottom.depth - self.limits.lowest
        near_bottom = lowest < floor
        if near_bottom:
            floor, rate = lowest, self.bottom.rate
        if floor == math.inf:
            return command
        gains = self.gains.depth
        needed = gains.p * (depth - max(0.0, floor)) + gains.d * (sinking - rate)
        if needed <= command:
            return command
        self.held = "bottom" if near_bottom else "maximum depth"
        self.lacks_altitude = self.lacks_altitude or (near_bottom and not self.bottom.is_known)
        return min(needed, gains.limit)
