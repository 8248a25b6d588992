"""Leaflet and uPlot from the wheels that carry them, whose bytes are known."""

import hashlib
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path


@dataclass(frozen=True)
class BrowserFile:
    """A file of a Python package, and the SHA-256 of the bytes that are served."""

    package: str
    path: str
    sha256: str


FILES = {
    "leaflet.js": BrowserFile(
        "js_lib_leaflet",
        "static/js_lib_leaflet/leaflet.js",
        "db49d009c841f5ca34a888c96511ae936fd9f5533e90d8b2c4d57596f4e5641a",
    ),
    "leaflet.css": BrowserFile(
        "js_lib_leaflet",
        "static/js_lib_leaflet/leaflet.css",
        "a7837102824184820dfa198d1ebcd109ff6d0ff9a2672a074b9a1b4d147d04c6",
    ),
    "uplot.js": BrowserFile(
        "youplot", "vendor/uplot.iife.min.js", "2d27e8ad3d228164525ce213f9dc716f39b4e3aee0cc773fb3491c96cf4921a2"
    ),
    "uplot.css": BrowserFile(
        "youplot", "vendor/uplot.min.css", "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04"
    ),
}
"""Libraries by the name in the page's requests: Leaflet 1.9.4 and uPlot 1.6.31, as their authors publish them."""


def read_browser_files() -> tuple[dict[str, bytes], list[str]]:
    """The files that are installed with the known bytes, by name, and a sentence for each that is not."""
    found: dict[str, bytes] = {}
    missing: list[str] = []
    for name, file in FILES.items():
        spec = find_spec(file.package)
        folder = None if spec is None or spec.origin is None else Path(spec.origin).parent
        try:
            data = b"" if folder is None else (folder / file.path).read_bytes()
        except OSError as error:
            missing.append(f"{name}: {error.strerror}: {error.filename}")
            continue
        if folder is None:
            missing.append(f"{name}: no package {file.package}: pip install 'shoal[console]'")
        elif hashlib.sha256(data).hexdigest() != file.sha256:
            missing.append(f"{name}: {folder / file.path} is not the known version, and is not served")
        else:
            found[name] = data
    return found, missing
