"""Camera models."""

from world.optics.lens import PRESETS, Floats, Lens, Projection, preset_lens
from world.optics.pinhole import Pinhole

__all__ = [
    "PRESETS",
    "Floats",
    "Lens",
    "Pinhole",
    "Projection",
    "preset_lens",
]
