"""Connections that take long: requests that do not end, readers that do not read, and many of them at once."""

import socket
import time

import pytest

from shoal.console.connections.page_listener import MOST_OF_ADDRESS, PageListener
from tasks.transports.imc_links.port_search import listening_socket
from tests.outside import until
from tests.shoal.console.page_of_nobody import ServedPage, served_page

DRIP = 0.05  # s between two bytes


@pytest.fixture
def quick(monkeypatch):
    """Limits of a second, so that the tests are short."""
    for name, seconds in (("HEAD", 1.0), ("BODY", 1.0), ("UNREAD", 1.0)):
        monkeypatch.setattr(f"shoal.console.connections.page_protocol.{name}", seconds)


def opened(page: ServedPage) -> socket.socket:
    return socket.create_connection(("127.0.0.1", page.server.port), 10.0)


def is_closed(connection: socket.socket) -> bool:
    """Whether the other side has closed a connection; what it has sent before is read."""
    connection.setblocking(False)
    try:
        while data := connection.recv(4096):
            assert data
    except BlockingIOError:
        return False
    except ConnectionError:
        pass
    return True


def drip(connection: socket.socket, content: bytes) -> int:
    """Send a content byte by byte until the connection is closed; returns how many bytes were sent."""
    for number in range(len(content)):
        try:
            connection.send(content[number : number + 1])
        except OSError:
            return number
        if is_closed(connection):
            return number
        time.sleep(DRIP)
    return len(content)


def head(page: ServedPage, length: int) -> bytes:
    lines = ("POST /api/login HTTP/1.1", f"Host: {page.host}", f"Origin: http://{page.host}")
    return "\r\n".join((*lines, f"Content-Length: {length}", "", "")).encode()


@pytest.mark.parametrize("part", ["head", "body", "second head", "nothing"])
def test_a_request_that_does_not_end_is_closed(quick, capfd, part):
    with served_page() as page, opened(page) as connection:
        if part == "body":
            connection.sendall(head(page, 5000))
        elif part == "second head":
            connection.sendall(f"GET /healthz HTTP/1.1\r\nHost: {page.host}\r\n\r\n".encode())
            assert connection.recv(4096).startswith(b"HTTP/1.1 200")
        if part == "nothing":
            until(lambda: is_closed(connection), 10.0)
        else:
            content = (b"x" if part == "body" else b"GET / HTTP/1.1\r\nX: " + b"x") * 400
            assert drip(connection, content) < 400
        assert page.request("GET", "/healthz")[0] == 200
    assert "Traceback" not in capfd.readouterr().err


def test_a_slow_request_in_time_is_answered(quick):
    with served_page() as page, opened(page) as connection:
        text = head(page, 2) + b"{}"
        for at in range(0, len(text), 30):
            connection.sendall(text[at : at + 30])
            time.sleep(DRIP)
        assert connection.recv(4096).startswith(b"HTTP/1.1 403")


def test_a_reader_that_does_not_read_is_closed(quick):
    with served_page() as page, opened(page) as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        asked = f"GET /files/leaflet.js HTTP/1.1\r\nHost: {page.host}\r\n\r\n".encode()
        connection.sendall(asked * 40)

        def reset() -> bool:
            try:
                connection.send(b"G")
            except ConnectionError:
                return True
            return False

        until(reset, 20.0, every=0.1)
        assert page.request("GET", "/healthz")[0] == 200


def test_the_connection_that_has_waited_longest_makes_room():
    with served_page() as page:
        waiting = [opened(page) for _ in range(MOST_OF_ADDRESS)]
        for _ in range(3):
            assert page.request("GET", "/healthz")[0] == 200
        until(lambda: is_closed(waiting[0]), 10.0)
        assert not is_closed(waiting[-1])
        assert page.server.rejected_connections >= 1
        for each in waiting:
            each.close()


def test_a_page_makes_no_room_for_others_and_has_no_end(quick):
    with served_page() as page:
        page.log_in()
        with page.frames() as frames:
            others = [opened(page) for _ in range(3 * MOST_OF_ADDRESS)]
            for _ in range(10):  # longer than a request may take
                assert frames.recv(10)
            assert page.request("GET", "/healthz")[0] == 200
            assert page.server.rejected_connections > MOST_OF_ADDRESS
            for each in others:
                each.close()


def test_connections_send_the_parts_of_an_answer_at_once():
    with (
        PageListener(listening_socket("127.0.0.1", 0, 1)) as listener,
        socket.create_connection(listener.getsockname()),
    ):
        listener.setblocking(True)
        accepted, _ = listener.accept()
        assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        accepted.close()
