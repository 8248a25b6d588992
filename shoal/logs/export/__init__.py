"""Logs in the formats of other tools; each format is a module, which needs its library."""

from shoal.logs.export.camera_calibration import OPTICS, is_like
from shoal.logs.export.message_batches import Source
from shoal.logs.export.photo_files import exported, exported_ending

__all__ = ["OPTICS", "Source", "exported", "exported_ending", "is_like"]
