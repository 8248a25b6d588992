"""The logger: the contents of its folders, also after damage to them."""

import gzip
from pathlib import Path
from typing import Any

import pytest

import imc
from imc.lsf import Log
from runtime import Script
from runtime.kernel import ScaledClock
from runtime.testing import simulate
from tasks.transports.logging import Logging
from tests.tasks.transports.logs_of_tests import Listener, Whistle, logs, only_log, read_by_imcpy, unpacked

Op = imc.LoggingControl.Op
VEHICLE = 0x001A
OPERATOR = 0x4001


def ask(at: float, op: Op, name: str = "", **header: Any) -> imc.LoggingControl:
    return imc.LoggingControl(timestamp=at, op=op, name=name, **header)


def test_folder_has_what_a_reader_needs(tmp_path: Path) -> None:
    feed = [
        imc.Voltage(timestamp=1.0, value=24.5, src_ent=200),
        imc.Announce(timestamp=2.0, sys_name="ccu-1", src=OPERATOR, src_ent=3),
        imc.Voltage(timestamp=3.0, value=24.4, src_ent=200),
    ]
    simulate(Logging, feed, seconds=4.0, log_root=tmp_path)
    folder = tmp_path / "lauv-noptilus-1" / "20260101" / "000000"
    names = ["Config.ini", "Data.lsf.gz", "IMC.xml.gz", "Output.txt", "Run.json"]
    assert sorted(path.name for path in folder.iterdir()) == names
    log = Log(folder)
    assert log.schema_source == folder / "IMC.xml.gz"
    assert log.schema == imc.builtin()
    assert log.losses == []
    messages = list(log)
    assert [type(message) for message in (messages[0], messages[-1])] == [imc.LoggingControl] * 2
    assert (messages[0].op, messages[0].name, messages[0].src) == (Op.STARTED, "20260101/000000", VEHICLE)
    assert (messages[-1].op, messages[-1].name) == (Op.STOPPED, "20260101/000000")
    assert [message.value for message in messages if isinstance(message, imc.Voltage)] == pytest.approx([24.5, 24.4])
    assert [m.sys_name for m in messages if isinstance(m, imc.Announce)] == ["lauv-noptilus-1", "ccu-1"]
    assert [m.timestamp for m in messages] == sorted(m.timestamp for m in messages)
    assert len(read_by_imcpy(unpacked(log))) == len(messages)


def test_entities_that_speak_are_named_in_the_log(tmp_path: Path) -> None:
    run = simulate([Logging, Whistle, Listener], seconds=2.0, log_root=tmp_path)
    messages = list(only_log(tmp_path))
    named = {m.src_ent: m.label for m in messages if isinstance(m, imc.EntityInfo) and m.src == VEHICLE}
    assert set(named.values()) == {"Daemon", "Logging", "Whistle"}
    speakers = {message.src_ent for message in messages if message.src == VEHICLE}
    assert speakers == set(named)
    assert len(run.of(imc.QueryEntityInfo)) == len(named)


def test_equal_runs_make_equal_files(tmp_path: Path) -> None:
    for _ in range(2):
        simulate([Logging, Whistle], seconds=12.0, seed=3, log_root=tmp_path)
    one, two = logs(tmp_path)
    assert (one.name, two.name) == ("000000", "000000_2")
    for name in ("Data.lsf.gz", "IMC.xml.gz", "Config.ini", "Output.txt"):
        assert (one / name).read_bytes() == (two / name).read_bytes()


def test_a_silent_task_leaves_no_trace(tmp_path: Path) -> None:
    simulate([Logging, Whistle], seconds=3.0, log_root=tmp_path / "without")
    simulate([Logging, Whistle, Listener], seconds=3.0, log_root=tmp_path / "with")
    assert only_log(tmp_path / "with").path.read_bytes() == only_log(tmp_path / "without").path.read_bytes()


def test_requests_start_stop_and_name_logs(tmp_path: Path) -> None:
    feed = [
        ask(1.0, Op.REQUEST_CURRENT_NAME, src=OPERATOR, src_ent=7, dst=VEHICLE),
        ask(2.0, Op.REQUEST_START, "my plan"),
        imc.Voltage(timestamp=2.5),
        ask(3.0, Op.REQUEST_START, "other", src=0x0015, dst=0xFFFF),
        ask(3.5, Op.REQUEST_START, "other", src=OPERATOR, dst=0x0015),
        ask(4.0, Op.REQUEST_STOP, src=OPERATOR, dst=0xFFFF),
        imc.Voltage(timestamp=4.5),
        ask(5.0, Op.REQUEST_CURRENT_NAME, src=OPERATOR, dst=VEHICLE),
        ask(6.0, Op.REQUEST_START),
    ]
    run = simulate(Logging, feed, seconds=7.0, log_root=tmp_path)
    names = [folder.name for folder in logs(tmp_path)]
    assert names == ["000000", "000002_my_plan", "000006"]
    for name, folder in zip(names, logs(tmp_path), strict=True):
        found = [(m.op, m.name) for m in Log(folder).messages(imc.LoggingControl) if m.src_ent == run.task.entity.id]
        assert found[0] == (Op.STARTED, f"20260101/{name}")
        assert found[-1] == (Op.STOPPED, f"20260101/{name}")
        assert "EntityInfo" in Log(folder).counts()
    assert Log(logs(tmp_path)[1]).counts()["Voltage"] == 1
    replies = [m for m in run.of(imc.LoggingControl) if m.op == Op.CURRENT_NAME]
    assert [(m.name, m.dst, m.dst_ent) for m in replies] == [("20260101/000000", OPERATOR, 7), ("", OPERATOR, 255)]
    said = [(m.op, m.name) for m in run.of(imc.LoggingControl) if m.op in (Op.STARTED, Op.STOPPED)]
    assert said[1:3] == [(Op.STOPPED, "20260101/000000"), (Op.STARTED, "20260101/000002_my_plan")]


@pytest.mark.parametrize(
    "label", ["../../../etc", "/etc/passwd", "..", "a\\b", "x\0y", "\udcff", "é" * 300, "a\nb", "CON:"]
)
def test_labels_stay_inside_the_folder(tmp_path: Path, label: str) -> None:
    root = tmp_path / "root"
    simulate(Logging, [ask(1.0, Op.REQUEST_START, label)], seconds=2.0, log_root=root)
    folders = logs(root)
    assert len(folders) == 2
    assert all(len(Log(folder)) > 2 for folder in folders)
    assert list(tmp_path.iterdir()) == [root]


def test_only_the_wanted_types(tmp_path: Path) -> None:
    feed = [imc.Voltage(timestamp=1.0), imc.Current(timestamp=1.0), imc.Unknown(timestamp=1.0, id=9999)]
    run = simulate(Logging, feed, seconds=2.0, log_root=tmp_path, transports=["Voltage", "Volt", "Rpm"])
    assert set(only_log(tmp_path).counts()) == {"LoggingControl", "EntityInfo", "Announce", "Voltage"}
    assert "Transports: no such message: Volt" in run.log


def test_pictures_that_consoles_ask_for_fill_no_disk(tmp_path: Path) -> None:
    feed = [imc.CompressedImage(timestamp=1.0, data=bytes(1000)), imc.Voltage(timestamp=1.0)]
    for name, options, count in (
        ("usual", {}, 0),
        ("all", {"unrecorded_messages": []}, 1),
        ("named", {"transports": ["CompressedImage"]}, 1),
    ):
        simulate(Logging, feed, seconds=2.0, log_root=tmp_path / name, **options)
        assert only_log(tmp_path / name).counts().get("CompressedImage", 0) == count


def test_unknown_messages_are_recorded_as_they_came(tmp_path: Path) -> None:
    packet = imc.encode(imc.Unknown(timestamp=1.0, src=VEHICLE, id=9999, payload=b"abc"))
    simulate(Logging, [imc.decode(packet)], seconds=2.0, log_root=tmp_path)
    assert unpacked(only_log(tmp_path)).count(packet[20:23]) == 1


@pytest.mark.parametrize(("method", "suffix"), [("none", ""), ("gzip", ".gz"), ("zlib", ".z"), ("bzip2", ".bz2")])
def test_compression_methods(tmp_path: Path, method: str, suffix: str) -> None:
    simulate([(Logging, {"lsf_compression_method": method}), Whistle], seconds=2.0, log_root=tmp_path)
    log = only_log(tmp_path)
    assert log.path.name == f"Data.lsf{suffix}"
    assert log.counts()["Temperature"] == 20


def test_volumes_of_a_size(tmp_path: Path) -> None:
    sample = imc.DevDataBinary(value=bytes(50_000), src_ent=9)
    feed = [sample.replace(timestamp=1.0 + number / 10) for number in range(60)]
    simulate(
        Logging,
        feed,
        seconds=8.0,
        log_root=tmp_path,
        lsf_compression_method="none",
        lsf_volume_size=1,
        flush_interval=1.0,
    )
    found = [Log(folder) for folder in logs(tmp_path)]
    assert len(found) == 3
    assert sum(log.counts()["DevDataBinary"] for log in found) == 60
    assert all(log.counts()["LoggingControl"] == 2 for log in found)
    assert found[0].path.stat().st_size < 2 << 20


def test_at_any_time_the_log_is_whole_and_lacks_one_interval_at_most(tmp_path: Path) -> None:
    seen: list[float] = []

    async def look(script: Script) -> None:
        await script.sleep(0.05)
        for _ in range(40):
            await script.sleep(0.25)
            log = only_log(tmp_path)
            times = [message.timestamp for message in log.messages(imc.Temperature)]
            assert log.losses == []
            gzip.decompress(log.path.read_bytes())
            seen.append(script.now - max(times, default=script.now - 0.3))

    simulate([(Logging, {"flush_interval": 2.0}), Whistle], seconds=11.0, log_root=tmp_path, script=look)
    assert len(seen) == 40
    assert max(seen) <= 2.2


def test_console_log(tmp_path: Path) -> None:
    feed = [
        imc.LogBookEntry(timestamp=1.25, type=1, context="Sensors.GPS", text="no fix\nfor long"),
        imc.LogBookEntry(timestamp=1.5, type=99, context="X", text="odd"),
        imc.LogBookEntry(timestamp=1.5, type=0, context="Y", text="not ours", src=0x0015),
    ]
    simulate(Logging, feed, seconds=2.0, log_root=tmp_path)
    assert (logs(tmp_path)[0] / "Output.txt").read_text().splitlines() == [
        "2026-01-01T00:00:01.250Z WARNING  [Sensors.GPS] no fix for long",
        "2026-01-01T00:00:01.500Z 99       [X] odd",
    ]


def test_on_a_wall_clock(tmp_path: Path) -> None:
    simulate(
        [(Logging, {"flush_interval": 0.5}), Whistle],
        seconds=5.0,
        log_root=tmp_path,
        clock=ScaledClock(10.0),
        keep_going=True,
    )
    log = only_log(tmp_path)
    names = [message.name for message in log.messages(imc.LoggingControl)]
    assert names == [f"{log.path.parent.parent.name}/{log.path.parent.name}"] * 2
    assert log.counts()["Temperature"] > 0
