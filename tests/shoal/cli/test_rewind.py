"""Snapshots, `shoal rewind` and `shoal run --from-snapshot`, each in its own process."""

from pathlib import Path

import pytest

import imc
from tests.shoal.cli.installed import shoal

VIRTUAL = ["run", "lauv-noptilus-1", "-p", "Kinematic", "--clock", "virtual", "--for", "8s", "--seed", "4"]


def packets(folder: Path) -> list[bytes]:
    """The packets of a log, without the first ones of a continued run."""
    (path,) = folder.glob("*/*/*")
    found = [packet for _, packet in imc.Log(path).packets()]
    heading = 2 + sum(imc.header(packet).id == imc.EntityInfo.ID for packet in found[:20])
    return found[heading:]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of eight seconds with snapshots at three and six."""
    root = tmp_path_factory.mktemp("run")
    done = shoal(*VIRTUAL, "--snapshot-every", "3s", cwd=root)
    assert done.returncode == 0, done.stderr
    (path,) = root.glob("log/*/*/*")
    assert sorted(p.name for p in path.glob("State-*")) == ["State-3.msgpack", "State-6.msgpack"]
    return path


@pytest.mark.heavy
def test_saving_changes_nothing(log: Path, tmp_path: Path) -> None:
    shoal(*VIRTUAL, cwd=tmp_path)
    (other,) = tmp_path.glob("log/*/*/*/Data.lsf.gz")
    assert other.read_bytes() == (log / "Data.lsf.gz").read_bytes()


def test_a_run_goes_on_from_a_saved_state(log: Path, tmp_path: Path) -> None:
    done = shoal("run", "--from-snapshot", log / "State-3.msgpack", "--for", "5s", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    after, whole = packets(tmp_path / "log"), [packet for _, packet in imc.Log(log).packets()]
    assert len(after) > 1000
    assert after == whole[-len(after) :]


@pytest.mark.parametrize("states", [True, False])
def test_rewinding_repeats_the_rest_of_the_log(log: Path, tmp_path: Path, states: bool) -> None:
    copy = tmp_path / "copy"
    copy.mkdir()
    for path in log.iterdir():
        if states or not path.name.startswith("State"):
            (copy / path.name).write_bytes(path.read_bytes())
    done = shoal("rewind", copy, "--at", "4.503s", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    after, whole = packets(tmp_path / "log"), [packet for _, packet in imc.Log(log).packets()]
    assert len(after) > 1000
    assert after == whole[-len(after) :]


def test_rewinding_with_a_change(log: Path, tmp_path: Path) -> None:
    change = "Simulators.EstimatedState:Simulated State Rate=10"
    done = shoal("rewind", log, "--at", "4s", "--for", "2s", "--set", change, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (path,) = tmp_path.glob("log/*/*/*")
    assert imc.Log(path).counts()["SimulatedState"] == pytest.approx(20, abs=1)


@pytest.mark.parametrize(("at", "said"), [("20s", True), ("8s", False)])
def test_a_time_behind_the_end_of_the_log_is_said(log: Path, tmp_path: Path, at: str, said: bool) -> None:
    done = shoal("rewind", log, "--at", at, "--for", "1s", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    line = f"{log} ends at 8 s of its run; the vehicle runs past this end to {at}\n"
    assert (line in done.stderr) is said


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ("Simulators.GPS/Kinematic:HACK=1", "Simulators.GPS/Kinematic has no such parameter"),
        ("Simulators.GPX:HACC=1", "the vehicle has no task 'Simulators.GPX'"),
        ("World:Water Type=9C", "[World] is read when a run begins"),
        ("Simulators.GPS/Kinematic:HACC=many", "many"),
    ],
)
def test_what_cannot_be_changed_is_refused(log: Path, tmp_path: Path, change: str, reason: str) -> None:
    done = shoal("rewind", log, "--at", "3s", "--set", change, cwd=tmp_path)
    assert done.returncode == 2
    assert reason in done.stderr
    go_on = ("run", "--from-snapshot", log / "State-3.msgpack", "--set", change)
    assert reason in shoal(*go_on, cwd=tmp_path).stderr
    assert list(tmp_path.glob("log/*/*/*")) == []


def test_a_log_of_dune_cannot_be_rewound(tmp_path: Path) -> None:
    dune = Path(__file__).parents[2] / "data" / "logs" / "dune-idle"
    done = shoal("rewind", dune, "--at", "3s", cwd=tmp_path)
    assert done.returncode == 2
    assert "has no Config.ini" in done.stderr


def test_only_a_virtual_run_is_saved(tmp_path: Path) -> None:
    done = shoal("run", "lauv-noptilus-1", "-p", "Kinematic", "--snapshot-every", "3s", "--for", "1s", cwd=tmp_path)
    assert done.returncode == 2
    assert "only a virtual run can be saved" in done.stderr


@pytest.mark.parametrize("option", [["lauv-noptilus-1"], ["-p", "Simulation"], ["--seed", "3"], ["--clock", "10x"]])
def test_a_snapshot_refuses_what_contradicts_it(tmp_path, option):
    (tmp_path / "State-3.msgpack").write_bytes(b"")
    done = shoal("run", "--from-snapshot", "State-3.msgpack", *option, cwd=tmp_path)
    assert done.returncode == 2
    assert "the snapshot has its own" in done.stderr
