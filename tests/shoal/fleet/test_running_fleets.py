"""Which fleets run: one of a name, noted as long as it runs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from shoal.fleet import find_running_fleets, register_fleet, stop_fleet


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path


def test_a_folder_that_somebody_made_in_tmp_stops_no_fleet(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Anybody can make it, as a file, a link or a folder that all may write to."""
    squatted = folder / f"shoal-{os.getuid()}"
    squatted.write_text("")
    with register_fleet("leixoes"):
        assert find_running_fleets() == {"leixoes": os.getpid()}
    (folder / "no home").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder / "no home"))
    for make in (lambda: None, lambda: squatted.symlink_to(folder / "cache"), lambda: squatted.mkdir(0o777)):
        make()
        if squatted.is_dir() and not squatted.is_symlink():
            squatted.chmod(0o777)
        with pytest.raises(PermissionError, match="belongs to somebody else"), register_fleet("leixoes"):
            pass
        squatted.rmdir() if squatted.is_dir() and not squatted.is_symlink() else squatted.unlink()


def test_a_fleet_is_noted_until_its_end_however_it_ends(folder: Path) -> None:
    again = f"the fleet leixoes runs already, process {os.getpid()}"

    def run() -> None:
        with register_fleet("leixoes"):
            assert find_running_fleets() == {"leixoes": os.getpid()}
            with pytest.raises(ValueError, match=again), register_fleet("leixoes"):
                pass
            sys.exit(0)

    with pytest.raises(SystemExit):
        run()
    assert find_running_fleets() == {}
    assert [path.read_text() for path in folder.rglob("*.fleet")] == [""]
    with register_fleet("leixoes"):
        assert find_running_fleets() == {"leixoes": os.getpid()}


def test_a_fleet_that_has_just_ended_has_ended() -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as gone:
        pass
    assert stop_fleet("leixoes", gone.pid)
