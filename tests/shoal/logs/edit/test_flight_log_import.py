"""Import of the logs that ArduPilot and PX4 write: units, frames, times, and what damage leaves."""

import math
import random

import pytest

import imc
from mavlink.ulog import BadULog
from shoal.logs.edit.flight_log_import import import_dataflash, import_ulog
from shoal.logs.edit.import_writer import NothingToImport
from support import wgs84
from tests.mavlink.flights import DataFlashWriter, ULogWriter

UTC = 315_964_800 + 2200 * 604_800 + 400.0 - 18  # s; GPS week 2200, 400 s, when the autopilot's clock showed 10 s
GOOD = {"Status": 4, "GMS": 400_000, "GWk": 2200, "NSats": 9, "HDop": 1.2, "Alt": 90.0, "Spd": 2.5, "GCrs": 180.0}


def imported(tmp_path, data, convert=import_dataflash, **options):
    (tmp_path / "a.log").write_bytes(data)
    (tmp_path / "log").mkdir()
    done = convert(tmp_path / "a.log", tmp_path / "log", **options)
    return imc.Log(tmp_path / "log"), done


def sub():
    log = DataFlashWriter().add(9.0, "MSG", Message="ArduSub V4.1.1 (66c674c1)")
    log.add(9.0, "PARM", Name="SYSID_THISMAV", Value=7.0).add(9.0, "PARM", Name="BATT_LOW_VOLT", Value=0.1)
    return log.add(10.0, "GPS", Lat=41.18, Lng=-8.7, **GOOD)


def test_a_dataflash_log_has_states_in_imcs_frames_and_units(tmp_path):
    log = sub().add(10.0, "XKF1", C=0, VN=2.0, VE=0.0, VD=1.0).add(10.0, "XKF1", C=1, VN=9.0, VE=9.0, VD=9.0)
    log.add(10.0, "IMU", I=0, GyrX=0.1, GyrY=0.2, GyrZ=0.3, AccZ=-9.8).add(10.0, "IMU", I=1, GyrX=9.0)
    log.add(10.0, "POS", Lat=41.18, Lng=-8.7, Alt=-1.5, RelHomeAlt=-2.5)
    log.add(10.5, "ATT", Roll=10.0, Pitch=0.0, Yaw=270.0)
    found, done = imported(tmp_path, log.data)
    (state,) = found.messages("EstimatedState")
    at = wgs84.displacement(math.radians(41.18), math.radians(-8.7), -1.5, state.lat, state.lon, state.height)
    assert at == pytest.approx((1.0, 0.0, 0.5), abs=1e-3)
    assert (state.phi, state.psi) == pytest.approx((math.radians(10.0), -math.pi / 2))
    assert (state.vx, state.vy, state.vz) == (2.0, 0.0, 1.0)
    assert (state.u, state.p, state.q, state.r) == pytest.approx((0.0, 0.1, 0.2, 0.3), abs=1e-6)
    assert (state.depth, state.alt, state.timestamp) == (3.0, -1.0, UTC + 0.5)
    assert (done.messages, done.lost, done.notes) == ({"mavlink-7": len(found)}, 0, [])
    labels = {info.id: info.label for info in found.messages("EntityInfo")}
    assert [labels[m.src_ent] for m in found.messages("AngularVelocity")] == ["IMU", "IMU 2"]
    assert next(found.messages("Acceleration")).z == pytest.approx(-9.8)


def test_the_filter_that_the_vehicle_uses_gives_its_velocity(tmp_path):
    log = sub().add(10.0, "XKF4", PI=1).add(10.0, "XKF1", C=0, VN=9.0).add(10.0, "XKF1", C=1, VN=2.0)
    log.add(10.0, "POS", Lat=41.18, Lng=-8.7).add(10.0, "ATT", Yaw=0.0)
    assert [state.vx for state in imported(tmp_path, log.data)[0].messages("EstimatedState")] == [2.0]


def test_a_dataflash_log_has_sensors_texts_modes_and_parameters(tmp_path):
    log = sub().add(10.1, "GPA", VDop=1.5, HAcc=0.8, VAcc=1.2, Und=-55.0).add(10.2, "GPS", Lat=41.0, Lng=-8.0, **GOOD)
    log.add(11.0, "BARO", I=0, Press=101_325.0, Temp=21.5).add(11.0, "BARO", I=1, Press=121_325.0, Alt=-2.04)
    log.add(11.0, "MAG", MagX=250, MagZ=-400).add(11.0, "BAT", Inst=1, Volt=16.2, Curr=2.5, RemPct=80)
    log.add(11.0, "RFND", Dist=3.5, Stat=4, Orient=25).add(11.0, "MODE", Mode=19, ModeNum=19).add(11.0, "EV", Id=10)
    log.add(11.0, "ERR", Subsys=2, ECode=1)
    found, _ = imported(tmp_path, log.data, system="bluerov")
    fix = list(found.messages("GpsFix"))[1]
    assert fix.validity == sum(imc.GpsFix.Validity)
    assert (fix.lat, fix.height, fix.satellites) == (math.radians(41.0), 145.0, 9)
    assert (fix.hdop, fix.vdop, fix.hacc, fix.vacc) == pytest.approx((1.2, 1.5, 0.8, 1.2))
    assert (fix.sog, fix.cog, fix.utc_year) == pytest.approx((2.5, math.pi, 2022))
    assert [m.value for m in found.messages("Pressure")] == pytest.approx([1013.25, 1213.25])
    assert [m.value for m in found.messages("Temperature")] == [21.5, 0.0]
    assert [m.value for m in found.messages("Depth")] == pytest.approx([2.04])
    field = next(found.messages("MagneticField"))
    assert (field.x, field.y, field.z) == (0.25, 0.0, -0.4)
    assert [round(m.value, 3) for m in found.messages("Voltage", "Current", "FuelLevel")] == [16.2, 2.5, 80.0]
    assert [m.value for m in found.messages("Distance")] == [3.5]
    assert [mode.mode for mode in found.messages("AutopilotMode")] == ["MANUAL"]
    texts = [entry.text for entry in found.messages("LogBookEntry")]
    assert texts == ["ArduSub V4.1.1 (66c674c1)", "armed", "error 1 of subsystem 2"]
    (parameters,) = found.messages("EntityParameters")
    assert [(p.name, p.value) for p in parameters.params] == [("SYSID_THISMAV", "7"), ("BATT_LOW_VOLT", "0.1")]
    (announce,) = found.messages("Announce")
    assert (announce.sys_name, announce.sys_type) == ("bluerov", imc.SystemType.UUV)
    ops = [m.op for m in found.messages("LoggingControl")]
    assert ops == [imc.LoggingControl.Op.STARTED, imc.LoggingControl.Op.STOPPED]


def test_without_a_gps_times_count_from_the_start_and_it_says_so(tmp_path):
    log, done = imported(tmp_path, DataFlashWriter().add(12.5, "ATT", Roll=1.0).data)
    assert next(log.messages("EulerAngles")).timestamp == 12.5
    assert "no GPS has given the time" in done.notes[0]


def px4():
    log = ULogWriter().parameter("MAV_SYS_ID", 3).parameter("MAV_TYPE", 2).text(1.0, 4, "Low battery")
    valid = {"vel_ned_valid": ("?", True), "vel_m_s": ("f", 2.5), "cog_rad": ("f", -math.pi / 2)}
    where = {"lat": ("i", 411800000), "lon": ("i", -87000000), "alt": ("i", 90_000), "alt_ellipsoid": ("i", 145_000)}
    dop = {"hdop": ("f", 1.2), "vdop": ("f", 1.5), "eph": ("f", 0.8), "epv": ("f", 1.2), "satellites_used": ("B", 9)}
    clock = {"fix_type": ("B", 4), "time_utc_usec": ("Q", 1_700_000_000_000_000)}
    log.add(10.0, "vehicle_gps_position", **valid, **where, **dop, **clock)
    log.add(10.0, "vehicle_angular_velocity", xyz=("f", [0.1, 0.2, 0.3]))
    log.add(10.0, "vehicle_global_position", lat=("d", 41.18), lon=("d", -8.7), alt=("f", 90.0))
    speed = {"vx": ("f", 2.0), "vy": ("f", 0.0), "vz": ("f", -1.0), "z": ("f", -20.0), "dist_bottom": ("f", 7.0)}
    known = dict.fromkeys(("v_xy_valid", "v_z_valid", "z_valid", "dist_bottom_valid"), ("?", True))
    log.add(10.0, "vehicle_local_position", **speed, **known)
    half = math.sqrt(0.5)
    log.add(10.5, "vehicle_attitude", q=("f", [half, 0.0, 0.0, half]))  # it looks east
    log.add(11.0, "battery_status", voltage_v=("f", 16.2), current_a=("f", -1.0), remaining=("f", 0.8))
    log.add(11.0, "vehicle_air_data", baro_pressure_pa=("f", 101325.0), baro_temp_celcius=("f", 21.5))
    log.add(11.0, "vehicle_magnetometer", magnetometer_ga=("f", [0.25, 0.0, -0.5]))
    log.add(11.0, "sensor_combined", gyro_rad=("f", [0.1, 0.2, 0.3]), accelerometer_m_s2=("f", [0.0, 0.0, -9.8]))
    for time, mode, armed in ((11.0, 4, 1), (11.5, 4, 2), (12.0, 3, 2)):
        log.add(time, "vehicle_status", nav_state=("B", mode), arming_state=("B", armed))
    return log.dropout(300)


def test_a_ulog_file_becomes_a_log(tmp_path):
    found, done = imported(tmp_path, px4().data, import_ulog)
    start = 1.7e9 - 10.0
    (state,) = found.messages("EstimatedState")
    at = wgs84.displacement(math.radians(41.18), math.radians(-8.7), 90.0, state.lat, state.lon, state.height)
    assert at == pytest.approx((1.0, 0.0, -0.5), abs=1e-3)
    assert (state.phi, state.theta, state.psi) == pytest.approx((0.0, 0.0, math.pi / 2), abs=1e-6)
    assert (state.u, state.v, state.w) == pytest.approx((0.0, -2.0, -1.0), abs=1e-6)
    assert (state.p, state.q, state.r) == pytest.approx((0.1, 0.2, 0.3))
    assert (state.depth, state.alt, state.timestamp) == (-1.0, 7.0, start + 10.5)
    (fix,) = found.messages("GpsFix")
    assert fix.validity == sum(imc.GpsFix.Validity)
    assert (fix.lat, fix.height, fix.utc_time) == (pytest.approx(math.radians(41.18)), 145.0, 80_000.0)
    assert (fix.sog, fix.cog) == pytest.approx((2.5, 1.5 * math.pi))
    assert [round(m.value, 3) for m in found.messages("Voltage", "Current", "FuelLevel")] == [16.2, 80.0]
    assert [m.value for m in found.messages("Pressure", "Temperature")] == pytest.approx([1013.25, 21.5])
    assert [m.x for m in found.messages("MagneticField")] == [0.25]
    assert [m.z for m in found.messages("Acceleration")] == pytest.approx([-9.8])
    assert [mode.mode for mode in found.messages("AutopilotMode")] == ["LOITER", "MISSION"]
    assert [(e.type, e.text) for e in found.messages("LogBookEntry")] == [
        (imc.LogBookEntry.Type.WARNING, "Low battery"),
        (imc.LogBookEntry.Type.INFO, "armed"),
    ]
    (parameters,) = found.messages("EntityParameters")
    assert [(p.name, p.value) for p in parameters.params] == [("MAV_SYS_ID", "3"), ("MAV_TYPE", "2")]
    assert next(found.messages("Announce")).sys_type == imc.SystemType.UAV
    assert list(done.messages) == ["mavlink-3"]
    assert "missed 0.3 s" in done.notes[0]


def test_records_with_other_fields_are_counted_and_the_others_stay(tmp_path):
    log = px4().add(13.0, "distance_sensor", what=("f", 1.0)).add(13.0, "vehicle_attitude", 0, q=("f", [1.0] * 4))
    found, done = imported(tmp_path, log.data, import_ulog)
    assert found.counts()["EulerAngles"] == 2
    assert "1 of its distance_sensor skipped: not as expected" in done.notes[-2]


@pytest.mark.parametrize("convert", [import_dataflash, import_ulog])
def test_a_log_without_anything_is_refused_by_name(tmp_path, convert):
    data = DataFlashWriter().data if convert is import_dataflash else ULogWriter().data
    with pytest.raises(NothingToImport, match=r"a\.log"):
        imported(tmp_path, data, convert)


def spoiled(data, seed):
    """The data with a few bytes changed, left out and put in."""
    chance, found = random.Random(seed), bytearray(data)
    for _ in range(chance.randrange(1, 12)):
        place, count = chance.randrange(len(found)), chance.randrange(30)
        kind = chance.randrange(4)
        if kind == 0:
            del found[place : place + count]
        elif kind == 1:
            found[place:place] = chance.randbytes(count)
        elif kind == 2:
            found[place : place + 8] = b"\xff\xff\xff\x7f" * 2
        else:
            found[place] = chance.randrange(256)
    return bytes(found)


@pytest.mark.parametrize("convert", [import_dataflash, import_ulog])
def test_damage_of_any_kind_leads_to_a_log_or_a_refusal(tmp_path, convert):
    """A parameter without a value ended the import."""
    flown = sub().add(10.5, "ATT", Roll=1.0).add(10.6, "MODE", ModeNum=3) if convert is import_dataflash else px4()
    whole = flown.data
    made, refused = 0, ["a.log"]
    for seed in range(40):
        (tmp_path / "a.log").write_bytes(spoiled(whole, seed))
        (folder := tmp_path / str(seed)).mkdir()
        try:
            convert(tmp_path / "a.log", folder)
        except (NothingToImport, BadULog) as error:
            refused.append(str(error))
        else:
            made += imc.Log(folder).losses == []
    assert made > 25
    assert all("a.log" in words for words in refused)
