"""Navigation with hand-made sensor data."""

import math

import pytest

import imc
from runtime import State, Task, param
from runtime.testing import simulate
from support.wgs84 import displace, displacement
from tasks.navigation.auv.navigation import Navigation

LAT, LON = math.radians(41.185), math.radians(-8.7062)
ANY = {"compass": "", "dvl": "", "depth_sensor": "", "altimeter": ""}
FIX = imc.GpsFix(
    validity=0x1FF, lat=LAT, lon=LON, height=50.0, hacc=2.0, hdop=0.9, type=imc.GpsFix.Type.STANDALONE, sog=0.0
)


def sensors(
    seconds, *, heading=0.0, depth=1.0, pitch=0.0, fixes=lambda _: FIX, surge=0.0, doppler=lambda _: True, rpm=0
):
    """The sensor data of a vehicle on a straight line, at the rates of its sensors."""
    for tick in range(round(seconds * 20)):
        time = tick * 0.05 + 0.01
        yield imc.EulerAngles(timestamp=time, psi=heading, theta=pitch)
        yield imc.AngularVelocity(timestamp=time)
        yield imc.Rpm(timestamp=time, value=rpm)
        if tick % 2 == 0:
            yield imc.Depth(timestamp=time, value=depth)
            yield imc.Distance(timestamp=time, validity=1, value=10.0)
        if tick % 4 == 0 and doppler(time):
            yield imc.GroundVelocity(timestamp=time, validity=7, x=surge)
        if tick % 20 == 0 and fixes(time) is not None:
            yield fixes(time).replace(timestamp=time + 0.001)


def test_it_waits_for_a_fix_and_publishes_no_position_before():
    nowhere = FIX.replace(lat=0.0, lon=0.0)
    for fixes in (lambda _: None, lambda _: nowhere, lambda _: nowhere.replace(type=imc.GpsFix.Type.MANUAL_INPUT)):
        run = simulate(Navigation, feed=sensors(3.0, fixes=fixes, heading=1.0), **ANY)
        assert run.of(imc.EstimatedState) == []
    assert run.task.entity.state is State.BOOT
    assert run.task.entity.description == "waiting for GPS fix"
    assert run.of(imc.NavigationUncertainty) == []


def test_the_first_fix_is_the_reference_at_the_surface():
    run = simulate(Navigation, feed=sensors(3.0), **ANY)
    last = run.of(imc.EstimatedState)[-1]
    assert (last.lat, last.lon) == (LAT, LON)
    assert last.height == pytest.approx(51.0)
    assert last.z == pytest.approx(last.depth) == pytest.approx(1.0)
    assert last.alt == pytest.approx(10.0)
    assert run.task.entity.state is State.NORMAL


def test_a_receiver_that_knows_no_height_gives_positions_all_the_same():
    run = simulate(Navigation, feed=sensors(3.0, fixes=lambda _: FIX.replace(height=math.nan)), **ANY)
    last = run.of(imc.EstimatedState)[-1]
    assert (last.lat, last.lon, last.height) == (LAT, LON, pytest.approx(1.0))
    assert run.of(imc.GpsFixRejection) == []
    endless = simulate(Navigation, feed=sensors(3.0, fixes=lambda _: FIX.replace(height=math.inf)), **ANY)
    assert endless.of(imc.EstimatedState) == []


def test_a_manual_fix_is_no_measurement():
    manual = FIX.replace(type=imc.GpsFix.Type.MANUAL_INPUT)
    run = simulate(Navigation, feed=sensors(3.0, fixes=lambda _: manual), **ANY)
    last = run.of(imc.EstimatedState)[-1]
    assert (last.lat, last.lon) == (LAT, LON)
    assert run.task.entity.state is State.BOOT


def test_it_goes_on_under_water_with_the_velocity_over_ground():
    run = simulate(
        Navigation, feed=sensors(30.0, heading=0.5, surge=1.5, fixes=lambda t: FIX if t < 0.5 else None), **ANY
    )
    last = run.of(imc.EstimatedState)[-1]
    assert math.hypot(last.x, last.y) == pytest.approx(45.0, abs=2.0)
    assert math.atan2(last.y, last.x) == pytest.approx(0.5, abs=0.05)
    assert (last.u, last.vx) == (pytest.approx(1.5, abs=0.01), pytest.approx(1.5 * math.cos(0.5), abs=0.02))
    variances = [m.x + m.y for m in run.of(imc.NavigationUncertainty)]
    assert variances[-1] > variances[100]


def test_it_goes_on_with_the_motor_where_velocities_are_missing_and_is_less_sure():
    def fixes(time):
        return FIX if time < 0.5 else None

    lost = simulate(Navigation, feed=sensors(40.0, surge=1.4, rpm=1400, fixes=fixes, doppler=lambda t: t < 10.0), **ANY)
    kept = simulate(Navigation, feed=sensors(40.0, surge=1.4, rpm=1400, fixes=fixes), **ANY)
    assert lost.of(imc.EstimatedState)[-1].x == pytest.approx(kept.of(imc.EstimatedState)[-1].x, abs=3.0)
    assert lost.of(imc.NavigationUncertainty)[-1].x > kept.of(imc.NavigationUncertainty)[-1].x + 1.0


def test_a_velocity_log_that_falls_silent_is_an_error_until_it_is_back():
    feed = list(sensors(40.0, surge=1.4, rpm=1400, doppler=lambda t: t < 5.0 or t > 35.0))
    run = simulate(Navigation, feed=feed, dvl_silence=20.0, **ANY)
    told = [
        (m.timestamp - run.vehicle.start_time, m.description) for m in run.of(imc.EntityState) if m.state == State.ERROR
    ]
    assert {description for _, description in told} == {"the velocity log is silent"}
    assert told[0][0] == pytest.approx(25.0, abs=0.5)
    assert run.task.entity.state is State.NORMAL
    for options in ({"dvl_silence": 0.0}, {"dvl_silence": 60.0}):
        run = simulate(Navigation, feed=[m for m in feed if m.timestamp < 34.0], **options, **ANY)
        assert (run.task.entity.state, run.task.entity.description) == (State.NORMAL, "active without DVL")


def test_a_velocity_log_without_echoes_or_at_rest_is_not_silent():
    quiet = list(sensors(40.0, surge=1.4, rpm=1400, doppler=lambda t: t < 5.0))
    unheard = [imc.GroundVelocity(timestamp=t + 0.5) for t in range(5, 40)]  # as over a bottom out of its range
    run = simulate(Navigation, feed=sorted([*quiet, *unheard], key=lambda m: m.timestamp), dvl_silence=20.0, **ANY)
    assert (run.task.entity.state, run.task.entity.description) == (State.NORMAL, "active without DVL")
    never = simulate(Navigation, feed=sensors(40.0, rpm=1400, doppler=lambda t: False), dvl_silence=20.0, **ANY)
    assert (never.task.entity.state, never.task.entity.description) == (State.NORMAL, "active without DVL")


class SwitchedOff(Task):
    """A velocity log that is switched off after 5 s, and on again, if `on`, after 6 s; from then on it is silent."""

    on: bool = param(False, "", "Whether it is switched on again.")

    def start(self) -> None:
        self.after(5.0, self.tell, imc.EntityActivationState.State.INACTIVE)
        if self.on:
            self.after(6.0, self.tell, imc.EntityActivationState.State.ACTIVE)

    def tell(self, state: imc.EntityActivationState.State) -> None:
        self.publish(imc.EntityActivationState(state=state))


@pytest.mark.parametrize(("on", "state"), [(False, State.NORMAL), (True, State.ERROR)])
def test_a_velocity_log_that_was_switched_off_is_not_waited_for(on, state):
    log = SwitchedOff, {"on": on}
    navigation = Navigation, {**ANY, "dvl": "SwitchedOff", "dvl_silence": 20.0}
    run = simulate([log, navigation], feed=sensors(40.0, rpm=1400, doppler=lambda t: False))
    assert run.vehicle.tasks[-1].entity.state is state


def test_pitch_and_depth_give_the_sinking_rate_and_the_heave():
    run = simulate(Navigation, feed=sensors(10.0, pitch=-0.2, surge=1.0, depth=3.0), **ANY)
    last = run.of(imc.EstimatedState)[-1]
    assert last.theta == pytest.approx(-0.2)
    assert -math.sin(last.theta) * last.u + math.cos(last.theta) * last.w == pytest.approx(last.vz, abs=1e-5)


def test_fixes_that_contradict_it_again_and_again_are_believed():
    lat, lon, height = displace(LAT, LON, 50.0, 200.0, 0.0)
    there = FIX.replace(lat=lat, lon=lon, height=height)
    run = simulate(Navigation, feed=sensors(60.0, fixes=lambda t: FIX if t < 50.0 else there), **ANY)
    assert run.of(imc.EstimatedState)[-1].x == pytest.approx(200.0, abs=1.0)
    assert "fixes contradict the position, which is reset to theirs" in run.log


def test_the_reference_moves_with_a_vehicle_that_is_far_away():
    lat, lon, height = displace(LAT, LON, 50.0, 1500.0, 0.0)
    there = FIX.replace(lat=lat, lon=lon, height=height)
    run = simulate(Navigation, feed=sensors(20.0, fixes=lambda t: FIX if t < 10.0 else there), **ANY)
    last = run.of(imc.EstimatedState)[-1]
    north, east, _ = displacement(last.lat, last.lon, 0.0, lat, lon, 0.0)
    assert (last.lat, last.lon) == (lat, lon)
    assert (north - last.x, east - last.y) == (pytest.approx(0.0, abs=1.0), pytest.approx(0.0, abs=1.0))


def test_what_cannot_be_is_refused_and_said():
    bad = [
        imc.GpsFix(timestamp=5.5, validity=0, lat=LAT, lon=LON),
        imc.GroundVelocity(timestamp=5.6, validity=7, x=9.0),
        imc.GroundVelocity(timestamp=5.61, validity=0, x=9.0),
        imc.GroundVelocity(timestamp=5.62, validity=7, x=math.nan),
        imc.WaterVelocity(timestamp=5.63, validity=7, y=3.0),
        imc.Depth(timestamp=5.6, value=math.nan),
        imc.EulerAngles(timestamp=5.6, psi=math.inf),
        imc.AngularVelocity(timestamp=5.6, z=math.nan),
        imc.Distance(timestamp=5.6, validity=1, value=math.nan),
    ]
    run = simulate(Navigation, feed=[*sensors(10.0), *bad], **ANY)
    assert [m.reason for m in run.of(imc.GpsFixRejection)] == [imc.GpsFixRejection.Reason.LOST_VAL_BIT]
    assert [m.type for m in run.of(imc.DvlRejection)] == [imc.DvlRejection.Type.GV, imc.DvlRejection.Type.WV]
    for state in run.of(imc.EstimatedState):
        assert all(math.isfinite(value) for value in state.to_dict().values() if isinstance(value, float))


def test_only_the_entities_that_are_named_are_received():
    run = simulate(Navigation, feed=sensors(8.0))
    assert run.of(imc.EstimatedState)[-1].depth == 0.0
    assert run.task.entity.state is State.ERROR
    assert run.task.entity.description == "depth is missing"


def test_missing_sensors_are_errors_until_they_are_back():
    feed = [message for message in sensors(20.0) if not isinstance(message, imc.Depth) or message.timestamp > 12.0]
    run = simulate(Navigation, feed=feed, **ANY)
    states = [(m.state, m.description) for m in run.of(imc.EntityState)]
    assert (State.ERROR, "depth is missing") in states
    assert run.task.entity.state is State.NORMAL


def test_the_stream_is_what_ground_and_water_differ_by():
    feed = [m for m in sensors(20.0, heading=math.pi / 2, surge=1.0)]
    feed += [
        imc.WaterVelocity(timestamp=m.timestamp, validity=7, x=0.7) for m in feed if isinstance(m, imc.GroundVelocity)
    ]
    run = simulate(Navigation, feed=sorted(feed, key=lambda m: m.timestamp), **ANY)
    stream = run.of(imc.EstimatedStreamVelocity)[-1]
    assert (stream.x, stream.y) == (pytest.approx(0.0, abs=1e-3), pytest.approx(0.3, abs=1e-3))


def test_heading_goes_round():
    feed = (
        m.replace(psi=math.remainder(0.2 * m.timestamp + 3.0, 2 * math.pi)) if isinstance(m, imc.EulerAngles) else m
        for m in sensors(20.0)
    )
    run = simulate(Navigation, feed=feed, **ANY)
    states = run.of(imc.EstimatedState)
    assert all(abs(state.psi) <= math.pi for state in states)
    last = states[-1]
    assert math.remainder(last.psi - 0.2 * (last.timestamp - run.vehicle.start_time) - 3.0, 2 * math.pi) == (
        pytest.approx(0.0, abs=0.1)
    )


SWING = math.radians(2.0)  # of the pitch, once a second


def swings(seconds, late):
    """A vehicle whose computer stands still for 0.25 s each second, always while it begins to pitch down.

    The samples of the pause are lost, or, if they are `late`, all arrive at its end.
    """
    for tick in range(round(seconds * 100)):
        time = tick * 0.01 + 0.002
        phase = time % 1.0
        if phase < 0.25 and not late:
            continue
        arrival = time - phase + 0.25 if phase < 0.25 else time
        pitch, rate = SWING * math.cos(math.tau * phase), -math.tau * SWING * math.sin(math.tau * phase)
        yield imc.EulerAngles(timestamp=arrival, theta=pitch)
        yield imc.AngularVelocity(timestamp=arrival, y=rate)
        if tick % 10 == 5:
            yield imc.Depth(timestamp=arrival, value=1.0)
        if tick % 100 == 50:
            yield FIX.replace(timestamp=arrival)


@pytest.mark.parametrize("late", [False, True])
def test_a_computer_that_stands_still_now_and_then_does_not_make_the_attitude_lie(late):
    run = simulate(Navigation, feed=swings(40.0, late), **ANY)
    assert {m.description for m in run.of(imc.EntityState) if m.state == State.ERROR} == set()
