"""The page of a vehicle with a list of consoles, and with viewers that misbehave."""

import base64
import itertools
import json
import os
import re
import socket
import time
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection

from tests.outside import until
from tests.shoal.console.operator_page import OperatorPage, frame_of, vehicle_page

NAME = "lauv-noptilus-1"

pytestmark = pytest.mark.heavy


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with vehicle_page(tmp_path_factory.mktemp("vehicle"), "--set", "General:Consoles=page:anna") as found:
        found.log_in()
        until(lambda: NAME in frame_of(found)["vehicles"], 40.0)
        yield found


def test_a_user_that_is_not_listed_commands_nothing(page):
    reason = "local may not command: page:local is not in [General] Consoles"
    for order in ("abort", "hold", "set"):
        assert page.order(NAME, order) == {"ok": False, "text": reason}
    assert page.lease(NAME, "take") == {"ok": False, "text": reason}
    assert "Depth Sensor" in page.get(f"/api/parameters?vehicle={NAME}")["entities"]


def test_viewers_that_read_a_byte_a_second_or_die_in_mid_frame_hold_nobody_up(page):
    slow = [raw_viewer(page) for _ in range(12)]
    dying = [raw_viewer(page) for _ in range(12)]
    for each in dying:
        each.sendall(b"\x81\xfe\x00")  # the beginning of a frame
        each.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\x01\0\0\0\0\0\0\0")
        each.close()
    with page.frames() as frames:
        times = []
        for _ in range(30):
            for each in slow:
                each.recv(1)
            frames.recv(10)
            times.append(time.monotonic())
    assert max(later - earlier for earlier, later in itertools.pairwise(times)) < 3.0
    for each in slow:
        each.close()
    assert page.order(NAME, "hold")["text"].startswith("local may not command")


def test_a_frame_of_a_megabyte_ends_its_page_only(page):
    before = resident(page)
    with page.frames() as other:
        for _ in range(10):
            with page.frames() as frames:
                frames.send("x" * (1 << 20))
                with pytest.raises(ConnectionClosed, match="1009"):
                    read_to_the_end(frames)
        assert json.loads(other.recv(10))["now"]
    assert resident(page) - before < 30.0


def read_to_the_end(frames: ClientConnection) -> None:
    while True:
        frames.recv(10)


def resident(page: OperatorPage) -> float:
    """Memory of the vehicle's process (MB)."""
    return int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{page.process.pid}/status").read_text())[1]) / 1024


def raw_viewer(page: OperatorPage) -> socket.socket:
    """The socket of a page that has asked for frames."""
    opened = socket.create_connection(("127.0.0.1", page.port), 30.0)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
    lines = [
        "GET /frames HTTP/1.1",
        f"Host: {page.host}",
        f"Origin: http://{page.host}",
        f"Cookie: {page.cookie}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}",
        "Sec-WebSocket-Version: 13",
    ]
    opened.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
    assert opened.recv(12).endswith(b"101")
    return opened
