"""The documentation builds as a web site, in which each link leads to a page and a heading."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.skipif(sys.version_info < (3, 11, 5), reason="the extra [docs] needs Python 3.11.5")
def test_the_site_builds_with_strict_links(tmp_path):
    command = [sys.executable, ROOT / "docs" / "build_site.py", tmp_path / "site"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    pages = {path.relative_to(tmp_path / "site").as_posix(): path for path in (tmp_path / "site").rglob("*.html")}
    assert {"index.html", "tutorial.html", "from-dune.html", "reference/runtime.kernel.html"} <= set(pages)
    assert 'id="runtime.kernel.EventQueue.schedule_timer"' in pages["reference/runtime.kernel.html"].read_text()
    outside = [
        name for name, path in pages.items() if re.search(r'(?:src|href)="(?:https?:)?//fonts', path.read_text())
    ]
    assert outside == []
