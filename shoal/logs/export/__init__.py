"""Logs in the formats of other tools; each format is a module, which needs its library."""

from shoal.logs.export.batches import ReportBytes, Source

__all__ = ["ReportBytes", "Source"]
