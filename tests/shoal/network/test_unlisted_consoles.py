"""One list of consoles for every way to a vehicle: who is not in it hears all, and gets a clear answer to an order."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import imc
import shoal
from shoal.network import Unlisted
from tests.shoal.network.running import REPOSITORY, Running, running

NAME = "lauv-noptilus-1"
OTTER = 0x0803
LISTED, STRANGER = "0x4101", "0x4202"
REASON = f"of {STRANGER} rejected: not in \\[General\\] Consoles of {NAME}"
WAYS = [
    lambda v: v.plan.start("survey"),
    lambda v: v.plan.stop(),
    lambda v: v.param.set("Path Control", {"Corridor -- Width": "2"}),
    lambda v: v.abort(),
]


@pytest.fixture(scope="module", params=["zenoh", "udp", "tcp"])
def vehicle(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    folder = tmp_path_factory.mktemp("vehicle")
    with running(folder, "--set", f"General:Consoles={LISTED}", network=request.param) as found:
        yield found


@pytest.mark.heavy
def test_a_console_that_is_not_listed_hears_the_vehicle_and_gets_the_reason_at_once(
    vehicle: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SHOAL_CONSOLE", STRANGER)
    for order in WAYS:
        with shoal.connect(NAME) as stranger:
            assert stranger.latest(imc.EstimatedState).src == 0x001A
            with pytest.raises(Unlisted, match=REASON):
                order(stranger)
            assert stranger.latest(imc.VehicleState).op_mode != imc.VehicleState.OpMode.ERROR
    monkeypatch.setenv("SHOAL_CONSOLE", LISTED)
    with shoal.connect(NAME) as console:
        assert console.param.set("Path Control", {"Corridor -- Width": "2.5"})
    told = [line for line in vehicle.log.read_text().splitlines() if f"packet from {STRANGER} " in line]
    assert len(told) == 1
    assert "command of a console that is not listed" in told[0]


COMMANDS = [
    ("send", NAME, "Abort"),
    ("plan", NAME, "stop"),
    ("abort", NAME),
    ("param", NAME, "get", "Path Control"),
    ("param", NAME, "load", "values.ini"),
    ("link", NAME),
]


@pytest.mark.heavy
def test_each_command_of_shoal_says_over_zenoh_that_the_vehicle_does_not_list_it(tmp_path: Path) -> None:
    (tmp_path / "values.ini").write_text("[Control.AUV.PathControl]\nCorridor -- Width = 2\n")
    with running(tmp_path, "--set", f"General:Consoles={LISTED}"):
        for words in COMMANDS:
            done = subprocess.run(
                [sys.executable, "-m", "shoal.cli", *words],
                env={**os.environ, "SHOAL_CONSOLE": STRANGER, "PYTHONPATH": str(REPOSITORY)},
                cwd=tmp_path,
                capture_output=True,
                text=True,
                check=False,
            )
            said = " ".join((done.stdout + done.stderr).split())
            assert done.returncode, (words, said)
            assert f"of {STRANGER} rejected: not in [General] Consoles of {NAME}" in said, words


@pytest.mark.heavy
def test_telemetry_of_another_vehicle_beyond_reports_is_counted_and_named_once(tmp_path: Path) -> None:
    import zenoh

    with running(tmp_path, "--set", f"General:Consoles={LISTED}") as vehicle:
        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("connect/endpoints", json.dumps([os.environ["SHOAL_CONNECT"]]))
        with zenoh.open(config) as session:
            publisher = session.declare_publisher("imc/otter/Distance/DVL")
            for number in range(100):
                publisher.put(imc.encode(imc.Distance(value=float(number), src=OTTER, timestamp=1e9 + number)))
            vehicle.until(f"Distance of 0x{OTTER:04X} (otter) over zenoh dropped")
        vehicle.popen.send_signal(signal.SIGTERM)
        assert vehicle.popen.wait(20.0) == 0
        printed = vehicle.log.read_text()
    assert printed.count("over zenoh dropped") == 1, printed
    assert f"{NAME}: 100 messages of other vehicles dropped, see [General] Consoles" in printed
