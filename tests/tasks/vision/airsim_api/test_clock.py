"""A vehicle and AirSim in lock-step."""

import pytest

import imc
from runtime.kernel import SECOND
from runtime.testing import simulate
from tasks.vision.airsim import AirSim
from tasks.vision.airsim_api.clock import AirSimClock
from tasks.vision.airsim_api.rpc_messages import AirSimError
from tests.runtime.kernel.clock_contract import ClockContract
from tests.tasks.vision.airsim_standin import StandIn

START = 1_767_225_600 * SECOND


class TestAirSimClock(ClockContract):
    @pytest.fixture
    def clock(self):
        with StandIn() as server:
            clock = AirSimClock(START, port=server.port, step=0.05)
            yield clock
            clock.close()


def flown():
    with StandIn(16, 16) as server:
        clock = AirSimClock(START, port=server.port, step=0.05)
        options = {"port": server.port, "size": 16, "frame_rate": 10.0, "pose_from": "AirSim", "publish_truth": True}
        run = simulate(AirSim, seconds=1.0, clock=clock, **options)
        clock.close()
        steps = [given for method, given in server.calls if method == "simContinueForTime"]
    return run, steps


def test_the_truth_of_airsim_and_the_time_of_the_vehicle_go_together():
    run, steps = flown()
    states = run.of(imc.SimulatedState)
    assert len(states) >= 9
    for state in states:  # 3 m/s east, seen at the end of its step
        assert -1e-6 <= state.y - 3.0 * (state.timestamp - run.vehicle.start_time) <= 3.0 * 0.05 + 1e-6
    assert 20 <= len(steps) <= 21
    assert all(given == [0.05] for given in steps)


def test_two_flights_are_one():
    first, second = flown()[0], flown()[0]
    assert first.of(imc.SimulatedState) == second.of(imc.SimulatedState)
    assert [frame.time for frame in first.frames] == [frame.time for frame in second.frames]
    assert [frame.image.tobytes() for frame in first.frames] == [frame.image.tobytes() for frame in second.frames]


def test_when_airsim_ends_the_run_ends_with_the_reason():
    with StandIn() as server:
        server.fault = lambda method, answer: None if len(server.calls) > 9 else answer
        clock = AirSimClock(START, port=server.port, timeout=0.1)
        with pytest.raises(OSError, match=r"no answer within 0.1 s"):
            simulate(AirSim, seconds=1.0, clock=clock, port=server.port)


def test_a_refusal_is_named():
    with StandIn() as server:
        clock = AirSimClock(START, port=server.port, step=0.5)
        server.do_simContinueForTime = None
        with pytest.raises(AirSimError, match="simContinueForTime: rpclib: function"):
            clock.advance(None, lambda seconds: None)
        clock.close()
    with pytest.raises(ValueError, match="2 s is not within"):
        AirSimClock(START, step=2.0)
