"""Numbers in files that people write."""


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
