"""The files around the source agree with it: citation, continuous integration, pre-commit, issue form."""

import os
import re
import tomllib
from pathlib import Path

import yaml

from tests.command import shoal

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_the_citation_has_the_version_and_the_license_of_the_package():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert (citation["version"], citation["license"]) == (PROJECT["version"], PROJECT["license"])


def test_continuous_integration_runs_what_contributors_run_on_each_python():
    jobs = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]
    assert any(step.get("run") == ".ci/run" for step in jobs["check"]["steps"])
    assert os.access(ROOT / ".ci/run", os.X_OK)
    pythons = jobs["check"]["strategy"]["matrix"]["python"]
    assert PROJECT["requires-python"] == f">={pythons[0]}"
    assert pythons == [f"3.{minor}" for minor in range(11, 15)]
    for script in ("pythons", "newest"):
        assert jobs[script]["steps"][-1]["run"].endswith(f".ci/{script}")
        assert os.access(ROOT / ".ci" / script, os.X_OK)
    for version in pythons:
        assert version in jobs["pythons"]["steps"][1]["with"]["python-version"].split()
    assert any("build" in step.get("run", "") for step in jobs["package"]["steps"])


def test_continuous_integration_runs_no_test_again_that_failed():
    for script in ("run", "pythons", "newest"):
        text = (ROOT / ".ci" / script).read_text()
        assert not re.search(r"--last-failed|--lf\b|--failed-first|--reruns|--flaky", text)
    assert not any("rerun" in each or "flaky" in each for each in PROJECT["optional-dependencies"]["dev"])


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
