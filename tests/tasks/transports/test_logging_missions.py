"""The logger on the vehicles of Shoal: each log can be read alone, and no trouble of the disk ends a plan."""

import os
import sqlite3
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

import imc
from runtime import Task
from runtime.logs import logs_of_run
from runtime.profile import load_profile
from runtime.snapshot import InputJournals, run_with_snapshots, save_beside_log
from runtime.testing import simulate
from runtime.vehicle import Vehicle
from shoal.missions import Mission, Report, fly, parse_plan, prepare
from tasks.plan.db import DB
from tasks.transports import logging
from tests.outside import TOO_LARGE, largest_file

Op = imc.LoggingControl.Op
Phase = imc.PlanControlState.State
OPERATOR = 0x4001
HEAD = "plan: test\norigin: 41.185°, -8.7062°\nspeed: 1.2 m/s\nmaneuvers:\n"
FLOATING = parse_plan(HEAD + "  - goto: {north: 15, depth: 0}\n")
FLYING = parse_plan(HEAD + "  - takeoff: {altitude: 5, speed: 2 m/s}\n  - land: {north: 0}\n")
PROFILES = ("lauv-noptilus-1", "otter", "caravel", "hexa-00")
LIGHT = {"lauv-noptilus-1": ("Simulators.MUGDetectionCamera:Enabled=Never",)}
FULL, EMPTY = 4.0, 12.0  # s: the disk is full meanwhile; the plan starts at about 5 s


def flown(profile: str, root: Path, prepared: Callable[[Vehicle], object] = id, *overrides: str) -> Report:
    vehicle = prepare(
        profile, overrides=[*LIGHT.get(profile, ()), *overrides], log_root=root / "log", state_folder=root / "db"
    ).vehicle
    prepared(vehicle)
    return Mission(vehicle, FLYING if profile == "hexa-00" else FLOATING).fly(200.0)


def logs(root: Path) -> list[imc.Log]:
    """The logs of the one run."""
    first = next(root.glob("log/*/*/*"))
    return [imc.Log(folder) for folder in logs_of_run(first)]


def counts(root: Path) -> Counter[str]:
    return sum((Counter(log.counts()) for log in logs(root)), Counter[str]())


def texts(root: Path) -> list[str]:
    entries = [entry for log in logs(root) for entry in log.messages("LogBookEntry")]
    return [entry.text for entry in entries if isinstance(entry, imc.LogBookEntry)]


def full_meanwhile(limit: Callable[[int | None], None], since: float = FULL) -> Callable[[Vehicle], None]:
    """Let the disk take no byte more, and later all again."""

    def prepared(vehicle: Vehicle) -> None:
        begin = vehicle.kernel.now_ns
        vehicle.kernel.at(begin + round(since * 1e9), partial(limit, 0))
        vehicle.kernel.at(begin + round(EMPTY * 1e9), partial(limit, None))

    return prepared


@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter", "caravel"])
def test_a_full_disk_ends_no_plan_and_loses_nothing(tmp_path: Path, profile: str) -> None:
    with largest_file() as limit:
        report = flown(profile, tmp_path, full_meanwhile(limit))
    assert report.completed, report.reason
    assert flown(profile, tmp_path / "undisturbed").completed
    found, expected = counts(tmp_path), counts(tmp_path / "undisturbed")
    for kind in (imc.SimulatedState, imc.EstimatedState, imc.PlanControlState, imc.PlanSpecification):
        assert found[kind.__name__] == expected[kind.__name__] > 0
    assert all(log.losses == [] for log in logs(tmp_path))
    assert any(f"cannot be recorded: {TOO_LARGE}" in text for text in texts(tmp_path))
    assert any("messages are recorded again; 0 were lost" in text for text in texts(tmp_path))


@pytest.mark.heavy
def test_what_could_not_be_held_is_counted_in_the_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logging, "LONGEST_BACKLOG", 1 << 16)
    with largest_file() as limit:
        assert flown("lauv-noptilus-1", tmp_path, full_meanwhile(limit)).completed
    assert flown("lauv-noptilus-1", tmp_path / "undisturbed").completed
    said = next(text for text in texts(tmp_path) if "recorded again" in text)
    lost = int(said.partition("again; ")[2].split()[0])
    missing = counts(tmp_path / "undisturbed").total() - counts(tmp_path).total()
    assert ", from 2026-01-01T00:00:" in said
    # Each log asks for names once, and the log book has more entries: a few messages more or less.
    assert lost > 1000
    assert abs(lost - missing) < 100


def test_a_profile_can_say_that_a_vehicle_that_cannot_record_ends_its_plan(tmp_path: Path) -> None:
    usual = load_profile("lauv-noptilus-1").config.value("Monitors.Entities", "Default Monitoring")
    with largest_file() as limit:
        monitored = f"Monitors.Entities:Default Monitoring={usual}, Logger"
        report = flown("lauv-noptilus-1", tmp_path, full_meanwhile(limit, 8.0), monitored)
    assert not report.completed
    assert "Logger" in report.reason


@pytest.mark.parametrize("profile", PROFILES)
def test_a_vehicle_without_a_logger_flies(tmp_path: Path, profile: str) -> None:
    report = flown(profile, tmp_path, id, "Transports.Logging:Enabled=Never")
    assert report.completed, report.reason
    assert not (tmp_path / "log").exists()


@pytest.mark.parametrize(("profile", "kind"), [*zip(PROFILES, ("UUV", "USV", "USV", "UAV"), strict=True)])
def test_every_log_stands_alone(tmp_path: Path, profile: str, kind: str) -> None:
    assert flown(profile, tmp_path).completed
    found = logs(tmp_path)
    assert [log.path.parent.name.partition("_")[2] for log in found] == ["", "test", ""]
    for log in found:
        messages = list(log)
        names = {path.name for path in log.path.parent.iterdir()}
        assert {"IMC.xml.gz", "Config.ini", "Output.txt"} <= names
        own = next(m for m in messages if isinstance(m, imc.Announce))
        assert (own.sys_name, own.sys_type, own.src) == (profile, imc.SystemType[kind], messages[0].src)
        assert log.systems[own.src] == profile
        labels = {m.src_ent for m in messages if isinstance(m, imc.EntityInfo)}
        assert {m.src_ent for m in messages} == labels
    plan = list(found[1])
    specification = next(i for i, m in enumerate(plan) if isinstance(m, imc.PlanSpecification))
    states = [(i, m) for i, m in enumerate(plan) if isinstance(m, imc.PlanControlState)]
    assert specification < states[0][0]
    last = states[-1][1]
    assert (last.state, last.last_outcome) == (Phase.READY, imc.PlanControlState.LastOutcome.SUCCESS)
    assert [m.info for m in plan if isinstance(m, imc.PlanControl)][-1] == "plan completed"
    place = imc.Log(found[1].path)["Announce"][-1]
    assert (place["lat"], place["lon"]) == pytest.approx((0.71881, -0.15195), abs=1e-4)


def test_a_log_that_an_operator_begins_in_the_middle_of_a_plan_has_the_plan(tmp_path: Path) -> None:
    request = imc.LoggingControl(op=Op.REQUEST_START, name="look")

    def prepared(vehicle: Vehicle) -> None:
        packet = imc.encode_with_header(request, vehicle.start_time, OPERATOR, 3, vehicle.system, 0xFF)
        vehicle.kernel.after(9.0, vehicle.bus.deliver_and_send, imc.decode(packet), packet, None)

    assert flown("lauv-noptilus-1", tmp_path, prepared).completed
    found = {log.path.parent.name.partition("_")[2]: log for log in logs(tmp_path)}
    (again,) = found["look"].messages("PlanSpecification")
    (first,) = found["test"].messages("PlanSpecification")
    assert isinstance(again, imc.PlanSpecification)
    assert isinstance(first, imc.PlanSpecification)
    assert again.maneuvers == first.maneuvers
    assert "PlanSpecification" not in logs(tmp_path)[-1].counts()


@pytest.mark.heavy
def test_a_thousand_requests_make_few_logs_and_lose_nothing(tmp_path: Path) -> None:
    def prepared(vehicle: Vehicle) -> None:
        for number in range(1000):
            request = imc.LoggingControl(op=Op.REQUEST_START, name=f"n{number}")
            packet = imc.encode_with_header(request, vehicle.start_time, OPERATOR, 3, vehicle.system, 0xFF)
            vehicle.kernel.after(2.0 + number / 1000, vehicle.bus.deliver_and_send, imc.decode(packet), packet, None)

    assert flown("lauv-noptilus-1", tmp_path, prepared).completed
    assert flown("lauv-noptilus-1", tmp_path / "undisturbed").completed
    assert len(logs(tmp_path)) == 1 + logging.MOST_LOGS
    assert sum("the next log begins later" in text for text in texts(tmp_path)) == 1
    assert counts(tmp_path)["LoggingControl"] >= 1000
    assert counts(tmp_path)["SimulatedState"] == counts(tmp_path / "undisturbed")["SimulatedState"]


def test_a_postponed_log_begins_with_the_label_of_the_last_request_and_the_plan(tmp_path: Path) -> None:
    feed = [imc.LoggingControl(timestamp=1.0 + n / 100, op=Op.REQUEST_START, name=f"n{n}") for n in range(20)]
    plan = imc.PlanSpecification(timestamp=3.0, plan_id="p", src_ent=77)
    going = imc.PlanControlState(timestamp=3.0, state=Phase.EXECUTING, src_ent=77)
    simulate(logging.Logging, [*feed, plan, going], seconds=70.0, log_root=tmp_path)
    last = sorted(tmp_path.glob("*/*/*"))[-1]
    assert last.name == "000105_n19"
    assert imc.Log(last).counts()["PlanSpecification"] == 1


def test_a_folder_that_cannot_be_made_is_reported_without_a_traceback(tmp_path: Path) -> None:
    (tmp_path / "log").write_text("in the way")
    assert flown("lauv-noptilus-1", tmp_path).completed


def test_plans_are_kept_in_memory_where_no_file_can_be_made(tmp_path: Path) -> None:
    (tmp_path / "db").write_text("in the way")
    plan = imc.PlanSpecification(plan_id="p")
    overrides = ["Plan.DB:Storage=File"]
    vehicle = prepare("otter", overrides=overrides, log_root=tmp_path / "log", state_folder=tmp_path / "db").vehicle
    answers: list[imc.PlanDB] = []
    vehicle.observe(imc.PlanDB, answers.append)
    try:
        vehicle.start()
        for op in (imc.PlanDB.Op.SET, imc.PlanDB.Op.GET):
            packet = imc.encode_with_header(
                imc.PlanDB(op=op, plan_id="p", arg=plan), 1.0, OPERATOR, 3, vehicle.system, 0xFF
            )
            vehicle.kernel.after(2.0, vehicle.bus.deliver_and_send, imc.decode(packet), packet, None)
        vehicle.run(4.0)
        state = vehicle.task("Plan.DB").entity
        assert (state.state, state.description.partition(":")[0]) == (
            imc.EntityState.State.FAULT,
            "plans are kept in memory only",
        )
    finally:
        vehicle.close()
    got = [a for a in answers if a.op == imc.PlanDB.Op.GET and a.type == imc.PlanDB.Type.SUCCESS]
    assert isinstance(got[0].arg, imc.PlanSpecification)


def test_a_plan_database_that_is_full_refuses_and_goes_on(tmp_path: Path) -> None:
    def full(*_: object) -> None:
        raise sqlite3.OperationalError("database or disk is full")

    request = imc.PlanDB(
        timestamp=1.0, op=imc.PlanDB.Op.SET, plan_id="p", arg=imc.PlanSpecification(plan_id="p"), src=OPERATOR, dst=26
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tasks.plan.store.PlanStore.set", full)
        run = simulate(DB, [request], seconds=2.0)
    assert [m.info for m in run.of(imc.PlanDB) if m.type == imc.PlanDB.Type.FAILURE] == [
        "database: database or disk is full"
    ]


def test_a_run_on_a_disk_of_its_own_that_is_full_from_the_start(tmp_path: Path) -> None:
    """Nothing is written, the plan is flown, and the run says at its end what is missing."""
    seen: list[str] = []

    def prepared(vehicle: Vehicle) -> None:
        vehicle.observe(imc.LogBookEntry, lambda entry: seen.append(entry.text))

    with largest_file(0):
        assert flown("otter", tmp_path, prepared).completed
    assert any("MiB of messages are not on the disk" in text for text in seen)
    assert not list(tmp_path.glob("log/*/*/*/Data*"))


def test_fly_without_a_log_root_leaves_no_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert fly(FLOATING, "otter").completed
    assert os.listdir(tmp_path) == []


class Hoarder(Task):
    """A user's task that happens to have a folder of its own."""

    def start(self) -> None:
        self.folder = Path("elsewhere")


@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter"])
def test_snapshots_are_beside_the_log_whatever_attributes_tasks_have(tmp_path: Path, profile: str) -> None:
    vehicle = prepare(profile, overrides=LIGHT.get(profile, ()), log_root=tmp_path, state_folder=tmp_path).vehicle
    vehicle.add(Hoarder, "A.Hoarder")
    InputJournals(vehicle)
    vehicle.start()
    try:
        assert run_with_snapshots(vehicle, 3.0, 2.0, partial(save_beside_log, vehicle)) == []
    finally:
        vehicle.close()
    assert [path.name for path in tmp_path.glob(f"{profile}/*/*/State*")] == ["State-2.msgpack"]


def test_a_full_disk_leaves_out_a_snapshot_and_the_plan_goes_on(tmp_path: Path) -> None:
    vehicle = prepare("otter", log_root=tmp_path, state_folder=tmp_path).vehicle
    with largest_file() as limit:

        def watch(beat: imc.Heartbeat) -> None:
            limit(0 if FULL <= beat.timestamp - vehicle.start_time < EMPTY else None)

        vehicle.observe(imc.Heartbeat, watch)
        mission = Mission(vehicle, FLOATING)
        assert mission.fly(200.0, snapshot_every=5.0).completed
    assert [error.strerror for error in mission.unsaved] == [TOO_LARGE, TOO_LARGE]
    assert [path.name for path in tmp_path.rglob("State*")] == ["State-15.msgpack"]


def test_a_disk_that_is_full_from_the_start_leaves_out_all_snapshots_and_the_plan_goes_on(tmp_path: Path) -> None:
    (tmp_path / "log").write_text("where the folder of the logs would be")
    vehicle = prepare("otter", log_root=tmp_path / "log", state_folder=tmp_path).vehicle
    mission = Mission(vehicle, FLOATING)
    assert mission.fly(200.0, snapshot_every=5.0).completed
    assert {error.strerror for error in mission.unsaved} == {"there is no log folder to keep it in"}
