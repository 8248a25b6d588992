"""What an autopilot says becomes messages of the vehicle; what it is asked. In virtual time, without sockets."""

import math
from itertools import pairwise
from pathlib import Path

import pytest

import imc
from mavlink import StreamSplitter, Tlog, encode, load_dialect
from runtime import State
from runtime.testing import START, simulate
from shoal.logs.edit.tlog_import import import_tlog
from tasks.control.autopilot.mavlink import MAVLink

DIALECT = load_dialect()
TLOG = Path(__file__).parents[3] / "data" / "logs" / "ardusub.tlog"
SERIAL = "serial:///dev/ttyAMA0"
BEAT = {"type": 2, "autopilot": 3, "base_mode": 1, "custom_mode": 4, "mavlink_version": 3}
AT = {"lat": 411850000, "lon": -87062000, "alt": 40000, "relative_alt": 10000, "vx": 100}


def frame(name, system=7, component=1, **values):
    definition = DIALECT.by_name[name]
    return encode(definition, definition.pack(values), 0, system, component)


def heard(*portions, **parameters):
    return simulate(MAVLink, stream=list(portions), address=SERIAL, **parameters)


def at(time, boot=None, **values):
    """A heartbeat, a position and an attitude at a time (s)."""
    boot = round(1000 * (100.0 + time if boot is None else boot))
    place = frame("GLOBAL_POSITION_INT", time_boot_ms=boot, **{**AT, **values})
    return time, frame("HEARTBEAT", **BEAT) + place + frame("ATTITUDE", time_boot_ms=boot, yaw=1.0)


def sent(run, name):
    splitter = StreamSplitter(DIALECT)
    return [m for _, data in run.sent for m in splitter.feed(data)[0] if m.name == name]


def modes(run, since=0.0):
    """The modes that it asked for; TIMESYNC tells when."""
    splitter, now, found = StreamSplitter(DIALECT), 0.0, set()
    for message in (m for _, data in run.sent for m in splitter.feed(data)[0]):
        if message.name == "TIMESYNC":
            now = message.values["ts1"] / 1e9 - START
        elif message.name == "COMMAND_LONG" and message.values["command"] == 176 and now >= since:
            found.add(message.values["param2"])
    return found


def asked(run):
    """The times that it began to ask for messages."""
    return [m for m in sent(run, "COMMAND_LONG") if (m.values["command"], m.values["confirmation"]) == (512, 0)]


def test_a_log_played_gives_the_states_of_its_import(tmp_path):
    (tmp_path / "log").mkdir()
    import_tlog(TLOG, tmp_path / "log")
    imported = [message for message in imc.Log(tmp_path / "log") if isinstance(message, imc.EstimatedState)]
    records = list(Tlog(TLOG, DIALECT).read(frozenset(DIALECT.by_name)))
    began = records[0].time
    portions = [
        (time - began, encode(m.definition, m.payload, m.sequence, m.system, m.component)) for time, m in records
    ]
    run = heard(*portions, autopilot_id=1)
    played = run.of(imc.EstimatedState)
    fields = [field.name for field in imc.fields(imc.EstimatedState)]

    def values(states):
        return [[getattr(state, name) for name in fields] for state in states]

    assert len(played) > 60
    assert values(played) == values(imported[-len(played) :])
    assert all(run.of(kind) for kind in (imc.Voltage, imc.Pressure, imc.Acceleration, imc.GpsFix))
    # Stamped when it was measured, not when it came, which varies by the delays of the link:
    steps = [b.timestamp - a.timestamp for a, b in pairwise(played)]
    assert min(steps) > 0.0


def test_it_introduces_itself_as_a_companion_and_asks_for_messages():
    run = heard(at(0.0), at(1.0), at(2.0))
    beat = sent(run, "HEARTBEAT")[0]
    assert (beat.system, beat.component) == (7, 191)
    assert (beat.values["type"], beat.values["autopilot"]) == (18, 8)
    first = sent(run, "COMMAND_LONG")[0].values
    assert (first["command"], first["param1"], first["target_system"]) == (512, 148.0, 7)
    assert sent(run, "TIMESYNC")


def test_without_message_intervals_it_asks_for_groups():
    refusals = [
        (0.1 + 0.1 * n, frame("COMMAND_ACK", command=command, result=3)) for n, command in enumerate((512, 511))
    ]
    run = heard(at(0.0), *refusals, at(1.0))
    groups = [m.values["req_stream_id"] for m in sent(run, "REQUEST_DATA_STREAM")]
    assert {6, 10} <= set(groups)


def test_a_single_message_that_is_unknown_changes_nothing_else():
    answers = [(0.1, frame("COMMAND_ACK", command=512))]
    answers += [(0.2 + 0.01 * n, frame("COMMAND_ACK", command=511, result=0 if n < 3 else 2)) for n in range(20)]
    run = heard(at(0.0), *answers, at(1.0))
    assert len([m for m in sent(run, "COMMAND_LONG") if m.values["command"] == 511]) == 15
    assert not sent(run, "REQUEST_DATA_STREAM")


def test_a_submarine_is_never_asked_for_what_ends_its_simulation():
    """ArduSub 4.5: WIND. What it was asked for in a recording of it, it knows."""
    recorded = {30, 33, 1, 24, 74, 27, 132, 245, 2, 147, 29, 137, 42}
    answers = [(0.1, frame("COMMAND_ACK", command=512))]
    answers += [(0.2 + 0.01 * n, frame("COMMAND_ACK", command=511)) for n in range(20)]
    run = heard((0.0, frame("HEARTBEAT", **{**BEAT, "type": 12})), *answers, (1.0, b""))
    intervals = {m.values["param1"] for m in sent(run, "COMMAND_LONG") if m.values["command"] == 511}
    assert intervals == recorded


def test_messages_that_do_not_come_are_asked_for_again():
    beats = [(float(time), frame("HEARTBEAT", **BEAT)) for time in range(12)]
    run = heard(*beats)
    assert len(asked(run)) >= 2
    assert run.task.vehicle.entities.find("Navigation").state is State.ERROR


def test_the_first_autopilot_stays_and_others_are_foreign():
    camera = frame("HEARTBEAT", component=100, type=30, autopilot=8)
    station = frame("HEARTBEAT", system=255, component=190, type=6, autopilot=8)
    other = frame("HEARTBEAT", system=9, **BEAT) + frame("GLOBAL_POSITION_INT", system=9, **{**AT, "lat": 1})
    run = heard((0.0, camera + station), at(0.5), (0.6, other), at(1.0), (1.1, other))
    states = run.of(imc.EstimatedState)
    assert [round(math.degrees(s.lat), 4) for s in states] == [41.185, 41.185]
    assert run.task.connection.system == 7
    assert run.task.connection.counts["foreign"] == 6


@pytest.mark.parametrize("wrong", [{"roll": math.nan}, {"yawspeed": math.inf}])
def test_an_attitude_that_is_no_number_is_left_out(wrong):
    run = heard(at(0.0), (0.1, frame("ATTITUDE", time_boot_ms=100100, **wrong)), at(1.0))
    assert len(run.of(imc.EstimatedState)) == 2
    assert run.task._telemetry.invalid > 0


def test_a_place_off_the_earth_is_left_out():
    run = heard(at(0.0), at(1.0, lat=1_000_000_000), at(1.5, lon=2_000_000_000))
    assert {round(math.degrees(state.lat), 4) for state in run.of(imc.EstimatedState)} == {41.185}
    assert run.task._telemetry.invalid == 2


def test_an_old_position_is_none():
    run = heard(at(0.0), (5.0, frame("ATTITUDE", time_boot_ms=105000)))
    assert len(run.of(imc.EstimatedState)) == 1


def test_silence_is_an_error_within_three_seconds():
    run = heard(at(0.0), at(1.0), (6.0, b"\0"))
    errors = [e for e in run.of(imc.EntityState) if e.state == State.ERROR and e.src_ent == run.task.entity.id]
    assert errors[0].timestamp - run.of(imc.EstimatedState)[-1].timestamp == pytest.approx(3.0, abs=0.5)


@pytest.mark.parametrize(("position_at", "lacks"), [(11.8, False), (15.0, True)])
def test_after_a_gap_the_position_may_come_later_than_the_heartbeat(position_at, lacks):
    beats = [(time, frame("HEARTBEAT", **BEAT)) for time in (10.6, 11.6, 12.6, 13.6, 14.6)]
    steady = [at(float(time)) for time in range(5)]
    run = heard(*steady, *sorted([*beats, at(position_at), at(position_at + 0.5)]), input_timeout=12.0)
    navigation = run.task._parts["Navigation"].id
    states = [e for e in run.of(imc.EntityState) if e.src_ent == navigation and e.timestamp > START + 4.0]
    errors = [e.description for e in states if e.state == State.ERROR]
    assert set(errors) == ({"no ATTITUDE and no GLOBAL_POSITION_INT for 2 s"} if lacks else set())


def test_a_new_start_is_noticed_and_asks_again():
    run = heard(at(0.0), at(1.0), at(2.0, boot=3.0), at(3.0, boot=4.0))
    assert "the autopilot has started anew" in run.log
    assert len(asked(run)) == 2
    assert [s.timestamp for s in run.of(imc.EstimatedState)] == sorted(s.timestamp for s in run.of(imc.EstimatedState))


def test_sensors_have_the_health_that_the_autopilot_sees():
    bits = {f"onboard_control_sensors_{word}": 0x2F for word in ("present", "enabled", "health")}
    good, bad = frame("SYS_STATUS", **bits), frame("SYS_STATUS", **{**bits, "onboard_control_sensors_health": 0x0F})
    gps = [run.task.vehicle.entities.find("GPS").state for run in (heard(at(0.0), (0.1, x)) for x in (good, bad))]
    assert gps == [State.NORMAL, State.ERROR]


def test_heights_are_above_the_ellipsoid_and_an_aircraft_knows_its_height_above_home():
    state = heard(at(0.0), geoid_undulation=54.6).of(imc.EstimatedState)[0]
    assert (state.height, state.alt, state.depth) == pytest.approx((94.6, 10.0, -1.0))


@pytest.mark.parametrize(("source", "mode"), [(None, None), (0x4001, 9.0)])
def test_an_abort_of_the_vehicle_itself_does_not_interrupt_a_pilot(source, mode):
    abort = imc.Abort(timestamp=1.5) if source is None else imc.Abort(timestamp=1.5, src=source)
    flying = frame("HEARTBEAT", **{**BEAT, "base_mode": 129, "custom_mode": 5})
    run = simulate(
        MAVLink, [abort], stream=[(0.1, flying), (1.0, flying), (3.0, flying)], address=SERIAL, ending="land"
    )
    assert modes(run) == ({mode} if mode else set())


@pytest.mark.parametrize(("later", "asked_for"), [(4, {17.0}), (6, set())])
def test_after_an_outage_the_copter_holds_unless_somebody_else_leads_it(later, asked_for):
    def portion(time, mode):
        beat = frame("HEARTBEAT", **{**BEAT, "base_mode": 129, "custom_mode": mode})
        return time, beat + at(time)[1][len(frame("HEARTBEAT", **BEAT)) :]

    loops = imc.ControlLoops(mask=imc.CLoopsMask.PATH, enable=1, scope_ref=1)
    path = imc.DesiredPath(
        end_lat=math.radians(41.19), end_lon=math.radians(-8.7062), end_z=20.0, end_z_units=imc.ZUnits.ALTITUDE,
        speed=5.0, speed_units=imc.SpeedUnits.METERS_PS,
    )  # fmt: skip
    plan = [loops.replace(timestamp=2.0), path.replace(timestamp=2.1)]
    over = [loops.replace(timestamp=6.0, enable=0, scope_ref=2)]
    led = [portion(0.0, 5), *(portion(float(time), 4) for time in range(1, 5))]
    stream = led + [portion(12.0 + time, later) for time in range(4)]
    run = simulate(MAVLink, plan + over, stream=stream, address=SERIAL)
    assert modes(run, since=11.0) == asked_for
    assert run.of(imc.PathControlState)


def test_a_copter_that_the_task_led_before_it_was_restarted_holds():
    beat = frame("HEARTBEAT", **{**BEAT, "base_mode": 129})
    run = heard((0.0, beat), (1.0, beat), (2.0, beat))
    assert modes(run) == {17.0}


def test_what_this_vehicle_tells_ground_stations_is_not_its_autopilot():
    own = frame("HEARTBEAT", system=0x1A, **BEAT)
    run = heard((0.0, own), (1.0, own))
    assert not run.task.connection.has_received_heartbeat
    assert sum("this vehicle's own MAVLink id" in words for words in run.log) == 1
    assert heard((0.0, own), autopilot_id=0x1A).task.connection.has_received_heartbeat
