"""Errors that wander: a first-order Gauss-Markov process."""

import math
from collections.abc import Sequence

from support.rotations import Vector


class Drift:
    """Three independent Gauss-Markov errors; it begins anywhere within its distribution.

    nu(t + T) = exp(-T / tau) nu(t) + eta (Beard and McLain, Small Unmanned Aircraft, 2012, section 7.5), with eta such
    that the standard deviations stay `sigmas`. `draws` are three standard normals.
    """

    def __init__(self, sigmas: Vector, tau: float, draws: Sequence[float]):
        self._sigmas = sigmas
        self._tau = tau
        self.value: Vector = (sigmas[0] * draws[0], sigmas[1] * draws[1], sigmas[2] * draws[2])

    def advance(self, seconds: float, draws: Sequence[float]) -> Vector:
        """The errors so many seconds later."""
        kept = math.exp(-seconds / self._tau)
        (a, b, c), (x, y, z), new = self._sigmas, self.value, math.sqrt(1.0 - kept * kept)
        self.value = kept * x + new * a * draws[0], kept * y + new * b * draws[1], kept * z + new * c * draws[2]
        return self.value
