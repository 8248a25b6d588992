"""Data that have to come: late ones are an error of the entity; and devices in virtual time."""

from pathlib import Path

import pytest

import imc
from runtime import State, Task, consume, expect, param
from runtime.kernel import VirtualClock
from runtime.snapshot import load, restore, take_snapshot
from runtime.task import expected_methods
from runtime.testing import START, NoProfile, Run, simulate
from runtime.vehicle import Vehicle


class Follower(Task):
    """Needs a depth every two seconds."""

    patience: float = param(2.0, "s", "Longest time without a depth.", minimum=0.0)

    @expect(every="patience")
    @consume
    def follow(self, depth: imc.Depth) -> None:
        if depth.value < 0.0:
            raise RuntimeError("no such depth")
        if depth.value > 5.0:
            self.set_entity_state(State.FAULT, "deep")


def states(run: Run) -> list[tuple[float, State, str]]:
    """Time (s), state and description of the entity whenever they change."""
    found: list[tuple[float, State, str]] = []
    for message in run.of(imc.EntityState):
        state = State(message.state), message.description
        if not found or state != found[-1][1:]:
            found.append((round(message.timestamp - START, 2), *state))
    return found


def depths(*times: float, value: float = 1.0) -> list[imc.Depth]:
    return [imc.Depth(timestamp=time, value=value) for time in times]


def test_data_that_are_late_are_an_error_until_they_return() -> None:
    run = simulate(Follower, feed=depths(1.0, 2.0, 3.0, 8.0), seconds=9.0)
    assert states(run) == [
        (1.0, State.NORMAL, "active"),
        (5.25, State.ERROR, "follow: no data for 2 s"),
        (8.0, State.NORMAL, "active"),
    ]


def test_data_that_never_come_are_an_error_and_the_limit_is_a_parameter() -> None:
    assert states(simulate(Follower, seconds=9.0, patience=4.0))[0][:2] == (4.25, State.ERROR)
    assert states(simulate(Follower, seconds=9.0, patience=0.0)) == []


def test_a_state_that_the_task_sets_itself_is_left_alone() -> None:
    run = simulate(Follower, feed=[*depths(1.0), *depths(2.0, value=6.0), *depths(3.0)], seconds=4.0)
    assert states(run)[-1][1:] == (State.FAULT, "deep")


def test_a_method_that_raises_had_no_data() -> None:
    run = simulate(Follower, feed=depths(1.0, value=-1.0), seconds=5.0, keep_going=True)
    assert [state for _, state, _ in states(run)] == [State.FAILURE, State.NORMAL, State.ERROR]
    assert states(run)[-1][2] == "follow: no data for 2 s"


def test_expectations_are_declared() -> None:
    assert expected_methods(Follower) == {"follow": "patience"}

    class Wrong(Task):
        @expect(every="patients")
        def follow(self, depth: imc.Depth) -> None: ...

    with pytest.raises(TypeError, match="there is no parameter 'patients'"):
        expected_methods(Wrong)


def test_what_is_expected_is_in_snapshots() -> None:
    def made(time: int = START * 10**9) -> Vehicle:
        vehicle = Vehicle("lauv-noptilus-1", 26, clock=VirtualClock(time), profile=NoProfile())
        vehicle.add(Follower, "Follower")
        return vehicle

    vehicle = made()
    vehicle.start()
    vehicle.run(1.0)
    snapshot = load(take_snapshot(vehicle))
    other = made(snapshot.time)
    restore(other, snapshot)
    other.run(1.5)
    task = other.task("Follower")
    assert (task.entity.state, task.entity.description) == (State.ERROR, "follow: no data for 2 s")
    for each in (vehicle, other):
        each.close()


class Lamp(Task):
    """Two devices."""

    def start(self) -> None:
        self.heard: list[str | bytes] = []
        self.left = self.serial("left", 9600, lines=self.heard.append, opened=lambda: self.left.write(b"on"))
        self.right = self.tcp("right", 80, frames=self.heard.append)


def test_a_stream_is_played_instead_of_devices(tmp_path: Path) -> None:
    (tmp_path / "left.txt").write_bytes(b"one\ntwo\n" * 100)
    run = simulate(Lamp, stream={"left": tmp_path / "left.txt", "tcp://right:80": [(0.1, b"a"), (0.2, "b\n")]})
    assert run.task.heard.count("one") == run.task.heard.count("two") == 100
    assert [item for item in run.task.heard if isinstance(item, bytes)] == [b"a", b"b\n"]
    assert run.sent == [("left", b"on")]
    assert run.vehicle.kernel.now_ns / 1e9 - START == pytest.approx(1.0)
    assert states(run)[-1][1:] == (State.NORMAL, "active")


def test_it_is_played_at_the_speed_of_the_line() -> None:
    run = simulate(Lamp, stream={"left": b"0123456789ABCDEF" * 600, "tcp://right:80": b""})
    assert run.vehicle.kernel.now_ns / 1e9 - START == pytest.approx(10.0)  # 9600 bytes at 960 bytes/s


def test_none_unplugs_and_what_follows_plugs_in() -> None:
    stream = {"left": [(1.0, "one\n"), (2.0, None), (3.0, "two\n")], "tcp://right:80": ""}
    run = simulate(Lamp, stream=stream)
    assert run.task.heard == ["one", "two"]
    assert [state[1:] for state in states(run)] == [
        (State.NORMAL, "active"),
        (State.ERROR, "left: unplugged"),
        (State.NORMAL, "active"),
    ]
    assert run.sent == [("left", b"on")] * 2
    assert run.log == ["left: unplugged", "left sends again"]


def test_a_loose_cable_does_not_fill_the_log_book() -> None:
    stream = [item for n in range(120) for item in ((n + 0.0, "one\n"), (n + 0.5, None))]
    run = simulate(Lamp, stream={"left": stream, "tcp://right:80": ""})
    assert run.task.heard == ["one"] * 120
    assert run.log.count("left: unplugged") == 4, "one in 30 s"
    assert run.log.count("left sends again") == 4


def test_no_device_is_opened_in_virtual_time() -> None:
    run = simulate(Lamp)
    text = "left: not opened in virtual time; tcp://right:80: not opened in virtual time"
    assert (run.task.entity.state, run.task.entity.description) == (State.ERROR, text)
    run = simulate(Lamp, stream={"left": b""})
    assert run.task.entity.description == "tcp://right:80: nothing is recorded of it"


def test_the_rest_of_a_line_is_not_joined_to_what_comes_after_a_long_silence() -> None:
    run = simulate(Lamp, stream={"left": [(0.0, "15"), (5.0, "00\n"), (5.5, "1600\n")], "tcp://right:80": ""})
    assert run.task.heard == ["1600"]


def test_a_device_has_one_handler() -> None:
    class Deaf(Task):
        def start(self) -> None:
            self.serial("left", 9600)

    with pytest.raises(TypeError, match="either lines or frames"):
        simulate(Deaf)
