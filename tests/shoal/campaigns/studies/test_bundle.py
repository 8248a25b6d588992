"""What a study is made of travels by content: files, profiles, plans, messages, and the tasks of a user."""

import os
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from runtime.profile import load_profile
from shoal.campaigns import load_study
from shoal.campaigns.results.append_log import read_append_log
from shoal.campaigns.studies.bundle import StudyBundle, parse_bundle
from shoal.campaigns.studies.bundle_workspace import BundleError
from shoal.campaigns.studies.user_module_dependencies import find_user_modules
from shoal.scenarios import ScenarioDependencies
from shoal.scenarios.file_dependencies import profile_dependencies
from tests.outside import until

ROOT = Path(__file__).parents[4]
WHISTLE = """\
import imc
from runtime import Task, param, periodic
from tones.scale import pitch


class Whistle(Task):
    \"\"\"Whistles once a second.\"\"\"

    loud: float = param(1.0, "", "Factor.")

    @periodic(1.0)
    def whistle(self) -> None:
        self.publish(imc.Temperature(value=self.loud * pitch()))
"""
SCALE = "def pitch():\n    from . import tuning\n    return tuning.A\n"
STUDY = """\
scenario:
  scenario: whistle
  vehicle:
    profile: mine
    modes: [Kinematic]
    plan: out.yaml
    parameters: {whistle.Whistle: {Enabled: Always}}
  expect:
    - {name: whistles, eventually: Temperature.value > 0, within: 5 s}
  metrics: {pitch: {max: Temperature.value}}
  limit: 3 s
vary:
  vehicle/parameters/whistle.Whistle/Loud: {uniform: [1, 2]}
runs: 4
"""
MESSAGE = """\
name: IMC
version: 5.4.31
messages:
  WhaleCall:
    id: 30001
    name: Whale Call
    fields:
      level: {type: fp32_t, name: Sound Pressure Level, unit: dB}
"""
PLAN = "plan: out\norigin: 41.185°, -8.7062°\nspeed: 1.2 m/s\ndepth: 1 m\nmaneuvers:\n  - goto: {north: 80, east: 20}\n"


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A study beside a user's profile, plan and tasks, in the working folder."""
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    for name in [name for name in sys.modules if name.split(".")[0] in ("whistle", "tones")]:
        monkeypatch.delitem(sys.modules, name)
    return write(tmp_path)


def write(folder):
    (folder / "etc").mkdir(parents=True)
    (folder / "tones").mkdir()
    (folder / "tones" / "__init__.py").write_text("")
    (folder / "tones" / "scale.py").write_text(SCALE)
    (folder / "tones" / "tuning.py").write_text("A = 440.0\n")
    (folder / "whistle.py").write_text(WHISTLE)
    (folder / "unused.py").write_text("X = 1\n")
    (folder / "etc" / "mine.ini").write_text("[Require more.ini]\n[General]\nVehicle = mine\n")
    (folder / "etc" / "more.ini").write_text("[Require lauv-noptilus-1.ini]\n")
    (folder / "out.yaml").write_text(PLAN)
    (folder / "mine.study.yaml").write_text(STUDY)
    return folder / "mine.study.yaml"


def test_all_that_a_study_names_is_in_its_bundle(study, monkeypatch):
    monkeypatch.chdir(study.parent)
    bundle = load_study(Path("mine.study.yaml")).bundle
    own = {
        Path(path).relative_to(study.parent).as_posix()
        for path in bundle.files
        if Path(path).is_relative_to(study.parent)
    }
    assert own == {
        *("mine.study.yaml", "out.yaml", "etc/mine.ini", "etc/more.ini"),
        *("whistle.py", "tones/__init__.py", "tones/scale.py", "tones/tuning.py"),
    }
    assert bundle.modules == ("tones", "tones.scale", "tones.tuning", "whistle")
    assert bundle.code == (str(study.parent),)
    assert parse_bundle(bundle.pack()) == bundle


@pytest.mark.heavy
def test_a_changed_task_of_a_user_is_another_study(study, monkeypatch):
    monkeypatch.chdir(study.parent)
    first = load_study(study).digest
    assert load_study(study).digest == first
    (study.parent / "unused.py").write_text("X = 2\n")
    assert load_study(study).digest == first
    (study.parent / "tones" / "tuning.py").write_text("A = 441.0\n")
    assert load_study(study).digest != first


@pytest.mark.heavy
def test_files_that_tasks_read_are_named_in_the_study(study, monkeypatch):
    monkeypatch.chdir(study.parent)
    (study.parent / "tables").mkdir()
    (study.parent / "tables" / "a.csv").write_text("1")
    first = load_study(study).digest
    study.write_text(f"{STUDY}files: [tables]\n")
    named = load_study(study)
    assert str(study.parent / "tables" / "a.csv") in named.bundle.files
    (study.parent / "tables" / "a.csv").write_text("2")
    assert len({first, named.digest, load_study(study).digest}) == 3
    study.write_text(f"{STUDY}files: [table]\n")
    with pytest.raises(ValueError, match=r"mine.study.yaml:\d+: there is no file or folder 'table'"):
        load_study(study)


def test_a_profile_or_plan_that_is_drawn_travels(study, monkeypatch):
    monkeypatch.chdir(study.parent)
    (study.parent / "etc" / "other.ini").write_text("[Require mine.ini]\n")
    study.write_text(STUDY.replace("runs: 4", "  vehicle/profile: {choice: [mine, other]}\nruns: 4"))
    assert str(study.parent / "etc" / "other.ini") in load_study(study).bundle.files


def test_messages_and_files_that_a_profile_names_travel(study, monkeypatch):
    monkeypatch.chdir(study.parent)
    (study.parent / "etc" / "more.yaml").write_text("messages: {}\n")
    (study.parent / "etc" / "more.ini").write_text(
        "[Require lauv-noptilus-1.ini]\n[World]\nWater Type = more.yaml\n[Vision.Recording/Old]\nSource = more.yaml\n"
    )
    found = profile_dependencies(load_profile("mine"), ("Kinematic",))
    assert list(found.data) == ["World: Water Type = more.yaml"]  # a task that is not enabled reads nothing


def test_own_modules_are_found_without_running_them(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    (tmp_path / "first.py").write_text(
        "import second as s, numpy, json\nraise SystemExit\ntry:\n  import a.b.c\nexcept E: pass\n"
    )
    (tmp_path / "second.py").write_text("def f():\n    from a import d\n")
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "c.py").write_text("from .. import d\nfrom ...out import of_reach\n")
    (tmp_path / "a" / "d.py").write_text("this is no Python")
    (tmp_path / "json.py").write_text("")
    assert list(find_user_modules(["first", "runtime.task", "tasks.control.auv.brakes"])) == [
        "a.b.c",
        "a.d",
        "first",
        "second",
    ]


SCRIPT = """
import sys
from pathlib import Path
from shoal.campaigns import run_study, load_study
from runtime.vehicle import add_task_folder
if __name__ == "__main__":
    add_task_folder(Path.cwd())
    study = load_study(Path(sys.argv[1]))
    print("read", flush=True)
    sys.stdin.readline()
    data = run_study(study, Path("runs"), workers=int(sys.argv[2]))
    for row in data.counted_rows:
        loud = row["values.vehicle/parameters/whistle.Whistle/Loud"]
        print(row["metrics.pitch"], loud, row["error"], row["warnings"])
"""


def name_absolutely(study):
    """Let the study and its files name all others by absolute paths."""
    folder = study.parent
    far = folder / "elsewhere"
    far.mkdir()
    (far / "out.yaml").write_text(PLAN)
    (far / "more.yaml").write_text(MESSAGE)
    (far / "mine.ini").write_text(f"[Require ../etc/more.ini]\n[General]\nVehicle = mine\nMessages = {far}/more.yaml\n")
    text = STUDY.replace("profile: mine", f"profile: {far}/mine.ini").replace("plan: out.yaml", f"plan: {far}/out.yaml")
    inside = textwrap.dedent(text[: text.index("vary:")].removeprefix("scenario:\n"))
    (far / "mine.scenario.yaml").write_text(inside)
    study.write_text(f"scenario: {far}/mine.scenario.yaml\n{text[text.index('vary:') :]}")


@pytest.mark.heavy
@pytest.mark.parametrize("named", ["relative", "absolute", "roundabout", "inside"])
def test_what_the_campaign_has_read_counts_and_not_what_is_there_later(tmp_path, named):
    study = write(tmp_path)
    if named == "inside":
        name_absolutely(study)
    (tmp_path / "go.py").write_text(SCRIPT)
    (tmp_path / "below").mkdir()
    path = {"absolute": study, "roundabout": tmp_path / "below" / ".." / study.name}.get(named, study.name)
    command = [sys.executable, "go.py", str(path), "1"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "cwd": tmp_path, "env": environment}
    with subprocess.Popen(command, **pipes) as process:
        assert process.stdout.readline() == "read\n"
        (tmp_path / "tones" / "tuning.py").write_text("A = 1.0\n")
        (tmp_path / "out.yaml").write_text("broken")
        study.write_text("broken")
        (tmp_path / "etc" / "more.ini").unlink()
        shutil.rmtree(tmp_path / "elsewhere", ignore_errors=True)
        said, _ = process.communicate("go\n", timeout=60.0)
    rows = [line.split(maxsplit=2) for line in said.splitlines()]
    assert len(rows) == 4
    for pitch, loud, *rest in rows:
        assert float(pitch) == pytest.approx(440.0 * float(loud), rel=1e-6)
        assert not rest


@pytest.mark.heavy
def test_a_campaign_that_is_killed_leaves_no_copies(tmp_path):
    study = write(tmp_path)
    study.write_text(STUDY.replace("runs: 4", "runs: 9999"))
    (tmp_path / "go.py").write_text(SCRIPT)
    folder = tmp_path / "temporary"
    folder.mkdir()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(folder)}
    command = [sys.executable, "go.py", study.name, "2"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, cwd=tmp_path, env=environment, text=True) as process:
        try:
            process.stdin.write("go\n")
            process.stdin.flush()
            until(lambda: (tmp_path / "runs" / "runs.journal").exists() and len(read(tmp_path / "runs")) > 3)
            assert list(folder.rglob(study.name))
        finally:
            process.kill()  # before the end of the block, which waits for it
    until(lambda: not list(folder.iterdir()))


def read(folder):
    return read_append_log(folder / "runs.journal")[0]


def test_bytes_that_are_no_bundle_and_paths_that_lead_out_are_refused(tmp_path):
    bundle = StudyBundle({"/a/b.txt": b"1\n2", "/c": b""}, "/a", "/e", ("/a",), ("m",), "00")
    assert parse_bundle(bundle.pack()) == bundle
    for damaged in (b"", b"{}\n", bundle.pack()[:-1], bundle.pack() + b"x", b"[1]\n", b"\xff\n"):
        with pytest.raises(BundleError, match="not a bundle"):
            parse_bundle(damaged)
    for path in ("/a/../../x", "a.txt"):
        with pytest.raises(BundleError, match="not an absolute path"):
            StudyBundle({path: b""}).unpack(tmp_path / "in")
    assert until(lambda: [path.name for path in tmp_path.rglob("*")] in ([], ["in"]))


def test_sources_are_put_together():
    both = ScenarioDependencies(frozenset([Path("/a")]), {"x": Path("/b")}) | ScenarioDependencies(
        modules=frozenset(["m"])
    )
    assert both == ScenarioDependencies(frozenset([Path("/a")]), {"x": Path("/b")}, frozenset(["m"]))
