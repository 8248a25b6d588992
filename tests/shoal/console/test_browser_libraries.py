"""Leaflet and uPlot: known bytes, or none."""

import hashlib

from shoal.console import browser_libraries
from shoal.console.browser_libraries import FILES, BrowserFile, read_browser_files


def test_the_files_are_those_of_their_authors():
    found, missing = read_browser_files()
    assert missing == []
    assert {name: hashlib.sha256(data).hexdigest() for name, data in found.items()} == {
        name: file.sha256 for name, file in FILES.items()
    }
    assert b"Leaflet 1.9.4" in found["leaflet.js"]
    assert b"(v1.6.31)" in found["uplot.js"]


def test_other_bytes_and_missing_packages_are_named_and_not_served(monkeypatch):
    file = FILES["uplot.js"]
    others = {
        "uplot.js": BrowserFile(file.package, file.path, "0" * 64),
        "leaflet.js": BrowserFile("no_such_package", "leaflet.js", file.sha256),
        "uplot.css": BrowserFile(file.package, "vendor/none.css", file.sha256),
    }
    monkeypatch.setattr(browser_libraries, "FILES", others)
    found, missing = read_browser_files()
    assert found == {}
    assert [text.partition(":")[0] for text in missing] == ["uplot.js", "leaflet.js", "uplot.css"]
    assert "not the known version" in missing[0]
    assert "pip install 'shoal[console]'" in missing[1]
