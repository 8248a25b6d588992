"""Folders of the user, by the XDG base directory specification."""

import os
from pathlib import Path


def cache_folder() -> Path:
    """Shoal's folder for what it can make again. Raises RuntimeError if the user has no home."""
    named = os.environ.get("XDG_CACHE_HOME", "")  # a relative one counts as none
    return (Path(named) if os.path.isabs(named) else Path.home() / ".cache") / "shoal"


def config_folder() -> Path:
    """Shoal's folder for what the user has set up."""
    named = os.environ.get("XDG_CONFIG_HOME", "")  # a relative one counts as none
    return Path(named if os.path.isabs(named) else os.path.expanduser("~/.config"), "shoal")
