"""Takes pictures and labels of a simulated run after the fact."""

from shoal.rendering.exposures import Exposures, Shot, expose
from shoal.rendering.processes import Rendered, render

__all__ = ["Exposures", "Rendered", "Shot", "expose", "render"]
