"""The task that serves a vehicle's logs over FTP."""

import ftplib
import socket
from threading import Thread

import pytest

from runtime import State
from runtime.kernel import WallClock
from runtime.testing import simulate
from tasks.transports.ftp import FTP

HOST = "127.0.0.1"


class Client:
    """Downloads in a thread, as another computer would."""

    def __init__(self, port):
        self.found, self.error = [], None
        self.port = port
        self.thread = Thread(target=self.run)
        self.thread.start()

    def run(self):
        try:
            with ftplib.FTP(timeout=10) as client:
                client.connect(HOST, self.port)
                client.login()
                self.found = client.nlst()
                client.sendcmd("DELE /x")
        except Exception as error:
            self.error = error


@pytest.mark.heavy
def test_the_task_serves_its_vehicle_and_reports(tmp_path):
    (tmp_path / "lauv-noptilus-1" / "20260101").mkdir(parents=True)
    found = []

    async def download(script):
        task = script.task.vehicle.task("Transports.FTP")
        client = Client(task.port)
        while client.thread.is_alive():
            await script.sleep(0.01)
        await script.sleep(1.2)
        found.append((client.found, str(client.error), task.entity.state, task.entity.description))

    run = simulate(FTP, clock=WallClock(), seconds=1.6, log_root=tmp_path, script=download, control_port=0)
    ((names, error, state, description),) = found
    assert names == ["20260101"]
    assert error.startswith("550")
    assert state == State.NORMAL
    assert "1 rejected" in description
    assert any("may not DELE /x" in line for line in run.log)
    (service,) = [m.service for m in run.messages if type(m).__name__ == "AnnounceService"]
    assert service.startswith("ftp://127.0.0.1:")


def test_a_port_in_use_is_left_to_its_owner_and_a_bad_address_is_named(tmp_path):
    with socket.socket() as taken:
        taken.bind((HOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        run = simulate(FTP, clock=WallClock(), seconds=0.1, log_root=tmp_path, control_port=port)
    assert port < run.task.port <= port + 4
    run = simulate(FTP, clock=WallClock(), seconds=0.1, log_root=tmp_path, address="203.0.113.9")
    assert run.task.entity.state == State.ERROR
    assert any("203.0.113.9:30021" in line for line in run.log)


def test_an_open_address_is_warned_of(tmp_path):
    opened = {"address": "0.0.0.0", "control_port": 0}
    run = simulate(FTP, clock=WallClock(), seconds=0.1, log_root=tmp_path, **opened)
    assert any("can read the logs" in line for line in run.log)
    run = simulate(FTP, clock=WallClock(), seconds=0.1, log_root=tmp_path, **opened, allow_deletion=True)
    assert any("can read and remove the logs" in line for line in run.log)
