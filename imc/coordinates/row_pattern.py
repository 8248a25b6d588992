"""Patterns of parallel rows, as offsets in m from their first corner."""

from collections.abc import Callable, Iterator
from math import cos, sin, tan

from imc.messages import Rows, RowsCoverage

MOST_ROWS = 10_000
SHORTEST = 1e-3  # m
ROUNDING = 1e-9  # m; a sum of steps may exceed the width by this much


def row_corners(
    *,
    bearing: float,
    cross_angle: float,
    width: float,
    length: float,
    step: float,
    overshoot: float = 0.0,
    alternation: float = 1.0,
    square: bool = False,
    right: bool = True,
) -> list[tuple[float, float]]:
    """North and east (m) of the corners of rows of `length` at `bearing`, side by side over `width`, as DUNE goes.

    The first point is `overshoot` before the corner, and each row ends `overshoot` beyond the area. The step at the far
    end is `alternation` times `step`, the one at the near end 2 - `alternation` times; it is turned by `cross_angle`
    out of the right angle to the rows, away from the side to which the path goes. The path returns to the edge of the
    area during a step or, with `square`, after it. Lengths are in m, angles in rad. Raises ValueError if width, length
    or step is below 1 mm, or for more than 10 000 rows.
    """
    return list(
        iterate_row_corners(bearing, cross_angle, width, length, lambda: step, overshoot, alternation, square, right)
    )


def iterate_row_corners(
    bearing: float,
    cross_angle: float,
    width: float,
    length: float,
    step: Callable[[], float],
    overshoot: float,
    alternation: float,
    square: bool,
    right: bool,
) -> Iterator[tuple[float, float]]:
    """Corners of `row_corners`, one by one; `step` is called for its length (m) before each step to the next row."""
    if not min(width, length, step()) >= SHORTEST:
        raise ValueError("width, length and step must be at least 1 mm")
    if width > MOST_ROWS * step() * abs(cos(cross_angle)):
        raise ValueError(f"there would be more than {MOST_ROWS} rows")
    c, s = cos(bearing), sin(bearing)
    side = 1.0 if right else -1.0

    def at(x: float, y: float) -> tuple[float, float]:
        return c * x - s * side * y, s * x + c * side * y

    yield at(-overshoot, 0.0)
    x = y = 0.0
    yield at(x, y)
    ahead, share = 1.0, alternation
    while True:
        x += ahead * (length + overshoot)
        yield at(x, y)
        across = share * step()
        x, y = x - across * sin(cross_angle), y + across * cos(cross_angle)
        # An alternation of 0 or 200 % goes back on the same row. DUNE does not end there, either.
        if abs(across * cos(cross_angle)) > SHORTEST and abs(y) > width + ROUNDING:
            return
        if square:
            yield at(x, y)
        x -= ahead * overshoot
        yield at(x, y)
        ahead, share = -ahead, 2.0 - share


def maneuver_corner_offsets(
    area: Rows | RowsCoverage, swath: Callable[[], float] | None = None
) -> Iterator[tuple[float, float]]:
    """North and east (m) of the corners of a maneuver, one by one. Raises ValueError like `row_corners`.

    The row spacing of RowsCoverage follows from its sonar, or is `swath()` before each step if that is less.
    """
    if isinstance(area, Rows):
        step, alternation = area.hstep, 0.01 * area.alternation
    else:
        step, alternation = sonar_row_spacing(area.angaperture, area.range, area.overlap), 1.0
    return iterate_row_corners(
        bearing=area.bearing,
        cross_angle=area.cross_angle,
        width=area.width,
        length=area.length,
        step=lambda: step if swath is None else min(step, swath()),
        overshoot=area.coff,
        alternation=alternation,
        square=bool(area.flags & Rows.Flags.SQUARE_CURVE),
        right=bool(area.flags & Rows.Flags.CURVE_RIGHT),
    )


def sonar_row_spacing(aperture: float, reach: float, overlap: float) -> float:
    """Row spacing (m) for a sonar: `aperture` (rad) of its fan, `reach` (m), `overlap` (%) of its swaths, as in DUNE.

    The fan points straight down, so at its range it covers 2 reach sin(aperture/2); without an aperture 2 reach. Each
    of two neighbors gives half of the overlap.
    """
    covered = sin(0.5 * aperture) if aperture > 0.0 else 1.0
    return 2.0 * reach * covered * (1.0 - 0.005 * overlap)


def altitude_row_spacing(aperture: float, altitude: float, overlap: float) -> float:
    """Row spacing (m) at an `altitude` (m) above a flat bottom, of which the fan covers 2 altitude tan(aperture/2)."""
    return 2.0 * altitude * tan(0.5 * aperture) * (1.0 - 0.005 * overlap)
