"""Patterns of parallel rows, as offsets in m from their first corner."""

from math import cos, sin, tan

from imc.messages import Rows, RowsCoverage

MOST_ROWS = 10_000


def rows(
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
    """North and east (m) of the corners of rows of `length` at `bearing`, side by side over `width`.

    The first point is `overshoot` before the corner. The step at the far end is `alternation` times `step`, the one at
    the near end 2 - `alternation` times. The sides lean by `cross_angle`. With `square`, the path turns `overshoot`
    beyond the end of each row. Lengths are in m, angles in rad. Raises ValueError if width, length or step is below
    1 mm, or for more than 10 000 rows.
    """
    if min(width, length, step) < 1e-3:
        raise ValueError("width, length and step must be at least 1 mm")
    if width / step > MOST_ROWS:
        raise ValueError(f"there would be more than {MOST_ROWS} rows")
    side = 1.0 if right else -1.0
    beyond = overshoot if square else 0.0
    steps = alternation * step, (2.0 - alternation) * step
    across, far = 0.0, False
    points = [(-overshoot, 0.0), (0.0, 0.0)]
    while True:
        far = not far
        end = length + beyond if far else -beyond
        lean = across * tan(cross_angle)
        points.append((end + lean, across))
        across += steps[0] if far else steps[1]
        if across > width + 1e-9:
            break
        lean = across * tan(cross_angle)
        points.append((end + lean, across))
        if square:
            points.append(((length if far else 0.0) + lean, across))
    c, s = cos(bearing), sin(bearing)
    return [(c * x - s * side * y, s * x + c * side * y) for x, y in points]


def rows_of(area: Rows | RowsCoverage) -> list[tuple[float, float]]:
    """North and east (m) of the corners of a maneuver. Raises ValueError like `rows`.

    The row spacing of RowsCoverage follows from its sonar.
    """
    if isinstance(area, Rows):
        step, alternation = area.hstep, area.alternation / 100.0
    else:
        step, alternation = swath(area.angaperture, area.range, area.overlap / 100.0), 1.0
    return rows(
        bearing=area.bearing,
        cross_angle=area.cross_angle,
        width=area.width,
        length=area.length,
        step=step,
        overshoot=area.coff,
        alternation=alternation,
        square=bool(area.flags & Rows.Flags.SQUARE_CURVE),
        right=bool(area.flags & Rows.Flags.CURVE_RIGHT),
    )


def swath(aperture: float, reach: float, overlap: float) -> float:
    """Row spacing (m) that a sonar covers: `aperture` (rad) of its fan, `reach` (m), `overlap` of rows (0 to 1).

    The fan points straight down, so at its range it covers 2 reach sin(aperture/2).
    """
    return 2.0 * reach * sin(0.5 * abs(aperture)) * (1.0 - overlap)
