"""The systemd unit: systemd itself accepts it, and it runs what was asked for."""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from shoal.cli.service import quote_for_systemd
from tests import command
from tests.outside import NO_FILE


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def shoal(*words: str):
    return command.shoal("service", *words)


def options(unit: str) -> dict[str, str]:
    """The settings of a unit; none occurs twice."""
    found = re.findall(r"^(\w+)=(.*)$", unit, re.MULTILINE)
    assert len(found) == len(dict(found))
    return dict(found)


def test_the_unit_runs_the_vehicle_and_is_watched(folder: Path) -> None:
    done = shoal("lauv-noptilus-1", "-p", "Hardware", "--set", "General:Seed=3")
    assert done.exit_code == 0, done.output
    assert "wrote shoal-lauv-noptilus-1.service" in done.output
    unit = options((folder / "shoal-lauv-noptilus-1.service").read_text())
    program, _, rest = unit["ExecStart"].partition(" run ")
    assert Path(program.split()[0]).is_absolute()
    assert rest == "lauv-noptilus-1 -p Hardware --set General:Seed=3 --log-dir /var/lib/shoal/log"
    assert unit["Type"] == "notify"
    assert int(unit["WatchdogSec"]) == 15
    assert (unit["Restart"], unit["StartLimitIntervalSec"]) == ("always", "0")
    assert (unit["User"], unit["SupplementaryGroups"]) == ("shoal", "dialout")
    assert (unit["ProtectSystem"], unit["NoNewPrivileges"], unit["StateDirectory"]) == ("strict", "yes", "shoal")
    assert unit["WorkingDirectory"] == str(folder)
    assert unit["LimitMEMLOCK"] == "256M"


@pytest.mark.parametrize(
    "words",
    [
        ["lauv-noptilus-1", "-p", "Hardware"],
        ["otter", "-p", "Simulation", "--log-dir", "/data/my logs/log", "--wait-for-clock", "0"],
        ["own.ini", "--set", "Transports.Logging:Entity Label=50 % of \"$HOME\" \\ 'now'"],
    ],
)
def test_systemd_accepts_the_unit(folder: Path, systemd_analyze: str, words: list[str]) -> None:
    (folder / "own.ini").write_text("[Require otter.ini]\n[Transports.Logging]\nEnabled = Always\n")
    done = shoal(*words)
    assert done.exit_code == 0, done.output
    (unit,) = folder.glob("*.service")
    verified = subprocess.run([systemd_analyze, "verify", unit], capture_output=True, text=True)
    about_it = [line for line in (verified.stdout + verified.stderr).splitlines() if unit.name in line]
    assert about_it == []
    rated = subprocess.run(
        [systemd_analyze, "security", "--offline=yes", "--threshold=30", unit], capture_output=True, text=True
    )
    assert rated.returncode == 0, rated.stdout  # an exposure of at most 3.0, which is OK


@pytest.mark.parametrize("name", ["$(touch pwned)", "`id`", "%n", "a b", "-auv", "it's"])
def test_a_name_that_a_shell_or_systemd_expands_is_refused(folder: Path, name: str) -> None:
    done = shoal("lauv-noptilus-1", "-p", "Hardware", "--set", f"General:Vehicle={name}", "-o", "-")
    assert done.exit_code == 2, done.output
    assert "cannot be in the name of a service; use letters, digits" in done.output
    assert "ExecStart" not in done.output


@pytest.mark.parametrize("place", ["folder", "profile", "code"])
def test_a_line_break_in_a_path_adds_no_line_to_the_unit(
    folder: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    (bad := folder / "a\nExecStartPre=reboot").mkdir()
    (bad / "own.ini").write_text("[Require otter.ini]\n")
    words = ["own.ini"] if place == "folder" else [str(bad / "own.ini")] if place == "profile" else ["otter"]
    if place == "folder":
        monkeypatch.chdir(bad)
    if place == "code":
        words += ["--code", str(bad)]
    done = shoal(*words, "-p", "Simulation", "-o", "-")
    assert done.exit_code == 2, done.output
    assert "has a line break or another control character" in done.output
    assert "ExecStart=" not in done.output


@pytest.mark.parametrize(
    "word", ["plain", "two words", 'a "quote"', "100 %", "$HOME", "back\\slash", "tab\t", "it's", ""]
)
def test_no_word_is_expanded_by_systemd(word: str) -> None:
    text = quote_for_systemd(word)
    assert "%" not in text.replace("%%", "")
    assert "$" not in text.replace("$$", "")
    inner = text[1:-1] if text.startswith('"') else text
    back = re.sub(r"\\(.)", lambda m: {"t": "\t", "n": "\n"}.get(m[1], m[1]), inner)
    assert back.replace("%%", "%").replace("$$", "$") == word


def test_what_a_profile_of_ones_own_needs_is_named_absolutely(folder: Path) -> None:
    (folder / "own.ini").write_text("[Require otter.ini]\n[Transports.Logging]\nEnabled = Always\n")
    (folder / "code").mkdir()
    done = shoal("own.ini", "--code", "code", "-d", ".", "-o", "-")
    assert done.exit_code == 0, done.output
    assert f" run {folder}/own.ini -d {folder} --code {folder}/code " in options(done.stdout)["ExecStart"]
    assert "may not see" in done.stderr, "tests run below /tmp"


VISION = ["--set", "General:Bus=zenoh", "--set", "Vision.FisheyeCamera:Process=vision"]


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["--process", "vision"], "lauv-noptilus-1-vision"),
        (["--process", "main"], "lauv-noptilus-1"),
        (["--alone"], "lauv-noptilus-1"),
    ],
)
def test_each_computer_of_a_vehicle_has_a_unit_for_its_process(folder: Path, words: list[str], name: str) -> None:
    done = shoal("lauv-noptilus-1", "-p", "Simulation,Camera", *VISION, *words)
    assert done.exit_code == 0, done.output
    assert f"systemctl enable --now shoal-{name}\n" in done.output
    unit = options((folder / f"shoal-{name}.service").read_text())
    assert unit["ExecStart"].endswith(f" {' '.join(words)} --log-dir /var/lib/shoal/log")
    assert unit["RuntimeDirectory"] == f"shoal-{name}"


def test_a_unit_that_was_changed_by_hand_is_not_replaced_unasked(folder: Path) -> None:
    words = ["lauv-noptilus-1", "-p", "Hardware", "--bus", "zenoh"]
    assert shoal(*words).exit_code == shoal(*words).exit_code == 0, "the same again"
    unit = folder / "shoal-lauv-noptilus-1.service"
    assert " --bus zenoh --log-dir " in unit.read_text()
    changed = unit.read_text() + "# mine\n"
    unit.write_text(changed)
    refused = shoal(*words)
    assert refused.exit_code != 0
    assert f"{unit.name} exists, differs and was not changed; --force replaces it" in refused.output
    assert unit.read_text() == changed
    assert shoal(*words, "--force").exit_code == 0
    assert "# mine" not in unit.read_text()


@pytest.mark.heavy
def test_it_waits_for_the_clock_once_a_boot(folder: Path) -> None:
    unit = options(shoal("otter", "-p", "Simulation", "--wait-for-clock", "1", "-o", "-").stdout)
    assert (unit["RuntimeDirectory"], unit["RuntimeDirectoryPreserve"]) == ("shoal-otter", "restart")
    program, _, script = unit["ExecStartPre"].partition(" -c ")
    assert program == "-/bin/sh", "a failure does not matter"
    (folder / "timedatectl").write_text("#!/bin/sh\necho NTPSynchronized=no\n")
    (folder / "timedatectl").chmod(0o755)
    command = script.strip("'").replace("/run/shoal-otter/", f"{folder}/")
    took: list[float] = []
    for _ in range(2):
        began = time.monotonic()
        subprocess.run(["/bin/sh", "-c", command], env={"PATH": f"{folder}:/usr/bin:/bin"}, check=True)
        took.append(time.monotonic() - began)
    assert took[0] > 0.9
    assert took[1] < 0.9


def test_a_home_is_not_hidden_if_python_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "prefix", "/opt/shoal")
    monkeypatch.setattr(sys, "executable", "/opt/shoal/bin/python")
    monkeypatch.setattr("shoal.cli.service.__file__", "/opt/shoal/lib/shoal/cli/service.py")
    for base, wanted in (("/usr", "yes"), ("/home/pilot/.local/share/uv/python", "read-only")):
        monkeypatch.setattr(sys, "base_prefix", base)
        done = shoal("otter", "-p", "Simulation", "-o", "-")
        assert options(done.stdout)["ProtectHome"] == wanted
        assert (base in done.stderr) is (wanted == "read-only")


def test_logs_elsewhere_are_writable(folder: Path) -> None:
    unit = options(shoal("otter", "-p", "Simulation", "--log-dir", "/data/log", "-o", "-").stdout)
    assert unit["ReadWritePaths"] == "-/data"
    assert "StateDirectory" not in unit


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nemo"], "there is no profile 'nemo'"),
        (
            ["lauv-noptilus-1", "-p", "Camera", *VISION, "--process", "visoin"],
            "no enabled section has Process = visoin",
        ),
        (["lauv-noptilus-1", "-p", "Camera", *VISION[2:], "--process", "vision"], "needs a zenoh bus"),
        (["otter"], "has nothing to run without a mode; select one with -p: Camera, Detector, Hardware"),
        (["otter", "-p", "Simlation"], "did you mean 'Simulation'"),
        (["otter", "-p", "Simulation", "--set", "Simulators.GPS:HACC=high"], "'high' is not a number"),
        (["otter", "-p", "Simulation", "--user", "root; rm"], "not the name of a user"),
        (["otter", "-p", "Simulation", "--log-dir", "log"], "log is not absolute"),
        (["otter", "-p", "Simulation", "-o", "missing/unit"], f"missing/unit: {NO_FILE}"),
    ],
)
def test_mistakes_write_nothing(folder: Path, words: list[str], said: str) -> None:
    done = shoal(*words)
    assert done.exit_code == 2
    assert said in done.output
    assert list(folder.glob("*.service")) == []


@pytest.mark.heavy
def test_the_command_of_the_unit_starts(folder: Path) -> None:
    """Not as the service manager runs it: without its user and its folders."""
    done = shoal("lauv-noptilus-1", "-p", "Hardware", "--log-dir", str(folder / "log"), "-o", "-")
    words = options(done.stdout)["ExecStart"].split()
    run = subprocess.run(
        [*words, "--set", "Transports.MAVLink:Enabled=Never", "--for", "1s"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert run.returncode == 0, run.stderr
    assert list(folder.glob("log/lauv-noptilus-1/*/*/Data.lsf.gz"))
    assert Path(words[0]).parent == Path(sys.executable).parent
