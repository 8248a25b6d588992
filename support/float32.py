"""Numbers of 32 bits."""

import numpy as np


def shortest_float32(value: float) -> float:
    """The shortest number with the same 32 bits: 0.1, not 0.10000000149."""
    return float(str(np.float32(value)))
