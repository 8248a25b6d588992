"""Logs where disks, folders and processes fail."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import imc
from runtime import Script, State
from runtime.kernel import WallClock
from runtime.testing import simulate
from tasks.transports.log_series import LogSeries
from tasks.transports.logging import Logging
from tests.outside import NO_FILE, largest_file
from tests.tasks.transports.logs_of_tests import Whistle, only_log, read_by_imcpy, unpacked


def states(run: Any) -> list[tuple[State, str]]:
    found = [(State(m.state), m.description) for m in run.of(imc.EntityState) if m.src_ent == run.task.entity.id]
    return [state for index, state in enumerate(found) if index == 0 or state != found[index - 1]]


def disturb(change: Callable[[], object], repair: Callable[[], object]) -> Callable[[Script], Any]:
    async def disturbance(script: Script) -> None:
        await script.sleep(5.5)
        change()
        await script.sleep(10.0)
        repair()

    return disturbance


def test_full_disk_is_reported_survived_and_forgotten(tmp_path: Path) -> None:
    with largest_file() as limit:
        run = simulate(
            [(Logging, {"flush_interval": 1.0}), Whistle],
            seconds=20.0,
            log_root=tmp_path,
            script=disturb(lambda: limit(only_log(tmp_path).path.stat().st_size + 50), lambda: limit(None)),
        )
    assert [state for state, _ in states(run)] == [State.NORMAL, State.FAILURE, State.NORMAL]
    assert "too large" in states(run)[1][1]
    log = only_log(tmp_path)
    assert log.counts()["Temperature"] == 200
    assert log.losses == []
    assert any("recorded again; 0 were lost" in text for text in run.log)


def test_no_folder_can_be_made(tmp_path: Path) -> None:
    root = tmp_path / "root"
    root.write_text("in the way")
    run = simulate(
        [(Logging, {"flush_interval": 1.0}), Whistle],
        seconds=20.0,
        log_root=root,
        script=disturb(lambda: None, root.unlink),
    )
    assert [state for state, _ in states(run)] == [State.FAILURE, State.NORMAL]
    assert str(root) in states(run)[0][1]
    log = only_log(root)
    assert log.path.parent.name == "000000"
    assert log.counts()["Temperature"] == 200
    assert any("recorded again; 0 were lost" in text for text in run.log)


def without_folders(disk: Path) -> None:
    """A place that is there, in which the system answers to each new folder that there is no such file."""
    if sys.platform != "linux":
        pytest.skip("needs /proc")
    disk.symlink_to("/proc")


def test_no_folder_can_be_made_where_no_such_file_is_the_answer(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    without_folders(disk)
    run = simulate(
        [(Logging, {"flush_interval": 1.0}), Whistle],
        seconds=20.0,
        log_root=disk / "log",
        script=disturb(lambda: None, disk.unlink),
    )
    assert [state for state, _ in states(run)] == [State.FAILURE, State.NORMAL]
    assert NO_FILE in states(run)[0][1]
    assert only_log(disk / "log").counts()["Temperature"] == 200
    assert any("recorded again; 0 were lost" in text for text in run.log)


def test_a_log_that_has_ended_and_waits_for_its_folder_is_not_given_up(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    without_folders(disk)
    series = LogSeries(disk / "vehicle", lambda _: None)
    series.begin("20260101/000000", "none", {}).data.write(imc.encode(imc.Temperature(value=4.0)))
    series.end()
    with pytest.raises(FileNotFoundError):
        series.flush()
    disk.unlink()
    series.flush()
    assert imc.Log(disk / "vehicle" / "20260101" / "000000").counts()["Temperature"] == 1
    assert not series.waiting_logs


def test_folder_that_vanishes_is_followed_by_another(tmp_path: Path) -> None:
    run = simulate(
        [(Logging, {"flush_interval": 1.0}), Whistle],
        seconds=20.0,
        log_root=tmp_path,
        script=disturb(lambda: shutil.rmtree(tmp_path / "lauv-noptilus-1"), lambda: None),
    )
    log = only_log(tmp_path)
    assert log.path.parent.name == "000006"
    assert next(log.messages()).timestamp == pytest.approx(run.vehicle.start_time + 6.0)
    assert State.FAILURE in [state for state, _ in states(run)]
    assert states(run)[-1][0] == State.NORMAL


CHILD = """
import sys
from pathlib import Path
import imc
from runtime import Task, periodic
from runtime.kernel import WallClock
from runtime.testing import simulate
from tasks.transports.logging import Logging

class Counter(Task):
    count = 0

    @periodic(500.0)
    def tick(self):
        self.publish(imc.DevDataText(value=str(self.count)))
        self.count += 1

class Told(Logging):
    def _tick(self):
        flushed = counted.count
        super()._tick()
        print(flushed, flush=True)

class Keeper(Counter):
    def start(self):
        global counted
        counted = self

simulate([(Told, {"flush_interval": 0.1}), Keeper], seconds=60.0, clock=WallClock(), log_root=Path(sys.argv[1]))
"""


def test_killed_process_leaves_a_log_that_others_read(tmp_path: Path) -> None:
    child = subprocess.Popen([sys.executable, "-c", CHILD, tmp_path], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    flushed = 0
    for _ in range(4):
        flushed = int(child.stdout.readline())
    child.send_signal(signal.SIGKILL)
    rest = child.communicate()[0].split()
    flushed = int(rest[-1]) if rest else flushed
    messages = read_by_imcpy(unpacked(only_log(tmp_path)))
    texts = [m.value for m in messages if type(m).__name__ == "DevDataText"]
    assert flushed > 0
    assert texts == [str(number) for number in range(len(texts))]
    # Messages on their way to the logger during a flush are written with the next one.
    assert len(texts) >= flushed - 2


def test_the_folder_of_a_log_and_what_is_beside_its_data_reach_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After a power cut a folder that was not synchronized is missing, with the synchronized data in it."""
    synced: set[Path] = set()
    real = os.fsync

    def fsync(file: int) -> None:
        real(file)
        synced.add(Path(os.readlink(f"/proc/self/fd/{file}")))

    monkeypatch.setattr(os, "fsync", fsync)
    simulate([(Logging, {"flush_interval": 0.1})], seconds=0.8, clock=WallClock(), log_root=tmp_path / "log")
    folder = only_log(tmp_path / "log").path.parent
    assert set(folder.iterdir()) <= synced
    assert {tmp_path, *(parent for parent in (folder / "x").parents if tmp_path in parent.parents)} <= synced
