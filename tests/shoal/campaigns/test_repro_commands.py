"""Commands that a campaign prints work when they are pasted, with all options that it had."""

import shlex
import shutil
import sys

import pytest

from shoal.campaigns import open_results
from tests import command

HUM = """\
from pathlib import Path

import imc
from runtime import Task, param, periodic


class Hum(Task):
    \"\"\"Publishes a temperature from a table.\"\"\"

    factor: float = param(1.0, "", "Factor.")

    @periodic(1.0)
    def hum(self) -> None:
        self.publish(imc.Temperature(value=float(Path("table.csv").read_text()) * self.factor))
"""
STUDY = """\
scenario:
  scenario: hum
  vehicle: {profile: lauv-noptilus-1, modes: Kinematic, parameters: {hum_of_test.Hum: {Enabled: Always}}}
  expect: [{name: warm, always: Temperature.value > 10}]
  limit: 2 s
vary:
  vehicle/parameters/hum_of_test.Hum/Factor: {uniform: [0.6, 2]}
runs: 3
"""
SET = ("--set", "vehicle/parameters/Simulators.GPS/Kinematic/HACC=1.0e-07")


def shoal(*words):
    return command.shoal("campaign", *words)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.delitem(sys.modules, "hum_of_test", raising=False)
    (tmp_path / "my code").mkdir()
    (tmp_path / "my code" / "hum_of_test.py").write_text(HUM)
    (tmp_path / "table.csv").write_text("20.5")
    (tmp_path / "hum.study.yaml").write_text(STUDY + "files: [table.csv]\n")
    return tmp_path


def pasted(line):
    """The command in a line of what is printed."""
    shoal_word, campaign, *words = shlex.split(line.removesuffix(" does them"))
    assert (shoal_word, campaign) == ("shoal", "campaign")
    return words


@pytest.mark.heavy
def test_merge_and_rerun_print_commands_with_all_options(folder):
    options = ("-j", 1, "-o", "parts", "--code", "my code", "--logs", "all", "--wall-limit", "5 min", *SET)
    assert shoal("hum.study.yaml", "--shard", "1/2", *options).exit_code == 0
    some = shoal("merge", "parts/shard-1-of-2", "-o", "parts")
    assert some.exit_code == 1
    [command] = [line for line in some.output.splitlines() if line.endswith(" does them")]
    words = pasted(command)
    assert words[0] == "hum.study.yaml"
    assert words[words.index("--wall-limit") + 1] == "300 s"
    done = shoal(*words, "-j", 1)
    assert done.exit_code == 0, done.output
    assert "of 3 passed" in done.output
    data = open_results(folder / "parts")
    assert all(row["logs.lauv-noptilus-1"] for row in data.counted_rows)
    [again] = [line for line in done.output.splitlines() if line.startswith("shoal campaign rerun")]
    same = shoal(*pasted(again), "--log-dir", "again")
    assert same.exit_code == 0, same.output
    assert "as it was: fingerprint and log" in same.output


@pytest.mark.heavy
def test_what_is_not_on_this_computer_is_reported(folder):
    assert shoal("hum.study.yaml", "--shard", "1/2", "-j", 1, "-o", "parts", "--code", "my code").exit_code == 0
    shutil.rmtree(folder / "my code")
    some = shoal("merge", "parts/shard-1-of-2", "-o", "parts")
    assert f"note: {folder / 'my code'} is not on this computer" in some.output
    assert "hum.study.yaml is not" not in some.output


@pytest.mark.heavy
def test_a_file_that_the_study_does_not_name_is_reported_as_the_reason(folder):
    (folder / "hum.study.yaml").write_text(STUDY)
    done = shoal("hum.study.yaml", "-j", 1, "-o", "bare", "--code", "my code", "--runs", 1)
    assert "FileNotFoundError" in done.output
    assert "'table.csv'" in done.output
    assert "is this one missing in `files`?" in done.output
    (folder / "table.csv").unlink()
    again = shoal("rerun", "bare", "--run", 0, "--code", "my code")
    assert again.exit_code == 0, again.output
