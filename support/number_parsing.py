"""Reads numbers in files that people write, and limits numbers."""


def parse_number(text: str) -> int | float:
    """A decimal or 0x integer, or a finite float. Raises ValueError."""
    try:
        return int(text, 16 if text.lower().startswith(("0x", "-0x")) else 10)
    except ValueError:
        pass
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if value - value != 0.0:
        raise ValueError(f"{text!r} is not a number")
    return value


def clamp_magnitude(value: float, limit: float) -> float:
    """The value, limited to between -`limit` and `limit`."""
    return -limit if value < -limit else limit if value > limit else value
