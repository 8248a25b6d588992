"""Drawings of a campaign for its page, as pieces of HTML."""

import base64
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from shoal.campaigns.jobs import ResultRow, unpack_track
from shoal.campaigns.optional_import import import_optional
from shoal.campaigns.pass_rate import PassRate
from shoal.campaigns.report.sensitivity import Columns

PASSED, FAILED, LINE = "#1769c2", "#c62f36", "#8795a3"
MOST_PLOTS = 24
COLUMNS = 3
BINS = 40
STEPS = 10  # of pass rates over an input
MOST_POINTS = 250_000  # of all tracks on the map
EARTH = 6_371_000.0  # m
_STYLE = {
    "font.size": 8,
    "axes.edgecolor": LINE,
    "axes.labelcolor": "#5c6b7a",
    "xtick.color": "#5c6b7a",
    "ytick.color": "#5c6b7a",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "shoal",
    "figure.facecolor": "none",
    "axes.facecolor": "none",
}


def histogram_plots(columns: Columns, passed: Any, units: Mapping[str, str]) -> str:
    """Distribution of each column, passed and failed runs apart."""

    def draw(axes: Any, name: str) -> None:
        column = columns[name]
        good = np.isfinite(column)
        parts = [column[good & passed], column[good & ~passed]]
        bins = min(BINS, max(5, int(math.sqrt(good.sum()))))
        axes.hist(parts, bins=bins, stacked=True, histtype="stepfilled", color=[PASSED, FAILED])
        if name.startswith("margins."):
            axes.axvline(0.0, color=LINE, linewidth=0.8, linestyle="--")
        axes.set_title(_named(name, units), fontsize=8)

    return _grid_of(list(columns)[:MOST_PLOTS], draw, 1.5)


def pass_rate_plots(inputs: Columns, passed: Any, units: Mapping[str, str], rate: PassRate) -> str:
    """The pass rate over each input, in steps of equally many runs, each with its interval if that of all has one.

    `passed` is 1, 0, or NaN where it is not known.
    """

    def draw(axes: Any, name: str) -> None:
        column, known = inputs[name], np.flatnonzero(np.isfinite(passed))
        order = known[np.argsort(column[known], kind="stable")]
        steps = [part for part in np.array_split(order, min(STEPS, max(1, len(order) // 5))) if len(part)]
        rates = [replace(rate, passed=int(passed[part].sum()), runs=len(part), unknown=0) for part in steps]
        places = [float(np.median(column[part])) for part in steps]
        shares = np.array([step.ratio for step in rates])
        spread: Any = None
        if rate.has_interval and rates:
            spread = 100 * np.abs(np.array([step.interval for step in rates]).T - shares)
        axes.errorbar(places, 100 * shares, spread, color=PASSED, marker="o", markersize=3, linewidth=1)
        axes.set_ylim(-4, 104)
        axes.set_title(_named(name, units), fontsize=8)

    return _grid_of(list(inputs)[:MOST_PLOTS], draw, 1.5)


def scatter_plots(
    pairs: Sequence[tuple[str, str]], inputs: Columns, outputs: Columns, passed: Any, units: Mapping[str, str]
) -> str:
    """Outputs over inputs, one point per run."""

    size = max(2.0, min(6.0, 60.0 / math.sqrt(len(passed))))  # pt

    def draw(axes: Any, pair: tuple[str, str]) -> None:
        x, y = inputs[pair[0]], outputs[pair[1]]
        for chosen, color in ((passed, PASSED), (~passed, FAILED)):
            axes.plot(x[chosen], y[chosen], ".", color=color, markersize=size, alpha=0.5, markeredgewidth=0)
        axes.set_xlabel(_named(pair[0], units))
        axes.set_title(pair[1].partition(".")[2] or pair[1], fontsize=8)

    return _grid_of(list(pairs), draw, 1.9, picture=True)


def best_so_far_plot(values: Sequence[float], best: Sequence[float]) -> str:
    """The values of the runs of a search, and the best one until each; empty without a finite one."""
    if not any(math.isfinite(value) for value in best):
        return ""
    finite = [[value if math.isfinite(value) else math.nan for value in column] for column in (values, best)]
    with import_optional("matplotlib").rc_context(_STYLE):
        figure = _figure(9.0, 2.2)
        axes = figure.add_subplot()
        axes.plot(range(len(values)), finite[0], ".", color=LINE, markersize=4, markeredgewidth=0)
        axes.step(range(len(best)), finite[1], where="post", color=PASSED, linewidth=1)
        axes.set_xlabel("run")
        return _drawing(figure)


def track_map(rows: Sequence[ResultRow]) -> str:
    """All tracks on one map, north up, those of failed runs above the others; empty without a track."""
    tracks = [
        (track[:, :2], bool(row["passed"]))
        for row in rows
        for name in row
        if name.startswith("tracks.") and len(track := unpack_track(row[name])) > 1
    ]
    if not tracks:
        return ""
    every = max(1, math.ceil(math.fsum(len(track) for track, _ in tracks) / MOST_POINTS))
    tracks.sort(key=lambda track: not track[1])
    lat, lon = (float(value) for value in tracks[0][0][0])
    scale = np.array([math.radians(1.0) * EARTH, math.radians(1.0) * EARTH * math.cos(math.radians(lat))])
    lines = [((track[::every] - (lat, lon)) * scale)[:, ::-1] for track, _ in tracks]
    figure = _figure(9.0, 6.0)
    axes = figure.add_subplot()
    collection = import_optional("matplotlib.collections").LineCollection
    alpha = max(0.05, min(0.8, 30.0 / len(lines)))
    colors = [PASSED if passed else FAILED for _, passed in tracks]
    axes.add_collection(collection(lines, colors=colors, linewidths=0.6, alpha=alpha))
    starts = np.array([line[0] for line in lines])
    axes.plot(starts[:, 0], starts[:, 1], ".", color="#1a8a5a", markersize=4)
    axes.autoscale()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"m east of {lon:.5f}°")
    axes.set_ylabel(f"m north of {lat:.5f}°")
    return _picture(figure, 130)


def _named(name: str, units: Mapping[str, str]) -> str:
    short = name.partition(".")[2]
    unit = units.get(short, "")
    short = short if len(short) <= 44 else f"…{short[-43:]}"
    return f"{short}, {unit}" if unit else short


def _grid_of(names: Sequence[Any], draw: Any, height: float, *, picture: bool = False) -> str:
    if not names:
        return ""
    with import_optional("matplotlib").rc_context(_STYLE):
        lines = math.ceil(len(names) / COLUMNS)
        figure = _figure(9.0, height * lines)
        for place, name in enumerate(names, 1):
            axes = figure.add_subplot(lines, COLUMNS, place)
            draw(axes, name)
            axes.locator_params(nbins=5)
        return _picture(figure, 110) if picture else _drawing(figure)


def _figure(width: float, height: float) -> Any:
    made = import_optional("matplotlib.figure").Figure(figsize=(width, height), layout="constrained")
    import_optional("matplotlib.backends.backend_agg").FigureCanvasAgg(made)
    return made


def _drawing(figure: Any) -> str:
    out = io.StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = re.sub(r"(\d+\.\d\d)\d+", r"\1", text[text.index("<svg") :])  # 0.01 pt is less than anybody sees
    return re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)


def _picture(figure: Any, dpi: int) -> str:
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=dpi, metadata={"Software": None})
    return f'<img alt="" src="data:image/png;base64,{base64.b64encode(out.getvalue()).decode()}">'
