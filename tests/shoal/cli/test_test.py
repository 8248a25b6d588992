"""`shoal test`: what it tells of scenarios, in words, files and its exit status."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from shoal.scenarios import load_document
from tests.outside import NO_FILE, children, until
from tests.shoal.campaigns.examples import FLAT, NAME, TROUBLE, scenario, trouble
from tests.shoal.cli.installed import ENVIRONMENT, SHOAL, shoal

PLANNED = f"""\
vehicle:
  profile: {NAME}
  plan: {{origin: "41.185°, -8.7062°", speed: 1.2 m/s, depth: 0 m, maneuvers: [{{goto: {{north: 90}}}}]}}
limit: 12 s
expect:
  - {{outcome: SUCCESS}}
"""
LOG = f"{NAME}/20260101/000000"


@pytest.fixture
def write(tmp_path):
    """Writes scenarios by name to a folder, which is the current one of the command."""

    def write(**texts):
        for name, text in texts.items():
            (tmp_path / f"{name}.scenario.yaml").write_text(text)
        return tmp_path

    return write


def lines(out):
    """What is told of each scenario, by its name, without the time that it took."""
    found = re.findall(r"^(passed|FAILED)  (?:.*/)?([\w-]+)\.scenario\.yaml  [\d.]+ s(.*)$", out, re.MULTILINE)
    return {name: (word, rest.strip()) for word, name, rest in found}


@pytest.mark.heavy
def test_all_that_pass(write):
    folder = write(one=scenario(), two=scenario(seed=2))
    (folder / "deep" / "er").mkdir(parents=True)
    (folder / "deep" / "er" / "three.scenario.yaml").write_text(scenario())
    (folder / ".hidden").mkdir()
    found = folder / "campaigns" / "breaks"  # of a search
    found.mkdir(parents=True)
    (found / "runs.journal").touch()
    for name in (".hidden/four", "campaigns/breaks/five"):
        (folder / f"{name}.scenario.yaml").write_text("nonsense")
    status, out, err = shoal("test", cwd=folder)
    assert (status, err) == (0, "")
    told = lines(out)
    assert set(told) == {"one", "two", "three"}
    assert all(re.fullmatch(r"margin 17\.\d+ of depth", rest) for _, rest in told.values()), out
    assert re.search(r"^3 passed in [\d.]+ s; 60 s simulated$", out, re.MULTILINE)
    assert not (folder / "log").exists()
    status, out, _ = shoal("test", "campaigns/breaks", cwd=folder)
    assert (status, set(lines(out))) == (2, {"five"}), out


@pytest.mark.heavy
def test_one_that_fails_is_reported_with_its_log_and_the_command_that_repeats_it(write):
    folder = write(good=scenario(), bad=scenario(FLAT, seed=3))
    status, out, err = shoal("test", "-j", "2", cwd=folder)
    assert (status, err) == (1, "")
    told = lines(out)
    assert told["good"][0] == "passed"
    word, why = told["bad"]
    assert word == "FAILED"
    assert re.fullmatch(r"depth: failed first at 1\d\.\d+ s, worst at 19\.\d+ s, by 1\.\d+", why)
    assert "1 passed, 1 failed" in out
    log = Path(re.search(r"^  log of lauv-noptilus-1: (.*)$", out, re.MULTILINE)[1])
    assert log == Path("log/bad", LOG)
    command = shlex.split(re.search(r"^  again: (.*)$", out, re.MULTILINE)[1])
    assert command[0] == "shoal"
    again = shoal(*command[1:], cwd=folder)
    assert again.returncode == 1
    assert lines(again.stdout) == {"bad": told["bad"]}
    first, second = (folder / f"{log}{suffix}" / "Data.lsf.gz" for suffix in ("", "_2"))
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.heavy
def test_seed_and_values_are_in_the_command_that_repeats_a_run(write):
    folder = write(it=scenario())
    given = ["--seed", "5", "--set", "expect/0/always=EstimatedState.depth < 2 m", "--log-dir", "my logs"]
    status, out, _ = shoal("test", "it.scenario.yaml", *given, "--json", "it.json", cwd=folder)
    assert status == 1
    [run] = json.loads((folder / "it.json").read_text())["runs"]
    assert run["seed"] == 5
    assert Path(run["logs"][NAME]) == Path("my logs/it", LOG)
    command = shlex.split(run["again"])
    assert command == ["shoal", "test", "it.scenario.yaml", *given]
    assert lines(shoal(*command[1:], cwd=folder).stdout) == lines(out)


@pytest.mark.heavy
@pytest.mark.parametrize(("keep", "logs"), [("all", 2), ("none", 0)])
def test_logs_of_all_or_of_none(write, keep, logs):
    folder = write(good=scenario(), bad=scenario(FLAT))
    assert shoal("test", "--keep", keep, cwd=folder).returncode == 1
    assert len(list(folder.rglob("Data.lsf.gz"))) == logs


@pytest.mark.heavy
def test_a_file_that_cannot_be_read_is_one_line_and_the_others_run(write):
    broken = {"a": "vehicle: [", "b": scenario(profile="nothere"), "c": scenario("always: EstimatedState.deep < 1 m")}
    broken["g"] = scenario() + "events: [{at: 1 s, set: {Control.Path: {Nothing: 1}}}]\n"
    folder = write(**broken, good=scenario(), bad=scenario(FLAT))
    os.mkfifo(folder / "f.scenario.yaml")
    (folder / "d.scenario.yaml").mkdir()
    (folder / "d.scenario.yaml" / "e.scenario.yaml").symlink_to("nowhere")
    status, out, err = shoal("test", ".", "bad.scenario.yaml", cwd=folder)
    assert (status, err) == (2, "")
    told = lines(out)
    assert {name: word for name, (word, _) in told.items()} == dict.fromkeys("abcefg", "FAILED") | {
        "good": "passed",
        "bad": "FAILED",
    }
    assert "a.scenario.yaml:" in told["a"][1]
    assert "'nothere'" in told["b"][1]
    assert re.search(r"c\.scenario\.yaml:5: .*deep", told["c"][1])
    assert NO_FILE in told["e"][1]
    assert told["f"][1] == "f.scenario.yaml: a scenario is a file"
    assert re.match(r"g\.scenario\.yaml:\d+: there is no task 'Control.Path'", told["g"][1])
    assert "1 passed, 1 failed, 6 not readable" in out
    assert out.count("'nothere'") == 1  # each is told once
    assert out.count("again: ") == 1


@pytest.mark.heavy
def test_a_wrong_value_is_blamed_and_no_line_of_the_file(write):
    status, out, _ = shoal("test", "--set", "limit=1 s", "--set", "seed=abc", cwd=write(a=scenario()))
    assert status == 2
    assert lines(out)["a"][1] == "--set seed=abc: expected a whole number, 0 or more, not 'abc'"


@pytest.mark.heavy
def test_a_distribution_in_a_scenario_is_said_to_be_for_a_campaign(write):
    folder = write(a=scenario().replace("limit: 20 s", "limit: {uniform: [10 s, 20 s]}"))
    status, out, _ = shoal("test", cwd=folder)
    assert status == 2
    assert "(a value that varies, as limit does, is for `shoal campaign`)" in out
    assert shoal("test", "--set", "limit=1 s", cwd=folder).returncode == 0


@pytest.mark.heavy
def test_all_logs_of_a_failed_run_are_reported(write):
    """A vehicle begins a log with a plan."""
    folder = write(a=PLANNED)
    status, out, _ = shoal("test", cwd=folder)
    assert status == 1
    told = [
        Path(place) for place in re.findall(r"(?:log of lauv-noptilus-1|of the same run): (.*)$", out, re.MULTILINE)
    ]
    assert len(told) == 2
    assert {folder / place for place in told} == {path.parent for path in folder.rglob("Data.lsf.gz")}


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["test"], "there is no *.scenario.yaml in the current folder"),
        (["test", "nowhere"], "nowhere: no such file or folder"),
        (["test", "file.txt", "--set", "seed"], "'seed' is no assignment"),
        (["test", "file.txt", "--wall-limit", "soon"], "'soon' is not a duration"),
        (["test", "file.txt", "--wall-limit", "0"], "--wall-limit must be more than 0 s"),
        (["test", "file.txt", "-j", "-1"], "-1"),
        (["test", "file.txt", "--junit", "file.txt/j.xml"], "file.txt"),
    ],
)
def test_wrong_use(tmp_path, words, why):
    (tmp_path / "file.txt").write_text("")
    status, out, err = shoal(*words, cwd=tmp_path)
    assert (status, out) == (2, "")
    assert why in err.splitlines()[-1]


@pytest.mark.heavy
def test_tasks_of_a_user_that_make_trouble_cost_their_own_runs_alone(write):
    hows = ("die", "hang", "fail", "exhaust")
    folder = write(**{how: trouble(how) for how in hows}, good=scenario())
    (folder / "trouble.py").write_text(TROUBLE)
    status, out, err = shoal("test", "--wall-limit", "4 s", cwd=folder)
    assert (status, err) == (1, "")
    told = lines(out)
    assert {name: word for name, (word, _) in told.items()} == dict.fromkeys(hows, "FAILED") | {"good": "passed"}
    assert told["die"][1] == "5 processes that ran it ended (SIGKILL)"
    assert re.match(r"not done after 4 s of wall time: in .*trouble\.py:\d+ \(hang\)", told["hang"][1])
    assert "ZeroDivisionError: of a kind" in told["fail"][1]
    assert "RecursionError" in told["exhaust"][1]
    assert "log/fail" in out
    assert "--wall-limit '4 s'" in out


@pytest.mark.heavy
def test_a_run_that_does_not_repeat_itself_is_reported(write):
    folder = write(it=trouble("differ", "always: RelativeHumidity.value < 0"))
    (folder / "trouble.py").write_text(TROUBLE)
    status, out, _ = shoal("test", cwd=folder)
    assert status == 1
    assert "warning: the run for the log went otherwise: something in it depends on more than file and seed" in out


@pytest.mark.heavy
def test_an_expectation_that_never_applied_is_a_warning(write):
    folder = write(it=scenario("always: EstimatedState.depth < 20 m, while: EstimatedState.depth > 500 m"))
    status, out, _ = shoal("test", cwd=folder)
    assert status == 0
    assert re.search(r"warning: depth proved nothing", out)


@pytest.mark.heavy
def test_the_files_for_programs(write):
    folder = write(good=scenario(), bad=scenario(FLAT), broken="]")
    status, out, err = shoal("test", "--junit", "new/j.xml", "--json", "-", cwd=folder)
    assert status == 2
    assert "1 passed, 1 failed, 1 not readable" in err
    runs = {run["scenario"]: run for run in json.loads(out)["runs"]}
    assert {name: run["passed"] for name, run in runs.items()} == {"good": True, "bad": False, "broken": False}
    assert [run["readable"] for run in runs.values()].count(False) == 1
    told = {name: (run["seed"], run["repeated"]) for name, run in runs.items()}
    assert told == {"good": (0, True), "bad": (0, True), "broken": (None, None)}
    assert runs["bad"]["margin"] == runs["bad"]["verdicts"][0]["margin"] < 0.0 < runs["good"]["margin"]
    assert runs["bad"]["logs"] == {NAME: f"log/bad/{LOG}"}
    assert (folder / "new" / "j.xml").read_text().count("<testcase ") == 3


@pytest.mark.heavy
def test_a_new_scenario_can_be_read(tmp_path):
    done = shoal("new", "scenario", "dvl-outage", cwd=tmp_path)
    assert done.returncode == 0
    assert "shoal test dvl-outage.scenario.yaml" in done.stdout
    made = load_document(tmp_path / "dvl-outage.scenario.yaml").scenario()
    assert (len(made.events), len(made.expectations), len(made.metrics)) == (1, 4, 1)
    assert shoal("new", "scenario", "dvl-outage", cwd=tmp_path).returncode == 2
    assert "is not a name such as" in shoal("new", "scenario", "a/b", cwd=tmp_path).stderr


@pytest.mark.heavy
def test_ctrl_c_leaves_no_process_and_tells_what_was_done(write):
    folder = write(a=scenario(), b=trouble("hang"), c=trouble("hang"), d=scenario())
    (folder / "trouble.py").write_text(TROUBLE)
    process = subprocess.Popen(
        [*SHOAL, "test", "-j", "2", "--json", "it.json", "--junit", "it.xml"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=folder, env=ENVIRONMENT, start_new_session=True,
    )  # fmt: skip
    assert process.stdout.readline().startswith("passed  a.scenario.yaml")
    workers = children(process.pid)
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=20.0)
    assert (process.returncode, err) == (130, "")
    assert re.search(r"1 passed, 3 not run in .*; stopped", out)
    assert json.loads((folder / "it.json").read_text())["undone"] == [f"{name}.scenario.yaml" for name in "bcd"]
    assert (folder / "it.xml").read_text().count("<skipped") == 3
    until(lambda: not any(Path(f"/proc/{worker}").exists() for worker in workers))


@pytest.mark.heavy
def test_a_terminal_has_a_progress_bar(write):
    folder = write(one=scenario(), two=scenario())
    program = f"import pty, sys; sys.exit(pty.spawn({[*SHOAL, 'test']!r}) >> 8)"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=folder, env={**ENVIRONMENT, "TERM": "xterm", "COLUMNS": "100"},
        stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60.0,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert "0/2" in done.stdout
    assert "2/2" in done.stdout
    assert "2 passed" in done.stdout


def test_a_limit_that_nobody_watches_is_refused(tmp_path):
    (tmp_path / "a.scenario.yaml").write_text("vehicle: {profile: otter}\nlimit: 1 s\n")
    status, _, err = shoal("test", "-j", "0", "--wall-limit", "4s", cwd=tmp_path)
    assert (status, "-j 0 has no time limit" in err) == (2, True)
