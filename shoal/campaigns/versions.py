"""What a run was computed with: versions, and the digest of Shoal's own files."""

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

_ROOMS = ("imc", "mavlink", "runtime", "shoal", "tasks", "world")
_APART = ("cli", "campaigns", "fleet", "logs", "network", "neptus", "rendering", "rerun")  # a run knows nothing of them
_ENDINGS = (".py", ".yaml", ".ini", ".xml", ".npz", ".csv", ".txt")


@cache
def versions() -> str:
    """Shoal with a digest of its files, Python, NumPy and the processor: equal where runs are equal."""
    try:
        shoal = version("shoal")
    except PackageNotFoundError:
        shoal = "?"
    parts = (f"shoal {shoal} ({_digest()[:12]})", f"python {platform.python_version()}", f"numpy {version('numpy')}")
    return ", ".join((*parts, platform.machine()))


def _digest() -> str:
    """A digest of all files of Shoal that a run depends on: a version number does not change with each of them."""
    root = Path(__file__).parent.parent.parent
    total = hashlib.sha256()
    for room in _ROOMS:
        for path in sorted((root / room).rglob("*")):
            parts = path.relative_to(root).parts
            if path.suffix in _ENDINGS and not (room == "shoal" and len(parts) > 2 and parts[1] in _APART):
                total.update(str(path.relative_to(root)).encode())
                total.update(path.read_bytes())
    return total.hexdigest()
