"""Tasks that can make an input are found by their source."""

import py_compile
from pathlib import Path

import pytest

from runtime.profile import load_profile
from shoal.rerun.publishing_tasks import publishing_sections

TASK = """
import imc
from runtime import Task, periodic


class Whistle(Task):
    \"\"\"Sends a text.\"\"\"

    @periodic(1.0)
    def tick(self) -> None:
        self.publish(imc.Sms(contents="here"))
"""


@pytest.mark.parametrize(("compiled", "found"), [(False, {"Sms": ["whistle_of_mine.Whistle"]}), (True, {})])
def test_a_task_of_your_own_is_found_and_one_without_source_ends_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, compiled: bool, found: dict[str, list[str]]
) -> None:
    name = "whistle_of_mine" if not compiled else "compiled_whistle"
    source = tmp_path / f"{name}.py"
    source.write_text(TASK)
    if compiled:
        py_compile.compile(str(source), cfile=str(tmp_path / f"{name}.pyc"))
        source.unlink()
    monkeypatch.syspath_prepend(tmp_path)
    profile = tmp_path / "mine.ini"
    profile.write_text(f"[General]\nVehicle = lauv-noptilus-1\n[{name}.Whistle]\nEnabled = Always\n")
    assert publishing_sections(load_profile(profile), {"Sms", "GpsFix"}) == found
