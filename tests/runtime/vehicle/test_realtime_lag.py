"""What the log book says where the vehicle's time and the computer's part."""

import time

import pytest

from runtime import State, Task, periodic
from runtime.kernel import SECOND, ScaledClock, WallClock
from runtime.profile import load_profile
from runtime.vehicle import build, realtime_lag
from tests.tasks.mission.stalling_clock import StallingClock


class Busy(Task):
    """Takes more time than there is."""

    @periodic(10.0)
    def toil(self) -> None:
        time.sleep(0.02)


def run(clock, seconds, folder):
    """A shipped vehicle with a busy task."""
    profile = load_profile("lauv-noptilus-1", overrides=("Transports.MAVLink:Enabled=Never",))
    vehicle = build(profile, profile.parse_modes(["Kinematic"]), clock=clock, log_root=folder).vehicle
    vehicle.add(Busy, "Busy")
    said = []
    write = vehicle.daemon.log.warning
    vehicle.daemon.log.warning = lambda text: (said.append(text), write(text))
    vehicle.start()
    vehicle.run(seconds)
    vehicle.close()
    return vehicle, said


@pytest.mark.heavy
def test_a_clock_that_cannot_keep_its_factor_says_which_it_reaches(monkeypatch, tmp_path):
    monkeypatch.setattr(realtime_lag, "WINDOW", 0.5)
    vehicle, said = run(ScaledClock(500.0), 10.0, tmp_path)
    told = [text for text in said if text.startswith("the computer is too slow: time passes ")]
    assert len(told) == 1
    assert told[0].endswith("times as fast as real time, not 500 times")
    assert str(vehicle.realtime_lag).endswith("x of 500x")
    assert vehicle.realtime_lag.describe_run(30.0, 1.0) == "30x of 500x"
    assert vehicle.realtime_lag.describe_run(30.0, 0.06) == ""


@pytest.mark.heavy
def test_a_system_time_that_is_set_is_reported_and_does_not_reach_the_vehicle(monkeypatch, tmp_path):
    began, real = time.monotonic(), time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: real() + (3_600_000_000_000 if time.monotonic() > began + 2.0 else 0))
    vehicle, said = run(WallClock(), 3.5, tmp_path)
    told = [text for text in said if text.startswith("the system time was set forward by 3600.")]
    assert len(told) == 1
    assert "keeps its own time until the run is started again: 3600." in told[0]
    assert "behind the system time" in told[0]
    assert vehicle.kernel.now_ns / 1e9 - vehicle.start_time < 100.0


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("begin", "length", "said_of_it"),
    [
        (0.4, 6.0, ""),
        (0.4, 12.0, "the start took 1"),
        (3.4, 6.0, "the process stood still for "),
    ],
)
def test_a_start_that_takes_long_is_no_stall(tmp_path, begin, length, said_of_it):
    """As on an overloaded computer, where loading takes seconds."""
    vehicle, said = run(StallingClock(1_750_000_000 * SECOND, [(begin, length)]), length + 6.0, tmp_path)
    found = [text for text in said if "stood still" in text or "start took" in text]
    assert len(found) == bool(said_of_it)
    assert all(text.startswith(said_of_it) for text in found)
    assert vehicle.daemon.entity.state == State.NORMAL


@pytest.mark.heavy
def test_no_more_calls_are_merged_than_were_due(monkeypatch, tmp_path):
    monkeypatch.setattr(realtime_lag, "WINDOW", 1e-9)
    shares, poll = [], realtime_lag.RealtimeLag.poll

    def note_share(lag):
        poll(lag)
        shares.append(lag.merged)

    monkeypatch.setattr(realtime_lag.RealtimeLag, "poll", note_share)
    slow = StallingClock(1_750_000_000 * SECOND, overload=(0.0, 300.0), cost=0.02)
    run(slow, 300.0, tmp_path)
    assert 0.5 < max(shares) <= 1.0
