"""Draws a log as one HTML page that needs no other file and no network."""

import math
from collections.abc import Iterable, Sequence
from functools import partial
from html import escape

import numpy as np

import imc
from imc.lsf import ReportProgress
from runtime.logs import LogSummary, summarize
from shoal.html import cut_text, escape_text, html_section, html_table, html_tiles
from shoal.logs.inspect.field_plot import FieldPlot, read_field_plots
from shoal.logs.inspect.report_data import LogbookLine, ReportData, TimeSpan, read_report_data
from shoal.logs.inspect.report_document import report_document
from shoal.logs.inspect.report_figures import run_figures
from shoal.logs.inspect.time_plot import Curve, draw_curves, draw_timeline, elapsed_text, state_css_class
from shoal.logs.inspect.time_size_text import format_duration, format_noun_count, format_rate, format_size, format_time
from shoal.logs.inspect.track_plot import draw_track
from support import wgs84
from support.positions import format_position
from support.terminal_text import printable

MOST_ROWS = 40  # entities in the timeline
MOST_ENTRIES = 200
MOST_TYPES = 20
MOST_STRETCHES = 300
SEVERE = ("WARNING", "ERROR", "CRITICAL")


def render_report(log: imc.Log, progress: ReportProgress | None = None, fields: Sequence[str] = ()) -> str:
    """The page of a log, with plots of `fields` ("Temperature.value", "Temperature.value:CTD").

    Text of the log is escaped. Raises ValueError for an empty log, and for a field that it does not have.
    """
    summary = summarize(log, progress)
    if summary.packets == 0:
        raise ValueError(f"{log.path}: there is no message in this log")
    plots = read_field_plots(log, summary, fields)
    return render_page(read_report_data(log, summary), plots)


def render_page(content: ReportData, plots: Sequence[FieldPlot] = ()) -> str:
    summary = content.summary
    name = summary.names.system_name(summary.owner)
    duration = max(summary.duration, 0.0) if math.isfinite(summary.duration) else 0.0
    parts = [
        html_tiles(run_figures(content)),
        draw_track(content),
        *_charts(content, duration),
        *(draw_curves(plot.title, plot.curves, duration) for plot in plots),
        *_timelines(content, duration),
        _detections(content),
        _judged(content),
        _book(content.entries, content),
        _rates(summary),
        _troubles(summary),
    ]
    source = summary.schema_source.name if summary.schema_source else "the built-in definitions"
    about = f"{format_time(summary.start)}, {format_duration(summary.duration)} · {summary.path}"
    footer = f"IMC {summary.schema.version} from {source}."
    return report_document(name, about, "".join(parts), footer, duration, summary.start)


def _charts(content: ReportData, duration: float) -> Iterable[str]:
    motion = content.motion
    if len(motion.time) == 0:
        return
    bed = motion.depth + motion.altitude
    curves = [Curve("depth", "a", motion.time, motion.depth, "m", 2)]
    if content.is_surface_vehicle:
        if np.isfinite(bed).any():
            below = [Curve("altitude", "c", motion.time, motion.altitude, "m", 2)]
            yield draw_curves("Altitude above the seabed, m", below, duration, 130)
    elif not np.isfinite(motion.depth).any():
        curves = [Curve("altitude", "c", motion.time, motion.altitude, "m", 2)]
        yield draw_curves("Altitude, m", curves, duration, 200)
    elif np.isfinite(bed).any():
        curves.append(Curve("altitude", "c", motion.time, motion.altitude, "m", 2))
        curves.insert(0, Curve("seabed", "ground", motion.time, bed, "m", 1))
        low, high = min(0.0, float(np.nanmin(motion.depth))), float(np.nanmax(bed)) * 1.08
        yield draw_curves(
            "Depth and seabed, m", curves[:2], duration, 220, down=True, ground="seabed", limits=(low - 0.3, high)
        )
        yield draw_curves("Altitude above the seabed, m", curves[2:], duration, 130)
    else:
        yield draw_curves("Depth, m", curves, duration, 200, down=True)
    roll, pitch = (np.degrees(angle) for angle in (motion.roll, motion.pitch))
    yield draw_curves(
        "Roll and pitch, °",
        [Curve("roll", "b", motion.time, roll, "°"), Curve("pitch", "a", motion.time, pitch, "°")],
        duration,
    )
    heading = np.degrees(motion.heading) % 360.0
    turn = [Curve("heading", "a", motion.time, heading, "°", 0, wraps=True)]
    yield draw_curves("Heading, °", turn, duration, 160, limits=(0.0, 360.0), marks=(0.0, 90.0, 180.0, 270.0, 360.0))
    yield draw_curves(
        "Speed over ground, m/s", [Curve("speed", "c", motion.time, motion.speed, "m/s", 2)], duration, 150
    )
    times, percent = content.progress
    if np.isfinite(percent).any():
        plan = [Curve("progress", "a", times, percent, "%", 0)]
        yield draw_curves("Plan progress, %", plan, duration, 130, limits=(0.0, 103.0), marks=(0.0, 50.0, 100.0))


def _timelines(content: ReportData, duration: float) -> Iterable[str]:
    rows: list[tuple[str, list[TimeSpan]]] = []
    if content.maneuvers:
        rows.append(("maneuver", content.maneuvers))
    if content.modes:
        rows.append(("mode", content.modes))
    severe = [entry for entry in content.entries if entry.level in SEVERE]
    if severe:
        marks = [TimeSpan(entry.time, entry.time, entry.level, f"{entry.context}: {entry.text}") for entry in severe]
        rows.append(("log book", marks))
    if rows:
        yield draw_timeline("Plan and mode", _printable(rows), duration)
    changing = {name: found for name, found in content.entities.items() if _worst(found) > 0}
    calm = [name for name in content.entities if name not in changing]
    few = len(content.entities) <= 12
    order = sorted(content.entities if few else changing, key=lambda name: (-_worst(content.entities[name]), name))
    if order:
        states = ("BOOT", "NORMAL", "FAULT", "ERROR", "FAILURE")
        legend = "".join(f'<span><i class="state {state_css_class(s)}"></i>{s.lower()}</span>' for s in states)
        shown = [(name, content.entities[name]) for name in order[:MOST_ROWS]]
        yield draw_timeline("Entity states", _printable(shown), duration, legend)
    if calm and not few:
        more = f" {len(order) - MOST_ROWS} more changed." if len(order) > MOST_ROWS else ""
        names = ", ".join(sorted(calm))
        yield (
            f"<section><details><summary>{format_noun_count(len(calm), 'entity was', 'entities were')} "
            f"normal all the time.{more}</summary>{escape(printable(names))}</details></section>"
        )


def _worst(stretches: list[TimeSpan]) -> int:
    """The rank of the worst state; BOOT is bad only if it never ends."""
    ranks = {"NORMAL": 0, "BOOT": 0, "WARNING": 2, "FAULT": 2, "ERROR": 3, "CRITICAL": 4, "FAILURE": 4}
    ended = int(bool(stretches) and stretches[-1].value != "NORMAL")
    return max((ranks.get(stretch.value, 1) for stretch in stretches), default=0) or ended


def _detections(content: ReportData) -> str:
    seen = content.detections
    if len(seen.time) == 0:
        return ""
    rows: list[tuple[str, ...]] = []
    for identity in np.unique(seen.id)[:MOST_ENTRIES].tolist():
        of = seen.id == identity
        north, east = float(seen.north[of].mean()), float(seen.east[of].mean())
        spread = math.hypot(float(seen.north[of].std()), float(seen.east[of].std()))
        lat, lon, _ = wgs84.displace(*(content.origin or (0.0, 0.0)), 0.0, north, east)
        where = format_position(lat, lon)
        times = (elapsed_text(float(seen.time[of].min())), elapsed_text(float(seen.time[of].max())))
        figures = (f"{north:.2f} m", f"{east:.2f} m", f"± {spread:.2f} m")
        rows.append((f"MUG {identity}", str(int(of.sum())), *times, *figures, where))
    head = ("", "detections", "first", "last", "north", "east", "spread", "latitude, longitude")
    return html_section("MUG detections", html_table(head, rows, numbers=range(1, 7)))


def _judged(content: ReportData) -> str:
    rows: list[tuple[str, ...]] = []
    for label, gliders, found in content.detection_scores:
        for glider, thing in zip(gliders, found.objects, strict=True):
            looks = ("", "") if thing.pictures < 0 else (str(thing.pictures), str(thing.missed_picture_count))
            errors = [
                f"{value:.2f}{unit}" if math.isfinite(value) else ""
                for value, unit in ((thing.rms, " m"), (thing.nees, ""))
            ]
            rows.append((label, f"MUG {glider}", *looks, str(thing.detections), str(thing.switches), *errors))
        rows.append((label, "false alarms", "", "", str(found.false_alarms), "", "", ""))
    if content.unscored_reason:
        text = f'<p class="none">Not compared: {escape_text(cut_text(content.unscored_reason))}.</p>'
        return html_section("MUG detections and the truth", text)
    if not rows:
        return ""
    head = ("by", "", "in view", "missed", "detections", "id switches", "error, rms", "NEES")
    note = (
        "<p class=none>In view are pictures that show the glider, large enough, by the truth. NEES is the squared "
        "error over the stated variance of a single detection: 2 if that is right, less for a track.</p>"
    )
    table = html_table(head, rows[:MOST_ENTRIES], numbers=range(2, 8))
    return html_section("MUG detections and the truth", table + note)


def _book(entries: list[LogbookLine], content: ReportData) -> str:
    severe = [entry for entry in entries if entry.level in SEVERE]
    others = [entry for entry in entries if entry.level not in SEVERE]
    head = ("time", "level", "who", "what")
    text = html_table(head, map(_line, severe[:MOST_ENTRIES]), numbers=(0,)) if severe else '<p class="none">None.</p>'
    if len(severe) > MOST_ENTRIES:
        text += f'<p class="none">The first {MOST_ENTRIES} of {sum(content.levels[level] for level in SEVERE)}.</p>'
    if others:
        table = html_table(head, map(_line, others[:MOST_ENTRIES]), numbers=(0,))
        first = f"the first {MOST_ENTRIES} of " if len(others) > MOST_ENTRIES else ""
        count = format_noun_count(len(others), "other entry", "other entries")
        text += f"<details><summary>{first}{count}</summary>{table}</details>"
    return html_section("Errors and warnings of the log book", text)


def _line(entry: LogbookLine) -> tuple[str, ...]:
    return elapsed_text(entry.time), entry.level.lower(), cut_text(entry.context), cut_text(entry.text)


def _rates(summary: LogSummary) -> str:
    most = max(tally.size for tally in summary.by_type.values())
    rows = [
        (
            *(escape_text(name), str(tally.count), format_rate(tally.rate), format_size(tally.size)),
            f'<div class=bar><i style="width:{100 * tally.size / most:.0f}%"></i></div>',
        )
        for name, tally in summary.by_type.items()
    ]
    draw = partial(html_table, ("message", "count", "rate", "size", ""), numbers=(1, 2, 3), as_is=True)
    text = draw(rows[:MOST_TYPES])
    if rows[MOST_TYPES:]:
        table = draw(rows[MOST_TYPES:])
        text += f"<details><summary>{len(rows) - MOST_TYPES} rarer types</summary>{table}</details>"
    return html_section("Messages", text)


def _troubles(summary: LogSummary) -> str:
    rows = [
        (f"byte {loss.offset}", format_noun_count(loss.length, "byte"), loss.reason)
        for loss in summary.losses[:MOST_ENTRIES]
    ]
    for step in summary.clock_steps[:MOST_ENTRIES]:
        what = f"the clock of {summary.names.system_name(step.src)} was set at {format_time(step.before)}"
        rows.append((f"byte {step.offset}", format_duration(step.after - step.before), what))
    table = html_table(("where", "how much", "what"), rows, numbers=(1,)) if rows else ""
    return html_section("Damage and clock steps", table)


def _printable(rows: Iterable[tuple[str, list[TimeSpan]]]) -> list[tuple[str, list[TimeSpan]]]:
    """Rows to draw: without control characters, and at most MOST_STRETCHES each, the worst and longest."""
    found: list[tuple[str, list[TimeSpan]]] = []
    for name, stretches in rows:
        by_weight = sorted(stretches, key=lambda at: (-_worst([at]), at.begin - at.end))[:MOST_STRETCHES]
        kept = sorted(by_weight, key=lambda at: at.begin)
        drawn = [at._replace(value=printable(cut_text(at.value)), text=printable(cut_text(at.text))) for at in kept]
        found.append((printable(cut_text(name)), drawn))
    return found
