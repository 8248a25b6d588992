"""Units, signs, frames and ages of what an autopilot measures, and of what it is told. In virtual time."""

import math
from itertools import pairwise

import pytest

import imc
from runtime import State
from runtime.testing import simulate
from support.wgs84 import displacement
from tasks.control.autopilot.aiding import GPS_EPOCH, fix_of, gps_input
from tasks.control.autopilot.kinds import ARDUPILOT, PX4, body_of
from tasks.control.autopilot.leg import Leg, Whereabouts
from tasks.control.autopilot.mavlink import MAVLink
from tasks.control.autopilot.memory import Memory
from tasks.control.autopilot.pilot import TARGET, WARM_UP, Pilot
from tasks.control.autopilot.targets import one_command, target
from tests.tasks.control.autopilot.test_messages import BEAT, SERIAL, at, frame, heard, sent

HERE = Whereabouts(0.7188, -0.1519, amsl=40.0, above_home=10.0)
GPS = {"fix_type": 3, "lat": 411850000, "lon": -87062000, "alt": 40000, "eph": 90, "epv": 120}
DOWN = {"min_distance": 10, "max_distance": 4000, "current_distance": 523, "orientation": 25}


def path(**values):
    usual = {"end_lat": HERE.lat, "end_lon": HERE.lon, "speed": 3.0, "speed_units": imc.SpeedUnits.METERS_PS}
    return imc.DesiredPath(**{**usual, **values})


@pytest.mark.parametrize(("ellipsoid", "height"), [(0, 94.6), (94000, 94.0)])
def test_a_fix_is_above_the_ellipsoid_whatever_the_receiver_tells(ellipsoid, height):
    run = heard(at(0.0), (0.1, frame("GPS_RAW_INT", **GPS, alt_ellipsoid=ellipsoid)), geoid_undulation=54.6)
    (fix,) = run.of(imc.GpsFix)
    assert fix.height == pytest.approx(height)
    assert not any("Geoid Undulation" in words for words in run.log)


def test_a_wrong_undulation_is_told_once():
    fixes = [(0.1 * n, frame("GPS_RAW_INT", **GPS, alt_ellipsoid=60000)) for n in range(1, 9)]
    run = heard(at(0.0), *fixes, geoid_undulation=54.6)
    wrong = "Geoid Undulation is 54.6 m, but the autopilot's GPS says 20.0 m"
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
    assert (gps.state, gps.description) == (State.ERROR, "the autopilot does not tell its health")


def test_it_speaks_first_since_the_autopilot_may_wait_for_it():
    beats = sent(heard((3.0, b"\0")), "HEARTBEAT")
    assert [(beat.system, beat.component) for beat in beats[:2]] == [(1, 191)] * 2


def test_a_stamp_for_another_program_says_nothing_of_the_clock():
    reply = frame("TIMESYNC", tc1=999_000_000_000, ts1=1)
    run = heard(at(0.0), (0.1, reply), at(1.0))
    assert [state.timestamp for state in run.of(imc.EstimatedState)][-1] == pytest.approx(run.task.now, abs=1.1)
    assert run.task._hearing.clock._offset is None


def test_arduplane_gets_its_side_apart_from_the_radius_and_px4_with_it():
    leg = Leg(path(lradius=70.0, flags=imc.DesiredPath.Flags.CCLOCKW), HERE, 50.0)
    plane, px4 = (one_command(body_of(kind, 1), leg, HERE).fields for kind in (ARDUPILOT, PX4))
    assert (plane["param3"], plane["param4"], plane["z"]) == (70.0, 1.0, 80.0)
    assert px4["param3"] == -70.0
    assert math.isnan(px4["param4"])


def test_offboard_setpoints_move_ahead_at_the_speed_of_the_leg():
    body = body_of(PX4, 2, offboard=True)
    leg = Leg(path(end_lat=HERE.lat + 100.0 / 6.37e6, speed=4.0), HERE, 10.0)
    north = 0.0
    for _ in range(100):  # PX4 approaches by 0.95/s of the distance
        lat = HERE.lat + north / 6.3596e6
        fields = target(body, leg, Whereabouts(lat, HERE.lon, 40.0, 10.0))
        away = displacement(lat, HERE.lon, 0.0, math.radians(fields["lat_int"] / 1e7), HERE.lon, 0.0)[0]
        north += 0.1 * 0.95 * away
    assert north == pytest.approx(40.0, rel=0.02)
    here = target(body, None, HERE)
    assert (here["lat_int"], here["alt"]) == (round(math.degrees(HERE.lat) * 1e7), 10.0)


class Deaf:
    """A pilot whose autopilot acknowledges, or refuses, and does nothing; `said` has times and what was sent."""

    def __init__(self, body, result=0):
        self.now, self.said, self.words = 0.0, [], []
        memory = Memory(self.send)
        self.pilot = Pilot(self.give(result), self.send, self.words.append, lambda: "", memory)
        self.pilot.body, self.pilot.armed, self.pilot.at = body, True, HERE
        self.pilot.mode = body.hold

    def send(self, name, fields):
        self.said.append((self.now, name, fields))

    def give(self, result):
        def give(message, fields, then):
            self.said.append((self.now, message, fields))
            then(result)

        return give

    def run(self, seconds):
        for _ in range(round(5 * seconds)):
            self.pilot.step(self.now)
            self.now += 0.2


def test_setpoints_stream_before_offboard_and_on_until_it_has_left_it():
    line = Deaf(body_of(PX4, 2, offboard=True))
    line.pilot.follow(Leg(path(), HERE, 10.0), 0.0)
    line.run(1.6)
    asked = next(time for time, name, _ in line.said if name == "COMMAND_LONG")
    before = [time for time, name, _ in line.said if name == TARGET and time < asked]
    assert asked >= WARM_UP
    assert len(before) >= 5
    line.pilot.mode = line.pilot.body.guided
    line.run(1.0)
    line.pilot.release(line.now)
    line.run(1.0)
    times = [time for time, name, _ in line.said if name == TARGET]
    assert max(b - a for a, b in pairwise(times)) < 0.5
    assert times[-1] > line.now - 0.5
    line.pilot.mode = line.pilot.body.hold
    line.run(1.0)
    assert line.said[-1][0] < line.now - 0.5


@pytest.mark.parametrize(("kind", "hold", "instead"), [(2, 17, 9), (11, 5, 4), (12, 16, 2)])
def test_a_hold_that_is_refused_gives_way_to_one_that_needs_no_position(kind, hold, instead):
    line = Deaf(body_of(ARDUPILOT, kind), result=4)
    line.pilot.mode = 3
    line.pilot.release(0.0)
    line.run(12.0)
    asked = [fields["param2"] for _, _, fields in line.said]
    assert asked[:4] == [hold] * 3 + [instead]
    assert line.words


class Remembered:
    """A mission that is in the autopilot's memory already."""

    busy, ready, error = False, True, ""
    items, current = ("home", "there", "back"), 1

    def recall(self, start, now):
        return True


def test_orders_that_took_several_tries_leave_the_next_ones_theirs():
    """On a bad line, HEARTBEAT may show only after the third time that it is armed."""
    rover = body_of(ARDUPILOT, 10)
    line = Deaf(rover)
    line.pilot.memory, line.pilot.armed, line.pilot.mode = Remembered(), False, rover.ready
    leg = Leg(path(), HERE, 0.0)
    leg.item = 1
    line.pilot.follow(leg, 0.0)
    line.run(4.0)
    line.pilot.armed = True
    before = len(line.said)
    line.run(4.6)
    assert [fields["command"] for _, _, fields in line.said] == [400] * 3 + [176] * 3
    assert (before, line.pilot.error) == (3, "")
    line.run(2.0)
    assert line.pilot.error == "the mode was accepted, but did not come"


@pytest.mark.parametrize(("current", "mode", "waits"), [(2, "hold", True), (1, "hold", False), (2, "guided", False)])
def test_a_mission_that_is_left_at_its_last_item_may_be_over(current, mode, waits):
    """Whatever told so was lost, or comes after the mode in which autopilots are then."""
    rover = body_of(ARDUPILOT, 10)
    line = Deaf(rover)
    line.pilot.memory, line.pilot.mode = Remembered(), rover.mission
    line.pilot.memory.current = current
    leg = Leg(path(), HERE, 0.0)
    leg.item = 2
    line.pilot.follow(leg, 0.0)
    line.run(1.0)
    line.pilot.mode = getattr(rover, mode)
    line.run(2.0)
    assert (line.pilot.error == "") is waits
    line.run(2.0)
    assert line.pilot.error.startswith("a pilot or a failsafe has chosen another mode")
    assert line.said == []


def fix(**values):
    good = imc.GpsFix.Validity.VALID_POS | imc.GpsFix.Validity.VALID_HDOP
    return imc.GpsFix(**{"validity": good, "lat": 0.7, "lon": -0.15, "height": 52.6, "hdop": 1.5, **values})


def test_a_position_of_shoal_becomes_the_gps_of_the_autopilot():
    said = gps_input(fix(), 54.6, GPS_EPOCH + 604800.0 + 100.0)
    assert (said["lat"], said["lon"]) == (round(math.degrees(0.7) * 1e7), round(math.degrees(-0.15) * 1e7))
    assert said["alt"] == pytest.approx(-2.0)
    assert (said["fix_type"], said["hdop"], said["ignore_flags"]) == (3, 1.5, 4 | 8 | 16 | 32 | 128)
    assert (said["time_week"], said["time_week_ms"]) == (1, 118_000)
    flags = imc.GpsFix.Validity
    moving = gps_input(
        fix(validity=flags.VALID_POS | flags.VALID_SOG | flags.VALID_COG, sog=2.0, cog=math.pi), 0.0, 2e9
    )
    assert (moving["vn"], moving["ve"]) == pytest.approx((-2.0, 0.0), abs=1e-9)
    assert moving["ignore_flags"] & 8 == 0
    assert gps_input(fix(validity=0), 0.0, 2e9)["fix_type"] == 1
    under = fix_of(imc.UsblFixExtended(lat=0.7, lon=-0.15, z=12.0, z_units=imc.ZUnits.DEPTH, accuracy=2.0), 54.6)
    assert (under.height, under.hacc) == pytest.approx((42.6, 2.0))


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


def test_a_hold_after_a_plan_does_not_fight_a_failsafe_that_the_leg_has_not_noticed():
    line = Deaf(body_of(ARDUPILOT, 2))
    line.pilot.mode = 4
    line.pilot.follow(Leg(path(), HERE, 10.0), 0.0)
    line.run(1.0)
    line.pilot.mode = 6  # RTL, in the same HEARTBEAT that says critical
    line.pilot.release(line.now)
    line.said.clear()
    line.run(5.0)
    assert not line.said


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
    assert run.task._hearing.clock._offset is not None
