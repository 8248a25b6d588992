"""The miniSVS: lines with a speed of sound."""

from imc import SoundSpeed
from runtime import State
from runtime.testing import simulate
from tasks.sensors.mini_svs import MiniSVS


def test_each_line_is_a_speed_of_sound() -> None:
    run = simulate(MiniSVS, stream=" 1500.123\r\n 1501.250\r\n 1502500\r\n", port="/dev/ttyS1")
    assert [round(message.value, 3) for message in run.of(SoundSpeed)] == [1500.123, 1501.25, 1502.5]
    assert (run.task.entity.state, run.task.entity.description) == (State.NORMAL, "active")
    assert run.sent == [("/dev/ttyS1", b"#M1\r\n")]


def test_in_air_there_is_none() -> None:
    run = simulate(MiniSVS, stream=" 0000.000\r\n nan\r\n 9999.999\r\n")
    assert [message.value for message in run.of(SoundSpeed)] == [-1.0, -1.0, -1.0]


def test_garbage_is_left_out_and_silence_is_an_error() -> None:
    run = simulate(MiniSVS, stream=b"\xff\xfe\r\n 15a0\r\n 1500.0\r\n", seconds=4.0, port="/dev/ttyS1")
    assert [message.value for message in run.of(SoundSpeed)] == [1500.0]
    assert run.task.sensor.bad == 2
    assert (run.task.entity.state, run.task.entity.description) == (State.ERROR, "/dev/ttyS1: no data for 2 s")
