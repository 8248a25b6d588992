"""Units, signs, frames and ages of what an autopilot measures, and of what it is told. In virtual time."""

import math
from itertools import pairwise

import pytest

import imc
from runtime import State
from runtime.testing import START, simulate
from tasks.control.autopilot.mavlink import MAVLink
from tests.tasks.control.autopilot.test_messages import BEAT, SERIAL, at, frame, heard, sent
from tests.tasks.mission.stalling_clock import StallingClock

GPS = {"fix_type": 3, "lat": 411850000, "lon": -87062000, "alt": 40000, "eph": 90, "epv": 120}
DOWN = {"min_distance": 10, "max_distance": 4000, "current_distance": 523, "orientation": 25}


@pytest.mark.parametrize(("ellipsoid", "height"), [(0, 94.6), (94000, 94.0)])
def test_a_fix_is_above_the_ellipsoid_whatever_the_receiver_tells(ellipsoid, height):
    run = heard(at(0.0), (0.1, frame("GPS_RAW_INT", **GPS, alt_ellipsoid=ellipsoid)), geoid_undulation=54.6)
    (fix,) = run.of(imc.GpsFix)
    assert fix.height == pytest.approx(height)
    assert not any("Geoid Undulation" in words for words in run.log)


def test_a_wrong_undulation_is_reported_once():
    fixes = [(0.1 * n, frame("GPS_RAW_INT", **GPS, alt_ellipsoid=60000)) for n in range(1, 9)]
    run = heard(at(0.0), *fixes, geoid_undulation=54.6)
    wrong = "Geoid Undulation is 54.6 m, but the autopilot's GPS reports 20.0 m"
    assert sum(words.startswith(wrong) for words in run.log) == 1


def test_a_fix_has_the_time_at_which_it_was_measured():
    clock = frame("SYSTEM_TIME", time_unix_usec=1_700_000_000_000_000, time_boot_ms=100_000)
    run = heard(at(0.0), (0.1, clock), (0.9, frame("GPS_RAW_INT", **GPS, time_usec=100_750_000)))
    assert run.of(imc.GpsFix)[0].utc_time == pytest.approx(80_000.75)


def test_the_altitude_of_a_range_finder_that_falls_silent_is_forgotten():
    run = heard(at(0.0), (0.1, frame("DISTANCE_SENSOR", **DOWN)), *(at(float(time)) for time in range(1, 5)))
    altitudes = [state.alt for state in run.of(imc.EstimatedState)]
    assert altitudes[1] == pytest.approx(5.23)
    assert altitudes[-1] == pytest.approx(10.0), "above home, as before"


def test_the_imu_of_px4_and_the_wind():
    imu = frame("HIGHRES_IMU", zacc=-9.81, xgyro=0.1, xmag=0.2, ymag=0.1, fields_updated=0x1FF, time_usec=100_000_000)
    blind = frame("HIGHRES_IMU", zacc=-9.0, fields_updated=0x07)
    winds = frame("WIND", direction=90.0, speed=5.0, speed_z=3.0), frame("WIND_COV", wind_x=1.0, wind_y=-2.0)
    run = heard(at(0.0), (0.1, imu + blind + b"".join(winds)))
    assert [a.z for a in run.of(imc.Acceleration)] == pytest.approx([-9.81, -9.0])
    assert [(w.x, w.time) for w in run.of(imc.AngularVelocity)] == [pytest.approx((0.1, 100.0))]
    assert [(m.x, m.y) for m in run.of(imc.MagneticField)] == [pytest.approx((0.2, 0.1))]
    from_the_east, told = run.of(imc.EstimatedStreamVelocity)
    assert (from_the_east.x, from_the_east.y, from_the_east.z) == pytest.approx((0.0, -4.0, 3.0), abs=1e-6)
    assert (told.x, told.y) == (1.0, -2.0)


def test_no_battery_has_no_voltage():
    none = frame("SYS_STATUS", voltage_battery=0, current_battery=-1, battery_remaining=-1)
    assert not heard(at(0.0), (0.1, none)).of(imc.Voltage)
    assert heard(at(0.0), (0.1, frame("SYS_STATUS", voltage_battery=15200))).of(imc.Voltage)[0].value == pytest.approx(
        15.2
    )


def test_a_stall_of_the_computer_is_no_silence_of_the_autopilot():
    clock = StallingClock(round(START * 1e9), [(10.3, 4.0)])
    times = [0.25 * n for n in range(80) if not 10.0 < 0.25 * n < 14.4]
    run = heard(*map(at, times), clock=clock, position_timeout=2.0)
    worse = [(m.state, m.description) for m in run.of(imc.EntityState) if m.state not in (State.BOOT, State.NORMAL)]
    assert not clock.stalls
    assert not worse


@pytest.mark.parametrize(("stalls", "warned"), [([(10.2, 22.4)], False), ([], True)])
def test_a_stall_of_the_computer_is_no_time_in_which_a_leg_was_too_slow(stalls, warned):
    beat = frame("HEARTBEAT", **{**BEAT, "type": 11, "base_mode": 129, "custom_mode": 15})
    acks = b"".join(frame("COMMAND_ACK", command=number) for number in (178, 511, 512))
    times = [0.5 * n for n in range(70) if not (stalls and 10.0 < 0.5 * n < 32.6)]
    stream = [(time, beat + at(time, vx=100 if time < 34.0 else 400)[1][len(beat) :] + acks) for time in times]
    loops = imc.ControlLoops(timestamp=2.0, enable=imc.ControlLoops.Enable.ENABLE, mask=imc.CLoopsMask.PATH)
    meters = imc.SpeedUnits.METERS_PS
    path = imc.DesiredPath(timestamp=2.5, end_lat=0.7190, end_lon=math.radians(-8.7062), speed=4.0, speed_units=meters)
    clock = StallingClock(round(START * 1e9), stalls)
    run = simulate(MAVLink, [loops, path], stream=stream, address=SERIAL, position_timeout=2.0, clock=clock)
    assert any("it moves at 1.0 m/s only" in text for text in run.log) is warned, run.log


def test_a_position_from_before_a_new_start_is_none():
    run = heard(at(0.0), (1.0, frame("ATTITUDE", time_boot_ms=500)))
    assert len(run.of(imc.EstimatedState)) == 1


def test_an_autopilot_that_doubts_its_position_is_an_error_of_the_navigation():
    bits = dict.fromkeys(("onboard_control_sensors_present", "onboard_control_sensors_enabled"), 0x20002F)
    ill = frame("SYS_STATUS", **bits, onboard_control_sensors_health=0x2F)
    run = heard(at(0.0), (0.1, ill), at(0.5))
    navigation = run.task.vehicle.entities.find("Navigation")
    assert (navigation.state, navigation.description) == (State.ERROR, "not healthy")


def test_a_health_that_is_not_repeated_is_unknown():
    bits = {f"onboard_control_sensors_{word}": 0x2F for word in ("present", "enabled", "health")}
    run = heard(at(0.0), (0.1, frame("SYS_STATUS", **bits)), *(at(float(time)) for time in range(1, 14)))
    gps = run.task.vehicle.entities.find("GPS")
    assert (gps.state, gps.description) == (State.ERROR, "the autopilot does not report its health")


def test_it_speaks_first_since_the_autopilot_may_wait_for_it():
    beats = sent(heard((3.0, b"\0")), "HEARTBEAT")
    assert [(beat.system, beat.component) for beat in beats[:2]] == [(1, 191)] * 2


def test_a_stamp_for_another_program_says_nothing_of_the_clock():
    reply = frame("TIMESYNC", tc1=999_000_000_000, ts1=1)
    run = heard(at(0.0), (0.1, reply), at(1.0))
    assert [state.timestamp for state in run.of(imc.EstimatedState)][-1] == pytest.approx(run.task.now, abs=1.1)
    assert run.task._telemetry.clock._offset is None


def test_usbl_fixes_of_this_vehicle_go_to_the_autopilot_and_others_do_not():
    names = "lauv-noptilus-1", "lauv-noptilus-2"
    fixes = [
        imc.UsblFixExtended(target=name, lat=0.1 * n, src=0x4001, timestamp=1.0) for n, name in enumerate(names, 1)
    ]
    stream = [(0.0, frame("HEARTBEAT", **BEAT)), (3.0, b"\0")]
    run = simulate(MAVLink, fixes, stream=stream, address=SERIAL, aiding_entity="USBL")
    (told,) = sent(run, "GPS_INPUT")
    assert told.values["lat"] == round(math.degrees(0.1) * 1e7)
    assert not sent(simulate(MAVLink, fixes, stream=stream, address=SERIAL), "GPS_INPUT")


def test_a_critical_state_of_the_autopilot_is_an_error():
    critical = frame("HEARTBEAT", **BEAT, system_status=5)
    task = heard(at(0.0), (1.0, critical)).task
    assert task.entity.state is State.ERROR
    assert task.entity.description.startswith("reports a critical state: copter, disarmed")


def test_a_long_text_comes_whole_whatever_its_letters():
    words = "Überschreitung der Höchstgeschwindigkeit über dem nördlichen Prüfgelände".encode()
    pieces = [words[n : n + 50] for n in range(0, len(words), 50)]
    texts = b"".join(frame("STATUSTEXT", severity=4, text=p, id=3, chunk_seq=n) for n, p in enumerate(pieces))
    run = heard(at(0.0), (0.1, texts))
    assert [entry.text for entry in run.of(imc.LogBookEntry) if entry.context == "STATUSTEXT"] == [words.decode()]


def test_what_is_ahead_is_no_altitude():
    run = heard(at(0.0), (0.1, frame("DISTANCE_SENSOR", **{**DOWN, "orientation": 0})), at(0.5))
    assert not run.of(imc.Distance)
    assert run.of(imc.EstimatedState)[-1].alt == pytest.approx(10.0)


def test_states_go_forward_when_the_clocks_are_compared_better():
    """TIMESYNC says that all stamps were 0.2 s too late."""

    def attitude(time):
        return time, frame("ATTITUDE", time_boot_ms=round(1000 * (100.0 + time)))

    asked = sent(heard(at(0.0), (0.5, b"")), "TIMESYNC")[0].values["ts1"]
    reply = frame("TIMESYNC", tc1=100_200_000_000, ts1=asked)
    run = heard(at(0.0), (0.01, reply), *(attitude(0.02 * n) for n in range(1, 40)))
    times = [state.timestamp for state in run.of(imc.EstimatedState)]
    assert len(times) > 30
    assert min(b - a for a, b in pairwise(times)) > 0.0
    assert run.task._telemetry.clock._offset is not None
