"""`shoal fleet` with real processes: started, killed, started again, stopped."""

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import zenoh

import imc
from runtime.zenoh import ProcessPart, ZenohConfig, ZenohTransport
from shoal.fleet import FleetMonitor, register_fleet
from tests.command import shoal
from tests.outside import children, until
from tests.repeats import repeat
from tests.runtime.zenoh.processes import PATIENCE, REPOSITORY, Network, Process

FLEET = """
name: test-{port}
per_process: {per_process}
stagger: 0.1s
zenoh: {{Local Port: "{port}"}}
set: ["Transports.MAVLink:Enabled=Never", {own_udp}]
vehicles:
  - {{name: "lauv-{{number}}", count: 2}}
  - {{name: otter-1, profile: otter}}
"""
GONE = "STATUS  2 of 3 run; (silent|not running): lauv-1\n"  # zenoh gives a process up that says nothing for 10 s
NAMES = {"lauv-1", "lauv-2", "otter-1"}


def fleet_file(network: Network, per_process: int) -> str:
    return FLEET.format(port=network.local_port, per_process=per_process, own_udp=json.dumps(network.own_udp)[1:-1])


def wait_until(condition: Callable[[], bool], process: Process) -> None:
    until(condition, 2 * PATIENCE, every=0.1, told=lambda: process.errors)


def connected(port: int) -> Any:
    """A zenoh client, as soon as there is somebody to connect to."""
    config: Any = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))

    def opened() -> Any:
        with contextlib.suppress(zenoh.ZError):
            return zenoh.open(config)

    return until(opened, 2 * PATIENCE, every=0.2)


@pytest.mark.heavy
@pytest.mark.parametrize("per_process", [repeat(1), 2])
def test_a_fleet_is_started_kept_and_stopped(network: Network, tmp_path: Path, per_process: int) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(fleet_file(network, per_process))
    run = network.add("-m", "shoal.cli", "fleet", file, "--log-dir", tmp_path / "log")
    session = connected(network.local_port)

    def alive() -> set[str]:
        replies = session.liveliness().get("imc/*/@alive/*/main", timeout=2.0)
        return {str(reply.ok.key_expr).split("/")[1] for reply in replies if reply.ok is not None}

    wait_until(lambda: alive() == NAMES, run)
    assert len(children(run.popen.pid)) == (3 if per_process == 1 else 2)
    victim = children(run.popen.pid)[0]
    os.kill(victim, signal.SIGKILL)
    wait_until(lambda: alive() != NAMES, run)
    wait_until(lambda: alive() == NAMES, run)
    wait_until(lambda: len(list((tmp_path / "log").glob("*/*/*/Data.lsf*"))) >= 4, run)
    session.close()
    living = children(run.popen.pid)
    command = [sys.executable, "-m", "shoal.cli", "fleet", "stop", f"test-{network.local_port}"]
    stopped = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, timeout=40)
    assert stopped.stdout == f"test-{network.local_port} stopped\n", stopped.stderr
    assert run.wait() == 0
    assert not [process for process in living if Path(f"/proc/{process}").exists()]
    ids = {
        message.src
        for folder in (tmp_path / "log").glob("*/*/*")
        for message in list(imc.Log(folder))[:50]
        if isinstance(message, imc.LoggingControl)
    }
    assert len(ids) == 3
    again = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, timeout=40)
    assert again.returncode == 2
    assert "no fleet" in again.stderr


@pytest.mark.heavy
def test_the_status_names_who_does_not_run_and_who_is_silent_and_the_end_is_reported(
    network: Network, tmp_path: Path
) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(fleet_file(network, 1))
    command = [
        sys.executable,
        "-m",
        "shoal.cli",
        "fleet",
        str(file),
        "--log-dir",
        str(tmp_path / "log"),
    ]
    gone = 0
    with subprocess.Popen(command, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        lines: list[str] = []
        for line in run.stdout:
            lines.append(line)
            if line.endswith("STATUS  3 of 3 run\n"):
                frozen = children(run.pid)[0]
                os.kill(frozen, signal.SIGSTOP)
            elif re.search(GONE, line):
                gone += 1
                if gone == 1:
                    os.kill(frozen, signal.SIGCONT)
                else:
                    run.terminate()
    assert run.returncode == 1, lines
    assert any(re.search(GONE, line) for line in lines), lines
    assert lines[-1].endswith(" s, 0 restarts, down: lauv-1\n"), lines
    assert f" test-{network.local_port} has ended after " in lines[-1]
    assert not any("inf" in line for line in lines)


@pytest.mark.heavy
@pytest.mark.parametrize("is_ignored", [False, True])
def test_a_closed_terminal_ends_the_vehicles_in_order_unless_they_run_under_nohup(
    network: Network, tmp_path: Path, is_ignored: bool
) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(fleet_file(network, 3) + "restart: never\n")
    before = "import os, signal, sys; signal.signal(signal.SIGHUP, signal.Handlers(int(sys.argv[1])));"
    start = f"{before} os.execv(sys.executable, [sys.executable, '-m', 'shoal.cli', *sys.argv[2:]])"
    handler = int(signal.SIG_IGN if is_ignored else signal.SIG_DFL)
    run = network.add("-c", start, handler, "fleet", file, "--log-dir", tmp_path / "log")
    wait_until(lambda: len(list((tmp_path / "log").glob("*/*/*/Data.lsf*"))) == 3, run)
    (crew,) = children(run.popen.pid)
    os.kill(crew, signal.SIGHUP)
    if is_ignored:
        os.kill(run.popen.pid, signal.SIGHUP)
        time.sleep(1.0)
        assert run.popen.poll() is None
        assert children(run.popen.pid) == [crew]
        run.popen.terminate()
    assert run.popen.wait(2 * PATIENCE) == 0, "it would be 1 if the signal had killed the vehicles"


@pytest.mark.heavy
def test_a_fleet_whose_processes_cannot_be_started_fails(network: Network, tmp_path: Path) -> None:
    file = tmp_path / "fleet.yaml"
    file.write_text(fleet_file(network, 3))
    busy = "import errno, subprocess; from shoal.cli import main\n"
    busy += "class Refused(subprocess.Popen):\n"
    busy += "    def __init__(self, *_, **options): raise BlockingIOError(errno.EAGAIN, 'busy')\n"
    busy += "subprocess.Popen = Refused; main()"
    words = [sys.executable, "-c", busy, "fleet", str(file), "--log-dir", str(tmp_path / "log"), "--for", "2s"]
    done = subprocess.run(words, cwd=REPOSITORY, capture_output=True, text=True, timeout=2 * PATIENCE)
    assert done.returncode == 1, done.stderr
    assert done.stdout.count(" cannot be started: ") >= 2
    assert "0 restarts, down: lauv-1, lauv-2, otter-1" in done.stdout


@pytest.mark.heavy
def test_a_fleet_whose_vehicles_already_run_is_refused_before_anything_starts(network: Network, tmp_path: Path) -> None:
    config = ZenohConfig(local_port=network.local_port, scouting="none", vehicle="lauv-2")
    running = ZenohTransport(config, str, lambda *_: "", part=ProcessPart("lauv-2", 7, 1))
    running.open(lambda _: None)
    file = tmp_path / "fleet.yaml"
    file.write_text(fleet_file(network, 1))
    second = network.add("-m", "shoal.cli", "fleet", file, "--log-dir", tmp_path / "log")
    assert second.wait() == 2
    (said,) = second.errors
    assert said.startswith("Error: lauv-2 already runs on "), said
    assert f", process {os.getpid()}, since " in said
    assert "; this is " in said
    assert "Local Port" in said
    assert not (tmp_path / "log").exists()
    running.close()


def test_a_fleet_that_could_not_log_is_refused_and_another_name_to_stop_is_reported(
    network: Network, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    file = tmp_path / "fleet.yaml"
    file.write_text(fleet_file(network, 1))
    refused = shoal("fleet", str(file), "--log-dir", str(file))
    assert refused.exit_code == 2
    assert f"no log can be written to {file}: " in refused.output
    with register_fleet(f"other-{network.local_port}"):
        stop = shoal("fleet", "stop", "nobody")
    assert stop.exit_code == 2
    assert stop.output.startswith("Error: no fleet nobody runs; running: ")
    assert f"other-{network.local_port}" in stop.output


@pytest.mark.heavy
def test_errors_in_the_log_books_of_vehicles_are_reported_once(network: Network) -> None:
    watch = FleetMonitor({"Local Port": str(network.local_port)})
    config = ZenohConfig(mode="client", local_port=network.local_port, scouting="none", vehicle="lauv-1")
    vehicle = ZenohTransport(config, lambda _: "lauv-1", lambda *_: "Logger", part=ProcessPart("lauv-1", 7, 1))
    vehicle.open(lambda _: None)
    types = imc.LogBookEntry.Type
    for kind, text in ((types.INFO, "began"), *[(types.ERROR, "disk full")] * 2, (types.ERROR, "off")):
        entry = imc.LogBookEntry(src=7, type=kind, context="Transports.Logging", text=text)
        vehicle.send(entry, imc.encode(entry))
    told: list[tuple[str, str]] = []
    until(lambda: told.extend(watch.new_errors()) or len(told) == 2)
    assert told == [("lauv-1", "Transports.Logging: disk full"), ("lauv-1", "Transports.Logging: off")]
    vehicle.close()
    watch.close()


@pytest.mark.heavy
def test_a_port_that_another_program_has_is_named() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(ConnectionError, match=rf"no zenoh at port {port} .*another program has it"):
            FleetMonitor({"Local Port": str(port)})
