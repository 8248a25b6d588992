"""Durations in the options of commands, and times of the day in their output."""

from datetime import UTC, datetime

import click

from support.durations import parse_duration

SHORTEST = 0.01  # s; the shortest period of a repeated action


def parse_period(context: click.Context, parameter: click.Parameter, text: str | None) -> float | None:
    """Click callback: seconds of a duration of at least `SHORTEST`."""
    period = parse_duration_option(context, parameter, text)
    if period is not None and period < SHORTEST:
        raise click.BadParameter(f"{text!r} is too short; use at least {SHORTEST:g} s")
    return period


def parse_duration_option(_: click.Context, __: click.Parameter, text: str | None) -> float | None:
    """Click callback: seconds of a duration."""
    try:
        return None if text is None else parse_duration(text)
    except ValueError as error:
        raise click.BadParameter(str(error)) from None


def format_clock_time(timestamp: float) -> str:
    """A time stamp (s since 1970) as the time of the day in UTC."""
    try:
        return datetime.fromtimestamp(timestamp, UTC).strftime("%H:%M:%S.%f")[:-3]
    except (OverflowError, ValueError, OSError):
        return "--:--:--.---"
