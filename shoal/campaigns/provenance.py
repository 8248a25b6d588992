"""Provenance of a run: versions, and the digest of Shoal's own files."""

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from runtime.profile import own_etc
from support.top_level_packages import PACKAGES

_APART = (
    "cli",
    "campaigns",
    "console",
    "fleet",
    "logs",
    "network",
    "neptus",
    "rendering",
    "rerun",
)  # no run depends on these
_ENDINGS = (".py", ".yaml", ".ini", ".xml", ".npz", ".csv", ".txt")


@cache
def software_versions() -> str:
    """Shoal with a digest of its files, Python, NumPy and the processor: equal where runs are equal."""
    try:
        shoal = version("shoal")
    except PackageNotFoundError:
        shoal = "?"
    parts = (f"shoal {shoal} ({_digest()[:12]})", f"python {platform.python_version()}", f"numpy {version('numpy')}")
    return ", ".join((*parts, platform.machine()))


def _digest() -> str:
    """A digest of all files of Shoal that a run depends on: a version number does not change with each of them."""
    root, etc = Path(__file__).parent.parent.parent, own_etc()
    total = hashlib.sha256()
    for folder in (*(root / room for room in PACKAGES), etc):
        for path in sorted(folder.rglob("*")):
            if path.suffix not in _ENDINGS or (
                folder != etc and path.is_relative_to(etc)
            ):  # etc is in an installed runtime
                continue
            parts = path.relative_to(folder).parts
            if not (folder.name == "shoal" and len(parts) > 1 and parts[0] in _APART):
                total.update("/".join((folder.name, *parts)).encode())
                total.update(path.read_bytes())
    return total.hexdigest()
