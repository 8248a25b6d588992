"""A summary of several simulated runs of the rest of a plan, for the page."""

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from support.wgs84 import displace, offset

MARKS = 4  # times at which the places of all runs are enclosed
NEARLY = 0.97  # of the horizon: the last row of a run is a little before its end
COMPLETED = "completed"

ForecastResult = dict[str, Any]
"""A run, as `shoal.console.plans.forecast_worker.forecast` gives it."""


def describe_runs(runs: Sequence[ForecastResult], horizon: float) -> str:
    """Time of the plan's end, battery there, and crossings of each limit, each with the number of runs."""
    count = len(runs)
    ended = [run for run in runs if run["outcome"] == COMPLETED]
    words = [f"{count} runs to {horizon:g} s" if count != 1 else f"1 run to {horizon:g} s"]
    if ended:
        words.append(f"the plan ends in {_span([run['seconds'] for run in ended], 0)} s in {len(ended)} of {count}")
    if going := sum(run["seconds"] is None for run in runs):
        words.append(f"the plan continues beyond {horizon:g} s in {going} of {count}")
    failures = Counter(run["outcome"] for run in runs if run["outcome"] not in ("", COMPLETED))
    words += [f"fails ({reason}) in {number} of {count}" for reason, number in failures.most_common()]
    levels = [run["battery"] for run in runs if run["battery"] is not None]
    if levels:
        words.append(f"battery at the end {_span(levels, 1)} %")
    crossed = Counter(text for run in runs for text in run["crossed"])
    words += [f"{text} in {number} of {count}" for text, number in crossed.most_common()]
    if not crossed:
        words.append(f"no limit is crossed in {count} of {count}")
    return "; ".join(words)


def enclosing_circles(runs: Sequence[ForecastResult], horizon: float) -> list[dict[str, float]]:
    """Circles around the places of all runs at some times, ended ones at their last place.

    `seconds` from now, `lat`, `lon` (degrees) of the mean, `radius` (m), `runs` in it. Empty without runs.
    """
    tracks = [run["rows"] for run in runs if run["rows"]]
    latest = max((track[-1][0] for track in tracks), default=0.0)
    end = horizon if latest > NEARLY * horizon else latest
    return [_circle(tracks, end * number / MARKS) for number in range(1, MARKS + 1)] if end > 0.0 else []


def _circle(tracks: Sequence[list[list[float]]], seconds: float) -> dict[str, float]:
    rows = [[track[0], *(row for row in track if row[0] <= seconds)][-1] for track in tracks]
    places = [(math.radians(row[1]), math.radians(row[2])) for row in rows]
    offsets = [offset(*places[0], *place) for place in places]
    north, east = (math.fsum(axis) / len(offsets) for axis in zip(*offsets, strict=True))
    lat, lon, _ = displace(*places[0], 0.0, north, east)
    radius = max(math.dist((north, east), each) for each in offsets)
    return {
        "seconds": round(seconds),
        "lat": round(math.degrees(lat), 6),
        "lon": round(math.degrees(lon), 6),
        "radius": round(radius, 1),
        "runs": len(tracks),
    }


def _span(numbers: Sequence[float], digits: int) -> str:
    least, most = f"{min(numbers):.{digits}f}", f"{max(numbers):.{digits}f}"
    return least if least == most else f"{least} to {most}"
