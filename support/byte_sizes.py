"""Parses amounts of data such as 500 MB or 2GiB."""

import math
import re

_DECIMAL = {"": 1, "b": 1, "kb": 10**3, "mb": 10**6, "gb": 10**9, "tb": 10**12}
_UNITS = _DECIMAL | {"kib": 1 << 10, "mib": 1 << 20, "gib": 1 << 30, "tib": 1 << 40}
_SIZE = re.compile(r"(\d+(?:\.\d*)?|\.\d+)\s*([a-z]*)")


def parse_byte_size(text: str) -> int:
    """Bytes of "500MB", "2 GiB" or "1000". Raises ValueError for anything else."""
    match = _SIZE.fullmatch(text.strip().lower())
    if match is None or match.group(2) not in _UNITS:
        raise ValueError(f"{text!r} is not an amount of data; write 500MB, 2GiB or a number of bytes")
    size = float(match.group(1)) * _UNITS[match.group(2)]
    if math.isinf(size):
        raise ValueError(f"{text[:20]!r}... is too large an amount of data")
    return int(size)
