"""Summaries of a log in one pass, and of a folder of logs."""

import math
from pathlib import Path

import pytest

import imc
from runtime.logs import SystemNames, UnknownNameError, find_message_ids, summarize
from shoal.logs.inspect import logs_below
from tests.log_messages import OPERATOR, OTHER, START, VEHICLE, at, labels

LOGS = Path(__file__).parents[2] / "data" / "logs"


def test_log_of_dune():
    log = imc.Log(LOGS / "dune-idle")
    summary = summarize(log)
    assert {name: tally.count for name, tally in summary.by_type.items()} == log.counts()
    assert summary.packets == 6647
    assert summary.owner == VEHICLE
    assert summary.names.system_name(VEHICLE) == "lauv-noptilus-1"
    assert summary.names.system_name(16384) == "ccu-ref"
    assert summary.duration == pytest.approx(5.03, abs=0.01)
    assert summary.by_type["SimulatedState"].rate == pytest.approx(100.0, rel=0.01)
    assert "AHRS" in summary.names.labels.values()
    assert summary.names.labels[VEHICLE, 0] == "Daemon"
    assert (summary.losses, summary.clock_steps) == ([], [])
    assert summary.unpacked == 320106


def test_rates_sizes_and_speakers(make_log):
    messages = [*labels(Battery=7, GPS=8), *(at(n / 10) for n in range(101)), at(3, src_ent=8)]
    summary = summarize(imc.Log(make_log(messages)))
    voltage = summary.by_type["Voltage"]
    assert (voltage.count, voltage.size) == (102, 102 * 26)
    assert summary.by_entity[VEHICLE, 7].count == 102
    assert summary.names.entity_label(VEHICLE, 8) == "GPS"
    assert summary.names.entity_label(VEHICLE, 9) == "entity 9"
    assert (summary.start, summary.duration) == (START, pytest.approx(10.0))


def test_few_messages_have_no_rate(make_log):
    assert math.isnan(summarize(imc.Log(make_log([at(0), at(0.001), at(0.002)]))).by_type["Voltage"].rate)


def test_damage_has_its_place(make_log):
    packets = [imc.encode(at(n)) for n in range(10)]
    summary = summarize(imc.Log(make_log([*packets[:3], b"garbage", *packets[3:]], compression="none")))
    assert summary.packets == 10
    assert [(loss.offset, loss.length) for loss in summary.losses] == [(3 * 26, 7)]


@pytest.mark.parametrize("leap", [-3600.0, -2.0, 30.0, 1e6])
def test_a_clock_that_is_set_is_one_step(make_log, leap):
    messages = [at(n / 10 + (leap if n >= 500 else 0.0)) for n in range(1000)]
    (step,) = summarize(imc.Log(make_log(messages))).clock_steps
    assert step.offset == 500 * 26
    assert step.after - step.before == pytest.approx(leap + 0.1, abs=0.01)


@pytest.mark.parametrize("stray", [-1e6, 1e6, math.nan, math.inf, -1e300, -START])
def test_a_stray_time_is_no_step_and_does_not_stretch_the_log(make_log, stray):
    messages = [at(stray if n == 300 else n / 10) for n in range(1000)]
    summary = summarize(imc.Log(make_log(messages)))
    assert summary.clock_steps == []
    assert (summary.start, summary.end) == (START, pytest.approx(START + 99.9))
    assert summary.clocks[VEHICLE].outliers == 1


def test_times_that_are_none_at_all(make_log):
    summary = summarize(imc.Log(make_log([at(math.nan)] * 20)))
    assert summary.packets == 20
    assert math.isnan(summary.duration)


def test_both_byte_orders_and_several_systems(make_log):
    packets = [imc.encode(at(n, src=(VEHICLE, OTHER)[n % 3 == 0]), ("little", "big")[n % 2]) for n in range(90)]
    summary = summarize(imc.Log(make_log(packets)))
    assert {src: clock.packets for src, clock in summary.clocks.items()} == {OTHER: 30, VEHICLE: 60}
    assert summary.owner == VEHICLE


def test_a_log_is_of_the_system_whose_logger_has_started_it_whoever_floods_it(make_log):
    started = at(0, imc.LoggingControl, op=imc.LoggingControl.Op.STARTED, name="20260101/000000")
    flood = [imc.QueryEntityInfo(src=OPERATOR, dst=VEHICLE, timestamp=START) for _ in range(50)]
    theirs = at(2, imc.LoggingControl, op=imc.LoggingControl.Op.STARTED, src=OPERATOR)
    summary = summarize(imc.Log(make_log([started, *flood, theirs, *map(at, range(1, 11))])))
    assert summary.owner == VEHICLE
    assert summary.duration == pytest.approx(9.0)


def test_names_are_found_by_case_number_or_nearest():
    names = SystemNames()
    names.learn(imc.Announce(src=OPERATOR, sys_name="ccu-1"))
    names.learn(imc.EntityList(src=VEHICLE, op=imc.EntityList.Op.REPORT, list="GPS=31;Depth Sensor=27;bad;=4;x=999;"))
    assert names.labels == {(VEHICLE, 31): "GPS", (VEHICLE, 27): "Depth Sensor"}
    present = [VEHICLE, OPERATOR]
    assert names.find_system_ids(["CCU-1", "0x1A"], present) == {OPERATOR, VEHICLE}
    assert names.find_entity_ids(["gps", "27"], names.labels) == {(VEHICLE, 31), (VEHICLE, 27)}
    assert find_message_ids(["estimatedstate", "303"], imc.builtin()) == {imc.EstimatedState.ID, 303}
    for call in (
        lambda: names.find_system_ids(["cc-1"], present),
        lambda: names.find_entity_ids(["Depth Sensr"], names.labels),
        lambda: find_message_ids(["EstimatedStat"], imc.builtin()),
    ):
        with pytest.raises(UnknownNameError, match="did you mean"):
            call()


def test_logs_below_a_folder(make_log, tmp_path):
    for compression in ("none", "gzip", "bzip2", "zlib"):
        make_log([at(n) for n in range(1000)], f"v/20260101/{compression}", compression=compression, block=5000)
    make_log([], "v/20260102/empty")
    (tmp_path / "v/20260102/garbage").mkdir()
    (tmp_path / "v/20260102/garbage/Data.lsf").write_bytes(b"nothing" * 100)
    found = logs_below(tmp_path)
    assert [glance.path.parent.name for glance in found] == ["bzip2", "gzip", "none", "zlib", "empty", "garbage"]
    for glance in found[:4]:
        assert (glance.system, glance.start, glance.end) == ("lauv-noptilus-1", START, START + 999.0)
    assert [glance.problem for glance in found] == ["", "", "", "", "empty", "no message in it"]


@pytest.mark.parametrize("compression", ["none", "gzip"])
@pytest.mark.parametrize("count", [0, 1000])
def test_a_log_says_at_a_glance_whose_it_is(make_log, tmp_path, compression, count):
    announces = [
        imc.Announce(timestamp=START, src=src, sys_name=name) for src, name in ((0x4001, "ccu"), (26, "squid"))
    ]
    make_log([at(0), *announces, *(at(n) for n in range(count))], compression=compression, block=5000)
    (glance,) = logs_below(tmp_path)
    assert glance.system == "squid"


def test_a_cut_file_at_a_glance(make_log, tmp_path):
    path = make_log([at(n) for n in range(100_000)], block=20_000) / "Data.lsf.gz"
    path.write_bytes(path.read_bytes()[:-1000])
    (glance,) = logs_below(tmp_path)
    assert 90_000 < glance.end - glance.start < 100_000
