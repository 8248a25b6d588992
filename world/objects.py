"""Objects in the world: where the gliders (MUGs) lie."""

import math
from collections.abc import Sequence


def parse_gliders(texts: Sequence[str]) -> tuple[tuple[float, float], ...]:
    """North and east (m) of each glider, from "1.0 0.3, 25 5" split at the commas or at all blanks.

    Raises ValueError if the numbers are not finite or do not come in pairs.
    """
    words = " ".join(texts).split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        raise ValueError(f"{', '.join(texts)!r}: expected numbers") from None
    if len(numbers) % 2 or not all(map(math.isfinite, numbers)):
        raise ValueError(f"{', '.join(texts)!r}: expected pairs of north and east")
    return tuple(zip(numbers[::2], numbers[1::2], strict=True))
