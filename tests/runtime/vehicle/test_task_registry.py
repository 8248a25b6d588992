"""Sections of any depth name tasks by their path."""

import sys

import pytest

from runtime.vehicle import task_registry

TASK = "from runtime import Task\n\nclass {name}(Task):\n    '''Does it.'''\n"


@pytest.fixture
def fleet(tmp_path, monkeypatch):
    """A package `fleet` that stands in for `tasks`."""
    files = {
        "control/auv/attitude.py": TASK.format(name="Attitude"),
        "control/auv/loops.py": "GAIN = 1.0\n",
        "maneuver/vehicle_formation/swarm.py": TASK.format(name="Swarm"),
        "transports/udp.py": TASK.format(name="UDP"),
        "transports/wire_protocol/frames.py": "SIZE = 2\n",
    }
    for name, text in files.items():
        path = tmp_path / "fleet" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    for folder in [tmp_path / "fleet", *(p for p in (tmp_path / "fleet").rglob("*") if p.is_dir())]:
        (folder / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(task_registry, "TASKS", "fleet")
    task_registry.task_modules.cache_clear()
    yield
    task_registry.task_modules.cache_clear()
    for name in [name for name in sys.modules if name.split(".")[0] == "fleet"]:
        del sys.modules[name]


@pytest.mark.parametrize(
    ("section", "name"),
    [
        ("Control.AUV.Attitude", "Attitude"),
        ("Control.AUV.Attitude/Second", "Attitude"),
        ("Maneuver.VehicleFormation.Swarm", "Swarm"),
        ("Transports.UDP", "UDP"),
    ],
)
def test_a_section_names_a_task_at_any_depth(fleet, section, name):
    found = task_registry.find_task(section)
    assert found is not None
    assert found.__name__ == name


@pytest.mark.parametrize("section", ["Control.Attitude", "Control.AUV", "AUV.Attitude", "Control.AUV.Loops", "Control"])
def test_nothing_else_is_found(fleet, section):
    assert task_registry.find_task(section) is None


def test_a_module_that_fails_is_one_named_problem(fleet, tmp_path):
    (tmp_path / "fleet/transports/tcp.py").write_text("raise KeyError('boom')\n")
    task_registry.task_modules.cache_clear()
    broken: list[task_registry.TaskImportError] = []
    assert "Transports.UDP" in task_registry.all_tasks(broken)
    place = tmp_path / "fleet/transports/tcp.py"
    assert [str(error) for error in broken] == [
        f"Transports: module fleet.transports.tcp cannot be imported: {place}:1: KeyError: 'boom'"
    ]
    with pytest.raises(task_registry.TaskImportError, match=r"fleet\.transports\.tcp"):
        task_registry.all_tasks()


def test_a_task_whose_declaration_is_wrong_is_named(tmp_path, monkeypatch):
    text = TASK.format(name="Whistle").replace("import Task", "import Task, param")
    (tmp_path / "odd_whistles.py").write_text(text + "    pitch: dict = param({}, 'Hz', 'Pitch.')\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(task_registry.TaskImportError, match=r"^odd_whistles\.Whistle .* a parameter is a bool, int"):
        task_registry.find_task("odd_whistles.Whistle")


def test_all_tasks_have_the_names_of_their_sections(fleet):
    assert list(task_registry.all_tasks()) == [
        "Control.AUV.Attitude",
        "Maneuver.VehicleFormation.Swarm",
        "Transports.UDP",
    ]
