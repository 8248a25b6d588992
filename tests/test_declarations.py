"""Rules for every task, profile and module."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from runtime.kernel import VirtualClock
from runtime.profile import load_profile, own_etc
from runtime.vehicle import all_tasks, build, check_profile, find_task, task_modules

ROOT = Path(__file__).parent.parent
TASKS = all_tasks()
PROFILES = sorted(path.stem for path in own_etc().glob("*.ini"))


def test_every_module_that_names_a_task_has_it():
    assert {"Simulators.EstimatedState", "Simulators.MUGDetectionCamera", "Vision.FisheyeCamera"} <= set(TASKS)
    assert set(TASKS.values()) <= {find_task(section) for section in TASKS}


def test_every_task_has_a_sentence():
    first = {section: (cls.__doc__ or "").strip().split("\n")[0].rstrip() for section, cls in TASKS.items()}
    assert not [section for section, line in first.items() if not line.endswith((".", ":", ",", "the", "by"))]


def test_every_parameter_has_a_unit_and_a_sentence():
    wrong = []
    for section, cls in TASKS.items():
        for name, parameter in cls.parameters().items():
            is_told = parameter.description.endswith(".")
            has_unit = bool(parameter.unit) == (parameter.type in (int, float) and not parameter.choices)
            if not (is_told and has_unit and parameter.parse(parameter.format(parameter.default)) == parameter.default):
                wrong.append(f"{section}: {name}")
    assert not wrong


@pytest.mark.parametrize("name", PROFILES)
def test_every_profile_has_no_mistakes(name):
    profile = load_profile(name, [own_etc()])
    assert check_profile(profile, TASKS, None, find_task) == []


@pytest.mark.parametrize("name", PROFILES)
def test_every_profile_runs_ten_seconds_in_simulation(name, tmp_path):
    profile = load_profile(name, [own_etc()])
    selected = profile.parse_modes("Simulation,Camera" if "Camera" in profile.selectable_modes else "Simulation")
    made = build(profile, selected, clock=VirtualClock(profile.start_time_ns), log_root=tmp_path)
    made.vehicle.start()
    made.vehicle.run(10.0)
    states = {entity.label: entity.state.name for entity in made.vehicle.entities if entity.stateful}
    made.vehicle.close()
    assert set(states.values()) == {"NORMAL"}, states
    assert made.vehicle.bus.delivered > 1000


def _imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            yield node.module or ""
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def test_tasks_never_import_tasks():
    tasks = {cls.__module__ for cls in TASKS.values()}
    paths = {module: ROOT / (module.replace(".", "/") + ".py") for module in task_modules().values()}
    imported = {module: tasks & set(_imports(path)) - {module} for module, path in paths.items()}
    assert not any(imported.values()), imported


@pytest.mark.heavy
def test_the_core_install_imports_without_the_extras():
    code = (
        "import sys\n"
        "drivers, charts = ('serial', 'pynmeagps', 'pyubx2'), ('rasterio', 'netCDF4')\n"
        "for name in ('zenoh', 'pymavlink', 'PIL', 'cv2', 'pyftpdlib', *drivers, *charts):\n"
        "    sys.modules[name] = None\n"
        "from runtime.vehicle.task_registry import all_tasks\n"
        "import shoal.cli.run, shoal.cli.replay, shoal.cli.check, shoal.cli.tasks, runtime.zenoh\n"
        "assert len(all_tasks()) >= 9\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
