"""`shoal run` and `shoal replay` as users run them: in a shell, in a pipe, on a terminal."""

import gzip
import os
import pty
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pyte
import pytest

import imc
from tests.outside import ALONE_WORDS, TOO_LARGE
from tests.shoal.cli.installed import SHOAL, shoal

VIRTUAL = ["run", "lauv-noptilus-1", "-p", "Kinematic", "--clock", "virtual"]

FAULTY = '''"""Faulty: fails at a depth."""

import imc
from runtime import Task, consume


class Faulty(Task):
    """Fails."""

    @consume
    def look(self, state: imc.EstimatedState) -> None:
        if state.depth > 1.0:
            raise ValueError("too deep for me")
'''

SILENT = FAULTY.replace("Faulty", "Silent").replace("> 1.0", "> 1000.0")


def data(folder):
    (log,) = Path(folder).glob("log/*/*/*/Data.lsf.gz")
    return gzip.decompress(log.read_bytes())


@pytest.mark.heavy
def test_a_virtual_run_leaves_a_log_that_begins_at_the_profiles_time(tmp_path):
    done = shoal(*VIRTUAL, "--for", "30s", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "30.0 s of vehicle time" in done.stdout
    assert "LOG     log/lauv-noptilus-1/20260101/000000" in done.stdout
    assert "skipped: Transports.MAVLink (needs the network, which is off in virtual time)" in done.stderr
    log = imc.Log(tmp_path / "log/lauv-noptilus-1/20260101/000000")
    counts = log.counts()
    assert counts["SimulatedState"] == 3000
    assert counts["EstimatedState"] == 600
    assert counts["EstimatedMugState"] > 10
    assert log.losses == []


@pytest.mark.heavy
def test_equal_runs_leave_equal_bytes_whatever_the_hash_seed_and_the_other_tasks(tmp_path):
    logs = []
    for name, seed, more in [
        ("a", "0", []),
        ("b", "random", []),
        ("c", "1", ["--set", "silent.Silent:Enabled=Always"]),
    ]:
        folder = tmp_path / name
        folder.mkdir()
        (folder / "silent.py").write_text(SILENT)
        done = shoal(*VIRTUAL, "--for", "20s", "--seed", "3", *more, cwd=folder, PYTHONHASHSEED=seed)
        assert done.returncode == 0, done.stderr
        logs.append(data(folder))
    assert logs[0] == logs[1] == logs[2]
    assert len(logs[0]) > 400_000


@pytest.mark.heavy
def test_another_seed_is_another_run(tmp_path):
    for seed in "12":
        (tmp_path / seed).mkdir()
        shoal(*VIRTUAL, "--for", "5s", "--seed", seed, cwd=tmp_path / seed)
    assert data(tmp_path / "1") != data(tmp_path / "2")


def test_a_failing_task_ends_a_simulation_with_its_own_traceback(tmp_path):
    (tmp_path / "faulty.py").write_text(FAULTY)
    done = shoal(*VIRTUAL, "--for", "60s", "--set", "faulty.Faulty:Enabled=Always", cwd=tmp_path)
    assert done.returncode == 1
    assert "too deep for me" in done.stderr
    assert "in faulty.Faulty at" in done.stderr
    assert "runtime/kernel" not in done.stderr


@pytest.mark.heavy
def test_keep_going_restarts_it_and_says_so(tmp_path):
    (tmp_path / "faulty.py").write_text(FAULTY)
    done = shoal(*VIRTUAL, "--for", "60s", "--set", "faulty.Faulty:Enabled=Always", "--keep-going", cwd=tmp_path)
    assert done.returncode == 0
    assert "too deep for me (faulty.py:13 in look): restarting in 1 s" in done.stdout


@pytest.mark.heavy
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_it_in_order_within_a_second(tmp_path, number):
    command = [*SHOAL, "run", "lauv-noptilus-1", "-p", "Simulation", *ALONE_WORDS]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 20
    while not list(tmp_path.glob("log/*/*/*/Data.lsf.gz")) and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(0.5)
    process.send_signal(number)
    asked = time.monotonic()
    out, err = process.communicate(timeout=20)
    assert time.monotonic() - asked < 3.0
    assert process.returncode == 0, err
    assert "messages" in out
    last = list(imc.Log(next(tmp_path.glob("log/*/*/*"))))[-1]
    assert isinstance(last, imc.LoggingControl)
    assert last.op == imc.LoggingControl.Op.STOPPED


@pytest.mark.heavy
def test_whoever_reads_may_go_and_the_vehicle_goes_on(tmp_path):
    command = [*SHOAL, *VIRTUAL, "--for", "1min", "--set", "Transports.Logging:Transports=Nonsense"]
    read, write = os.pipe()
    os.close(read)
    process = subprocess.run(command, cwd=tmp_path, stdout=write, stderr=subprocess.PIPE, text=True)
    os.close(write)
    assert process.returncode == 0, process.stderr
    assert imc.Log(next(tmp_path.glob("log/*/*/*"))).counts()["LoggingControl"] == 2


@pytest.mark.heavy
def test_a_closed_terminal_stops_it_in_order(tmp_path):
    process, terminal = pty.fork()
    if process == 0:
        os.chdir(tmp_path)
        os.execv(SHOAL[0], [*SHOAL, "run", "lauv-noptilus-1", "-p", "Simulation", *ALONE_WORDS])
    deadline, screen = time.monotonic() + 30, b""
    while time.monotonic() < deadline and b"MUG 1 at" not in screen:
        screen += os.read(terminal, 65536)
    os.close(terminal)
    _, status = os.waitpid(process, 0)
    assert status == 0
    last = list(imc.Log(next(tmp_path.glob("log/*/*/*"))))[-1]
    assert isinstance(last, imc.LoggingControl)
    assert last.op == imc.LoggingControl.Op.STOPPED


@pytest.mark.heavy
def test_a_terminal_shows_the_vehicle(tmp_path):
    screen = pyte.Screen(110, 30)
    stream = pyte.ByteStream(screen)
    process, terminal = pty.fork()
    if process == 0:
        os.chdir(tmp_path)
        os.environ.update(TERM="xterm-256color", COLUMNS="110", LINES="30")
        os.execv(SHOAL[0], [*SHOAL, "run", "lauv-noptilus-1", "-p", "Simulation", *ALONE_WORDS])
    text, deadline = "", time.monotonic() + 30
    while time.monotonic() < deadline and "MUG 1 at" not in text:
        if select.select([terminal], [], [], 0.2)[0]:
            stream.feed(os.read(terminal, 65536))
        text = "\n".join(screen.display)
    os.write(terminal, b"\x03")
    while True:
        try:
            if not (chunk := os.read(terminal, 65536)):
                break
        except OSError:
            break
        stream.feed(chunk)
    _, status = os.waitpid(process, 0)
    os.close(terminal)
    for word in ("lauv-noptilus-1 (Simulation)", "depth", "heading", "normal", "detections", "per second", "log/"):
        assert word in text, text
    assert status == 0
    assert sum("lauv-noptilus-1 (Simulation)" in line for line in screen.display) == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "lauv-noptilus-9"], "lauv-noptilus-1"),
        (["run", "../lauv-noptilus-1"], "not a profile name"),
        (["run", "lauv-noptilus-1", "-p", "Simulaton"], "Simulation"),
        (["run", "lauv-noptilus-1", "--set", "nonsense"], "Section:Option=value"),
        (["run", "lauv-noptilus-1", "--clock", "soon"], "real, virtual, or a factor"),
        (["run", "lauv-noptilus-1", "--for", "ten"], "not a duration"),
        (
            ["run", "lauv-noptilus-1", "-p", "Simulation", "--set", "Simulators.GPS:HDOP=-1"],
            "HDOP: -1 is below the minimum (expects real, 0 or more)",
        ),
        (["run"], "name a profile"),
        (["rnu"], "Did you mean run?"),
        (["replay", "nowhere"], "nowhere"),
    ],
)
def test_what_cannot_be_is_said_in_one_line_and_nothing_runs(tmp_path, arguments, words):
    done = shoal(*arguments, cwd=tmp_path)
    assert done.returncode in (1, 2)
    assert words in done.stderr, done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "log").exists()


@pytest.mark.heavy
def test_a_log_is_replayed_whole(tmp_path):
    shoal(*VIRTUAL, "--for", "10s", cwd=tmp_path)
    folder = next(tmp_path.glob("log/*/*/*"))
    count = len(imc.Log(folder))
    done = shoal("replay", folder, "--clock", "virtual", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"played {count} packets, skipped 0" in done.stdout


def test_a_dune_tree_of_ones_own_loads_and_what_shoal_has_not_is_listed(tmp_path):
    (tmp_path / "dune" / "common").mkdir(parents=True)
    (tmp_path / "dune" / "common" / "gps.ini").write_text("[Simulators.GPS]\nEnabled = Simulation\n")
    (tmp_path / "dune" / "my-auv.ini").write_text(
        "[Require common/gps.ini]\n[General]\nVehicle = my-auv\n"
        "[Simulators.LBL]\nEnabled = Simulation\nEntity Label = LBL\nExecution Frequency = 100\n"
        "[Transports.HTTP]\nEnabled = Always\n"
    )
    command = "run -c my-auv -d dune -p Simulation --clock virtual --for 2s"
    done = shoal(*command.split(), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "skipped: Simulators.LBL, Transports.HTTP (not in Shoal)" in done.stderr


def test_what_a_profile_asks_for_in_vain_is_reported(tmp_path):
    done = shoal(*VIRTUAL, "--for", "1s", "--set", "Simulators.GPS:HDPO=1", cwd=tmp_path)
    assert "command line: warning: [Simulators.GPS] 'HDPO' is not a parameter" in done.stderr
    assert "did you mean 'HDOP'?" in done.stderr


@pytest.mark.heavy
def test_a_log_that_cannot_be_written_is_reported_at_the_end(tmp_path):
    command = ["bash", "-c", 'ulimit -f 0; exec "$@"', "-", *SHOAL, *VIRTUAL, "--for", "2s"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.splitlines()[-1].startswith(f"Logger: FAILURE {TOO_LARGE}")
    assert f"MiB of messages are not on the disk: {TOO_LARGE}" in done.stdout


@pytest.mark.heavy
@pytest.mark.parametrize(
    "arguments",
    [["tasks", "Simulators.IMU"], ["run", "lauv-noptilus-1", "-p", "Kinematic", *ALONE_WORDS, "--for", "0.1s"]],
)
def test_a_locale_without_unicode_only_loses_signs(tmp_path, arguments):
    done = shoal(*arguments, cwd=tmp_path, LC_ALL="C", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0")
    assert done.returncode == 0, done.stderr


@pytest.mark.heavy
def test_saved_parameters_come_back_and_leave_virtual_runs_alone(tmp_path):
    (tmp_path / "db").mkdir()
    (tmp_path / "db" / "lauv-noptilus-1-saved.ini").write_text("[Simulators.GPS/Kinematic]\nExecution Frequency = 5\n")
    fixes = []
    for clock in ("5x", "virtual"):
        run = ["run", "lauv-noptilus-1", "-p", "Kinematic", "--clock", clock, "--for", "10s", "--log-dir", clock]
        done = shoal(*run, *ALONE_WORDS, cwd=tmp_path)
        assert ("with the parameters saved in db/lauv-noptilus-1-saved.ini" in done.stderr) == (clock != "virtual")
        fixes.append(imc.Log(next((tmp_path / clock).glob("*/*/*"))).counts()["GpsFix"])
    assert fixes[0] > 20
    assert fixes[1] in (9, 10)
    assert (
        "lauv-noptilus-1-saved.ini:2"
        in shoal("explain", "lauv-noptilus-1", "Simulators.GPS/Kinematic", cwd=tmp_path).stdout
    )


@pytest.mark.heavy
def test_a_start_searches_no_garbage_and_imports_neither_network_clients_nor_yaml(tmp_path: Path) -> None:
    code = (
        "import gc, sys, shoal.cli\nfound = []\ngc.callbacks.append(lambda phase, _: found.append(phase))\n"
        "try:\n    shoal.cli.main(sys.argv[1:])\n"
        "finally:\n    print(len(found), gc.get_freeze_count(), *sys.modules, file=sys.stderr)\n"
    )
    words = ["run", "lauv-noptilus-1", "-p", "Simulation", "--clock", "virtual", "--for", "1s"]
    done = subprocess.run(
        [sys.executable, "-c", code, *words], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    searches, frozen, *modules = done.stderr.splitlines()[-1].split()
    assert (searches, frozen) == ("0", "0")
    assert "tasks.simulators.vsim" in modules
    assert not {"ssl", "http.client", "email.message", "urllib.request", "yaml"} & set(modules)
