"""What `shoal record` writes of a shipped vehicle, however it ends."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import imc
from shoal.logs.inspect import format_noun_count
from shoal.network import VehicleRecording
from support.byte_sizes import parse_byte_size
from tests.command import shoal
from tests.outside import largest_file, until
from tests.repeats import repeat
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"


@pytest.fixture(scope="module", params=["zenoh", "udp", "tcp"])
def network(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with running(tmp_path_factory.mktemp("vehicle"), network=request.param):
        until(lambda: shoal("plan", NAME, "status").exit_code == 0, 30.0)
        yield request.param


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("vehicles")
    with running(folder) as first, running(folder, "-V", "second", port=first.port):
        until(lambda: shoal("plan", f"{NAME},second", "status").exit_code == 0, 30.0)
        yield "zenoh"


def started(folder: Path, *words: str) -> "subprocess.Popen[str]":
    """A recording in a process of its own, which has begun."""
    process = subprocess.Popen(
        [sys.executable, "-c", "from shoal.cli import main; main()", "record", NAME, "-o", str(folder), *words],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    assert process.stderr.readline() == f"recording {NAME} to {folder / NAME}\n"
    return process


def info(folder: Path) -> Any:
    """What `shoal log info` says of a log that must have no damage."""
    result = shoal("log", "info", folder, "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["damage"] == []
    return found


@pytest.mark.heavy
def test_a_recording_is_a_log_of_the_vehicle(network: str, tmp_path: Path) -> None:
    folder = tmp_path / "here"
    result = shoal("record", NAME, "--for", "4s", "-o", folder, "--json")
    assert result.exit_code == 0, result.output
    (row,) = json.loads(result.stdout)
    found = info(folder / NAME)
    assert (found["system"], found["system_id"]) == (NAME, 26)
    assert found["messages"] == row["messages"] > 20
    assert "EstimatedState" in found["types"]
    assert {"Navigation", "Path Control"} <= {entity["label"] for entity in found["entities"]}
    assert found["schema_file"] == str(folder / NAME / "IMC.xml.gz")


@pytest.mark.heavy
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_signal_leaves_a_log_that_can_be_read(both: str, tmp_path: Path, number: int) -> None:
    folder = tmp_path / "here"
    with started(folder) as process:
        data = folder / NAME / "Data.lsf.gz"
        until(lambda: data.exists() and data.stat().st_size > 4000, 20.0)
        process.send_signal(number)
        printed, _ = process.communicate(timeout=20.0)
    assert process.returncode == (-signal.SIGKILL if number == signal.SIGKILL else 0)
    found = info(folder / NAME)
    assert found["messages"] > 20
    if number != signal.SIGKILL:
        assert printed.startswith(f"{NAME}: {found['messages'] // 1000 or ''}".rstrip())


@pytest.mark.heavy
def test_a_full_disk_ends_the_recording_with_a_log_up_to_there(both: str, tmp_path: Path) -> None:
    folder = tmp_path / "here"
    with largest_file(60_000):
        process = started(folder)
    with process:
        printed, errors = process.communicate(timeout=60.0)
    assert process.returncode == 1
    assert printed.startswith(f"{NAME}: {format_noun_count(info(folder / NAME)['messages'], 'message')}, ")
    assert f"{folder / NAME / 'Data.lsf.gz'}: " in errors
    assert "the logs end at " in errors
    assert "Traceback" not in errors
    assert info(folder / NAME)["messages"] > 20
    assert (folder / NAME / "Data.lsf.gz").stat().st_size <= 60_000


@pytest.mark.heavy
@pytest.mark.parametrize("network", [repeat("zenoh"), "udp"])
def test_a_vehicle_that_halts_is_recorded_on_and_one_that_ends_is_named(network: str, tmp_path: Path) -> None:
    with running(tmp_path, "--set", "General:Consoles=0x4101", network=network) as vehicle:  # we may only listen
        folder = tmp_path / "here"
        with started(folder) as process:
            data = folder / NAME / "Data.lsf.gz"
            until(lambda: data.exists() and data.stat().st_size > 20_000, 30.0)
            os.kill(vehicle.popen.pid, signal.SIGSTOP)
            time.sleep(5.0)
            os.kill(vehicle.popen.pid, signal.SIGCONT)
            size = data.stat().st_size
            until(lambda: data.stat().st_size > size + 60_000, 60.0)
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=60.0)
        assert (process.returncode, errors) == (0, "")
        assert info(folder / NAME)["messages"] > 100
        folder = tmp_path / "there"
        with started(folder) as process:
            until(lambda: (folder / NAME / "Data.lsf.gz").stat().st_size > 20_000, 30.0)
            vehicle.kill()
            time.sleep(6.0)
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=60.0)
        assert process.returncode == 1
        assert f"Error: {NAME} is silent since " in errors
        assert "Traceback" not in errors
        assert info(folder / NAME)["messages"] > 20


def test_a_time_stamp_that_is_none_does_not_hide_the_others(tmp_path: Path) -> None:
    recording = VehicleRecording(tmp_path / "log", imc.builtin())
    for time_stamp in (100.0, math.nan, math.inf, 1e300, -5.0, 0.0, 102.0):
        message = imc.Heartbeat(timestamp=time_stamp, src=0x001A)
        recording.write(message, imc.encode(message))
    recording.close()
    assert (recording.count, recording.first, recording.last) == (7, 100.0, 102.0)


@pytest.mark.heavy
def test_the_limit_holds_for_all_logs_together(both: str, tmp_path: Path) -> None:
    folder = tmp_path / "here"
    result = shoal("record", "-o", folder, "--limit", "200kB", "--for", "60s")
    assert result.exit_code == 1
    assert "Error: the limit of 200 kB is reached" in result.stderr
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    assert 100_000 < sum(sizes) <= 200_000  # integers
    for name in (NAME, "second"):
        assert info(folder / name)["system"] == name


@pytest.mark.heavy
def test_an_mcap_has_the_packets_of_the_log(both: str, tmp_path: Path) -> None:
    folder = tmp_path / "here"
    result = shoal(
        "record", "s*", "nobody", "-m", "VehicleState,EstimatedState", "-f", "mcap", "--for", "2s", "-o", folder
    )
    assert result.exit_code == 1
    assert "Error: nobody: nothing was recorded" in result.stderr
    assert [path.name for path in folder.iterdir()] == ["second.mcap"]
    copy = tmp_path / "copy"
    assert shoal("log", "import", folder / "second.mcap", copy).exit_code == 0
    kinds = {type(message) for message in imc.Log(next(copy.rglob("Data.lsf.gz")))}
    assert (
        {imc.VehicleState, imc.EstimatedState}
        <= kinds
        <= {
            imc.VehicleState,
            imc.EstimatedState,
            imc.Announce,
            imc.EntityInfo,
            imc.EntityList,
        }
    )


@pytest.mark.heavy
def test_nobody_there_or_a_folder_that_is_used_is_said_at_once(both: str, tmp_path: Path) -> None:
    nobody = shoal("record", "nobody", "-o", tmp_path / "here")
    assert nobody.exit_code == 1
    assert "no vehicle 'nobody' on the network" in nobody.stderr
    assert not (tmp_path / "here").exists()
    (tmp_path / "file").write_text("")
    used = shoal("record", "-o", tmp_path)
    assert (used.exit_code, used.stderr.strip()) == (
        2,
        f"Error: {tmp_path} is not empty; a recording needs a folder of its own",
    )
    assert shoal("record", "--limit", "5", "-o", tmp_path / "x").exit_code == 2


def test_a_missing_library_is_reported_before_the_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "shoal.logs.export.mcap_writer", raising=False)
    monkeypatch.setitem(sys.modules, "zstandard", None)
    result = shoal("record", NAME, "-f", "mcap", "--for", "60s", "-o", tmp_path / "here")
    assert result.exit_code == 2
    assert "this needs zstandard: pip install 'shoal[analysis]'" in result.stderr
    assert not (tmp_path / "here").exists()


def test_amounts_of_data() -> None:
    assert [parse_byte_size(text) for text in ("500MB", "2 GiB", "1000", "1.5kB")] == [500_000_000, 2 << 30, 1000, 1500]
    for text in ("", "MB", "5 apples", "-3MB"):
        with pytest.raises(ValueError, match="is not an amount of data"):
            parse_byte_size(text)
    with pytest.raises(ValueError, match="is too large an amount of data"):
        parse_byte_size("9" * 400)
