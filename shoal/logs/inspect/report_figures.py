"""The figures that sum up a run: duration, distance, depth, speed, messages, errors."""

import numpy as np

from shoal.logs.inspect.report_data import ReportData
from shoal.logs.inspect.time_size_text import format_duration, format_noun_count


def run_figures(content: ReportData) -> list[tuple[str, str, str]]:
    """Value, words, and "bad", "fair" or nothing for each figure."""
    summary, motion = content.summary, content.motion
    figures = [(format_duration(summary.duration), "duration", "")]
    if len(motion.time):
        moving = motion.speed[motion.speed > 0.05]
        figures.append((f"{content.distance:,.0f} m".replace(",", " "), "over ground", ""))
        for height, words in ((motion.depth, "greatest depth"), (motion.altitude, "greatest altitude")):
            if np.isfinite(height).any() and not content.is_surface_vehicle:
                figures.append((f"{float(np.nanmax(height)):.1f} m", words, ""))
                break
        figures.append((f"{float(np.median(moving)) if len(moving) else 0.0:.2f} m/s", "median speed", ""))
    if len(content.detections.time):
        words = f"detections of {format_noun_count(len(np.unique(content.detections.id)), 'MUG')}"
        figures.append((f"{len(content.detections.time)}", words, ""))
    figures.append((f"{summary.packets:,}".replace(",", " "), "messages", ""))
    bad, fair = content.levels["ERROR"] + content.levels["CRITICAL"], content.levels["WARNING"]
    figures.append((f"{bad} · {fair}", "errors · warnings", "bad" if bad else "fair" if fair else ""))
    if summary.losses:
        figures.append((str(len(summary.losses)), "damaged places", "bad"))
    return figures
