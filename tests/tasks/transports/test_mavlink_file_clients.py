"""Clients that take files and logs: pymavlink's and MAVSDK's, over UDP."""

import json
import random
import subprocess
import sys
from pathlib import Path

import pytest
from pymavlink import mavutil
from pymavlink.mavftp import MAVFTP, FtpError, MAVFTPSettings

from mavlink.vehicle.files.virtual_files import VirtualFiles
from tasks.transports.mavlink_links.ftp_folders import DiskFolders
from tests.outside import free_port
from tests.tasks.transports.mavlink_files import SYSTEM, serving
from tests.tasks.transports.mavlink_station import HOST

PATIENCE = 60.0
DIVE = "20240102/030405_dive"
SECONDS = {"idle_detection_time": 0.6, "read_retry_time": 0.3, "retry_time": 0.15}


@pytest.fixture
def logs(tmp_path):
    """Two logs; the content of both."""
    content = random.Random(1).randbytes(30_000)
    for name in (DIVE, "20240103/000001"):
        folder = tmp_path / "logs" / name
        folder.mkdir(parents=True)
        (folder / "Data.lsf").write_bytes(content)
    return content


@pytest.fixture
def tree(tmp_path, logs):
    return VirtualFiles({"general.json": lambda: b"{}" * 300}, DiskFolders({"logs": tmp_path / "logs"}))


class Client:
    """pymavlink's, with shorter times to wait."""

    def __init__(self, port, size):
        self.link = mavutil.mavlink_connection(f"udpout:{HOST}:{port}", source_system=255, source_component=190)
        whole = ("debug", "pkt_loss_tx", "pkt_loss_rx", "max_backlog", "burst_read_size", "write_size", "write_qsize")
        values = [(name, int, value) for name, value in zip(whole, (0, 0, 0, 5, size, 80, 5), strict=True)]
        values += [(name, float, value) for name, value in SECONDS.items()]
        self.ftp = MAVFTP(self.link, SYSTEM, 1, settings=MAVFTPSettings(values))

    def get(self, path):
        got = []
        self.ftp.cmd_get([path], callback=lambda file: got.append(file.read() if file else None))
        self.ftp.process_ftp_reply("OpenFileRO", timeout=PATIENCE)
        return got[0]

    def list(self, path):
        assert self.ftp.cmd_list([path]).error_code == FtpError.Success
        return {entry.name: entry.size_b for entry in self.ftp.list_result}


@pytest.mark.heavy
@pytest.mark.parametrize("size", [239, 100])  # of the pieces; 100 divides the length
def test_pymavlink(tree, logs, tmp_path, size):
    (tmp_path / "logs/many").mkdir()
    for number in range(300):
        (tmp_path / f"logs/many/picture_{number}.png").touch()
    with serving(tree) as vehicle:
        client = Client(vehicle.port, size)
        assert client.list("/") == {"general.json": 600, "logs": 0}
        assert len(client.list("/logs/many")) == 300
        assert client.get(f"/logs/{DIVE}/Data.lsf") == logs
        assert client.get("/general.json") == b"{}" * 300
        assert client.ftp.cmd_rm(["/general.json"]).error_code == FtpError.FileProtected
        assert client.ftp.cmd_list(["/nothing"]).error_code == FtpError.FileNotFound
        client.link.close()


@pytest.mark.heavy
def test_pymavlink_with_a_fifth_of_all_lost_and_others_twice(tree, logs):
    with serving(tree, loss=0.2, twice=0.05) as vehicle:
        client = Client(vehicle.port, 239)
        assert client.get(f"/logs/{DIVE}/Data.lsf") == logs
        client.link.close()


@pytest.mark.heavy
def test_mavsdk(tree, logs, tmp_path):
    port = free_port()
    with serving(tree, station=(HOST, port)):
        command = [sys.executable, str(Path(__file__).with_name("mavsdk_files_client.py")), str(port), str(tmp_path)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    changed = int((tmp_path / "logs" / DIVE / "Data.lsf").stat().st_mtime)
    assert seen["files"] == [["Data.lsf", len(logs), changed]]
    assert (seen["same"], "FILE_PROTECTED" in seen["refused"]) == (True, True)
    assert seen["logs"] == [[0, "2024-01-02T03:04:05Z", len(logs)], [1, "2024-01-03T00:00:01Z", len(logs)]]
    assert [(tmp_path / name).read_bytes() for name in ("True/Data.lsf", "False/Data.lsf", "log")] == [logs] * 3
