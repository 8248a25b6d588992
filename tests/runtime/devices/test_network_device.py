"""Devices behind TCP and UDP: late, silent, by name."""

import socket

import pytest

from runtime import Script, State
from runtime.devices.connections import KEEPALIVE, Datagram, UdpSocket
from tests.outside import REFUSED, TIMED_OUT, free_port
from tests.runtime.devices.sounder import depths, played, sounder_of, states, until


@pytest.mark.heavy
def test_a_tcp_server_that_comes_late_goes_and_comes_back() -> None:
    number = free_port()

    async def script(script: Script) -> None:
        task = sounder_of(script)
        await until(script, lambda: task.entity.state is State.ERROR)
        for round_ in range(2):
            server = socket.create_server(("127.0.0.1", number))
            server.setblocking(False)
            await until(script, lambda: task.sounder.is_open)
            client, _ = server.accept()
            with server, client:
                client.sendall(b".5\n1.%d\n2." % round_)  # a converter of serial ports begins midway: 1500.5
                await until(script, lambda count=round_ + 1: task.sounder.good == count)
                assert client.recv(100) == b"start\n"
            await until(script, lambda: not task.sounder.is_open)

    run = played(script, kind="tcp", port="localhost", number=number)
    assert depths(run) == pytest.approx([1.0, 1.1])
    assert states(run)[0] == (State.ERROR, f"tcp://localhost:{number}: {REFUSED}")
    assert f"tcp://localhost:{number}: the other side has closed the connection" in run.log


def test_a_tcp_address_by_name_is_looked_up_elsewhere() -> None:
    async def script(script: Script) -> None:
        await until(script, lambda: sounder_of(script).entity.state is State.ERROR)

    run = played(script, kind="tcp", port="no-such-host.invalid", number=1)
    assert states(run)[0][1].startswith("tcp://no-such-host.invalid:1: no-such-host.invalid: ")


def test_a_tcp_server_that_never_answers_is_given_up_and_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("runtime.devices.device.CONNECT_TIMEOUT", 0.5)
    with socket.socket() as server:  # listens, but nobody accepts, and the queue is full
        server.bind(("127.0.0.1", 0))
        server.listen(0)
        number = server.getsockname()[1]
        fillers = [socket.socket() for _ in range(4)]
        for filler in fillers:
            filler.setblocking(False)
            filler.connect_ex(("127.0.0.1", number))

        async def script(script: Script) -> None:
            await until(script, lambda: "no answer" in sounder_of(script).entity.description)

        run = played(script, kind="tcp", port="127.0.0.1", number=number)
        for filler in fillers:
            filler.close()
    assert f"tcp://127.0.0.1:{number}: no answer" in run.log


@pytest.mark.heavy
def test_a_tcp_server_that_takes_nothing_any_more_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(KEEPALIVE, "TCP_USER_TIMEOUT", 300)
    with socket.create_server(("127.0.0.1", 0)) as server:

        async def script(script: Script) -> None:
            task = sounder_of(script)
            await until(script, lambda: task.sounder.is_open)
            while task.sounder.is_open and task.sounder.write(b"x" * 50_000):
                await script.sleep(0.02)
            await until(script, lambda: TIMED_OUT in task.entity.description)

        run = played(script, kind="tcp", port="127.0.0.1", number=server.getsockname()[1])
    assert any(TIMED_OUT in line for line in run.log)


def test_datagrams_are_pieces_and_are_answered() -> None:
    number = free_port()
    with socket.socket(type=socket.SOCK_DGRAM) as device:
        device.bind(("127.0.0.1", 0))
        device.settimeout(5.0)

        async def script(script: Script) -> None:
            task = sounder_of(script)
            await until(script, lambda: task.sounder.is_open)
            assert task.sounder.write(b"nobody is there")
            for data in (b"1.5\n", b"2.5\nhalf", b"", b"3.5\n"):
                device.sendto(data, ("127.0.0.1", number))
            await until(script, lambda: task.sounder.good == 3)
            task.sounder.write(b"thanks")
            assert device.recv(100) == b"thanks"

        run = played(script, kind="udp", number=number)
    assert depths(run) == [1.5, 2.5, 3.5]


def test_an_answer_may_go_to_one_of_several_senders() -> None:
    port = free_port()
    opened = UdpSocket(port, "127.0.0.1", None).open("")
    first, second = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
    with first, second:
        for sender, text in ((first, b"ours"), (second, b"foreign")):
            sender.bind(("127.0.0.1", 0))
            sender.sendto(text, ("127.0.0.1", port))
        pieces = opened.read()
        assert pieces == [b"ours", b"foreign"]
        assert isinstance(pieces[0], Datagram)
        assert pieces[0].source == first.getsockname()
        opened.set_destination(first.getsockname())
        second.sendto(b"foreign", ("127.0.0.1", port))
        assert opened.read() == [b"foreign"]
        opened.write(b"answer")
        first.settimeout(5.0)
        assert first.recv(100) == b"answer"
    opened.close()
