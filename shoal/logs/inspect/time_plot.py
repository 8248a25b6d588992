"""Draws curves and bands over time as SVG, small enough for a page and sharp enough to zoom."""

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from runtime.logs import Array
from shoal.logs.inspect.report_data import TimeSpan
from support.text_length import clip

WIDTH, LEFT, RIGHT = 1000, 132, 10
INNER = WIDTH - LEFT - RIGHT
BINS = 700  # each shows its lowest and highest value
PAUSE = 3.0  # s
STEPS = (1, 2, 5)
TIME_STEPS = (1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 14400, 21600, 43200, 86400)


class Curve(NamedTuple):
    """A line: name, color class, times (s), values in `unit`, read out with `digits` decimals.

    If it `wraps`, as an angle does, the line breaks there.
    """

    name: str
    color: str
    time: Array
    value: Array
    unit: str
    digits: int = 1
    wraps: bool = False


def decimate(time: Array, value: Array, bins: int = BINS) -> tuple[Array, Array]:
    """The lowest and the highest value of each of `bins` equal spans of time, in order, and the ends."""
    good = np.isfinite(value)
    time, value = time[good], value[good]
    if len(time) <= 2 * bins:
        return time, value
    begin, end = time[0], time[-1]
    place = np.minimum(((time - begin) / (end - begin) * bins).astype(np.int64), bins - 1) if end > begin else 0 * time
    order = np.lexsort((value, place))
    starts = np.flatnonzero(np.diff(place[order], prepend=-1))
    ends = np.append(starts[1:], len(order)) - 1
    chosen = np.unique(np.concatenate((order[starts], order[ends], [0, len(time) - 1])))
    return time[chosen], value[chosen]


def ticks(low: float, high: float, about: int) -> list[float]:
    """Round numbers between `low` and `high`, `about` of them."""
    if not high > low:
        return [low]
    rough = (high - low) / about
    power = 10.0 ** math.floor(math.log10(rough))
    step = next((power * step for step in STEPS if power * step >= rough * 0.999), 10 * power)
    first = math.ceil(low / step - 1e-9)
    return [number * step for number in range(first, math.floor(high / step + 1e-9) + 1)]


def time_ticks(duration: float, about: int = 8) -> list[float]:
    step = next(
        (step for step in TIME_STEPS if step * about >= duration), 86400 * max(1, round(duration / 86400 / about))
    )
    return [float(at) for at in range(0, math.floor(duration) + 1, step)]


def elapsed_text(seconds: float) -> str:
    """ "2:05", "1:02:05" since the start."""
    whole = round(seconds)
    hours, rest = divmod(abs(whole), 3600)
    text = f"{hours}:{rest // 60:02}:{rest % 60:02}" if hours else f"{rest // 60}:{rest % 60:02}"
    return f"-{text}" if whole < 0 else text


def draw_curves(
    title: str,
    curves: Sequence[Curve],
    duration: float,
    height: int = 190,
    down: bool = False,
    ground: str = "",
    limits: tuple[float, float] | None = None,
    marks: Sequence[float] | None = None,
) -> str:
    """Curves over time. `down` draws larger values lower; the area below the curve named `ground` is filled;
    `limits` and `marks` set the ends and the lines of the vertical axis."""
    shown = [(curve, *decimate(curve.time, curve.value)) for curve in curves]
    low, high = limits or _limits([value for _, _, value in shown])
    plot, top = height - 30, 8
    body: list[str] = []
    for at in ticks(low, high, 4) if marks is None else marks:
        y = _y(at, low, high, plot, down)
        body.append(f'<line class="grid" x1="0" x2="{INNER}" y1="{y:.1f}" y2="{y:.1f}"/>')
    for curve, time, value in shown:
        points = list(zip(_x(time, duration).tolist(), _y(value, low, high, plot, down).tolist(), strict=True))
        data = f'data-name="{escape(curve.name)}"'
        if curve.name == ground and points:
            area = "".join(f"L{x:.1f} {y:.2f}" for x, y in points)[1:]
            edge = f"L{points[-1][0]:.1f} {plot}L{points[0][0]:.1f} {plot}Z"
            body.append(f'<path class="ground" d="M{area}{edge}"/>')
        d = _path(points, time, PAUSE, wrap=plot * 0.6 if curve.wraps else math.inf)
        body.append(f'<path class="curve {curve.color}" {data} d="{d}"/>')
    axis = "".join(
        f'<text class="tick" x="{LEFT - 6}" y="{top + _y(at, low, high, plot, down) + 4:.1f}" text-anchor="end">'
        f"{_number(at)}</text>"
        for at in (ticks(low, high, 4) if marks is None else marks)
    )
    legend = "".join(
        f'<span class="key {curve.color}" data-name="{escape(curve.name)}" data-unit="{escape(curve.unit)}" '
        f'data-digits="{curve.digits}"><i></i>{escape(curve.name)} <b></b></span>'
        for curve in curves
    )
    above, below = (low, high) if down else (high, low)
    scale = f'data-top="{above:.9g}" data-bottom="{below:.9g}" data-plot="{plot}"'
    return html_figure(title, legend, time_svg(height, plot, "".join(body), axis, duration, scale))


def draw_timeline(title: str, rows: Iterable[tuple[str, Iterable[TimeSpan]]], duration: float, legend: str = "") -> str:
    """A row for each name, with a bar for each stretch: colored if it is a state, else with its value in it."""
    body: list[str] = []
    labels: list[str] = []
    row_height, y = 20, 0
    for name, stretches in rows:
        text = f"{escape(clip(name, 18))}<title>{escape(name)}</title>"
        labels.append(f'<text class="row" x="{LEFT - 8}" y="{y + 22}">{text}</text>')
        for place, stretch in enumerate(stretches):
            x, end = (float(_x(np.array(at), duration)) for at in (stretch.begin, stretch.end))
            what = ": ".join(filter(None, (stretch.value, stretch.text)))
            tooltip = f"{name}\n{what}\n{elapsed_text(stretch.begin)} – {elapsed_text(stretch.end)}"
            kind = state_css_class(stretch.value)
            fits = kind == "other" and end - x > 7 * len(stretch.value) + 8
            inside = f'<text x="{x + 6:.1f}" y="{y + 14}">{escape(stretch.value)}</text>' if fits else ""
            kind += " alt" * (place % 2 and kind == "other")
            body.append(
                f'<rect class="band {kind}" x="{x:.1f}" y="{y + 2}" height="{row_height - 4}" '
                f'width="{max(end - x, 1.5):.1f}" data-tip="{escape(tooltip)}"/>{inside}'
            )
        y += row_height
    return html_figure(title, legend, time_svg(y + 30, y, "".join(body), "", duration, "", "".join(labels)))


def state_css_class(value: str) -> str:
    """The CSS class of a state; "other" if it is not a known one."""
    known = {"BOOT", "NORMAL", "FAULT", "ERROR", "FAILURE", "WARNING", "CRITICAL"}
    return value.lower() if value in known else "other"


def html_figure(title: str, legend: str, drawing: str) -> str:
    return (
        f'<figure><figcaption><h2>{escape(title)}</h2><div class="legend">{legend}</div></figcaption>{drawing}</figure>'
    )


def time_svg(height: int, plot: int, body: str, axis: str, duration: float, data: str, over: str = "") -> str:
    """A drawing over time; the page's script zooms the inner <svg>."""
    at = (
        f'<text class="tick" x="{LEFT + INNER * time / duration:.1f}" y="{height - 6}" text-anchor="middle">'
        f"{elapsed_text(time)}</text>"
        for time in (time_ticks(duration) if duration > 0.0 else [0.0])
        if duration > 0.0
    )
    return (
        f'<svg class="time" viewBox="0 0 {WIDTH} {height}" {data} role="img">'
        f'<rect class="frame" x="{LEFT}" y="8" width="{INNER}" height="{plot}"/>{axis}'
        f'<g class="times">{"".join(at)}</g>'
        f'<svg class="plot" x="{LEFT}" y="8" width="{INNER}" height="{plot}" viewBox="0 0 {INNER} {plot}" '
        f'preserveAspectRatio="none">{body}</svg>{over}'
        f'<line class="cursor" y1="8" y2="{8 + plot}"/><rect class="choice" y="8" height="{plot}"/></svg>'
    )


def _limits(values: Sequence[Array]) -> tuple[float, float]:
    known = np.concatenate(values) if values else np.empty(0)
    if len(known) == 0:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    room = max((high - low) * 0.06, 0.05, abs(high) * 1e-6)
    return (0.0 if 0.0 <= low < (high - low) else low - room), high + room


def _x(time: Array, duration: float) -> Array:
    return time / duration * INNER if duration > 0.0 else time * 0.0


def _y(value: Array | float, low: float, high: float, plot: int, down: bool) -> Array:
    share = (np.asarray(value) - low) / (high - low)
    return plot * (share if down else 1.0 - share)


def _path(points: list[tuple[float, float]], time: Array, pause: float, wrap: float) -> str:
    """The line; it breaks at long gaps, and where an angle wraps around."""
    usual = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    parts: list[str] = []
    for index, (x, y) in enumerate(points):
        broken = index == 0 or time[index] - time[index - 1] > max(pause, 8.0 * usual)
        broken = broken or abs(y - points[index - 1][1]) > wrap
        parts.append(f"{'M' if broken else 'L'}{x:.1f} {y:.2f}")
    return "".join(parts)


def _number(value: float) -> str:
    return f"{value:.6g}".replace("-", "−")
