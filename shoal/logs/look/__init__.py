"""Shows what is in logs, what is wrong with them, and where two differ."""

from shoal.logs.look.comparison import FieldDifference, LogDifference, LogMessage, compare, differing
from shoal.logs.look.doctor import examine, repair
from shoal.logs.look.formatting import moment, number, rate, size, span
from shoal.logs.look.listing import logs_below
from shoal.logs.look.page import report

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
