"""Faults of what a task publishes, with tasks in virtual time."""

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from runtime import Task, consume, param, periodic
from runtime.bus import Frame
from runtime.fault_injection import (
    Biased,
    Crash,
    Fault,
    FaultError,
    FaultInjector,
    Injection,
    Noisy,
    PublishInterceptor,
    Silent,
    Stuck,
)
from runtime.testing import simulate

LOST = Injection(Silent(), start=2.05, duration=2.0)


class Sonde(Task):
    """Counts depths, headings and the angles of two servos; its noise is its own."""

    rate: float = param(10.0, "Hz", "Rate.")

    def configure(self) -> None:
        self.counted = 0
        self.returned = []

    def start(self) -> None:
        self.set_entity_state(imc.EntityState.State.NORMAL, "active")

    @periodic("rate")
    def tick(self) -> None:
        self.counted += 1
        self.returned.append(self.publish(imc.Depth(value=self.counted)))
        self.publish(imc.Temperature(value=self.random.normal()))
        self.publish(imc.EulerAngles(psi=3.0, theta=1.5))
        for servo in range(2):
            self.publish(imc.ServoPosition(id=servo, value=self.counted * (servo - 0.5) * 1e-3))
        self.publish(imc.GpsFix(satellites=self.counted % 256))


class Camera(Task):
    """Shares frames whose picture has their number."""

    @periodic(10.0)
    def tick(self) -> None:
        picture = np.full((1, 1, 4), round(10.0 * (self.now % 10.0)), np.uint8)
        self.publish_frame(Frame(self.now, self.entity.label, int(picture[0, 0, 0]), picture))


class Listener(Task):
    """Repeats the depths that it hears."""

    @consume
    def hear(self, depth: imc.Depth) -> None:
        self.publish(imc.Salinity(value=depth.value))


class Fragile(Task):
    """Fails by itself at 1 s."""

    def start(self) -> None:
        self.after(1.0, self.stumble)

    def stumble(self) -> None:
        raise ValueError("a stone")


def values(run, kind=imc.Depth):
    return [message.value for message in run.of(kind)]


def test_a_silent_task_tells_only_of_itself_and_goes_on_afterwards():
    run = simulate([Sonde, Listener], seconds=6.0, faults=[LOST])
    assert values(run) == [float(n) for n in range(1, run.task.counted + 1) if not 22 <= n <= 41]
    assert values(run, imc.Salinity) == values(run)
    assert [message.value for message in run.task.returned] == list(range(1, run.task.counted + 1)), (
        "the task itself does not notice"
    )
    assert all(message.timestamp > 0.0 and message.src_ent == run.task.entity.id for message in run.task.returned)
    assert run.log == [
        f"fault of {run.task.name}: silent, for 2 s",
        f"fault of {run.task.name} ends: silent",
    ]
    assert not {"publish", "publish_frame", "start"} & vars(run.task).keys(), "afterward the task is as before"


def test_only_the_named_messages_are_silent():
    run = simulate(Sonde, seconds=1.0, faults=[Injection(Silent(("Depth",)))])
    assert (values(run), len(run.of(imc.Temperature))) == ([], 10)


def test_a_stuck_task_repeats_its_last_values_with_new_times():
    run = simulate(Sonde, seconds=4.0, faults=[Injection(Stuck(), start=1.05, duration=2.0)])
    assert values(run)[9:33] == [10.0, 11.0, *[11.0] * 20, 32.0, 33.0]
    times = [message.timestamp for message in run.of(imc.Depth)]
    assert np.diff(times) == pytest.approx(0.1, abs=1e-6)
    for servo in range(2):
        angles = [message.value for message in run.of(imc.ServoPosition) if message.id == servo]
        assert angles[11:31] == pytest.approx([11e-3 * (servo - 0.5)] * 20), "each servo has its own"
    assert len(run.of(imc.EntityState)) == len(simulate(Sonde, seconds=4.0).of(imc.EntityState))


def test_a_task_that_is_stuck_from_the_start_keeps_its_first_values():
    run = simulate(Sonde, seconds=1.0, faults=[Injection(Stuck(("Depth",)))])
    assert values(run) == [1.0] * 10
    assert [message.satellites for message in run.of(imc.GpsFix)] == list(range(1, 11))


def test_a_camera_is_silent_or_repeats_its_picture():
    faults = [Injection(Silent(), start=0.25, duration=0.2), Injection(Stuck(), start=0.55, duration=0.3)]
    frames = simulate(Camera, seconds=1.0, faults=faults).frames
    assert [frame.index for frame in frames] == [0, 1, 2, 5, 6, 7, 8, 9]
    assert [int(frame.image[0, 0, 0]) for frame in frames] == [0, 1, 2, 5, 5, 5, 5, 9]


def test_a_bias_goes_round_in_a_full_turn_and_stops_at_other_limits():
    run = simulate(
        Sonde,
        seconds=1.0,
        faults=[
            Injection(Biased("EulerAngles", "psi", 0.5), start=0.05),
            Injection(Biased("EulerAngles", "theta", 0.5), start=0.05),
            Injection(Biased("Depth", "value", -2.5), start=0.05),
            Injection(Biased("GpsFix", "satellites", -3.4), start=0.05),
        ],
    )
    first, *_, last = run.of(imc.EulerAngles)
    assert (first.psi, first.theta) == (3.0, 1.5), "nothing is wrong before its time"
    assert (last.psi, last.theta) == pytest.approx((3.5 - 2.0 * math.pi, 0.5 * math.pi))
    assert values(run)[1:] == [n - 2.5 for n in range(2, 11)]
    assert [message.satellites for message in run.of(imc.GpsFix)] == [1, 0, 0, 1, 2, 3, 4, 5, 6, 7]


def test_a_bias_that_is_not_finite():
    faults = [
        Injection(Biased("Depth", "value", math.nan), start=0.05),
        Injection(Biased("Temperature", "value", 1e300), start=0.05),
        Injection(Biased("GpsFix", "satellites", math.inf), start=0.05),
    ]
    run = simulate(Sonde, seconds=0.2, faults=faults)
    assert math.isnan(values(run)[-1])
    assert values(run, imc.Temperature)[-1] == pytest.approx(3.4e38, rel=0.01), "the largest that the field carries"
    assert run.of(imc.GpsFix)[-1].satellites == 255


def test_noise_follows_from_seed_task_and_field_and_leaves_other_noise_alone():
    def noisy(deviation=2.0, seed=1, extra=()):
        faults = [Injection(Noisy("Depth", "value", deviation), start=0.05), *extra]
        return simulate(Sonde, seconds=100.0, seed=seed, faults=faults)

    run, quiet = noisy(), simulate(Sonde, seconds=100.0, seed=1)
    errors = np.array(values(run))[1:] - np.array(values(quiet))[1:]
    assert run.packets == noisy().packets
    assert (np.mean(errors), np.std(errors)) == (pytest.approx(0.0, abs=0.2), pytest.approx(2.0, rel=0.1))
    assert values(run, imc.Temperature) == values(quiet, imc.Temperature)
    assert values(noisy(seed=2)) != values(run)
    twice = noisy(extra=[Injection(Noisy("Depth", "value", 2.0), start=0.05)])
    assert np.std(np.array(values(twice))[1:] - np.array(values(quiet))[1:]) == pytest.approx(8.0**0.5, rel=0.1)


def test_faults_overlap_in_the_order_in_which_they_began():
    faults = [
        Injection(Stuck(("Depth",)), start=0.25, duration=0.5),
        Injection(Biased("Depth", "value", 100.0), start=0.45, duration=0.5),
        Injection(Silent(), start=0.55, duration=0.1),
    ]
    run = simulate(Sonde, seconds=1.0, faults=faults)
    assert values(run) == [1, 2, 3, 3, 3, 103, 103, 109, 110]


def test_a_crashed_task_restarts_with_back_off_and_others_go_on():
    run = simulate([Sonde, Listener], seconds=4.0, faults=[Injection(Crash(), start=1.05)])
    times = [message.timestamp - run.of(imc.Depth)[0].timestamp for message in run.of(imc.Depth)]
    assert [t for t in times if 1.0 < t < 2.1] == pytest.approx([2.05])
    assert len(run.of(imc.Salinity)) == len(times)
    failed = imc.EntityState.State.FAILURE
    assert [m.state for m in run.of(imc.EntityState) if m.src_ent == run.task.entity.id].count(failed) >= 1
    assert f"fault of {run.task.name}: crash" in run.log
    assert any("SimulatedCrash: crashed on purpose" in text and "restarting in 1 s" in text for text in run.log)


def test_a_crash_that_lasts_lets_no_start_succeed():
    faults = [Injection(Crash(), start=1.05, duration=5.0), Injection(Crash(), start=1.55, duration=1.0)]
    run = simulate(Sonde, seconds=12.0, faults=faults)
    times = [message.timestamp - run.of(imc.Depth)[0].timestamp for message in run.of(imc.Depth)]
    silence = [round(b - a, 6) for a, b in pairwise(times) if b - a > 0.11]
    assert len(silence) == 1
    assert 5.0 < silence[0] < 9.0
    assert not {"publish", "start"} & vars(run.task).keys()


def test_an_exception_that_no_fault_raised_ends_the_run():
    faults = [Injection(Crash(), start=0.5)]
    with pytest.raises(ValueError, match="a stone"):
        simulate([Fragile, Sonde], seconds=4.0, faults=[*faults, Injection(Silent(), start=0.1)])


@pytest.mark.parametrize(
    ("fault", "task", "words"),
    [
        (Silent(), "Sond", "there is no task 'Sond'"),
        (Silent(("Dpeth",)), "", r"there is no message 'Dpeth' \(did you mean 'Depth'\?\)"),
        (Stuck(("Nothing at all",)), "", "there is no message"),
        (Biased("EulerAngle", "psi", 1.0), "", "did you mean 'EulerAngles'"),
        (Biased("EulerAngles", "pi", 1.0), "", r"EulerAngles has no field 'pi' \(did you mean 'p[sh]i'"),
        (Biased("EntityState", "state", 1.0), "", "EntityState.state is not a number"),
        (Noisy("LogBookEntry", "text", 1.0), "", "LogBookEntry.text is not a number"),
        (Biased("GpsFix", "satellites", math.nan), "", "cannot be NaN"),
    ],
)
def test_faults_that_cannot_be(fault, task, words):
    with pytest.raises(FaultError, match=words):
        simulate(Sonde, faults=[Injection(fault, task=task)])


@pytest.mark.parametrize("deviation", [-1.0, math.nan, math.inf])
def test_noise_that_cannot_be(deviation):
    with pytest.raises(FaultError, match="at least 0"):
        Noisy("Depth", "value", deviation)


def test_a_fault_of_ones_own():
    @dataclasses.dataclass(frozen=True)
    class Late(Fault):
        """Every second message is lost."""

        def begin(self, source: PublishInterceptor, number: int):
            count = iter(range(1_000_000))
            return lambda item: item if next(count) % 2 else None

    run = simulate(Listener, feed=[imc.Depth(value=n, timestamp=n) for n in range(6)], faults=[Injection(Late())])
    assert values(run, imc.Salinity) == [1.0, 3.0, 5.0]


def test_a_fault_that_is_ended_by_hand_ends_once():
    run = simulate(Sonde, seconds=0.0)
    faults = FaultInjector(run.vehicle)
    end = faults.begin(run.task.name, Silent(), 10.0)
    assert "publish" in vars(run.task)
    end()
    end()
    assert "publish" not in vars(run.task)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([Silent(), Stuck(), Biased("Depth", "value", 1.0), Noisy("Depth", "value", 1.0), Crash()]),
            st.integers(0, 20),
            st.integers(0, 20),
        ),
        max_size=6,
    )
)
def test_any_faults_leave_a_task_as_it_was_and_the_run_deterministic(planned):
    faults = [Injection(fault, start=0.1 * at, duration=0.1 * lasting) for fault, at, lasting in planned]
    run = simulate(Sonde, seconds=8.0, faults=faults)
    assert run.packets == simulate(Sonde, seconds=8.0, faults=faults).packets
    assert "start" not in vars(run.task)
    if not any(isinstance(injection.fault, Stuck) for injection in faults):
        assert "publish" not in vars(run.task)
    times = [message.timestamp for message in run.of(imc.Depth)]
    assert times == sorted(times)
    assert run.of(imc.Depth)[-1].value == run.task.counted
