"""Replay: pausing, seeking, looping, and choosing which part of a log is played."""

from pathlib import Path
from typing import Any

import pytest

import imc
from imc.lsf import LsfWriter
from runtime import ParameterError, State, Task, consume
from runtime.testing import START, simulate
from shoal.cli.replay_keyboard import handle_keys
from tasks.transports.replay import Replay
from tasks.transports.replayed_log import LogTime

LOGGED, OTHER = 0x001A, 0x0030
T0 = 1.7e9
Op = imc.ReplayControl.Op


class Ear(Task):
    """Records messages of other systems, and when they came."""

    def start(self) -> None:
        self.heard: list[tuple[float, float]] = []

    @consume(others=True)
    def hear(self, message: imc.Voltage) -> None:
        self.heard.append((round(self.now - START, 3), round(message.timestamp - T0, 3)))


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Ten seconds: Voltage at each of the logged system's entity 5 (GPS), and half a second later of another system."""
    writer = LsfWriter(tmp_path / "Data.lsf", "none")

    def write(kind: type[imc.Message], time: float, **values: Any) -> None:
        writer.write(imc.encode(kind(**{"timestamp": T0 + time, "src": LOGGED, "src_ent": 5, **values})))

    write(imc.LoggingControl, 0.0, op=imc.LoggingControl.Op.STARTED, src_ent=2)
    write(imc.EntityInfo, 0.0, id=5, label="GPS")
    write(imc.Announce, 0.0, sys_name="lauv-seen", src=OTHER)
    for second in range(10):
        write(imc.Voltage, second)
        write(imc.Rpm, second, src_ent=6)
        write(imc.Voltage, second + 0.5, src=OTHER)
    writer.close()
    return tmp_path


def play(log: Path | str, feed: Any = (), *, seconds: float = 30.0, **values: Any) -> Any:
    system: dict[str, Any] = {"system": "lauv-other", "system_id": 0x0015}
    run = simulate([(Replay, {"load_at_start": str(log), **values}), Ear], feed, seconds=seconds, **system)
    run.heard = run.tasks[1].heard
    return run


def control(time: float, op: Op) -> imc.ReplayControl:
    return imc.ReplayControl(timestamp=time, op=op)


def give(time: float, name: str, value: str) -> imc.SetEntityParameters:
    entry = imc.EntityParameter(name=name, value=value)
    return imc.SetEntityParameters(timestamp=time, name="Replay", params=(entry,))


@pytest.mark.parametrize("begin", ["3", "3s", "2023-11-14T22:13:23", "2023-11-14T22:13:23Z"])
@pytest.mark.parametrize("end", ["5", "2023-11-14T22:13:25.000"])
def test_a_part_by_seconds_or_dates(log: Path, begin: str, end: str) -> None:
    run = play(log, begin=begin, end=end, replay_systems=["0x001A"])
    assert run.heard == [(0.0, 3.0), (1.0, 4.0)]


def test_a_place_between_packets_is_waited_for(log: Path) -> None:
    assert play(log, begin="7.75", replay_systems=["26"]).heard == [(0.25, 8.0), (1.25, 9.0)]


@pytest.mark.parametrize("text", ["tomorrow", "-3", "2026-13-01"])
def test_what_is_no_place_is_refused(log: Path, text: str) -> None:
    with pytest.raises(ParameterError, match=f"From: '{text}' is not a place in a log"):
        play(log, begin=text)


def test_behind_the_end_there_is_nothing(log: Path) -> None:
    run = play(log, begin="1h")
    assert run.heard == []
    assert "nothing to play from this place of the log" in run.log


def test_systems_by_the_names_that_they_announce(log: Path) -> None:
    run = play(log, replay_systems=["lauv-seen"], end="3")
    assert [stamp for _, stamp in run.heard] == [0.5, 1.5, 2.5]


def test_entities_by_label(log: Path) -> None:
    run = play(log, replay_entities=["gps"], end="3")
    assert [stamp for _, stamp in run.heard] == [0.0, 1.0, 2.0]
    assert run.of(imc.Rpm) == []


@pytest.mark.parametrize(
    ("choice", "reason"),
    [
        ({"replay_messages": ["Voltag"]}, "there is no message 'Voltag'; did you mean Voltage"),
        ({"replay_systems": ["lauv-sean"]}, "there is no system 'lauv-sean'; did you mean lauv-seen"),
        ({"replay_entities": ["GPX"]}, "there is no entity 'GPX'; did you mean GPS"),
    ],
)
def test_what_the_log_does_not_have_is_reported(log: Path, choice: dict[str, Any], reason: str) -> None:
    run = play(log, **choice)
    assert run.task.entity.state == State.FAILURE
    assert any(text.startswith(reason) for text in run.log)


def test_seeking_over_the_bus_goes_back_and_on(log: Path) -> None:
    feed = [give(2.25, "Position", "7.5"), give(3.25, "Position", "1")]
    run = play(log, feed, replay_systems=["0x001A"])
    times = [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (2.75, 8.0), (3.25, 1.0), (4.25, 2.0)]
    assert run.heard[:6] == times
    assert run.heard[-1] == (11.25, 9.0)
    assert run.task.entity.description == "finished"


def test_seeking_while_paused_waits_there(log: Path) -> None:
    feed = [control(1.5, Op.PAUSE), give(2.0, "Position", "6"), control(5.0, Op.RESUME)]
    run = play(log, feed, replay_systems=["0x001A"], seconds=6.5)
    assert run.heard == [(0.0, 0.0), (1.0, 1.0), (5.0, 6.0), (6.0, 7.0)]
    assert f"paused in {log.name} at 6 s" in [state.description for state in run.of(imc.EntityState)]


def test_another_speed_does_not_leap(log: Path) -> None:
    run = play(log, [give(2.5, "Time Multiplier", "4")], replay_systems=["0x001A"], seconds=3.5)
    assert run.heard == [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (2.625, 3.0), (2.875, 4.0), (3.125, 5.0), (3.375, 6.0)]


def test_a_loop_begins_again_at_its_begin(log: Path) -> None:
    run = play(log, begin="8", loop=True, replay_systems=["0x001A"], seconds=3.5)
    assert [stamp for _, stamp in run.heard] == [8.0, 9.0, 8.0, 9.0, 8.0, 9.0, 8.0]


def test_a_loop_of_one_instant_lets_time_pass(log: Path) -> None:
    run = play(log, begin="9", loop=True, replay_systems=["0x001A"], seconds=3.5)
    assert run.heard == [(0.0, 9.0), (1.0, 9.0), (2.0, 9.0), (3.0, 9.0)]


def test_starting_without_a_name_begins_anew(log: Path) -> None:
    run = play(log, [control(1.5, Op.STOP), control(3.0, Op.START)], replay_systems=["0x001A"], seconds=4.5)
    assert run.heard == [(0.0, 0.0), (1.0, 1.0), (3.0, 0.0), (4.0, 1.0)]


class Player:
    """Records the actions of keys."""

    def __init__(self) -> None:
        self.paused = False
        self.done: list[object] = []

    def pause(self) -> None:
        self.paused = True
        self.done.append("pause")

    def resume(self) -> None:
        self.paused = False
        self.done.append("resume")

    def skip(self, seconds: float) -> None:
        self.done.append(seconds)


def test_keys() -> None:
    player = Player()
    handle_keys(player, b" x\x1b[C\x1b[C\x1b[D \x1b[A\x1b[B\x1b")
    assert player.done == ["pause", 10.0, 10.0, -10.0, "resume", 60.0, -60.0]


@pytest.mark.parametrize(
    ("text", "place"), [("90", (90.0, False)), ("1h30min", (5400.0, False)), ("1970-01-01T00:01:00", (60.0, True))]
)
def test_places(text: str, place: tuple[float, bool]) -> None:
    assert LogTime.parse(text) == place
