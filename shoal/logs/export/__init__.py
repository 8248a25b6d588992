"""Logs in the formats of other tools; each format is a module, which needs its library."""

from shoal.logs.export.batches import Source
from shoal.logs.export.calibration import OPTICS, is_like
from shoal.logs.export.pictures import exported, exported_ending

__all__ = ["OPTICS", "Source", "exported", "exported_ending", "is_like"]
