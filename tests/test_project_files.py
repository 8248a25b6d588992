"""The files around the source agree with it: citation, continuous integration, pre-commit, issue form."""

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml

from tests.command import shoal
from tests.test_public_interface import MODULES

ROOT = Path(__file__).parent.parent
PARTS = ("tests", "heavy", "computing", "checks", "browser")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_the_citation_has_the_version_and_the_license_of_the_package():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert (citation["version"], citation["license"]) == (PROJECT["version"], PROJECT["license"])


def test_continuous_integration_runs_what_contributors_run_on_each_python():
    jobs = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]
    assert jobs["check"]["steps"][-1]["run"] == ".ci/run ${{ matrix.parts }}"
    matrix = jobs["check"]["strategy"]["matrix"]
    assert sorted([*" ".join(matrix["parts"]).split(), "browser"]) == sorted(PARTS)
    assert PROJECT["requires-python"] == f">={matrix['python'][0]}"
    assert matrix["python"] == [f"3.{minor}" for minor in range(11, 15)]
    for script in ("pythons", "newest", "campaigns", "browser"):
        assert jobs[script]["steps"][-1]["run"].endswith(f".ci/{script}")
    setup = jobs["pythons"]["steps"][1]["with"]["python-version"]
    assert sorted(setup.split()) == matrix["python"]
    assert any("build" in step.get("run", "") for step in jobs["package"]["steps"])


@pytest.fixture
def ci_run(tmp_path):
    """Runs .ci/run where each command only notes its words, and fails if `failing` is among them."""
    for folder in ("commands", ".ci"):
        (tmp_path / folder).mkdir()
    for script in ("run", "browser"):
        shutil.copy(ROOT / ".ci" / script, tmp_path / ".ci")
    install, tests = "pip install '.[dev]'", "pytest -n 2 --dist worksteal"
    (tmp_path / "README.md").write_text(f"Text.\n{install} && {tests}\n")
    stub = '#!/bin/sh\nwords="$(basename $0) $*"\necho "$words" >>"$NOTES"\ncase "$words" in $FAILING) exit 1;; esac\n'
    for name in ("pip", "pytest", "ruff", "codespell", "pyright", "lint-imports", "python", "chromium"):
        (tmp_path / "commands" / name).write_text(stub)
        (tmp_path / "commands" / name).chmod(0o755)

    def run(*parts, failing="nothing"):
        notes = tmp_path / "notes"
        notes.write_text("")
        path = f"{tmp_path / 'commands'}{os.pathsep}{os.environ['PATH']}"
        environment = {**os.environ, "PATH": path, "NOTES": str(notes), "FAILING": failing}
        done = subprocess.run([tmp_path / ".ci/run", *parts], env=environment, capture_output=True, text=True)
        return done.returncode, notes.read_text().splitlines(), done.stdout

    return run


def test_the_parts_of_ci_are_all_of_it_and_each_test_runs_once(ci_run):
    status, everything, output = ci_run()
    assert status == 0
    install = "pip install .[dev]"
    found = [ci_run(part) for part in PARTS]
    assert all(status == 0 and commands[0] == install for status, commands, _ in found)
    assert sorted(everything) == sorted([install, *(word for _, commands, _ in found for word in commands[1:])])
    assert len(everything) == len(set(everything))
    marks = [words.partition(" -m ")[2] for words in everything if words.startswith("pytest")]
    assert {marks.pop(0), *marks} == {
        "",
        "computing and not campaign --timeout 1800",
        "heavy and not alone and not computing and not campaign",
        "alone",
        "browser",
    }
    assert everything[-1] == "pytest -m browser"
    timed = re.findall(r"^([a-z]+).*: \d+ s, \d+ s since the start$", output, re.MULTILINE)
    assert timed == ["install", "tests", "heavy", "computing", "checks", "alone", "browser"]
    assert "\npytest -n 2 --dist worksteal -p no:cacheprovider -m campaign " in (ROOT / ".ci/campaigns").read_text()


def test_tests_are_marked_in_their_own_file_where_ci_looks_for_them():
    shared = [path for path in (ROOT / "tests").rglob("*.py") if not path.name.startswith("test_")]
    assert len(shared) > 80
    marker = re.compile(r"pytest\.mark\.(heavy|computing|alone)\b")
    assert not [path.name for path in shared if marker.search(path.read_text())]


@pytest.mark.parametrize("failing", ["*-m heavy and not*", "ruff check*", "*-m browser"])
def test_what_fails_in_ci_fails_it_and_is_not_repeated(failing, ci_run):
    _, everything, _ = ci_run()
    status, commands, _ = ci_run(failing=failing)
    assert status == 1
    assert len(commands) == len(set(commands))
    assert set(commands) <= set(everything)


def test_ci_names_its_parts_if_one_is_unknown(ci_run):
    assert ci_run("tets")[:2] == (2, [])


def test_continuous_integration_verifies_the_types_of_each_public_package():
    run = (ROOT / ".ci/run").read_text()
    (packages,) = re.findall(r"for package in ([\w ]+); do\n +pyright --verifytypes \$package", run)
    assert {name.split(".")[0] for name in MODULES} <= set(packages.split())


def test_each_command_of_pre_commit_is_in_the_dev_extra():
    packages = {"lint-imports": "import-linter"}
    dev = {re.split("[=><]", each)[0] for each in PROJECT["optional-dependencies"]["dev"]}
    (repository,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    commands = {hook["entry"].split()[0] for hook in repository["hooks"]}
    assert commands == {"ruff", "codespell", "lint-imports"}
    assert {packages.get(each, each) for each in commands} <= dev


def test_the_issue_form_asks_for_check_and_doctor():
    form = yaml.safe_load((ROOT / ".github/ISSUE_TEMPLATE/defect.yml").read_text())
    labels = [part["attributes"]["label"] for part in form["body"]]
    assert {"shoal check", "shoal log doctor"} <= set(labels)
    for label in ("shoal check", "shoal log doctor"):
        assert shoal(*label.split()[1:], "--help").exit_code == 0
