"""Real serial ports (pseudo terminals): missing, unplugged, flooded, taken."""

import os
import tty
from pathlib import Path

import pytest

from runtime import Script, State
from tests.outside import NO_FILE
from tests.runtime.devices.sounder import depths, played, sounder_of, states, until


class Cable:
    """A serial port with a fixed name; the test is the device at the other end."""

    def __init__(self, path: Path):
        self.path = path
        self.end = -1

    def plug(self) -> None:
        self.end, own = os.openpty()
        tty.setraw(own)
        os.set_blocking(self.end, False)
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(own))
        os.close(own)

    def send(self, data: bytes) -> int:
        try:
            return os.write(self.end, data)
        except BlockingIOError:
            return 0

    def heard(self) -> bytes:
        try:
            return os.read(self.end, 4096)
        except OSError:
            return b""

    def unplug(self) -> None:
        if self.end >= 0:
            os.close(self.end)
            self.end = -1
        self.path.unlink(missing_ok=True)


@pytest.fixture
def cable(tmp_path: Path):
    made = Cable(tmp_path / "ttyTEST")
    yield made
    made.unplug()


@pytest.mark.heavy
def test_a_cable_is_missing_plugged_unplugged_and_plugged_again(cable: Cable) -> None:
    async def script(script: Script) -> None:
        task = sounder_of(script)
        await until(script, lambda: task.entity.state is State.ERROR)
        cable.plug()
        await until(script, lambda: task.sounder.is_open and b"start\n" in cable.heard())
        cable.send(b"5\n1.5\n2")
        await until(script, lambda: task.sounder.good == 1)
        cable.send(b".5\n")
        await until(script, lambda: task.sounder.good == 2)
        assert task.entity.state is State.NORMAL
        await until(script, lambda: task.entity.state is State.ERROR)  # the cable is silent
        cable.unplug()
        await until(script, lambda: not task.sounder.is_open)
        cable.plug()
        await until(script, lambda: task.sounder.is_open and b"start\n" in cable.heard())
        cable.send(b"rest of a line\n3.5\n")
        await until(script, lambda: task.sounder.good == 3)

    run = played(script, port=str(cable.path))
    assert depths(run) == [1.5, 2.5, 3.5]  # and not 5, which may be the end of 1.5
    named = f"{cable.path}: "
    assert states(run)[0] == (State.ERROR, named + NO_FILE)
    assert (State.ERROR, named + "no data for 0.6 s") in states(run)
    assert states(run)[-1] == (State.NORMAL, "active")
    assert [text for text in run.log if "ttyTEST" in text and "unplugged" not in text] == [
        named + NO_FILE,
        f"{cable.path} sends again",
        *([named + NO_FILE] if run.log.count(named + NO_FILE) > 1 else []),
        f"{cable.path} sends again",
    ]
    assert named + "unplugged" in run.log


@pytest.mark.heavy
def test_garbage_is_counted_and_costs_nothing_else(cable: Cable) -> None:
    async def script(script: Script) -> None:
        task = sounder_of(script)
        cable.plug()
        await until(script, lambda: task.sounder.is_open)
        cable.send(b"\n")
        for number in range(12):
            cable.send(b"\xff\x00\xfe rubbish\n%d\n" % number + b"x" * 2000 + b"\n")
            await until(script, lambda count=number + 1: task.sounder.good == count)

    run = played(script, port=str(cable.path))
    assert depths(run) == list(range(12))
    assert run.task.sounder.bad == 24
    assert run.task.sounder.skipped_bytes == 24000
    assert states(run)[-1] == (State.NORMAL, "active")
    first, tenth = [text for text in run.log if "damaged" in text or "not understood" in text]
    assert first.startswith(f"{cable.path}: ")
    assert "10 bad, the last " in tenth


@pytest.mark.heavy
def test_the_wrong_baud_rate_is_guessed(cable: Cable) -> None:
    async def script(script: Script) -> None:
        task = sounder_of(script)
        cable.plug()
        await until(script, lambda: task.sounder.is_open)
        while task.entity.state is not State.ERROR:
            cable.send(b"\xfe\x80\x06\n")
            await script.sleep(0.05)

    run = played(script, port=str(cable.path))
    assert "nothing valid for 0.6 s, in " in states(run)[-1][1]
    assert states(run)[-1][1].endswith("bytes; is the baud rate right?")


@pytest.mark.heavy
def test_a_flood_leaves_the_others_their_time(cable: Cable) -> None:
    late: list[float] = []

    async def script(script: Script) -> None:
        task = sounder_of(script)
        cable.plug()
        await until(script, lambda: task.sounder.is_open)
        cable.send(b"\n")
        begin = script.now
        while script.now < begin + 1.5:
            due = script.now + 0.01
            while cable.send(b"1.5\n" * 500):
                pass
            await script.sleep(0.01)
            late.append(script.now - due)

    run = played(script, port=str(cable.path))
    late.sort()
    assert late[len(late) // 2] < 0.05
    assert 2000 <= run.task.sounder.good <= 8000  # at most 2000 a second, and a portion
    assert len([text for text in run.log if "more than can be handled" in text]) == 1


@pytest.mark.heavy
def test_a_mistake_of_the_driver_restarts_it_and_closes_the_port(cable: Cable) -> None:
    async def script(script: Script) -> None:
        task = sounder_of(script)
        cable.plug()
        await until(script, lambda: task.sounder.is_open)
        first = task.sounder
        cable.send(b"\ncrash\n")
        await until(script, lambda: task.sounder is not first and task.sounder.is_open)
        cable.send(b"\n4.5\n")
        await until(script, lambda: task.sounder.good)

    run = played(script, port=str(cable.path))
    assert depths(run) == [4.5]
    assert any("RuntimeError: a mistake of the driver" in text for text in run.log)


def test_the_last_word_of_a_task_reaches_its_device(cable: Cable) -> None:
    async def script(script: Script) -> None:
        await until(script, lambda: sounder_of(script).sounder.is_open and b"start\n" in cable.heard())

    cable.plug()
    run = played(script, port=str(cable.path))
    assert cable.heard() == b"stop\n"
    assert not run.task.sounder.is_open


def test_a_port_that_another_program_has_is_named(cable: Cable) -> None:
    import serial

    async def script(script: Script) -> None:
        await until(script, lambda: sounder_of(script).entity.state is State.ERROR)

    cable.plug()
    with serial.Serial(str(cable.path), exclusive=True):
        run = played(script, port=str(cable.path))
    assert states(run) == [(State.ERROR, f"{cable.path}: another program has it open")]


@pytest.mark.parametrize(
    ("port", "reason"),
    [
        ("", "serial port: its device is not set"),
        ("/dev/null", "/dev/null: is not a serial port"),
        ("/etc/passwd", "/etc/passwd: is not a serial port"),
        ("tcp://127.0.0.1:99999", "tcp://127.0.0.1:99999: its port is not a number from 1 to 65535"),
        ("tcp://127.0.0.1:x", "tcp://127.0.0.1:-1: its port is not a number"),
    ],
)
def test_what_is_no_port_is_an_error_and_no_crash(port: str, reason: str) -> None:
    async def script(script: Script) -> None:
        await until(script, lambda: sounder_of(script).entity.state is State.ERROR)

    run = played(script, port=port)
    assert len(states(run)) == 1
    assert states(run)[0][1].startswith(reason)


@pytest.mark.heavy
def test_what_is_sent_to_a_device_that_does_not_read_is_bounded(cable: Cable) -> None:
    async def script(script: Script) -> None:
        task = sounder_of(script)
        cable.plug()
        await until(script, lambda: task.sounder.is_open)
        accepted = [task.sounder.write(b"x" * 1000) for _ in range(200)]
        assert accepted.count(True) < 100
        total = 0
        for _ in range(200):
            total += len(cable.heard())
            await script.sleep(0.005)
        assert total == accepted.count(True) * 1000 + len(b"start\n")

    played(script, port=str(cable.path))


def test_a_line_that_takes_nothing_holds_up_nobody(cable: Cable) -> None:
    async def script(script: Script) -> None:
        task = sounder_of(script)
        cable.plug()
        await until(script, lambda: task.sounder.is_open)
        assert task.sounder.write(b"x" * 30_000)
        await script.sleep(0.2)
        cable.send(b"part of a line\n1.5\n")
        await until(script, lambda: task.sounder.good == 1)

    assert depths(played(script, port=str(cable.path))) == [1.5]
