"""pytest runs scenarios beside Python tests, and these may run scenarios and vehicles themselves."""

import importlib
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest

from shoal.campaigns import SCENARIO_SUFFIX
from shoal.campaigns.results.store import JOURNAL, TABLE
from tests.outside import NO_FILE
from tests.shoal.campaigns.examples import FLAT, NAME, TROUBLE, scenario, trouble

ROOT = Path(__file__).parents[2]
ENVIRONMENT = {
    **os.environ,
    "PYTHONPATH": str(ROOT),
    "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",  # whether or not Shoal is installed here, the plugin is loaded once
    "PYTEST_PLUGINS": "shoal.pytest_plugin",
}


def run(folder, *words):
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--color=no", *words]
    return subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, timeout=120.0)


def write(folder, **texts):
    for name, text in texts.items():
        suffix = ".py" if name.startswith(("test_", "trouble")) else SCENARIO_SUFFIX
        (folder / f"{name}{suffix}").write_text(text)


def test_the_plugin_is_an_entry_point_and_knows_the_files():
    points = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]["pytest11"]
    module = importlib.import_module(points["shoal"])
    assert (*module.RESULTS_FILES, module.SCENARIO_SUFFIX) == (JOURNAL, TABLE, SCENARIO_SUFFIX)


def test_pytest_starts_without_importing_shoal(tmp_path):
    write(
        tmp_path,
        test_plain="import sys\n\n\ndef test_it():\n"
        "    ours = {name for name in sys.modules if name.split('.')[0] in ('imc', 'runtime', 'shoal', 'tasks')}\n"
        "    assert ours == {'shoal', 'shoal.pytest_plugin'}\n"
        "    assert not {'numpy', 'yaml', 'msgspec'} & set(sys.modules)\n",
    )
    done = run(tmp_path)
    assert done.returncode == 0, done.stdout


@pytest.mark.heavy
def test_what_a_search_has_found_is_a_test_only_if_it_is_named(tmp_path):
    found = tmp_path / "campaigns" / "breaks"
    found.mkdir(parents=True)
    (found / JOURNAL).touch()
    write(tmp_path, good=scenario())
    write(found, bad=scenario(FLAT))
    for words, passed, failed in (
        ([], 1, 0),
        (["campaigns"], 0, 0),
        (["campaigns/breaks"], 0, 1),
        ([f"campaigns/breaks/bad{SCENARIO_SUFFIX}"], 0, 1),
    ):
        told = run(tmp_path, *words).stdout
        assert (f"{passed} passed" in told, f"{failed} failed" in told) == (passed > 0, failed > 0), told


@pytest.mark.heavy
def test_scenarios_are_tests_with_reasons_warnings_and_logs(tmp_path):
    (tmp_path / "deep").mkdir()
    vain = scenario("always: EstimatedState.depth < 20 m, while: EstimatedState.depth > 500 m")
    write(tmp_path / "deep", good=scenario(), bad=scenario(FLAT), broken="vehicle: [", vain=vain)
    write(tmp_path, test_python="def test_it():\n    pass\n", error=trouble("fail"), trouble=TROUBLE)
    done = run(tmp_path, "--junit-xml=j.xml", "-rf")
    assert done.returncode == 1
    assert "3 failed, 3 passed" in done.stdout, done.stdout
    assert re.search(r"^deep/bad\.scenario\.yaml:5: depth: failed first at ", done.stdout, re.MULTILINE)
    assert f"log of {NAME}: log/bad/{NAME}/20260101/000000" in done.stdout
    assert (tmp_path / "log" / "bad" / NAME / "20260101" / "000000" / "Data.lsf.gz").is_file()
    assert re.search(r"^FAILED deep/broken\.scenario\.yaml::broken - deep/broken", done.stdout, re.MULTILINE)
    assert "ZeroDivisionError: of a kind" in done.stdout
    assert "ScenarioWarning: vain: depth proved nothing" in done.stdout
    assert "Traceback" not in done.stdout
    cases = [case.get("name") for case in ElementTree.parse(tmp_path / "j.xml").iter("testcase")]
    assert sorted(cases) == ["bad", "broken", "error", "good", "test_it", "vain"]


@pytest.mark.heavy
def test_scenarios_run_in_several_processes(tmp_path):
    pytest.importorskip("xdist")
    write(tmp_path, **{f"dive{number}": scenario(seed=number) for number in range(2)}, bad=scenario(FLAT))
    done = run(tmp_path, "-p", "xdist", "-n", "2", "--scenario-logs", "elsewhere")
    assert done.returncode == 1
    assert "1 failed, 2 passed" in done.stdout, done.stdout
    assert list((tmp_path / "elsewhere").rglob("Data.lsf.gz"))


TEST = f'''
import imc
import pytest


@pytest.mark.parametrize("limit", [20, 1])
def test_a_scenario(scenario, limit):
    result = scenario("dive.scenario.yaml", {{"expect/0/always": f"EstimatedState.depth < {{limit}} m"}}, seed=4)
    assert result.seed == 4
    assert result.passed == (limit == 20)
    assert bool(result.logs) == (limit == 1)


def test_a_log(scenario):
    first, second = (scenario("dive.scenario.yaml", log=True) for _ in range(2))
    assert first.hashes == second.hashes != {{}}
    assert (second.logs["{NAME}"] / "Data.lsf.gz").is_file()


def test_a_wrong_file(scenario):
    scenario("nothere.scenario.yaml")


def test_a_vehicle(vehicle):
    boat = vehicle("otter", overrides=["Simulators.GPS:HACC=3"], seed=2)
    seen = []
    boat.observe(imc.GpsFix, seen.append)
    boat.start()
    boat.run(3.0)
    assert seen
'''


@pytest.mark.heavy
def test_fixtures_run_scenarios_and_vehicles(tmp_path):
    write(tmp_path, dive=scenario(), test_own=TEST)
    done = run(tmp_path, "test_own.py", "-rf")
    assert "1 failed, 4 passed" in done.stdout, done.stdout
    assert f"ScenarioFailed: nothere.scenario.yaml: {NO_FILE}" in done.stdout
    assert not (tmp_path / "log").exists()
