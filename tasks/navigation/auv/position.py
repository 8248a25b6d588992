"""A position on Earth, moved by a horizontal filter and corrected by fixes."""

import math

import imc
from imc.coordinates import displacement
from tasks.navigation.auv.horizontal_filter import EAST, NORTH, PSI, HorizontalFilter, U

ACCURACIES = 10.0, 8.0, 4.0  # m, of the classes of fixes
SOG_VARIANCE = 0.04  # (m/s)²
CONTRADICTION = 30.0  # squared Mahalanobis distance of a fix that the filter cannot explain
CONTRADICTIONS = 3  # contradicting fixes in a row reset the filter


def fix_variance(fix: imc.GpsFix, by_class: list[float]) -> float:
    """Variance (m²) of each horizontal coordinate of a fix: by its class of accuracy, else half of hacc squared.

    `hacc` is the root mean square of the horizontal error.
    """
    accuracy = fix.hacc if fix.validity & imc.GpsFix.Validity.VALID_HACC else 2.5 * fix.hdop
    if len(by_class) == len(ACCURACIES) + 1:
        return next((v for v, limit in zip(by_class, ACCURACIES, strict=False) if accuracy > limit), by_class[-1])
    return max(1e-4, 0.5 * accuracy**2)


class Position:
    """Offsets from a reference (rad, rad, m) at the surface of the water.

    The filter's north and east are relative to the reference, which moves if the vehicle is `farthest` (m) from it.
    """

    def __init__(
        self, fix: imc.GpsFix, depth: float, psi: float, variance: float, farthest: float, state: HorizontalFilter
    ):
        self.lat, self.lon, self.height = fix.lat, fix.lon, fix.height + depth
        self.filter = state
        self._farthest = farthest
        self._contradictions = 0
        state.x[PSI] = psi
        self._settle(0.0, 0.0, variance)

    def correct(self, fix: imc.GpsFix, variance: float, arm: tuple[float, float], ground_speed: bool) -> bool:
        """Apply a fix of an antenna that is `arm` north and east (m), and its speed as surge if `ground_speed`.

        If several fixes in a row contradict the filter, its position is reset to theirs and False returned.
        """
        north, east, _ = displacement(self.lat, self.lon, self.height, fix.lat, fix.lon, self.height)
        north, east = north - arm[0], east - arm[1]
        state = self.filter
        dn, de = north - state.x[NORTH], east - state.x[EAST]
        a, b, c = state.p[NORTH][NORTH] + variance, state.p[NORTH][EAST], state.p[EAST][EAST] + variance
        distance = (c * dn * dn - 2.0 * b * dn * de + a * de * de) / (a * c - b * b)
        self._contradictions = self._contradictions + 1 if distance > CONTRADICTION else 0
        believed = self._contradictions < CONTRADICTIONS
        if believed:
            state.update(dn, variance, (NORTH, 1.0))
            state.update(east - state.x[EAST], variance, (EAST, 1.0))
        else:
            self._contradictions = 0
            self._settle(north, east, variance)
        if ground_speed and fix.validity & imc.GpsFix.Validity.VALID_SOG and math.isfinite(fix.sog):
            state.update(fix.sog - state.x[U], SOG_VARIANCE, (U, 1.0))
        if math.hypot(north, east) > self._farthest:
            self.lat, self.lon = fix.lat, fix.lon
            state.x[NORTH] -= north
            state.x[EAST] -= east
        return believed

    def _settle(self, north: float, east: float, variance: float) -> None:
        state = self.filter
        state.x[NORTH], state.x[EAST] = north, east
        for index in (NORTH, EAST):
            for row in state.p:
                row[index] = 0.0
            state.p[index] = [0.0] * len(state.p)
            state.p[index][index] = variance
