"""Lenses whose image radius is a polynomial of the angle off the optical axis."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.floating[Any]]

TABLE_ENTRIES = 8193
NEWTON_STEPS = 3
QUARTIC, ODD = 4, 9  # coefficients of both kinds of lenses


@dataclass(frozen=True)
class Lens:
    """r(phi) = k1 phi + k2 phi² + k3 phi³ + k4 phi⁴, phi in rad off the optical axis, up to half of `fov` (rad).

    Nine coefficients reach to phi⁹, for lenses of Kannala and Brandt.
    r has the unit of `k`: normalized by the focal length, or pixels (as in NVIDIA's f-theta and WoodScape). Raises
    ValueError if r does not grow over the whole field of view, or if `fov` lies outside (0, 2π].
    """

    k: tuple[float, ...]
    fov: float

    def __post_init__(self) -> None:
        if not 0.0 < self.fov <= math.tau:
            raise ValueError(f"a field of view of {math.degrees(self.fov):g}° is not within 0 to 360°")
        if len(self.k) not in (QUARTIC, ODD) or not all(map(math.isfinite, self.k)):
            raise ValueError(f"a lens has four finite coefficients, not {list(self.k)}")
        if not any(self.k):
            raise ValueError("all coefficients of the lens are zero")
        fold = self._fold()
        if fold is not None:
            raise ValueError(
                f"the image radius of the lens {list(self.k)} does not grow beyond {math.degrees(fold):.4g}° off its "
                f"axis: up to {math.degrees(self.edge_angle):g}°, one pixel would show two directions"
            )

    @property
    def edge_angle(self) -> float:
        """Angle off the axis at which the image ends, rad."""
        return self.fov / 2

    @property
    def edge_radius(self) -> float:
        return float(self.radius(self.edge_angle))

    def radius(self, phi: ArrayLike) -> Floats:
        p = np.asarray(phi, dtype=np.float64)
        found = p * self.k[-1]
        for k in self.k[-2::-1]:
            found = p * (k + found)
        return found

    @property
    def kannala_brandt_coefficients(self) -> tuple[float, float, float, float] | None:
        """k1 to k4 of Kannala and Brandt's polynomial, if the lens is of that kind."""
        if len(self.k) != ODD or self.k[0] != 1.0 or any(self.k[1::2]):
            return None
        return self.k[2], self.k[4], self.k[6], self.k[8]

    def radius_slope(self, phi: ArrayLike) -> Floats:
        """dr/dphi."""
        p = np.asarray(phi, dtype=np.float64)
        found = p * (len(self.k) * self.k[-1])
        for power in range(len(self.k) - 1, 1, -1):
            found = p * (power * self.k[power - 1] + found)
        return self.k[0] + found

    def angle(self, radius: ArrayLike) -> Floats:
        """phi for r in [0, r(edge)], to 1e-12 rad; outside, that of the nearest end."""
        r = np.asarray(radius, dtype=np.float64)
        radii, angles = self._table
        phi = np.interp(r, radii, angles)
        r = np.clip(r, 0.0, self.edge_radius)
        for _ in range(NEWTON_STEPS):
            before, phi = phi, np.clip(phi - (self.radius(phi) - r) / self.radius_slope(phi), 0.0, self.edge_angle)
            if np.array_equal(before, phi):
                break
        return phi

    def _fold(self) -> float | None:
        """The angle (rad) from which on r no longer grows; None if that is beyond the edge."""
        if not self.k[0] > 0.0:
            return 0.0
        slopes = [power * k for power, k in enumerate(self.k, start=1)]
        # A root of the slope at which it only touches zero may come out as a pair that is not quite real.
        flat = (float(root.real) for root in np.roots(slopes[::-1]) if abs(root.imag) < 1e-7)
        return min((phi for phi in flat if 0.0 < phi <= self.edge_angle), default=None)

    @cached_property
    def _table(self) -> tuple[Floats, Floats]:
        angles = np.linspace(0.0, self.edge_angle, TABLE_ENTRIES)
        return self.radius(angles), angles


@dataclass(frozen=True)
class LensPreset:
    """Coefficients for focal length 1, and the widest field of view (rad) for which they are valid."""

    k: tuple[float, float, float, float]
    max_field_of_view: float = math.tau


LENS_PRESETS: Mapping[str, LensPreset] = MappingProxyType(
    {
        "equidistant": LensPreset((1.0, 0.0, 0.0, 0.0)),
        # Fit of 2 sin(phi/2), 1.4e-4 f off at most up to 135°.
        "equisolid": LensPreset((0.999008, 0.003988, -0.04686, 0.002745)),
        # Fit of 2 tan(phi/2), 8e-3 f off at most up to 110°.
        "stereographic_220": LensPreset((0.963771, 0.15811, -0.125677, 0.096013), math.radians(220.0)),
        # Fit of sin(phi), 2e-4 f off at most up to 85°.
        "orthographic": LensPreset((0.997724, 0.014693, -0.197519, 0.026511), math.radians(170.0)),
        # Camera 0 of TUM-VI (Kannala-Brandt), fitted to 97.5°.
        "tumvi_195": LensPreset((1.0072, -0.03706, 0.06068, -0.028182), math.radians(195.0)),
        # Published calibration of WoodScape: 339.749, -31.988, 48.275, -7.201 px/radⁿ.
        "woodscape": LensPreset((1.0, -0.0941519, 0.1420903, -0.0211951)),
    }
)


def preset_lens(name: str, fov: float) -> Lens:
    """The named lens for a field of view in rad. Raises ValueError beyond the range of its coefficients."""
    preset = LENS_PRESETS[name]
    if fov > preset.max_field_of_view + 1e-9:
        raise ValueError(
            f"the lens {name} is valid up to {math.degrees(preset.max_field_of_view):g}°, "
            f"not for {math.degrees(fov):g}°"
        )
    return Lens(preset.k, fov)
