"""Foxglove's own clients beside a shipped vehicle: they record it and set its parameters, and rosbags opens the record.

The clients are @foxglove/ws-protocol-examples of npm, in the versions of npm/package-lock.json.
"""

import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.outside import lacking, until
from tests.shoal.console.foxglove.test_foxglove import NAME, STATE, printed
from tests.shoal.console.operator_page import operator_page
from tests.shoal.logs.export.mcap_reader import Reader
from tests.shoal.network.running import running

LOCKED = Path(__file__).parent / "npm"
EXAMPLES = "node_modules/@foxglove/ws-protocol-examples/dist/cjs/ws-protocol-examples/src/index.js"
pytestmark = pytest.mark.heavy


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """The command of Foxglove's clients."""
    npm, node = shutil.which("npm"), shutil.which("node")
    if npm is None or node is None:
        lacking("Node.js is not installed")
    folder = tmp_path_factory.mktemp("npm")
    for path in LOCKED.iterdir():
        shutil.copy(path, folder)
    words = [npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund"]
    installed = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=200)
    if installed.returncode:
        lacking(f"npm installed no clients: {installed.stderr[-300:]}")
    return [node, str(folder / EXAMPLES)]


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    with running(tmp_path_factory.mktemp("vehicle")), operator_page("--foxglove", "operate") as page:
        yield next(line.split()[-1] for line in printed(page) if line.startswith("Foxglove: "))


def run_client(command, log):
    with log.open("w") as output:
        return subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)


def test_a_live_vehicle_is_recorded_and_rosbags_opens_the_file(client, address, tmp_path):
    record, log = tmp_path / "live.mcap", tmp_path / "log.txt"
    process = run_client([*client, "mcap-record", address, "-o", str(record)], log)
    try:
        until(lambda: f"{STATE}/pose" in log.read_text())
        time.sleep(5.0)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)
    assert "server error" not in log.read_text()
    reader = Reader(record, profile="")  # the client writes none
    for topic in (STATE, f"{STATE}/pose", f"{STATE}/odometry", f"{STATE}/location", "/tf"):
        assert len(reader.on(topic)) > 20, topic
    states = [state for _, state in reader.on(STATE)]
    assert {state.src for state in states} == {0x1A}
    stamps = [state.header.stamp.sec + state.header.stamp.nanosec / 1e9 for state in states]
    assert stamps == sorted(stamps)


def test_parameters_are_listed(client, address, tmp_path):
    log = tmp_path / "log.txt"
    process = run_client([*client, "param-client", address], log)
    try:
        until(lambda: "Subscribing to" in log.read_text())
    finally:
        process.terminate()
        process.wait(30)
    assert f"{NAME}/" in log.read_text()
    assert "missing" not in log.read_text()
