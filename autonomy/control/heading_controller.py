"""Steers a boat to a heading or at a heading rate."""

from collections.abc import Sequence

import imc
from autonomy.control.pid import PID
from support.number_parsing import clamp_magnitude
from support.rotations import wrap

YAW, YAW_RATE = imc.CLoopsMask.YAW.value, imc.CLoopsMask.YAW_RATE.value
HORIZONTAL = YAW | YAW_RATE


class HeadingController:
    """A cascade: heading error to heading rate, rate error to effort. References are None until they are set.

    `gains` are P, I, D of heading (1/s), with rates up to `maximum_rate` (rad/s); `rate_gains` are P, I, D of the rate,
    `feedforward` is its feed-forward gain (effort per rad/s). The integral of the rate is frozen while the effort is at
    its limit. `rate` is the last commanded rate (rad/s).
    """

    def __init__(
        self, gains: Sequence[float], maximum_rate: float, rate_gains: Sequence[float], feedforward: float = 0.0
    ):
        self._heading_law = PID(gains, limit=maximum_rate)
        self._maximum_rate = maximum_rate
        self._proportional, self._integral, self._derivative = rate_gains
        self._feedforward = feedforward
        self.reset()

    def reset(self) -> None:
        """Clear references and history."""
        self.heading: float | None = None
        self.desired_rate: float | None = None
        self.rate: float = 0.0
        self.p: float = 0.0
        self.i: float = 0.0
        self.d: float = 0.0
        self._accumulated = 0.0
        self._turned: float | None = None
        self._heading_law.reset()

    def error(self, psi: float) -> float:
        """Angle of the desired heading to starboard of `psi` (rad); 0 without a reference."""
        return wrap(self.heading - psi) if self.heading is not None else 0.0

    def effort(self, mask: int, psi: float, r: float, dt: float, limit: float) -> float | None:
        """Effort that turns the boat to starboard, between -`limit` and `limit`; None if a reference is missing.

        `mask` has the enabled loops; `psi` (rad) and `r` (rad/s) are heading and heading rate of the boat.
        """
        if mask & YAW_RATE:
            if self.desired_rate is None:
                return None
            self.rate = clamp_magnitude(self.desired_rate, self._maximum_rate)
        elif mask & YAW:
            if self.heading is None:
                return None
            self.rate = self._heading_law.step(dt, self.error(psi), -r)
        else:
            return 0.0
        turned, self._turned = self._turned, r
        error = self.rate - r
        self.p, self.i = self._proportional * error, self._accumulated
        self.d = -self._derivative * (r - turned) / dt if turned is not None and dt > 0.0 else 0.0
        wanted = self._feedforward * self.rate + self.p + self.i + self.d
        output = clamp_magnitude(wanted, limit)
        growth = self._integral * error * dt
        if not (wanted != output and growth * wanted > 0.0):
            self._accumulated = clamp_magnitude(self._accumulated + growth, limit)
        return output

    @property
    def pid_parts(self) -> imc.ControlParcel:
        """P, I, D parts of the last effort."""
        return imc.ControlParcel(p=self.p, i=self.i, d=self.d, a=self.p + self.i + self.d)
