"""What tests of commands share."""

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from tests import command


@pytest.fixture
def shoal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Result]:
    """The command in the folder of the test."""
    monkeypatch.chdir(tmp_path)
    return command.shoal
