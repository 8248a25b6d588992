"""A discrete controller with proportional, integral and derivative parts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from support.number_parsing import clamp_magnitude


@dataclass(frozen=True)
class PIDGains:
    """Gains of a PID and the limits of its integral part and its output."""

    p: float  # output per error
    i: float  # output per error and second
    d: float  # output per error per second
    integral_limit: float = math.inf  # as output
    limit: float = math.inf  # as output


class PID:
    """Output = P e + I ∫e dt + D de/dt, limited to ±`limit`; the integral part is limited to ±`integral_limit`.

    The integral part of a step covers the steps before it. With `conditional` it is frozen while the output is at its
    limit and the error would drive it further (conditional integration; Åström & Hägglund, Advanced PID Control, 2006,
    ch. 3.5). `p`, `i`, `d` are the parts of the last step.
    """

    def __init__(
        self,
        gains: Sequence[float],
        *,
        limit: float = math.inf,
        integral_limit: float = math.inf,
        conditional: bool = True,
    ):
        self._proportional, self._integral, self._derivative = gains
        self._limit = limit
        self._integral_limit = integral_limit
        self._conditional = conditional
        self.reset()

    @classmethod
    def from_gains(cls, gains: PIDGains) -> Self:
        return cls((gains.p, gains.i, gains.d), limit=gains.limit, integral_limit=gains.integral_limit)

    def reset(self) -> None:
        """Clear the history."""
        self.p: float = 0.0
        self.i: float = 0.0
        self.d: float = 0.0
        self._accumulated = 0.0

    def step(self, dt: float, error: float, error_rate: float = 0.0) -> float:
        """The output for an error and its rate; `dt` is the time since the last step (s)."""
        self.p = self._proportional * error
        self.d = self._derivative * error_rate
        self.i = self._accumulated
        wanted = self.p + self.i + self.d
        output = clamp_magnitude(wanted, self._limit)
        growth = self._integral * error * dt
        if growth and not (self._conditional and wanted != output and growth * wanted > 0.0):
            self._accumulated = clamp_magnitude(self._accumulated + growth, self._integral_limit)
        return output
