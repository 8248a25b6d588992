"""Replay: the messages of a log return at their times, and none is mistaken for another."""

from pathlib import Path
from typing import Any

import pytest

import imc
from imc.lsf import Log, LsfWriter
from runtime import State, Task, consume
from runtime.testing import START, simulate
from tasks.transports.logging import Logging
from tasks.transports.replay import Replay
from tasks.transports.replayed_log import Timeline

LOGS = Path(__file__).parents[2] / "data" / "logs"
DEFINITIONS = Path(imc.__file__).parent / "definitions"
Op = imc.ReplayControl.Op
LOGGED = 0x001A
OTHER: dict[str, Any] = {"system": "lauv-other", "system_id": 0x0015}
T0 = 1.7e9


class Ear(Task):
    """Records messages of other systems, and when they came."""

    def start(self) -> None:
        self.heard: list[tuple[float, bytes]] = []

    @consume(others=True, packets=True)
    def hear(self, message: imc.Message, packet: bytes) -> None:
        if message.src != self.system:
            self.heard.append((self.now - START, packet))


def write_log(folder: Path, *messages: imc.Message | bytes, schema: imc.Schema | None = None) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    writer = LsfWriter(folder / "Data.lsf", "none")
    for message in messages:
        if isinstance(message, bytes):
            writer.write(message)
        else:
            writer.write(schema.encode(message) if schema else imc.encode(message))
    writer.close()
    if schema is not None:
        (folder / "IMC.xml").write_bytes(imc.dump(schema))
    return folder


def at(time: float, kind: type[imc.Message] = imc.Heartbeat, **values: Any) -> imc.Message:
    """A message of the logged vehicle, `time` seconds into its log."""
    return kind(**{"src": LOGGED, "src_ent": 5, "timestamp": T0 + time, **values})


def begin(time: float = 0.0) -> imc.Message:
    return at(time, imc.LoggingControl, op=imc.LoggingControl.Op.STARTED, name="20231114/221320")


def play(
    path: Path | str, feed: Any = (), *, seconds: float = 10.0, log_root: Path | None = None, **values: Any
) -> Any:
    tasks = [(Replay, {"load_at_start": str(path), **values}), Ear]
    run = simulate(tasks, feed, seconds=seconds, log_root=log_root, **OTHER)
    run.heard = run.tasks[1].heard
    return run


def last_state(run: Any) -> tuple[State, str]:
    return run.task.entity.state, run.task.entity.description


def test_log_of_dune_comes_back_packet_by_packet() -> None:
    run = play(LOGS / "dune-idle")
    packets = [packet for _, packet in Log(LOGS / "dune-idle").packets()]
    assert [packet for _, packet in run.heard] == packets
    times, latest = [], 0.0
    first = imc.header(packets[0])
    for packet in packets:
        header = imc.header(packet)
        if header.src == first.src:
            latest = max(latest, header.timestamp - first.timestamp)
        times.append(latest)
    assert [time for time, _ in run.heard] == pytest.approx(times, abs=1e-4)
    assert last_state(run) == (State.NORMAL, "finished")
    assert "played 6647 packets, skipped 0" in run.log


def test_own_log_replayed_and_recorded_again(tmp_path: Path) -> None:
    simulate(Logging, [imc.Voltage(timestamp=0.5 * n, value=n, src_ent=9) for n in range(20)], log_root=tmp_path)
    (folder,) = tmp_path.glob("*/*/*")
    before = [packet for _, packet in Log(folder).packets()]
    simulate([(Replay, {"load_at_start": str(folder)}), Logging], seconds=20.0, log_root=tmp_path, **OTHER)
    (again,) = tmp_path.glob("lauv-other/*/*")
    after = [packet for _, packet in Log(again).packets() if imc.header(packet).src == LOGGED]
    assert after == before


def test_damage_is_passed_and_reported(tmp_path: Path) -> None:
    good = [imc.encode(begin()), *(imc.encode(at(n / 10, imc.Voltage, value=n)) for n in range(20))]
    parts = [*good[:5], b"\x54\xfe garbage", *good[5:12], good[12][:9], *good[12:]]
    run = play(write_log(tmp_path, *parts))
    assert [packet for _, packet in run.heard] == good
    assert last_state(run) == (State.NORMAL, "finished, 2 damaged places")
    assert any(text.startswith("2 damaged places in Data.lsf: ") and "(9 bytes)" in text for text in run.log)


def test_steps_back_do_not_change_the_order(tmp_path: Path) -> None:
    times = [0.0, 1.0, 0.5, 2.0, 1.9, 1.0, 3.0]
    run = play(write_log(tmp_path, *(at(time) for time in times)))
    assert [time for time, _ in run.heard] == [0.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0]
    assert [imc.header(packet).timestamp - T0 for _, packet in run.heard] == pytest.approx(times)


def test_other_systems_have_other_clocks(tmp_path: Path) -> None:
    messages = [begin(), at(1.0), at(500.0, src=0x0030), at(-900.0, src=0x0031), at(2.0)]
    run = play(write_log(tmp_path, *messages))
    assert [time for time, _ in run.heard] == [0.0, 1.0, 1.0, 1.0, 2.0]


def test_times_that_are_astray_cost_no_time(tmp_path: Path) -> None:
    run = play(write_log(tmp_path, begin(), at(1.0), at(1e8), at(-1e8), at(-30.0), at(float("nan")), at(2.0)))
    assert [time for time, _ in run.heard] == [0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0]


@pytest.mark.parametrize("step", [1e8, -1e8, -60.0])
def test_a_step_of_the_clock_costs_no_time(step: float) -> None:
    timeline = Timeline(3600.0)
    before = [timeline.advance_to_packet(T0 + n / 10) for n in range(20)]
    assert before == pytest.approx([n / 10 for n in range(20)])
    after = [timeline.advance_to_packet(T0 + step + n / 10) for n in range(20, 60)]
    assert timeline.steps == 1
    assert after[0] == before[-1]
    assert after[-1] == pytest.approx(after[0] + 2.0)
    assert after == sorted(after)


def test_timeline_without_times() -> None:
    timeline = Timeline(10.0)
    assert [timeline.advance_to_packet(time) for time in (float("inf"), 5.0, 8.0, -1e300, 1e300)] == [
        0.0,
        0.0,
        3.0,
        3.0,
        3.0,
    ]


def test_message_that_is_another_one_here_is_left_out_and_reported(tmp_path: Path) -> None:
    schema = imc.load(DEFINITIONS / "imc-5.4.31.yaml")
    gpio, heartbeat, batch = (schema[name] for name in ("GpioStateGet", "Heartbeat", "MsgList"))
    assert gpio.ID == imc.EstimatedMugState.ID
    messages = [
        at(0.0, heartbeat),
        at(0.1, gpio, name="a"),
        at(0.2, batch, msgs=(heartbeat(), gpio(name="b"))),
        at(0.3, batch, msgs=(heartbeat(),)),
        at(0.4, gpio, name="c"),
    ]
    run = play(write_log(tmp_path, *messages, schema=schema))
    assert [packet for _, packet in run.heard] == [schema.encode(messages[0]), schema.encode(messages[3])]
    assert "2 packets not played: GpioStateGet (2001, here EstimatedMugState)" in run.log
    assert "1 packets not played: MsgList with GpioStateGet (2001, here EstimatedMugState)" in run.log
    assert "played 2 packets, skipped 3" in run.log


def test_unknown_message_stays_opaque(tmp_path: Path) -> None:
    packet = imc.encode(imc.Unknown(timestamp=T0, src=LOGGED, id=9999, payload=b"abc"))
    short = imc.encode(imc.Unknown(timestamp=T0, src=LOGGED, id=imc.Rpm.ID, payload=b"a"))
    run = play(write_log(tmp_path, packet, short))
    assert [packet for _, packet in run.heard] == [packet]
    assert type(run.of(imc.Unknown)[0]) is imc.Unknown
    assert "1 packets not played: malformed" in run.log


def test_some_messages_only(tmp_path: Path) -> None:
    run = play(write_log(tmp_path, at(0.0), at(1.0, imc.Voltage), at(2.0, imc.Rpm)), replay_messages=["Rpm"])
    assert [(time, type(imc.decode(packet))) for time, packet in run.heard] == [(2.0, imc.Rpm)]


def test_entities_are_found_by_their_labels(tmp_path: Path) -> None:
    messages = [
        begin(),
        at(0.1, imc.EntityState, src_ent=5),
        at(0.2, imc.Voltage, src_ent=6),
        at(0.3, imc.Voltage, src_ent=7, dst=LOGGED, dst_ent=6),
        at(0.4, imc.Voltage, src=0x0030, src_ent=6),
        at(0.5, imc.EntityInfo, src_ent=6, id=6, label="Batteries"),
        at(0.5, imc.EntityInfo, src_ent=5, id=5, label="GPS"),
    ]
    values: dict[str, Any] = {"entities": ["GPS", "Batteries", "Sonar"], "replay_messages": ["Voltage"]}
    run = play(write_log(tmp_path, *messages), **values)
    gps, batteries = (run.vehicle.entities.find(label).id for label in ("GPS", "Batteries"))
    heard = [imc.decode(packet) for _, packet in run.heard]
    assert [(type(m).__name__, m.src, m.src_ent, m.dst_ent) for m in heard] == [
        ("EntityState", LOGGED, gps, 255),
        ("Voltage", LOGGED, batteries, 255),
        ("Voltage", LOGGED, 255, batteries),
        ("Voltage", 0x0030, 6, 255),
    ]
    assert "the log has no entity 'Sonar'" in run.log


def test_times_of_the_replay(tmp_path: Path) -> None:
    log = write_log(tmp_path, *(at(time) for time in (0.0, 1.0, 0.5, 4.0, 6.0)))
    run = play(log, keep_time=False, seconds_to_skip=1.0, time_multiplier=2.0)
    assert [time for time, _ in run.heard] == [0.0, 0.0, 1.5, 2.5]
    stamps = [imc.header(packet).timestamp - START for _, packet in run.heard]
    assert stamps == pytest.approx([0.0, -0.25, 1.5, 2.5])


def control(time: float, op: Op, file: str = "", **header: Any) -> imc.ReplayControl:
    return imc.ReplayControl(timestamp=time, op=op, file=file, **header)


def test_control_over_the_bus(tmp_path: Path) -> None:
    write_log(tmp_path / "lauv" / "log", *(at(time) for time in range(10)))
    feed = [
        control(0.5, Op.START, "lauv/log", src=0x0030),
        control(1.0, Op.START, "lauv/log"),
        control(2.5, Op.PAUSE),
        control(2.6, Op.PAUSE),
        control(4.5, Op.RESUME, src=0x4001, dst=0xFFFF),
        control(6.5, Op.STOP, src=0x4001, dst=OTHER["system_id"]),
    ]
    run = play("", feed, log_root=tmp_path)
    assert [time for time, packet in run.heard if imc.header(packet).src == LOGGED] == [1.0, 2.0, 5.0, 6.0]
    assert last_state(run) == (State.NORMAL, "stopped")


@pytest.mark.parametrize("file", ["../secret", "/etc/passwd", "lauv/../../secret"])
def test_control_does_not_leave_the_log_folder(tmp_path: Path, file: str) -> None:
    write_log(tmp_path / "secret", at(0.0))
    run = play("", [control(1.0, Op.START, file)], log_root=tmp_path / "root", seconds=3.0)
    assert run.heard == []
    assert any("is not in the log folder" in text for text in run.log)


def test_starting_again_begins_anew(tmp_path: Path) -> None:
    write_log(tmp_path / "log", *(at(time) for time in range(4)))
    feed = [control(1.0, Op.START, "log"), control(2.5, Op.START, "log")]
    run = play("", feed, log_root=tmp_path)
    assert [time for time, _ in run.heard] == [1.0, 2.0, 2.5, 3.5, 4.5, 5.5]


def test_end_of_the_log_ends_the_vehicle(tmp_path: Path) -> None:
    run = play(write_log(tmp_path, at(0.0), at(3.0)), exit_at_end=True, seconds=100.0)
    assert run.vehicle.kernel.now_ns == (START + 3) * 1_000_000_000
    assert run.vehicle.exit_status == 0


@pytest.mark.parametrize("content", [None, b"not xml <"])
def test_what_cannot_be_played_is_reported(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "missing"
    if content is not None:
        path = write_log(tmp_path / "bad", at(0.0))
        (path / "IMC.xml").write_bytes(content)
    run = play(path, exit_at_end=True, seconds=5.0)
    assert last_state(run)[0] == State.FAILURE
    assert str(path) in last_state(run)[1]
    assert run.vehicle.exit_status == 1


def test_empty_log_is_finished_at_once(tmp_path: Path) -> None:
    run = play(write_log(tmp_path))
    assert last_state(run) == (State.NORMAL, "finished")
