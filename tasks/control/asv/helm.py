"""How a boat is steered to a heading or turned at a rate."""

from collections.abc import Sequence

import imc
from tasks.control.pid import PID, clamp, wrap

Loops = imc.CLoopsMask
HORIZONTAL = Loops.YAW | Loops.YAW_RATE


class Helm:
    """A cascade: the heading asks for a rate, the rate for an effort; both references are None until they are given.

    `gains` are P, I, D of heading (1/s), with rates up to `maximum_rate` (rad/s); `rate_gains` P, I, D of the rate and
    `feedforward` its share that is known ahead, in units of the effort per rad/s. The integral of the rate rests while
    the effort is at its limit. `rate` is the rate that was asked for last (rad/s).
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
        """Forget references and the past."""
        self.heading: float | None = None
        self.wanted_rate: float | None = None
        self.rate = 0.0
        self.p = self.i = self.d = 0.0
        self._accumulated = 0.0
        self._turned: float | None = None
        self._heading_law.reset()

    def error(self, psi: float) -> float:
        """How far the heading is to starboard of `psi` (rad); 0 where none is wanted."""
        return wrap(self.heading - psi) if self.heading is not None else 0.0

    def effort(self, mask: int, psi: float, r: float, dt: float, limit: float) -> float | None:
        """What turns the boat to starboard, within plus and minus `limit`; None where a reference is missing.

        `mask` are the loops that are enabled, `psi` (rad) and `r` (rad/s) how the boat lies and turns.
        """
        if mask & Loops.YAW_RATE:
            if self.wanted_rate is None:
                return None
            self.rate = clamp(self.wanted_rate, self._maximum_rate)
        elif mask & Loops.YAW:
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
        output = clamp(wanted, limit)
        growth = self._integral * error * dt
        if not (wanted != output and growth * wanted > 0.0):
            self._accumulated = clamp(self._accumulated + growth, limit)
        return output

    @property
    def parcel(self) -> imc.ControlParcel:
        """The parts of the last effort."""
        return imc.ControlParcel(p=self.p, i=self.i, d=self.d, a=self.p + self.i + self.d)
