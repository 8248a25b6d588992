"""Draws two runs on one HTML page: their figures, their tracks and their curves over each other."""

from collections.abc import Sequence

import numpy as np

import imc
from runtime.logs import LogSummary, summarize
from shoal.html import escape_text, html_section, html_table
from shoal.logs.inspect.field_plot import COLORS, FieldPlot, join_plots, read_field_plots
from shoal.logs.inspect.report_data import ReportData, read_report_data
from shoal.logs.inspect.report_document import report_document
from shoal.logs.inspect.report_figures import run_figures
from shoal.logs.inspect.time_plot import Curve, draw_curves
from shoal.logs.inspect.track_plot import draw_tracks

NAMES = ("A", "B")


def render_comparison(logs: Sequence[imc.Log], fields: Sequence[str] = ()) -> str:
    """The page of two logs; the time of each counts from its own start.

    Raises ValueError for an empty log, and for one of `fields` that a log does not have.
    """
    summaries = [summarize(log) for log in logs]
    for log, summary in zip(logs, summaries, strict=True):
        if summary.packets == 0:
            raise ValueError(f"{log.path}: there is no message in this log")
    runs = [read_report_data(log, summary) for log, summary in zip(logs, summaries, strict=True)]
    own = [
        [*_motion_plots(run), *read_field_plots(log, run.summary, fields)] for log, run in zip(logs, runs, strict=True)
    ]
    duration = max(0.0, *(run.summary.duration for run in runs))
    parts = [
        _figures(runs),
        draw_tracks([(name, color, run) for name, color, run in zip(NAMES, COLORS, runs, strict=False)]),
        *(
            draw_curves(plot.title, plot.curves, duration, down=plot.title.startswith("Depth"))
            for plot in join_plots(zip(NAMES, own, strict=True))
        ),
    ]
    title = " and ".join(f"{name}: {_name(summary)}" for name, summary in zip(NAMES, summaries, strict=True))
    about = " · ".join(f"{name}: {summary.path}" for name, summary in zip(NAMES, summaries, strict=True))
    return report_document(title, about, "".join(parts), "Times of day are those of A.", duration, summaries[0].start)


def _name(summary: LogSummary) -> str:
    return f"{summary.names.system_name(summary.owner)}, {summary.path.parent.name}"


def _figures(runs: Sequence[ReportData]) -> str:
    by_words: dict[str, list[str]] = {}
    for place, run in enumerate(runs):
        for value, words, _ in run_figures(run):
            by_words.setdefault(words, [""] * len(runs))[place] = value
    rows = [(words, *values) for words, values in by_words.items()]
    keys = (
        f'<span class="key {color}"><i></i>{escape_text(name)}</span>'
        for name, color in zip(NAMES, COLORS, strict=False)
    )
    return html_section(
        "Figures", f'<div class="legend">{"".join(keys)}</div>' + html_table(("", *NAMES), rows, numbers=(1, 2))
    )


def _motion_plots(run: ReportData) -> list[FieldPlot]:
    motion = run.motion
    if len(motion.time) == 0:
        return []
    heading = np.degrees(motion.heading) % 360.0
    curves = {
        "Depth, m": Curve("", "a", motion.time, motion.depth, "m", 2),
        "Altitude, m": Curve("", "a", motion.time, motion.altitude, "m", 2),
        "Heading, °": Curve("", "a", motion.time, heading, "°", 0, wraps=True),
        "Speed over ground, m/s": Curve("", "a", motion.time, motion.speed, "m/s", 2),
        "Plan progress, %": Curve("", "a", *run.progress, "%", 0),
    }
    return [FieldPlot(title, [curve]) for title, curve in curves.items() if np.isfinite(curve.value).any()]
