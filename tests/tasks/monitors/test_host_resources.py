"""The figures of the computer."""

import shutil
from collections import namedtuple

import pytest

import imc
from runtime import State, Task, consume
from runtime.testing import simulate
from tasks.monitors import host_resources
from tasks.monitors.host_resources import HostResources, cpu_total_and_idle, innermost_existing_folder

Usage = namedtuple("Usage", "total used free")


class Listener(Task):
    """Keeps what the Daemon's entity publishes."""

    def start(self):
        self.cpu, self.storage = [], []

    @consume
    def note(self, usage: imc.CpuUsage | imc.StorageUsage):
        assert usage.src_ent == self.vehicle.daemon.entity.id
        (self.cpu if isinstance(usage, imc.CpuUsage) else self.storage).append(usage)


def report(tmp_path, **parameters):
    run = simulate([Listener, (HostResources, parameters)], seconds=3.5, log_root=tmp_path / "not" / "there")
    return run.task, run.tasks[1].entity


def test_the_load_and_the_space_on_the_disk_are_reported_as_the_daemons(tmp_path, monkeypatch):
    times = iter([(100.0, 90.0), (100.0, 90.0), (200.0, 150.0), (300.0, 240.0), (400.0, 240.0)])
    monkeypatch.setattr(host_resources, "cpu_total_and_idle", lambda: next(times))
    monkeypatch.setattr(shutil, "disk_usage", lambda path: Usage(100 << 20, 60 << 20, 25 << 20))
    listener, entity = report(tmp_path)
    assert [usage.value for usage in listener.cpu] == [40, 10, 100]
    assert {(usage.value, usage.available) for usage in listener.storage} == {(75, 25)}
    assert (entity.state, entity.description) == (State.NORMAL, "active")


def test_a_full_disk_and_a_busy_processor_are_faults(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: Usage(100 << 20, 98 << 20, 2 << 20))
    assert report(tmp_path)[1].description == "the disk of the logs is full: 2 MiB left"
    seconds = iter(range(0, 1000, 10))
    monkeypatch.setattr(host_resources, "cpu_total_and_idle", lambda: (next(seconds), 0.0))
    _, entity = report(tmp_path, samples=3)
    assert entity.state == State.FAULT
    assert "the processor is busy: 100 %" in entity.description


def test_a_disk_that_does_not_answer_is_reported(tmp_path, monkeypatch):
    def fail(path):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(shutil, "disk_usage", fail)
    assert "Input/output error" in report(tmp_path)[1].description


def test_the_times_of_this_computer_go_on():
    before = cpu_total_and_idle()
    assert sum(i * i for i in range(300_000))
    after = cpu_total_and_idle()
    assert after[0] >= before[0] > 0
    assert 0 <= after[1] <= after[0]


def test_the_times_of_this_process_stand_in(monkeypatch):
    monkeypatch.setattr(host_resources.Path, "read_text", lambda self: "nothing")
    total, idle = cpu_total_and_idle()
    assert 0.0 <= idle <= total


@pytest.mark.parametrize("name", ["", "a", "a/b/c"])
def test_a_folder_that_is_not_there_yet_is_on_the_disk_above_it(tmp_path, name):
    assert innermost_existing_folder(tmp_path / name) == tmp_path
