"""Control of a multirotor in the air: velocities, climbs, hovering, and when it lands by itself."""

import math
from itertools import pairwise

import pytest

import imc
from autonomy.control import GRAVITY
from runtime import State, Task, consume
from runtime.testing import simulate
from support.rotations import rotation, to_ned
from tasks.control.uav.autopilot import Autopilot
from tasks.simulators.stream_velocity import StreamVelocity
from tasks.simulators.uav import UAV
from tests.tasks.control.multirotor import ARMED, DISARMED, FIX, LAT, LON, OWN, Loops, enable, states, velocity


class Eyes(Task):
    """Knows the true state."""

    @consume
    def see(self, truth: imc.SimulatedState) -> None:
        if round(truth.timestamp * 100) % 5:
            return
        angles = truth.phi, truth.theta, truth.psi
        north, east, down = to_ned(rotation(*angles), (truth.u, truth.v, truth.w))
        self.publish(
            imc.EstimatedState(
                lat=truth.lat, lon=truth.lon, height=truth.height, x=truth.x, y=truth.y, z=truth.z, phi=truth.phi,
                theta=truth.theta, psi=truth.psi, vx=north + truth.svx, vy=east + truth.svy, vz=down + truth.svz,
                p=truth.p, q=truth.q, r=truth.r, depth=-1.0, alt=-truth.z,
            )
        )  # fmt: skip


def air(*feed, seconds, wind=0.0, without=(), **parameters):
    """Fly with the simulated airframe and true states."""
    tasks = [(UAV, {"wind_source": "StreamVelocity"}), (StreamVelocity, {"default_speed_north": wind})]
    tasks += [task for task in ((Autopilot, parameters), (Eyes, {})) if task[0] not in without]
    ordered = sorted([FIX, *feed], key=lambda message: message.timestamp)
    return simulate(tasks, feed=ordered, seconds=seconds)


def truth(run, time):
    return run.of(imc.SimulatedState)[round(time * 100) - 2]


UP = [enable(Loops.VELOCITY), *velocity(0.5, w=-2.0, until=6.5)]


def phases(run):
    found = []
    for message in run.of(imc.AutopilotMode):
        if found[-1:] != [message.mode]:
            found.append(message.mode)
    return found


def test_rotors_rest_until_a_climb_is_asked_for():
    run = air(enable(Loops.VELOCITY), *velocity(0.5, u=3.0, until=3.0), seconds=3.0)
    assert run.of(imc.SetThrusterActuation) == []
    assert {m.state for m in run.of(imc.ArmingState)} == {DISARMED}
    assert phases(run) == ["GROUND"]


def test_a_climb_has_the_rate_that_is_asked_for():
    run = air(*UP, seconds=6.0)
    assert truth(run, 5.5).z - truth(run, 4.5).z == pytest.approx(-2.0, abs=0.05)
    assert run.of(imc.ArmingState)[-1].state == ARMED


@pytest.mark.parametrize("wind", [0.0, 6.0, -9.0])
def test_a_velocity_is_followed_in_wind(wind):
    run = air(*UP, *velocity(6.5, u=4.0, v=-2.0, until=20.0), seconds=20.0, wind=wind)
    first, second = truth(run, 18.0), truth(run, 20.0)
    moved = second.x - first.x, second.y - first.y, second.z - first.z
    assert moved == pytest.approx((8.0, -4.0, 0.0), abs=0.15)


@pytest.mark.parametrize("wind", [0.0, 8.0])
def test_it_hovers_where_it_could_stop_when_nothing_is_asked_for(wind):
    stop = enable(Loops.ALL, scope=2, time=12.0, on=0)
    run = air(*UP, *velocity(6.5, u=5.0, until=12.0), stop, seconds=50.0, wind=wind)
    before, first, last = truth(run, 12.0), truth(run, 35.0), truth(run, 50.0)
    assert 2.0 < first.x - before.x < 9.0
    assert math.dist((first.x, first.y, first.z), (last.x, last.y, last.z)) < 0.1
    assert phases(run) == ["GROUND", "GUIDED", "LOITER"]
    if wind:
        assert last.theta == pytest.approx(math.atan((0.35 * 8.0 + 0.02 * 64.0) / (3.0 * GRAVITY)), abs=0.01)


def test_a_heading_is_turned_to_no_faster_than_allowed():
    turn = imc.DesiredHeading(timestamp=6.6, value=-3.0)
    run = air(*UP, *velocity(6.5, until=20.0), turn, seconds=15.0)
    assert truth(run, 15.0).psi == pytest.approx(-3.0, abs=0.02)
    assert max(abs(m.value) for m in run.of(imc.DesiredHeadingRate)) <= math.radians(60.0) + 1e-9
    assert min(m.psi for m in run.of(imc.SimulatedState)) < -2.9


@pytest.mark.parametrize("dst", [OWN, 0xFFF0, 0xFFFF])
def test_it_lands_after_an_abort_and_its_rotors_rest(dst):
    run = air(*UP, imc.Abort(timestamp=6.0, src=0x4000, dst=dst), seconds=40.0)
    assert phases(run) == ["GROUND", "GUIDED", "LAND", "GROUND"]
    assert (truth(run, 40.0).z, run.of(imc.SetThrusterActuation)[-1].value) == (0.0, 0.0)
    speeds = [float(text.split()[-2]) for text in run.log if text.startswith("touchdown")]
    assert max(speeds) < 0.8


def test_losses_of_power_of_a_flight_before_do_not_make_the_next_landing_harder():
    dips = [
        imc.Voltage(timestamp=time + late, value=0.0 if not late else 22.0)
        for time in (1.0, 3.0)
        for late in (0.0, 0.3)
    ]
    begin = 70.0
    up = [enable(Loops.VELOCITY), *velocity(begin, w=-2.0, until=begin + 6.0)]
    abort = imc.Abort(timestamp=begin + 6.0, src=0x4000, dst=OWN)
    run = air(*dips, *up, abort, seconds=begin + 40.0, batteries="")
    assert phases(run) == ["GROUND", "GUIDED", "LAND", "GROUND"]
    speeds = [float(text.split()[-2]) for text in run.log if text.startswith("touchdown")]
    assert 0.0 < max(speeds) < 0.8


def test_an_abort_for_somebody_else_lands_nobody():
    assert "LAND" not in phases(air(*UP, imc.Abort(timestamp=3.0, src=0x4000, dst=0x1B), seconds=5.0))


def test_it_lands_when_it_has_nothing_to_do_sooner_in_error():
    stop = enable(Loops.ALL, scope=2, time=6.0, on=0)

    def landing(mode, **timeouts):
        waits = {"idle_timeout": 20.0, **timeouts}
        run = air(*UP, stop, imc.VehicleState(timestamp=0.2, op_mode=mode), seconds=30.0, **waits)
        modes = [m for m in run.of(imc.AutopilotMode) if m.mode == "LAND"]
        return modes[0].timestamp - run.vehicle.start_time if modes else math.inf

    modes = imc.VehicleState.OpMode
    assert landing(modes.SERVICE) == pytest.approx(26.0, abs=0.2)
    assert landing(modes.ERROR) == pytest.approx(16.0, abs=0.2)
    assert landing(modes.MANEUVER) == math.inf
    assert landing(modes.ERROR, error_timeout=0.0) == math.inf, "0 is never, not the other timeout"


def test_an_empty_battery_lands_it_whatever_is_asked_for_and_keeps_it_there():
    empty = imc.FuelLevel(timestamp=4.0, value=9.0)
    again = [enable(Loops.VELOCITY, scope=3, time=30.0), *velocity(30.1, w=-2.0, until=34.0)]
    run = air(*UP, *velocity(6.5, u=2.0, until=20.0), empty, *again, seconds=36.0)
    assert phases(run) == ["GROUND", "GUIDED", "LAND", "GROUND"]
    assert any("the battery is low" in text for text in run.log)


def test_a_takeoff_that_is_refused_is_one_error_as_long_as_it_is_asked_for():
    low = imc.FuelLevel(timestamp=0.2, value=5.0)
    run = air(low, enable(Loops.VELOCITY), *velocity(0.5, w=-2.0, until=5.0), seconds=8.0)
    own = run.tasks[2].entity
    states = [message.state for message in run.of(imc.EntityState) if message.src_ent == own.id]
    changes = [after for before, after in pairwise(states) if before != after]
    assert changes == [State.ERROR, State.NORMAL]


def test_a_velocity_that_does_not_come_is_an_error_and_it_hovers():
    run = air(*UP, seconds=9.0)
    assert phases(run)[-1] == "LOITER"
    assert run.tasks[2].entity.state is State.ERROR


@pytest.mark.parametrize("climb", [-1.0, -0.1])
def test_a_climb_that_is_no_longer_asked_for_as_it_begins_ends_on_the_ground(climb):
    """Its loop stays enabled: the reference of a console that has lost its link."""
    run = air(enable(Loops.VELOCITY), *velocity(0.5, w=climb, until=0.9), seconds=20.0)
    assert max(-state.z for state in run.of(imc.SimulatedState)) < 1.0
    assert phases(run)[-2:] == ["LAND", "GROUND"]
    assert run.of(imc.SetThrusterActuation)[-1].value == 0.0


def test_an_autopilot_that_ends_in_the_air_leaves_a_level_command():
    run = air(*UP, *velocity(6.5, u=8.0, until=7.2), seconds=7.2)
    assert abs(run.of(imc.DesiredPitch)[-2].value) > 0.1
    assert [run.of(kind)[-1].value for kind in (imc.DesiredRoll, imc.DesiredPitch, imc.DesiredHeadingRate)] == [0.0] * 3
    assert run.of(imc.SetThrusterActuation)[-1].value == pytest.approx(0.7, abs=0.03)


def test_it_descends_level_where_it_does_not_know_its_state():
    class Blinking(Eyes):
        """Publishes states for ten seconds."""

        @consume
        def see(self, truth: imc.SimulatedState) -> None:
            if truth.timestamp < self.vehicle.start_time + 6.5:
                super().see(truth)

    tasks = [(UAV, {"wind_source": ""}), (Autopilot, {}), (Blinking, {})]
    run = simulate(tasks, feed=[FIX, *UP], seconds=60.0)
    assert phases(run) == ["GROUND", "GUIDED", "BLIND", "GROUND"]
    assert truth(run, 60.0).z == 0.0
    assert max(float(text.split()[-2]) for text in run.log if text.startswith("touchdown")) < 2.5


@pytest.mark.heavy
def test_states_that_come_and_go_are_not_believed_a_second_time():
    class Flickering(Eyes):
        """After the second gap it takes the height of that moment for the ground."""

        @consume
        def see(self, truth: imc.SimulatedState) -> None:
            time = truth.timestamp - self.vehicle.start_time
            if not (45.0 < time < 46.0 or 52.9 < time < 54.0):
                super().see(truth if time < 54.0 else truth.replace(z=0.0))

    tasks = [(UAV, {"wind_source": ""}), (Autopilot, {}), (Flickering, {})]
    climb = [enable(Loops.VELOCITY), *velocity(0.5, w=-2.0, until=45.0)]
    run = simulate(tasks, feed=[FIX, *climb], seconds=250.0)
    assert phases(run) == ["GROUND", "GUIDED", "BLIND", "LOITER", "BLIND", "GROUND"]
    assert min(m.z for m in run.of(imc.SimulatedState)) < -80.0
    assert truth(run, 250.0).z == 0.0
    assert max(float(text.split()[-2]) for text in run.log if text.startswith("touchdown")) < 2.5


def test_it_climbs_no_higher_than_the_limit_and_comes_back_to_a_lower_one():
    def limit(time, altitude):
        return imc.OperationalLimits(timestamp=time, mask=imc.OpLimitsMask.MAX_ALT, max_altitude=altitude)

    climb = [enable(Loops.VELOCITY), *velocity(0.5, w=-3.0, until=40.0)]
    run = air(*climb, limit(0.2, 12.0), limit(20.0, 6.0), seconds=40.0)
    assert truth(run, 19.0).z == pytest.approx(-12.0, abs=0.3)
    assert truth(run, 40.0).z == pytest.approx(-6.0, abs=0.3)
    assert min(m.z for m in run.of(imc.SimulatedState)) > -12.5


def test_what_is_no_number_is_refused():
    odd = [imc.DesiredVelocity(timestamp=3.0, u=math.nan), imc.DesiredHeading(timestamp=3.0, value=math.nan)]
    odd += [imc.EstimatedState(timestamp=3.001, x=math.nan, lat=LAT, lon=LON)]
    run = air(*UP, *odd, seconds=6.0)
    assert all(math.isfinite(m.z) for m in run.of(imc.SimulatedState))
    assert "desired velocity is not a number" in run.log


def test_a_reference_that_comes_in_a_gap_of_the_state_ages_as_any_other():
    forces = [imc.Acceleration(timestamp=0.2 + 0.05 * i, z=-GRAVITY) for i in range(200)]
    feed = [enable(Loops.VELOCITY), *states(5.0), *states(4.0, start=6.1), *forces, *velocity(0.5, until=6.0)]
    tasks = [(Autopilot, {"ahrs": "", "reference_timeout": 0.5})]
    run = simulate(tasks, feed=sorted(feed, key=lambda message: message.timestamp), seconds=8.0)
    modes = [message.mode for message in run.of(imc.AutopilotMode)]
    assert modes[-3:] == ["GUIDED", "LOITER", "LOITER"], "the last reference came at 5.9 s"


def test_one_that_begins_in_the_air_hovers():
    run = simulate(Autopilot, feed=states(3.0, z=-10.0, alt=10.0))
    assert phases(run) == ["GROUND", "LOITER"]
    assert run.of(imc.SetThrusterActuation)[-1].value == pytest.approx(0.7, abs=0.05)
    assert phases(simulate(Autopilot, feed=states(3.0, z=-1.0, alt=1.0))) == ["GROUND"]
