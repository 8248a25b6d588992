"""A position on Earth, moved by a horizontal filter and corrected by fixes."""

import math
from collections.abc import Sequence

import imc
from autonomy.navigation.fault_detection import GateDecision, JumpGate
from autonomy.navigation.horizontal_filter import (
    EAST,
    NORTH,
    PSI,
    HorizontalFilter,
    U,
    position_distance_squared,
    reset_position,
)
from support.wgs84 import displacement

ACCURACIES = 10.0, 8.0, 4.0  # m, of the classes of fixes
SOG_VARIANCE = 0.04  # (m/s)²
CONTRADICTION = 30.0  # squared Mahalanobis distance of a fix that the filter cannot explain
CONTRADICTIONS = 5  # contradicting fixes in a row that agree to within AGREEMENT reset the filter
AGREEMENT = 10.0  # m


def fix_variance(fix: imc.GpsFix, by_class: Sequence[float]) -> float:
    """Variance (m²) of each horizontal coordinate of a fix: by its class of accuracy, else half of hacc squared.

    `hacc` is the root mean square of the horizontal error.
    """
    accuracy = fix.hacc if fix.validity & imc.GpsFix.Validity.VALID_HACC and fix.hacc > 0.0 else 2.5 * fix.hdop
    if len(by_class) == len(ACCURACIES) + 1:
        return next((v for v, limit in zip(by_class, ACCURACIES, strict=False) if accuracy > limit), by_class[-1])
    return max(1e-4, 0.5 * accuracy**2)


class PositionEstimate:
    """Offsets from a reference (rad, rad, m) at the surface of the water.

    The filter's north and east are relative to the reference, which moves if the vehicle is `farthest` (m) from it.
    """

    def __init__(
        self, fix: imc.GpsFix, depth: float, psi: float, variance: float, farthest: float, state: HorizontalFilter
    ):
        self.lat: float = fix.lat
        self.lon: float = fix.lon
        self.height: float = fix.height + depth
        self.filter = state
        self._farthest = farthest
        self._gate = JumpGate(CONTRADICTIONS, AGREEMENT)
        self.jump: float = 0.0
        state.x[PSI] = psi
        reset_position(state.x, state.p, 0.0, 0.0, variance)

    def correct(self, fix: imc.GpsFix, variance: float, arm: tuple[float, float], fastest: float) -> GateDecision:
        """Apply a fix of an antenna that is `arm` north and east (m), and its speed as surge up to `fastest` (m/s).

        Fixes that contradict the filter are rejected, until several in a row agree: they reset its position.
        """
        north, east, dn, de = self._innovation(fix, arm)
        state = self.filter
        verdict = self._gate.evaluate(position_distance_squared(state.p, dn, de, variance) > CONTRADICTION, dn, de)
        if verdict is GateDecision.REJECTED:
            return verdict
        if verdict is GateDecision.ACCEPTED:
            state.update(dn, variance, (NORTH, 1.0))
            state.update(east - state.x[EAST], variance, (EAST, 1.0))
        else:
            self.jump = math.hypot(dn, de)
            reset_position(state.x, state.p, north, east, variance)
        if fix.validity & imc.GpsFix.Validity.VALID_SOG and 0.0 <= fix.sog <= fastest:
            state.update(fix.sog - state.x[U], SOG_VARIANCE, (U, 1.0))
        if math.hypot(north, east) > self._farthest:
            self.lat, self.lon = fix.lat, fix.lon
            state.x[NORTH] -= north
            state.x[EAST] -= east
        return verdict

    def agrees(self, fix: imc.GpsFix, variance: float) -> bool:
        """Whether a fix is where the filter is."""
        _, _, dn, de = self._innovation(fix, (0.0, 0.0))
        return position_distance_squared(self.filter.p, dn, de, variance) <= CONTRADICTION

    @property
    def has_rejected_fix(self) -> bool:
        """Whether the latest fix was rejected."""
        return self._gate.rejected > 0

    def _innovation(self, fix: imc.GpsFix, arm: tuple[float, float]) -> tuple[float, float, float, float]:
        north, east, _ = displacement(self.lat, self.lon, self.height, fix.lat, fix.lon, self.height)
        north, east = north - arm[0], east - arm[1]
        return north, east, north - self.filter.x[NORTH], east - self.filter.x[EAST]
