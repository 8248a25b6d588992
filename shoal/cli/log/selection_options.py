"""Selection of a part of a log on the command line: times and names."""

from datetime import UTC, datetime

from support.durations import parse_duration

TIMES = "a time since the start of the log (90, 1h30min), before its end (-30s), or a date (2026-01-01T00:05:00)"


def split_names(words: tuple[str, ...]) -> list[str]:
    """The names in an option that can be repeated, or has several separated by commas."""
    return [word.strip() for text in words for word in text.split(",") if word.strip()]


def parse_log_time(text: str | None, start: float, end: float) -> float | None:
    """Read a time as in TIMES; the result, start and end of the log are in s since 1970 UTC. Raises ValueError."""
    if text is None:
        return None
    try:
        return end - parse_duration(text[1:]) if text.startswith("-") else start + parse_duration(text)
    except ValueError:
        pass
    try:
        time = datetime.fromisoformat(text.removesuffix(" UTC"))
    except ValueError:
        raise ValueError(f"{text!r} is not a time; write {TIMES}") from None
    return (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()
