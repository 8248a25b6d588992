"""Whatever is done to a recording, what is before the damage is imported, and what is refused is refused by name."""

import math
import struct
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

import imc
from mavlink import load_dialect
from mavlink.dataflash import DataFlash
from mavlink.tlog import Tlog
from mavlink.ulog import BadULog, ULog
from shoal.logs.edit.flight_log_import import import_dataflash, import_ulog
from shoal.logs.edit.import_writer import NothingToImport
from shoal.logs.edit.tlog_import import import_tlog
from tests.command import shoal
from tests.mavlink.flights import DataFlashWriter, ULogWriter

DIALECT = load_dialect()
ALL = frozenset(DIALECT.by_name)
REAL = Path(__file__).parents[3] / "data" / "logs" / "ardusub.tlog"
SHORTEST = 16  # bytes with which a ULog file begins
ODD = st.one_of(st.floats(), st.sampled_from([math.nan, math.inf, -math.inf, 1e38, -1e38]))


def frames(*messages, system=1, component=1):
    """A .tlog of an autopilot with these messages, one per second."""
    sender, data = mavlink.MAVLink(None, srcSystem=system, srcComponent=component), b""
    for number, message in enumerate((mavlink.MAVLink_heartbeat_message(12, 3, 81, 0, 4, 3), *messages)):
        data += struct.pack(">Q", round((1.7e9 + number) * 1e6)) + message.pack(sender)
    return data


def flown():
    log = DataFlashWriter()
    for number in range(60):
        log.add(10.0 + number / 10, "ATT", Roll=number / 10, Yaw=359.0)
        log.add(10.0 + number / 10, "POS", Lat=41.18, Lng=-8.7, Alt=12.0)
    return log.data


def floated():
    log = ULogWriter()
    for number in range(60):
        log.add(10.0 + number / 10, "vehicle_attitude", q=("f", [1.0, 0.0, 0.0, 0.0]))
        log.add(10.0 + number / 10, "battery_status", voltage_v=("f", 16.0 + number / 100))
    return log.text(17.0, 6, "landed").data


def read_tlog(path):
    return [(time, m.name, m.content) for time, m in Tlog(path, DIALECT).read(ALL)]


def read_dataflash(path):
    return [tuple(map(repr, record)) for record in DataFlash(path).read(frozenset({"ATT", "POS"}))]


def read_ulog(path):
    topics = frozenset({"vehicle_attitude", "battery_status", "L"})
    return [tuple(map(repr, record)) for record in ULog(path).read(topics)]


FORMATS = {
    "tlog": (REAL.read_bytes()[:30_000], read_tlog, import_tlog),
    "BIN": (flown(), read_dataflash, import_dataflash),
    "ulg": (floated(), read_ulog, import_ulog),
}
damage = st.lists(
    st.tuples(st.sampled_from(["cut", "flip", "insert", "remove", "repeat"]), st.floats(0, 1), st.binary(max_size=40)),
    min_size=1,
    max_size=4,
)


def damaged(data, edits):
    """The data with damage, and the first place that it touches."""
    first = len(data)
    for kind, share, content in edits:
        at = round(share * len(data))
        first = min(first, at)
        match kind:
            case "cut":
                data = data[:at]
            case "flip":
                data = (
                    data[:at]
                    + bytes(byte ^ 0x5A for byte in data[at : at + 1 + len(content)])
                    + data[at + 1 + len(content) :]
                )
            case "insert":
                data = data[:at] + content + data[at:]
            case "remove":
                data = data[:at] + data[at + 1 + len(content) :]
            case _:
                data = data[:at] + data[max(0, at - 200) :]
    return data, first


@pytest.mark.heavy
@pytest.mark.parametrize("form", FORMATS)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(edits=damage)
def test_damage_costs_nothing_before_it_and_is_counted(tmp_path_factory, form, edits):
    good, read, convert = FORMATS[form]
    data, first = damaged(good, edits)
    folder = tmp_path_factory.mktemp("damaged")
    path, before = folder / f"a.{form}", folder / f"before.{form}"
    path.write_bytes(data)
    before.write_bytes(good[:first])
    (folder / "log").mkdir()
    try:
        done = convert(path, folder / "log")
    except (NothingToImport, BadULog) as refused:
        done, reason = None, str(refused)
    if done is None:
        assert reason.startswith(f"{path}: ")
        return
    whole = (
        read(before)[:-1] if first >= SHORTEST else []
    )  # nothing vouches for a record without a checksum that damage follows
    assert read(path)[: len(whole)] == whole
    assert 0 <= done.lost <= len(data)
    assert (done.first_lost >= 0) == (done.lost > 0)
    if done.lost:
        assert done.first_lost <= len(data)
    assert len(imc.Log(folder / "log")) == sum(done.messages.values())
    assert not imc.Log(folder / "log").losses


@pytest.mark.parametrize("form", FORMATS)
@settings(max_examples=30, deadline=None)
@given(data=st.binary(max_size=3000))
def test_foreign_files_are_refused_by_name_or_empty(tmp_path_factory, form, data):
    folder = tmp_path_factory.mktemp("foreign")
    (folder / f"a.{form}").write_bytes(data)
    with pytest.raises((NothingToImport, BadULog), match=rf"a\.{form}"):
        FORMATS[form][2](folder / f"a.{form}", folder)


ATTITUDE = mavlink.MAVLink_attitude_message(2000, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
PLACE = mavlink.MAVLink_global_position_int_message(1000, round(41.18e7), round(-8.7e7), 0, 0, 0, 0, 0, 0)


@pytest.mark.heavy
@settings(max_examples=60, deadline=None)
@given(values=st.lists(ODD, min_size=12, max_size=12), number=st.integers(0, 255))
def test_frames_with_impossible_values_cost_only_themselves(tmp_path_factory, values, number):
    """Their checksums are right: an autopilot that has lost its mind, or somebody who wants to do harm."""
    folder = tmp_path_factory.mktemp("odd")
    f = [struct.unpack("<f", struct.pack("<f", max(-3e38, min(3e38, v)) if math.isfinite(v) else v))[0] for v in values]
    odd = (
        mavlink.MAVLink_attitude_message(1500, *f[:6]),
        mavlink.MAVLink_vfr_hud_message(*f[:2], 7, 100, *f[2:4]),
        mavlink.MAVLink_scaled_pressure_message(1, f[0], f[1], -32768),
        mavlink.MAVLink_param_value_message(b"\xff" * 16, f[2], number, 0, 0),
        mavlink.MAVLink_statustext_message(number, b"\xff\xfe" * 25, number, number),
        mavlink.MAVLink_global_position_int_message(
            1, 2**31 - 1, -(2**31), 2**31 - 1, -(2**31), 32767, -32768, 32767, 0
        ),
        mavlink.MAVLink_gps_raw_int_message(0, number, 2**31 - 1, -(2**31), 2**31 - 1, 1, 1, 1, 1, number),
        mavlink.MAVLink_mission_count_message(255, 190, 65535),
        mavlink.MAVLink_mission_item_int_message(255, 190, 0, number, number, 0, 1, *f[:4], 2**31 - 1, 1, f[5]),
        mavlink.MAVLink_mission_ack_message(255, 190, number),
        mavlink.MAVLink_home_position_message(2**31 - 1, 1, 1, *f[:3], [f[0]] * 4, *f[3:6]),
        mavlink.MAVLink_mission_item_reached_message(65535),
        mavlink.MAVLink_rangefinder_message(f[0], f[1]),
    )
    path = folder / "a.tlog"
    path.write_bytes(frames(PLACE, *odd, ATTITUDE, PLACE, ATTITUDE))
    (folder / "log").mkdir()
    import_tlog(path, folder / "log")
    log = imc.Log(folder / "log")
    state = list(log.messages("EstimatedState"))[-1]
    assert (math.degrees(state.lat), state.phi) == pytest.approx((41.18, 0.1), abs=1e-6)
    assert not log.losses


def test_what_is_skipped_is_reported_with_file_kind_number_and_time(tmp_path):
    bad = mavlink.MAVLink_attitude_message(1500, math.inf, 0.0, 0.0, 0.0, 0.0, 0.0)
    (tmp_path / "a.tlog").write_bytes(frames(PLACE, bad, bad, ATTITUDE))
    (tmp_path / "log").mkdir()
    done = import_tlog(tmp_path / "a.tlog", tmp_path / "log")
    expected = f"{tmp_path / 'a.tlog'}: 2 of its ATTITUDE skipped: not as expected, the first at 1700000002.000 s"
    assert done.notes == [expected]
    assert len(list(imc.Log(tmp_path / "log").messages("EstimatedState"))) == 1


def shoal_import(path, out):
    return shoal("log", "import", str(path), str(out))


def test_frames_without_times_are_refused_with_the_reason(tmp_path):
    """MAVProxy's .tlog.raw: a heartbeat of types 3 to 14 ends like a time, and some were taken for that."""
    sender = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    data = b""
    for number in range(200):
        for _ in range(2):
            data += mavlink.MAVLink_heartbeat_message(12, 3, 0, 0, 3, 3).pack(sender, force_mavlink1=True)
        attitude = mavlink.MAVLink_attitude_message(1000 + 100 * number, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        data += attitude.pack(sender, force_mavlink1=True)
    (tmp_path / "mav.tlog.raw").write_bytes(data)
    result = shoal_import(tmp_path / "mav.tlog.raw", tmp_path / "out")
    assert result.exit_code != 0
    assert "MAVLink frames without times, as in a .tlog.raw of MAVProxy" in result.output
    assert not (tmp_path / "out").exists()


def test_an_import_that_loses_most_of_its_file_is_no_success(tmp_path):
    whole = REAL.read_bytes()
    (tmp_path / "some.tlog").write_bytes(whole + bytes(40_000))
    assert shoal_import(tmp_path / "some.tlog", tmp_path / "some").exit_code == 0
    (tmp_path / "most.tlog").write_bytes(whole + bytes(100_000))
    result = shoal_import(tmp_path / "most.tlog", tmp_path / "most")
    assert result.exit_code == 1
    assert "most of " in result.output
    assert len(imc.Log(tmp_path / "most")) > 50
