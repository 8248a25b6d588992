"""What an operator has set stays set."""

import errno
import os

import pytest

import imc
from runtime.kernel import WallClock
from runtime.testing import simulate
from runtime.vehicle import Vehicle
from tasks.monitors.operational_limits import OperationalLimits as Monitor
from tasks.transports.cache import Cache
from tests.outside import largest_file

CONSOLE, VEHICLE = 0x4000, 0x001A
LIMITS = imc.OperationalLimits(mask=imc.OpLimitsMask.MAX_DEPTH, max_depth=7.0)


class NoSettings:
    def value(self, section, option, default=""):
        return default

    def options(self, section):
        return {}

    def dump(self):
        return ""

    def override(self, assignment):
        pass


def live(folder, *messages, seconds=0.05, wall=True):
    """One life of a vehicle whose operator sends messages; what the monitor says at its end, and the log book."""
    vehicle = Vehicle("lauv", VEHICLE, clock=WallClock(), profile=NoSettings(), state_folder=folder, log_root=folder)
    vehicle.add(Monitor, "Monitors.OperationalLimits", maximum_depth=50.0)
    vehicle.add(Cache, "Transports.Cache")
    heard, log = [], []
    vehicle.observe(imc.OperationalLimits, heard.append)
    vehicle.observe(imc.LogBookEntry, lambda entry: log.append(entry.text))
    vehicle.start()
    vehicle.run(0.02)
    for message in messages:
        packet = imc.encode(message.replace(src=message.src if message.src != 0xFFFF else CONSOLE, dst=VEHICLE))
        vehicle.bus.deliver(imc.decode(packet), packet)
    vehicle.run(seconds)
    vehicle.close()
    own = [message for message in heard if message.src == VEHICLE and message.dst == 0xFFFF]
    return own[-1].max_depth, log


def test_limits_of_an_operator_survive_a_restart_and_are_reported(tmp_path):
    assert live(tmp_path)[0] == 50.0
    assert live(tmp_path, LIMITS)[0] == 7.0
    depth, log = live(tmp_path)
    assert depth == 7.0
    assert "OperationalLimits is what an operator has set before; CacheControl CLEAR forgets it" in log
    assert [path.name for path in tmp_path.rglob("*.*")] == ["OperationalLimits.imc"]


@pytest.mark.heavy
def test_they_are_written_while_the_vehicle_runs(tmp_path):
    live(tmp_path, LIMITS, seconds=1.2)
    assert (tmp_path / "lauv" / "Cache" / "OperationalLimits.imc").is_file()


def test_an_operator_can_clear_them(tmp_path):
    live(tmp_path, LIMITS)
    live(tmp_path, imc.CacheControl(op=imc.CacheControl.Op.CLEAR))
    assert live(tmp_path)[0] == 50.0
    assert not list(tmp_path.rglob("*.*"))


@pytest.mark.parametrize("message", [LIMITS.replace(src=0x0801), LIMITS.replace(max_depth=float("nan"))])
def test_what_no_operator_has_set_or_cannot_be_is_not_kept(tmp_path, message):
    live(tmp_path, message)
    assert not list(tmp_path.rglob("*.imc"))


@pytest.mark.parametrize("op", [imc.LblConfig.Op.GET_CFG, imc.LblConfig.Op.CUR_CFG])
def test_a_question_is_no_setting(tmp_path, op):
    live(tmp_path, imc.LblConfig(op=op), imc.CacheControl(op=imc.CacheControl.Op.STORE, message=imc.LblConfig(op=op)))
    assert not list(tmp_path.rglob("*.imc"))
    live(tmp_path, imc.LblConfig(op=imc.LblConfig.Op.SET_CFG))
    assert [path.name for path in tmp_path.rglob("*.imc")] == ["LblConfig.imc"]


@pytest.mark.parametrize("content", [b"", b"rubbish", imc.encode(LIMITS)[:-1], imc.encode(imc.Abort())])
def test_damaged_files_are_named_and_do_no_harm(tmp_path, content):
    folder = tmp_path / "lauv" / "Cache"
    folder.mkdir(parents=True)
    (folder / "OperationalLimits.imc").write_bytes(content)
    depth, log = live(tmp_path)
    assert depth == 50.0
    words = "OperationalLimits has to be set again, the cache cannot be read: "
    told = any(line.startswith(f"{words}{folder}/OperationalLimits.imc: ") for line in log)
    assert told == (content[2:4] != imc.encode(imc.Abort())[2:4])


def test_only_listed_messages_are_stored_and_nothing_is_copied_elsewhere(tmp_path):
    kind = imc.CacheControl
    wishes = [
        kind(op=kind.Op.STORE, message=imc.GpsFix()),
        kind(op=kind.Op.STORE),
        kind(op=kind.Op.COPY, snapshot="/tmp/x"),
    ]
    _, log = live(tmp_path, *wishes, kind(op=kind.Op.STORE, message=LIMITS))
    assert sum("rejected" in line for line in log) == 3
    assert not any("NoneType" in line for line in log)
    assert [path.name for path in tmp_path.rglob("*.imc")] == ["OperationalLimits.imc"]


@pytest.mark.heavy
def test_a_full_or_forbidden_disk_is_reported(tmp_path):
    (tmp_path / "lauv").write_text("a file where a folder should be")
    _, log = live(tmp_path, LIMITS, seconds=1.3)
    assert any("the cache cannot be written" in line for line in log)


@pytest.mark.heavy
def test_a_full_disk_is_reported_with_the_file_that_did_not_fit(tmp_path):
    with largest_file(10):
        _, log = live(tmp_path, LIMITS, seconds=1.3)
    path = tmp_path / "lauv" / "Cache" / "OperationalLimits.imc"
    assert f"the cache cannot be written: {path}: {os.strerror(errno.EFBIG)}" in log


def test_a_disk_that_is_full_at_the_end_is_reported_and_one_that_cannot_be_read_at_the_start(tmp_path):
    path = tmp_path / "lauv" / "Cache" / "OperationalLimits.imc"
    with largest_file(10):
        _, log = live(tmp_path, LIMITS)
    assert f"the cache cannot be written: {path}: {os.strerror(errno.EFBIG)}" in log
    assert not list(path.parent.iterdir())
    path.mkdir()
    _, log = live(tmp_path)
    reason = os.strerror(errno.EISDIR)
    assert f"OperationalLimits has to be set again, the cache cannot be read: {path}: {reason}" in log


def test_a_virtual_run_keeps_nothing_for_the_next():
    kind = imc.CacheControl
    feed = [
        LIMITS.replace(src=CONSOLE, dst=VEHICLE, timestamp=0.1),
        kind(op=kind.Op.LOAD, src=CONSOLE, dst=VEHICLE, timestamp=0.5),
    ]
    run = simulate([Cache, Monitor], feed, seconds=3.0)
    assert [m.max_depth for m in run.of(imc.OperationalLimits) if m.dst == VEHICLE] == [7.0]
    assert not list(run.vehicle.state_folder.rglob("*"))


@pytest.mark.parametrize("op", [imc.CacheControl.Op.COPY, imc.CacheControl.Op.CLEAR, imc.CacheControl.Op.STORE])
def test_a_console_that_asks_without_end_does_not_fill_the_log_book(op):
    request = imc.CacheControl(op=op, snapshot="x" * 30_000, src=CONSOLE, dst=VEHICLE)
    log = simulate(Cache, [request.replace(timestamp=1.0 + i / 45.0) for i in range(1000)], seconds=25.0).log
    assert 60 <= len(log) <= 90, "of 1000 lines the first 60, and later one in 2 s"
