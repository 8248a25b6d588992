"""Import of MAVLink .tlog files: part of a BlueROV2 dive, with damage, and frames made here."""

import math
import random
import struct
from collections import Counter
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

import imc
from mavlink import Tlog, load_dialect
from mavlink.translate import AutopilotTranslator
from shoal.logs.edit.import_writer import NothingToImport
from shoal.logs.edit.tlog_import import import_tlog
from support import wgs84

TLOG = Path(__file__).parents[3] / "data" / "logs" / "ardusub.tlog"
DIALECT = load_dialect()
KINDS = AutopilotTranslator(DIALECT).message_names

# What pymavlink 2.4.49's mavlogfile finds in the file from system 1, component 1.
FRAMES = {"ATTITUDE": 81, "GLOBAL_POSITION_INT": 16, "HEARTBEAT": 5, "GPS_RAW_INT": 11, "SYS_STATUS": 11}
FRAMES |= {"STATUSTEXT": 4, "VFR_HUD": 478, "RAW_IMU": 11, "SCALED_PRESSURE": 11, "SCALED_PRESSURE2": 118}


class Recorder:
    """Writes MAVLink messages to a .tlog; times in s."""

    def __init__(self, system=1, component=1):
        self.data = b""
        self._mavlink = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)

    def add(self, time, *messages):
        for message in messages:
            self.data += struct.pack(">Q", round(time * 1e6)) + message.pack(self._mavlink)
        return self


def heartbeat(kind=12, mode=0, base=81, autopilot=3):
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, base, mode, 4, 3)


def imported(tmp_path, data, **options):
    (tmp_path / "a.tlog").write_bytes(data)
    (tmp_path / "log").mkdir()
    done = import_tlog(tmp_path / "a.tlog", tmp_path / "log", **options)
    return imc.Log(tmp_path / "log"), done


def test_frames_are_those_that_pymavlink_finds():
    tlog = Tlog(TLOG, DIALECT)
    found = Counter(m.name for _, m in tlog.read(KINDS) if (m.system, m.component) == (1, 1))
    assert {name: found[name] for name in FRAMES} == FRAMES
    assert tlog.lost == 337


@pytest.mark.parametrize("garbage", [bytes(100_000), random.Random(1).randbytes(100_000)], ids=["zeros", "random"])
def test_garbage_is_skipped_without_a_look_at_each_byte(tmp_path, monkeypatch, garbage):
    """Counted, since a busy machine makes times longer: 50 MB took 17 s."""
    (tmp_path / "a.tlog").write_bytes(garbage + TLOG.read_bytes())
    looks, look = [], Tlog._record_at
    monkeypatch.setattr(Tlog, "_record_at", lambda *at: looks.append(at) or look(*at))
    tlog = Tlog(tmp_path / "a.tlog", DIALECT)
    frames = sum(1 for _ in tlog.read(KINDS))
    assert frames == sum(1 for _ in Tlog(TLOG, DIALECT).read(KINDS))
    assert tlog.lost == 337 + len(garbage)
    assert len(looks) < 2 * tlog.frames + 337


def test_a_dive_becomes_a_log(tmp_path):
    done = import_tlog(TLOG, tmp_path, system="bluerov")
    log = imc.Log(tmp_path)
    counts = log.counts()
    assert done.messages == {"bluerov": len(log)}
    assert (counts["EulerAngles"], counts["GpsFix"], counts["Throttle"], counts["Heartbeat"]) == (81, 11, 478, 5)
    assert (counts["Pressure"], counts["EstimatedState"], counts["LogBookEntry"]) == (129, 79, 4)
    assert next(log.messages("LogBookEntry")).text == "ArduSub V4.1.1 BETA5 (66c674c1)"
    (mode,) = log.messages("AutopilotMode")
    assert (mode.mode, mode.autonomy) == ("MANUAL", imc.AutopilotMode.Autonomy.ASSISTED)
    (announce,) = log.messages("Announce")
    assert (announce.sys_name, announce.sys_type) == ("bluerov", imc.SystemType.UUV)
    labels = {info.id: info.label for info in log.messages("EntityInfo")}
    assert {labels[state.src_ent] for state in log.messages("EstimatedState")} == {"Navigation"}
    times = [message.timestamp for message in log]
    assert times == sorted(times)
    state = next(log.messages("EstimatedState"))
    assert math.degrees(state.lat) == pytest.approx(48.386, abs=1e-2)
    assert log.losses == []


def test_states_are_in_imcs_frames_and_units(tmp_path):
    position = mavlink.MAVLink_global_position_int_message(
        1000, round(41.18e7), round(-8.7e7), -1500, -2500, 200, 0, 100, 9000
    )
    attitude = mavlink.MAVLink_attitude_message(1500, 0.0, 0.0, math.pi / 2, 0.1, 0.2, 0.3)
    recorder = Recorder().add(1.7e9, heartbeat(), position).add(1.7e9 + 0.5, attitude)
    (state,) = imported(tmp_path, recorder.data)[0].messages("EstimatedState")
    north, east, down = wgs84.displacement(
        math.radians(41.18), math.radians(-8.7), -1.5, state.lat, state.lon, state.height
    )
    assert (north, east, down) == pytest.approx((1.0, 0.0, 0.5), abs=1e-4)  # half a second on
    assert (state.vx, state.vy, state.vz) == (2.0, 0.0, 1.0)
    assert (state.u, state.v, state.w) == pytest.approx((0.0, -2.0, 1.0), abs=1e-6)  # it looks east
    assert (state.p, state.q, state.r) == pytest.approx((0.1, 0.2, 0.3))
    assert (state.depth, state.alt) == (3.0, -1.0)
    assert state.timestamp == 1.7e9 + 0.5


def test_only_submarines_have_a_depth(tmp_path):
    position = mavlink.MAVLink_global_position_int_message(1000, 1, 1, 50_000, 20_000, 0, 0, 0, 0)
    attitude = mavlink.MAVLink_attitude_message(1000, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    (state,) = imported(tmp_path, Recorder().add(1.7e9, heartbeat(2), position, attitude).data)[0].messages(
        "EstimatedState"
    )
    assert (state.depth, state.height) == (-1.0, 50.0)


def test_gps_says_what_it_does_not_know(tmp_path):
    time = mavlink.MAVLink_system_time_message(round(1.7e15), 1000)
    none = mavlink.MAVLink_gps_raw_int_message(0, 1, 0, 0, 0, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 255)
    good = mavlink.MAVLink_gps_raw_int_message(
        0, 4, round(41e7), round(-8e7), 90_000, 120, 150, 250, 18_000, 9, alt_ellipsoid=145_000, h_acc=800, v_acc=1200
    )
    log, _ = imported(tmp_path, Recorder().add(1.7e9, heartbeat(), none, time, good).data)
    first, second = log.messages("GpsFix")
    flags = imc.GpsFix.Validity
    assert (first.validity, first.satellites, first.sog) == (0, 0, 0.0)
    assert second.validity == sum(flags)
    assert second.type == imc.GpsFix.Type.DIFFERENTIAL
    assert (second.lat, second.height, second.satellites) == (math.radians(41.0), 145.0, 9)
    assert (second.hdop, second.vdop, second.hacc, second.vacc) == pytest.approx((1.2, 1.5, 0.8, 1.2))
    assert (second.sog, second.cog) == pytest.approx((2.5, math.pi))
    assert (second.utc_year, second.utc_month, second.utc_day, second.utc_time) == (2023, 11, 14, 80_000.0)


def test_long_texts_are_put_together(tmp_path):
    texts = [(b"a" * 50, 7, 0), (b"b" * 50, 7, 1), (b"end", 7, 2), (b"short", 0, 0)]
    frames = [mavlink.MAVLink_statustext_message(4, text, number, place) for text, number, place in texts]
    log, _ = imported(tmp_path, Recorder().add(1.7e9, heartbeat(), *frames).data)
    entries = list(log.messages("LogBookEntry"))
    assert [entry.text for entry in entries] == ["a" * 50 + "b" * 50 + "end", "short"]
    assert {entry.type for entry in entries} == {imc.LogBookEntry.Type.WARNING}


def test_batteries_say_only_what_they_know(tmp_path):
    status = mavlink.MAVLink_sys_status_message(0, 0, 0, 0, 16_200, -1, -1, 0, 0, 0, 0, 0, 0)
    second = mavlink.MAVLink_battery_status_message(1, 0, 0, 0, [4000, 4100] + [0xFFFF] * 8, 250, 0, 0, 80)
    log, _ = imported(tmp_path, Recorder().add(1.7e9, heartbeat(), status, second).data)
    labels = {info.id: info.label for info in log.messages("EntityInfo")}
    said = [(labels[m.src_ent], round(m.value, 3)) for m in log.messages("Voltage", "Current", "FuelLevel")]
    assert said == [("Batteries", 16.2), ("Batteries 2", 8.1), ("Batteries 2", 2.5), ("Batteries 2", 80.0)]


def test_each_autopilot_is_a_system_and_ground_stations_are_none(tmp_path):
    first = Recorder(1).add(1.7e9, mavlink.MAVLink_statustext_message(6, b"before"), heartbeat())
    second = Recorder(2).add(1.7e9, heartbeat(2))
    station = Recorder(255, 190).add(1.7e9, heartbeat(6, autopilot=8))
    camera = Recorder(1, 100).add(1.7e9, heartbeat(30, autopilot=8))
    log, done = imported(tmp_path, first.data + station.data + camera.data + second.data)
    assert sorted(done.messages) == ["mavlink-1", "mavlink-2"]
    assert [entry.text for entry in log.messages("LogBookEntry")] == ["before"]
    assert log.counts()["Heartbeat"] == 2


def test_good_frames_around_damage_are_found(tmp_path):
    frames = [Recorder().add(1.7e9 + number, heartbeat()).data for number in range(10)]
    frames[3] = frames[3][:-1] + b"\x00"
    frames[5] = b"\xfd\xfe garbage" + bytes(20)
    frames[7] = frames[7][:12]
    log, done = imported(tmp_path, b"".join(frames))
    assert [m.timestamp - 1.7e9 for m in log.messages("Heartbeat")] == [0, 1, 2, 4, 6, 8, 9]
    assert done.lost == sum(len(frames[number]) for number in (3, 5, 7))


@pytest.mark.parametrize("data", [b"", b"not a log of MAVLink" * 100, Recorder(255).add(1.7e9, heartbeat(6)).data])
def test_files_without_an_autopilot_are_refused(tmp_path, data):
    with pytest.raises(NothingToImport, match=r"a\.tlog"):
        imported(tmp_path, data)
