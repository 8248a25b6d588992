"""Finds the chart that the configuration of a log names: a log has the name of its chart, not the chart."""

from pathlib import Path
from typing import NamedTuple

from runtime.profile import load_profile
from support.diagnostics import ProfileError
from world.charts import find_chart_suffix

SECTION, OPTION = "Bathymetry", "Data"


class ChartReference(NamedTuple):
    """A chart as the configuration of a log names it, and whether its file is there."""

    name: str
    is_found: bool

    def describe(self) -> str:
        """The name; of a missing file also the remedy."""
        if self.is_found:
            return self.name
        return f"{self.name} is neither beside the log nor in the working folder: copy it there"


def read_chart_reference(log: Path) -> ChartReference | None:
    """The chart of a log, given its folder or a file in it; None without one, or without a readable configuration."""
    path = (log if log.is_dir() else log.parent) / "Config.ini"
    try:
        profile = load_profile(path, strict=False) if path.is_file() else None
    except (ProfileError, OSError):
        return None
    name = profile.value(SECTION, OPTION).strip() if profile is not None else ""
    if profile is None or not find_chart_suffix(name):
        return None
    try:
        return ChartReference(name, profile.find_file(SECTION, OPTION).is_file())
    except OSError:  # no file can have this name, or its folder cannot be read
        return ChartReference(name, False)
