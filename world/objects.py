"""Objects in the world: where the gliders (MUGs) lie."""

import math
from collections.abc import Sequence


def parse_gliders(texts: Sequence[str]) -> tuple[tuple[float, float], ...]:
    """North and east (m) of each glider: a pair in each text ("1.0 0.3", "25 5"), or all numbers one by one.

    Raises ValueError if the numbers are not finite or do not come in pairs.
    """
    rows = [text.split() for text in texts]
    if all(len(row) == 1 for row in rows):
        words = [row[0] for row in rows]
        rows = [words[place : place + 2] for place in range(0, len(words), 2)]
    return tuple(_pair(row) for row in rows)


def _pair(row: list[str]) -> tuple[float, float]:
    try:
        north, east = map(float, row)
    except ValueError:
        north = east = math.nan
    if not math.isfinite(north + east):
        raise ValueError(f"{' '.join(row)!r}: expected north and east")
    return north, east
