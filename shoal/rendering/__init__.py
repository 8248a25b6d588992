"""Takes pictures and labels of a simulated run after the fact."""

from shoal.rendering.logged_exposures import ExposedPicture, LoggedExposures, find_exposures
from shoal.rendering.parallel_render import RenderSummary, render_log

__all__ = ["ExposedPicture", "LoggedExposures", "RenderSummary", "find_exposures", "render_log"]
