"""Shows what is in logs, what is wrong with them, and where two differ."""

from shoal.logs.inspect.chart_reference import ChartReference, read_chart_reference
from shoal.logs.inspect.diff import FieldDifference, LogDifference, LogMessage, compare_logs, differing_fields
from shoal.logs.inspect.doctor import examine_log, repair_log
from shoal.logs.inspect.folder_listing import LogOverview, log_overview, logs_below
from shoal.logs.inspect.html_report import render_report
from shoal.logs.inspect.run_comparison import render_comparison
from shoal.logs.inspect.time_size_text import format_duration, format_noun_count, format_rate, format_size, format_time

__all__ = [
    "ChartReference",
    "FieldDifference",
    "LogDifference",
    "LogMessage",
    "LogOverview",
    "compare_logs",
    "differing_fields",
    "examine_log",
    "format_duration",
    "format_noun_count",
    "format_rate",
    "format_size",
    "format_time",
    "log_overview",
    "logs_below",
    "read_chart_reference",
    "render_comparison",
    "render_report",
    "repair_log",
]
