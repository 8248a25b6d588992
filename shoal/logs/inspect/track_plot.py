"""Draws the track of a vehicle over ground as SVG: colored by depth, with its detections."""

import math
from collections.abc import Iterator, Sequence
from html import escape
from itertools import pairwise

import numpy as np

from runtime.logs import Array
from shoal.logs.inspect.report_data import GliderDetections, ReportData, VehicleMotion
from shoal.logs.inspect.time_plot import WIDTH, html_figure, ticks
from support import wgs84
from support.positions import format_position

HEIGHT, MARGIN = 560, 46
SHADES = 6
MOST_POINTS = 2500
MOST_DOTS = 1500
ARROW, MOST_ARROWS = 230, 12
SMALLEST = 4.0  # m to show, at least, if a vehicle stays where it is


class MapScale:
    """Converts m north and east to the drawing's units."""

    def __init__(self, north: Array, east: Array):
        wide, high = WIDTH - 2 * MARGIN, HEIGHT - 2 * MARGIN
        self.span: float = max(float(np.ptp(east)) / wide, float(np.ptp(north)) / high, SMALLEST / high)
        self.middle: tuple[float, float] = (float(north.min() + north.max()) / 2, float(east.min() + east.max()) / 2)

    def x(self, east: Array | float) -> Array:
        return WIDTH / 2 + (np.asarray(east) - self.middle[1]) / self.span

    def y(self, north: Array | float) -> Array:
        return HEIGHT / 2 - (np.asarray(north) - self.middle[0]) / self.span


def draw_track(content: ReportData) -> str:
    """The track, where it begins and ends, and the detections; a grid in m north and east of the origin."""
    motion, seen = content.motion, content.detections
    if len(motion.time) == 0:
        return html_figure(
            "Track over ground", "", '<p class="none">The log has no EstimatedState with a position.</p>'
        )
    view = MapScale(np.concatenate((motion.north, seen.north)), np.concatenate((motion.east, seen.east)))
    kept = thin_out(motion, view.span)
    body = [
        *_grid(view),
        *_line(motion, kept, view),
        *_arrows(motion, kept, view),
        *_dots(seen, view),
        *_ends(motion, view),
    ]
    marker = '<g class="vehicle" visibility="hidden"><path d="M0-11 7 9 0 5-7 9Z"/></g>'
    places = ";".join(
        f"{time:.1f},{x:.1f},{y:.1f},{math.degrees(heading):.0f}"
        for time, x, y, heading in zip(
            motion.time[kept].tolist(),
            view.x(motion.east[kept]).tolist(),
            view.y(motion.north[kept]).tolist(),
            np.nan_to_num(motion.heading[kept]).tolist(),
            strict=True,
        )
    )
    origin = format_position(*(content.origin or (0.0, 0.0)))
    legend = f'<span class="origin">0, 0 is {origin}</span>' + _shades(motion) + _key(seen)
    head = f'<svg class="map" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" data-places="{places}">'
    drawing = f"{head}{''.join(body)}{marker}</svg>"
    return html_figure("Track over ground", legend, drawing)


def draw_tracks(runs: Sequence[tuple[str, str, ReportData]]) -> str:
    """Tracks of several runs, each with its name and color class, in m north and east of the first run's origin."""
    moved = [(name, color, _moved(run, runs[0][2].origin)) for name, color, run in runs if len(run.motion.time)]
    if not moved:
        return html_figure(
            "Tracks over ground", "", '<p class="none">No log has an EstimatedState with a position.</p>'
        )
    view = MapScale(*(np.concatenate([getattr(m, axis) for _, _, m in moved]) for axis in ("north", "east")))
    body = [*_grid(view)]
    for _, color, motion in moved:
        kept = thin_out(motion, view.span)
        points = zip(view.x(motion.east[kept]).tolist(), view.y(motion.north[kept]).tolist(), strict=True)
        body.append(f'<path class="track {color}" d="M{"L".join(f"{x:.1f} {y:.1f}" for x, y in points)}"/>')
        body.extend(_ends(motion, view))
    legend = "".join(f'<span class="key {color}"><i></i>{escape(name)}</span>' for name, color, _ in moved)
    head = f'<svg class="map" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" data-places="">'
    return html_figure("Tracks over ground", legend, f"{head}{''.join(body)}</svg>")


def _moved(run: ReportData, origin: tuple[float, float] | None) -> VehicleMotion:
    """The motion of a run relative to another origin (latitude, longitude, rad)."""
    if origin is None or run.origin is None:
        return run.motion
    north, east = wgs84.offset(*origin, *run.origin)
    return run.motion._replace(north=run.motion.north + north, east=run.motion.east + east)


def thin_out(motion: VehicleMotion, span: float) -> Array:
    """The places of the points that a drawing of `span` m per unit needs; at most MOST_POINTS and the last."""
    kept = [0]
    least = 0.7 * span
    north, east = motion.north.tolist(), motion.east.tolist()
    for index in range(1, len(north)):
        last = kept[-1]
        if math.hypot(north[index] - north[last], east[index] - east[last]) >= least:
            kept.append(index)
    if kept[-1] != len(north) - 1:
        kept.append(len(north) - 1)
    step = math.ceil(len(kept) / MOST_POINTS)
    return np.unique([*kept[::step], kept[-1]])


def _grid(view: MapScale) -> Iterator[str]:
    left, right = (view.middle[1] + side * WIDTH / 2 * view.span for side in (-1, 1))
    low, high = (view.middle[0] + side * HEIGHT / 2 * view.span for side in (-1, 1))
    step = (marks := ticks(left, right, 8))[1] - marks[0]
    for at in marks:
        x = float(view.x(at))
        yield f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="0" y2="{HEIGHT}"/>'
        if 40 < x < WIDTH - 60:
            yield f'<text class="tick" x="{x:.1f}" y="{HEIGHT - 8}" text-anchor="middle">{_meters(at)}</text>'
    for at in np.arange(math.ceil(low / step), math.floor(high / step) + 1) * step:
        y = float(view.y(at))
        yield f'<line class="grid" x1="0" x2="{WIDTH}" y1="{y:.1f}" y2="{y:.1f}"/>'
        if 40 < y < HEIGHT - 30:
            yield f'<text class="tick" x="8" y="{y + 4:.1f}">{_meters(at)}</text>'
    yield f'<text class="tick" x="{WIDTH - 8}" y="{HEIGHT - 8}" text-anchor="end">m east</text>'
    yield '<text class="tick" x="8" y="18">m north</text>'
    yield f'<g class="compass" transform="translate({WIDTH - 28} 34)"><path d="M0-16 6 8 0 4-6 8Z"/>'
    yield '<text y="22">N</text></g>'


def _meters(value: float) -> str:
    return f"{value:.6g}".replace("-", "−")


def _line(motion: VehicleMotion, kept: Array, view: MapScale) -> Iterator[str]:
    """The track in pieces of one shade each."""
    depth = np.nan_to_num(motion.depth[kept])
    deepest = max(float(depth.max()), 1.0)
    shade = np.clip((depth / deepest * SHADES).astype(np.int64), 0, SHADES - 1)
    points = [
        f"{x:.1f} {y:.1f}"
        for x, y in zip(view.x(motion.east[kept]).tolist(), view.y(motion.north[kept]).tolist(), strict=True)
    ]
    breaks = [0, *(np.flatnonzero(np.diff(shade)) + 1).tolist(), len(points)]
    for begin, end in pairwise(breaks):
        piece = "L".join(points[max(begin - 1, 0) : end])
        yield f'<path class="track s{shade[begin]}" d="M{piece}"/>'


def _arrows(motion: VehicleMotion, kept: Array, view: MapScale) -> Iterator[str]:
    """Arrowheads along the track, at least ARROW units apart."""
    x, y = view.x(motion.east[kept]), view.y(motion.north[kept])
    way = np.concatenate(([0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
    step = max(ARROW, float(way[-1]) / MOST_ARROWS)
    for index in np.searchsorted(way, np.arange(step / 2, way[-1], step)).tolist():
        if 0 < index < len(x):
            course = math.degrees(math.atan2(x[index] - x[index - 1], y[index - 1] - y[index]))
            place = f"translate({x[index]:.1f} {y[index]:.1f}) rotate({course:.0f})"
            yield f'<path class="way" d="M0-7 5 5 0 2-5 5Z" transform="{place}"/>'


def _shades(motion: VehicleMotion) -> str:
    deepest = float(np.nan_to_num(motion.depth).max())
    if deepest < 0.5:
        return ""
    boxes = "".join(f'<i class="shade s{number}"></i>' for number in range(SHADES))
    return f'<span class="depths">surface {boxes} {deepest:.1f} m deep</span>'


def _dots(seen: GliderDetections, view: MapScale) -> Iterator[str]:
    step = math.ceil(len(seen.time) / MOST_DOTS) or 1
    for x, y in zip(view.x(seen.east[::step]).tolist(), view.y(seen.north[::step]).tolist(), strict=True):
        yield f'<circle class="seen" cx="{x:.1f}" cy="{y:.1f}" r="2.5"/>'
    found: list[int] = np.unique(seen.id).tolist()
    for identity in found if len(found) <= 40 else []:
        of = seen.id == identity
        x, y = float(view.x(np.median(seen.east[of]))), float(view.y(np.median(seen.north[of])))
        yield f'<path class="mug" d="M{x - 7:.1f} {y:.1f}h14M{x:.1f} {y - 7:.1f}v14"/>'
        yield f'<text class="label" x="{x + 10:.1f}" y="{y - 6:.1f}">MUG {escape(str(identity))}</text>'


def _key(seen: GliderDetections) -> str:
    return '<span class="key mugs"><i></i>MUG detections</span>' if len(seen.time) else ""


def _ends(motion: VehicleMotion, view: MapScale) -> Iterator[str]:
    xs, ys = view.x(motion.east[[0, -1]]).tolist(), view.y(motion.north[[0, -1]]).tolist()
    close = math.hypot(xs[1] - xs[0], ys[1] - ys[0]) < 60
    yield f'<g class="start"><circle cx="{xs[0]:.1f}" cy="{ys[0]:.1f}" r="6"/></g>'
    yield f'<g class="end"><rect x="{xs[1] - 5.5:.1f}" y="{ys[1] - 5.5:.1f}" width="11" height="11"/></g>'
    side, anchor = (-10, "end") if close else (10, "start")
    yield f'<text class="label" x="{xs[0] + side:.1f}" y="{ys[0] + 4:.1f}" text-anchor="{anchor}">start</text>'
    yield f'<text class="label" x="{xs[1] + 10:.1f}" y="{ys[1] + 4:.1f}">end</text>'
