"""Shows what is in logs, what is wrong with them, and where two differ."""

from shoal.logs.inspect.diff import FieldDifference, LogDifference, LogMessage, compare, differing
from shoal.logs.inspect.doctor import examine, repair
from shoal.logs.inspect.formatting import moment, number, rate, size, span
from shoal.logs.inspect.html_report import report
from shoal.logs.inspect.listing import logs_below

__all__ = [
    "FieldDifference",
    "LogDifference",
    "LogMessage",
    "compare",
    "differing",
    "examine",
    "logs_below",
    "moment",
    "number",
    "rate",
    "repair",
    "report",
    "size",
    "span",
]
