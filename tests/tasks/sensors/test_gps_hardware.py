"""A GPS receiver of the shipped profile in mode Hardware: absent, and at a pseudo terminal."""

import math
import os
import signal
import subprocess
import sys
import time
import tty
from pathlib import Path

import pytest

import imc
from tests.outside import ALONE_WORDS, NO_FILE

DATA = Path(__file__).parents[2] / "data" / "sensors" / "gps.nmea"
WITH_FIXES = b"".join(DATA.read_bytes().splitlines(keepends=True)[33:])


def hardware(folder: Path, port: Path, *more: str) -> subprocess.Popen[str]:
    words = ["run", "lauv-noptilus-1", "-p", "Hardware", "--set", f"Sensors.GPS:Serial Port - Device={port}", *more]
    words += [*ALONE_WORDS, "--set", "Transports.Logging:Flush Interval=0.5"]
    return subprocess.Popen(
        [sys.executable, "-m", "shoal.cli", *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


@pytest.mark.heavy
def test_a_vehicle_without_its_receiver_runs_and_names_it(tmp_path: Path) -> None:
    run = hardware(tmp_path, tmp_path / "ttyNONE", "--for", "1s")
    output = run.communicate(timeout=60)[0]
    assert run.returncode == 0, output
    assert f"GPS: ERROR {tmp_path}/ttyNONE: {NO_FILE}" in output
    assert "Traceback" not in output


@pytest.mark.heavy
def test_the_shipped_vehicle_takes_its_fixes_from_a_serial_port(tmp_path: Path) -> None:
    end, own = os.openpty()
    tty.setraw(own)
    os.set_blocking(end, False)
    run = hardware(tmp_path, Path(os.ttyname(own)))
    try:
        limit = time.monotonic() + 60.0
        found: list[imc.GpsFix] = []
        data = bytearray()
        while len(found) < 3 and time.monotonic() < limit:
            data = data or bytearray(WITH_FIXES)
            try:
                del data[: os.write(end, data[:200])]
            except BlockingIOError:
                pass
            time.sleep(0.05)
            for log in tmp_path.glob("log/*/*/*/Data.lsf.gz"):
                try:
                    found = list(imc.Log(log).messages(imc.GpsFix))
                except Exception:
                    continue
    finally:
        run.send_signal(signal.SIGINT)
        output = run.communicate(timeout=60)[0]
        os.close(end)
        os.close(own)
    assert run.returncode == 0, output
    assert len(found) >= 3, output
    assert math.degrees(found[-1].lat) == pytest.approx(41.185, abs=1e-3)
