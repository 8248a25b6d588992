"""Parses durations such as 90s, 10min or 1h30min."""

import re

_UNITS = {"ms": 0.001, "s": 1.0, "": 1.0, "min": 60.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
LONGEST = 1e10  # s; three centuries
_PART = re.compile(r"(\d+(?:\.\d*)?|\.\d+)\s*([a-z]*)\s*")


def parse_duration(text: str) -> float:
    """Seconds of "90", "10min", "1h30min", "500ms". Raises ValueError for anything else."""
    word, position, total = text.strip().lower(), 0, 0.0
    while position < len(word):
        match = _PART.match(word, position)
        if match is None or match.group(2) not in _UNITS:
            break
        total += float(match.group(1)) * _UNITS[match.group(2)]
        position = match.end()
    if not word or position < len(word) or total > LONGEST:
        raise ValueError(f"{text!r} is not a duration; write 90s, 10min or 1h30min")
    return total
