"""Position of GPS fixes, and its accuracy."""

import math

import imc
from support.rotations import wrap
from support.wgs84 import displacement


def _beside(first: float, lon: float) -> float:
    """The longitude (rad), shifted by a multiple of 2π to within π of `first`."""
    return lon - math.tau * round((lon - first) / math.tau)


def mean_fix(fixes: list[imc.GpsFix]) -> imc.GpsFix:
    """The mean place of the fixes."""
    lat, height = (math.fsum(getattr(fix, name) for fix in fixes) / len(fixes) for name in ("lat", "height"))
    lon = wrap(math.fsum(_beside(fixes[0].lon, fix.lon) for fix in fixes) / len(fixes))
    return imc.GpsFix(lat=lat, lon=lon, height=height)


def offset_from(reference: imc.GpsFix, fix: imc.GpsFix) -> tuple[float, float]:
    """Meters north and east of the reference."""
    height = reference.height
    north, east, _ = displacement(reference.lat, reference.lon, height, fix.lat, fix.lon, height)
    return north, east


def horizontal_variance(fix: imc.GpsFix) -> float:
    """Variance (m²) of each horizontal coordinate of a fix; `hacc` is the root mean square of the horizontal error."""
    return max(1e-4, 0.5 * fix.hacc**2)
