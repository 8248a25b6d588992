"""Where indices of logs are kept in tests."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from imc.lsf import log as lsf


@pytest.fixture
def every_index_is_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """Writes indices of small logs too, and puts the cache in the test's folder."""
    monkeypatch.setattr(lsf, "WORTH_KEEPING", 1)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return iter([None])
