"""Logs in the formats of other tools; each format is a module, which needs its library."""

from shoal.logs.export.batches import Source

__all__ = ["Source"]
