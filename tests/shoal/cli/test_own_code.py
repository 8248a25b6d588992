"""A user's own code: found where the user keeps it, and never taken from a log."""

import os
import shutil
import subprocess
from pathlib import Path

import msgspec
import pytest

from shoal.cli.vehicle_subprocesses import shoal_command
from tests.shoal.cli.installed import shoal

TASK = '''"""A task of a user's own."""

import imc
from runtime import Task, periodic


class {name}(Task):
    """Measures a temperature."""

    @periodic(1.0)
    def measure(self) -> None:
        self.publish(imc.Temperature(value=3.0))
'''
ROOT = Path(__file__).parents[3]
PROFILE = """[Require lauv-noptilus-1.ini]
[Simulators.Whistle]
Enabled = Kinematic
Entity Label = Whistle
[Mine.Bell]
Enabled = Kinematic
Entity Label = Bell
[horns.Horn]
Enabled = Kinematic
Entity Label = Horn
"""


@pytest.fixture
def project(tmp_path):
    """A user's folder: tasks in a group of Shoal's, in a group of their own, and in a module."""
    files = {"tasks/simulators/whistle.py": "Whistle", "tasks/mine/bell.py": "Bell", "horns.py": "Horn"}
    for name, cls in files.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(TASK.format(name=cls))
    (tmp_path / "my.ini").write_text(PROFILE)
    return tmp_path


def run(project, *words):
    return shoal("run", "./my.ini", "-p", "Kinematic", "--clock", "virtual", "--for", "2s", *words, cwd=project)


@pytest.mark.heavy
def test_tasks_in_an_own_folder_are_found_by_path(project):
    status, out, err = run(project)
    assert (status, "skipped: Transports.MAVLink" in err, "Temperature" in err) == (0, True, False)
    log = next(project.glob("log/*/*/*"))
    status, out, err = shoal("log", "info", str(log), cwd=project)
    assert all(label in out for label in ("Whistle", "Bell", "Horn"))
    assert shoal("check", "my.ini", cwd=project)[:2] == (0, "my.ini: nothing wrong\n")
    (project / "tasks/simulators/gps.py").write_text(TASK.format(name="GPS"))
    (project / "imc").mkdir()
    (project / "imc/mine.py").write_text("")
    status, _, err = run(project)
    assert status == 0
    assert "tasks/simulators/gps.py: Shoal has a task in tasks/simulators/gps.py; rename yours" in err
    assert "imc: 'imc' is a package of Shoal" in err


@pytest.mark.heavy
@pytest.mark.parametrize("words", [["run", "./my.ini", "-p", "Kinematic"], ["fleet", "fleet.yaml", "--crew", "0"]])
def test_a_process_that_shoal_starts_has_own_tasks_but_no_other_module_of_the_folder(project, words):
    (project / "msgspec.py").write_text("raise SystemExit('a module of this folder runs')\n")
    (project / "fleet.yaml").write_text("vehicles: [{name: a, profile: my}]\nmodes: Kinematic\nrestart: soon\n")
    added = ["--clock", "virtual", "--for", "2s"] if words[0] == "run" else []
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
    environment["PYTHONPATH"] = str(ROOT)
    done = subprocess.run(
        [*shoal_command(*words), *added], cwd=project, env=environment, capture_output=True, text=True, timeout=60
    )
    if words[0] == "run":
        assert done.returncode == 0, done.stderr
        log = next(project.glob("log/*/*/*"))
        assert "Whistle" in shoal("log", "info", str(log), cwd=project)[1]
    else:
        assert "restart: 'soon' is not one of" in done.stderr


@pytest.mark.heavy
def test_a_clone_of_shoal_beside_the_installed_one_is_no_clash(project):
    for name in ("imc", "runtime", "tasks"):
        shutil.copytree(ROOT / name, project / name, dirs_exist_ok=True)
    status, _, err = run(project)
    assert (status, "rename" in err, "this clone" in err) == (0, False, False)
    with (project / "tasks/simulators/gps.py").open("a") as file:
        file.write("\n")
    status, _, err = run(project)
    assert status == 0
    assert f"{project}: the Shoal that runs is the one in {ROOT}, not this clone; this file differs: tasks/simu" in err


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        (
            "horns.Horn",
            "horns.Hron",
            "my.ini:8: error: [horns.Hron] is not a task ({project}/horns.py has no class Hron; did",
        ),
        ("horns.Horn", "hornz.Horn", "my.ini:8: error: [hornz.Horn] is not a task (there is no module 'hornz'"),
        (
            "Mine.Bell",
            "Sensors.SBE49",
            "my.ini:5: error: [Sensors.SBE49] is not a task (did you mean [Sensors.SBE49FastC",
        ),
        ("Mine.Bell", "Mine.Bel", "my.ini:5: error: [Mine.Bel] is not a task (did you mean [Mine.Bell]?)"),
        ("Simulators.Whistle", "Simulators.Whistel", "my.ini:2: error: [Simulators.Whistel] is not a task (did you"),
        (
            "Simulators.Whistle",
            "Simulators.Flute",
            "my.ini:2: error: [Simulators.Flute] is not a task (there is no module 'Simulators' and no "
            "tasks/simulators/flute.py where tasks are searched for; see --code)",
        ),
        ("Simulators.Whistle", "Whistle", "my.ini:2: error: [Whistle] is not a task (did you mean [Simulators.Whis"),
        ("horns.Horn", "msgspec.Horn", f"[msgspec.Horn] is not a task ({msgspec.__file__} has no class Horn)"),
        (
            "horns.Horn",
            "tasks.pip.Pip",
            "[tasks.pip.Pip] is not a task (write [pip.Pip] for the class Pip in tasks/pip/pip.py)",
        ),
        (
            "Mine.Bell",
            "tasks.mine.bell.Bell",
            "[tasks.mine.bell.Bell] is not a task (write [mine.Bell] for the class Bell in tasks/mine/bell.py)",
        ),
    ],
)
def test_a_misspelled_task_is_an_error(project, before, after, words):
    (project / "my.ini").write_text(PROFILE.replace(before, after))
    words = words.format(project=project)
    status, _, err = run(project)
    assert status != 0
    assert words in err
    status, out, _ = shoal("check", "my.ini", cwd=project)
    assert status == 1
    assert words in out


@pytest.mark.heavy
def test_run_and_check_say_the_same_of_a_section_without_enabled(project):
    names = ("Simulators.MUGDetectionCamera/Front", "Simulators.MUGDetectionCamra/Front", "horns.Horn/2", "horns.Hron")
    (project / "my.ini").write_text(PROFILE + "".join(f"[{name}]\nRate = 2\n" for name in names))
    status, out, _ = shoal("check", "my.ini", "-p", "Kinematic", cwd=project)
    told = [line for line in out.splitlines() if line.startswith("my.ini:")]
    assert (status, [line for line in told if "Rate" not in line]) == (
        0,
        [
            f"my.ini:11: warning: [{names[0]}] has no Enabled, so it never runs (write Enabled = Always)",
            f"my.ini:13: warning: [{names[1]}] is not a task (did you mean [Simulators.MUGDetectionCamera]?)",
            f"my.ini:15: warning: [{names[2]}] has no Enabled, so it never runs (write Enabled = Always)",
            f"my.ini:17: warning: [{names[3]}] is not a task ({project}/horns.py has no class Hron; did you mean "
            "Horn?)",
        ],
    )
    status, _, err = run(project)
    assert (status, [line for line in err.splitlines() if line.startswith("my.ini:")]) == (0, told)


def test_a_misspelled_task_whose_module_fails_is_an_error_without_a_traceback(project):
    (project / "tasks/mine/bell.py").write_text("import no_such_library\n")
    (project / "my.ini").write_text(PROFILE.replace("Mine.Bell", "Mine.Bel"))
    status, _, err = run(project)
    assert status != 0
    assert "my.ini:5: error: [Mine.Bel] is not a task (did you mean [Mine.bell]?)" in err
    assert "Traceback" not in err


@pytest.mark.heavy
def test_an_own_task_without_its_folder_in_reach_is_an_error(project, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    for word in ("run", "check"):
        status, out, err = shoal(word, project / "my.ini", "-p", "Kinematic", cwd=elsewhere)
        assert status == (2 if word == "run" else 1)
        assert "my.ini:2: error: [Simulators.Whistle] is not a task" in out + err
    words = ["--clock", "virtual", "--for", "2s", "--code", project]
    assert shoal("run", project / "my.ini", "-p", "Kinematic", *words, cwd=elsewhere)[0] == 0


@pytest.mark.heavy
def test_a_class_that_is_no_task_and_a_failing_import_name_the_place(project):
    (project / "horns.py").write_text("class Horn:\n    pass\n")
    assert f"Horn in {project}/horns.py is not a Task: write class Horn(Task)" in run(project)[2]
    (project / "horns.py").write_text("import imc\nimport no_such_library\n")
    assert f"{project / 'horns.py'}:2: ModuleNotFoundError: No module named 'no_such_library'" in run(project)[2]
    (project / "horns.py").write_text("def horn(:\n")
    assert f"{project / 'horns.py'}:1: SyntaxError" in run(project)[2]


@pytest.mark.heavy
def test_a_part_of_a_log_in_the_same_folder_hides_no_tasks(project):
    assert run(project)[0] == 0
    log = next(project.glob("log/*/*/*"))
    assert shoal("log", "cut", log, "dive", "--to", "1s", cwd=project)[0] == 0
    assert run(project)[0] == 0
    (project / "dive").rename(project / "101530_dive")  # named like a log, so the folder may be a day of a vehicle's
    status, _, err = run(project)
    assert status == 2
    assert f"note: own tasks in {project} are not searched for: {project}/101530_dive/Data.lsf.gz is named" in err
    assert "to run the code in this folder add --code .\n" in err
    assert run(project, "--code", ".")[0] == 0


@pytest.mark.heavy
def test_an_own_profile_with_the_name_of_that_of_a_log_tells_what_to_do(project):
    (project / "my.ini").rename(project / "Config.ini")
    status, _, err = shoal("check", "Config.ini", cwd=project)
    assert status == 1
    assert f"note: own tasks in {project} are not searched for: {project}/Config.ini is named like a" in err
    assert "add --code .; or, if it is a profile of yours, rename Config.ini\n" in err
    assert shoal("check", "Config.ini", "--code", ".", cwd=project)[0] == 0


@pytest.mark.heavy
@pytest.mark.parametrize("missing", ["", "case", "data"])
def test_a_received_log_runs_no_code(project, missing):
    assert run(project)[0] == 0
    log = next(project.glob("log/*/*/*"))
    if missing:
        (log / "Data.lsf.gz").rename(log / "DATA.LSF.GZ") if missing == "case" else (log / "Data.lsf.gz").unlink()
    (log / "tasks/mine").mkdir(parents=True)
    for name in ("horns.py", "tasks/mine/bell.py"):
        (log / name).write_text("open('/dev/stdout', 'w').write('CODE OF A STRANGER')\nraise SystemExit(0)\n")
    for folder in (log, log.parent, log.parent.parent):
        place = os.path.relpath(log, folder)
        for words in (
            ("check", f"{place}/Config.ini"),
            ("explain", f"{place}/Config.ini"),
            ("explain", f"{place}/Config.ini", "horns.Horn"),
            ("run", f"{place}/Config.ini", "-p", "Kinematic", "--for", "1s", "--clock", "virtual"),
            ("resim", place, "--task", "horns.Horn"),
            ("rewind", place, "--at", "1s"),
            ("replay", place, "--clock", "virtual"),
        ):
            _, out, err = shoal(*words, cwd=folder)
            assert "STRANGER" not in out + err, words
            assert "Traceback" not in err, words
    if missing:
        return
    status, _, err = shoal("rewind", str(log), "--at", "1s", "--code", str(project), "--log-dir", "new", cwd=project)
    assert status == 0, err
    status, out, err = shoal("resim", str(log), "--task", "horns.Horn", "--code", str(project), cwd=project)
    assert status == 0, err
