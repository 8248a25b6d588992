"""`shoal rewind` of a mission: its logs, its snapshots, and the request for its plan."""

import shutil
from pathlib import Path

import pytest

import imc
from tests.repeats import repeat
from tests.shoal.cli.installed import shoal

PLAN = """
plan: {name}
origin: 41.185°, -8.7062°
speed: 1.3 m/s
maneuvers:
  - goto: {{north: 8, depth: 0}}
  - station_keeping: {{north: {north}, depth: 0, radius: 15, duration: 3}}
"""


HEAD = (imc.Announce.ID, imc.EntityInfo.ID, imc.PlanSpecification.ID)


def packets(folder: Path) -> list[bytes]:
    return [packet for _, packet in imc.Log(folder).packets()]


def without_head(found: list[bytes]) -> list[bytes]:
    """The packets of a log, without the first ones of a continued run."""
    end = next(i for i, packet in enumerate(found[1:], 1) if imc.header(packet).id not in HEAD)
    return found[end:]


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The logs of a mission with snapshots, next to other logs."""
    root = tmp_path_factory.mktemp("missions")
    others = ("--set", "Plan.Engine:State Report Frequency=4")
    for name, north, options in (("one", 12, ()), ("two", 16, ()), ("one", 12, others)):
        (root / "plan.yaml").write_text(PLAN.format(name=name, north=north))
        done = shoal("mission", "lauv-noptilus-1", "plan.yaml", "--snapshot-every", "3s", *options, cwd=root)
        assert done.returncode == 0, done.stdout + done.stderr
    (found,) = root.glob("log/*/*")
    names = sorted(path.name for path in found.iterdir())
    assert names[:6] == ["000000", "000000_2", "000000_3", "000005_one", "000005_one_2", "000005_two"]
    assert len(list(found.glob("*_one/State-*"))) == 3
    return found


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("plan", "at", "states"),
    [("one", 9.5, True), ("one", 12.3, False), repeat(("two", 2.1, False)), ("one", 4.2, True)],
)
def test_a_mission_is_repeated_from_any_time(day: Path, tmp_path: Path, plan: str, at: float, states: bool) -> None:
    copy = tmp_path / day.parent.name / day.name
    shutil.copytree(day, copy, ignore=None if states else shutil.ignore_patterns("State-*"))
    done = shoal("rewind", copy / f"000005_{plan}", "--at", f"{at}s", "--log-dir", "again", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    first, *rest = sorted((tmp_path / "again").glob("*/*/*"))
    old = packets(day / (f"000005_{plan}" if at > 5.0 else {"one": "000000", "two": "000000_2"}[plan]))
    tail = without_head(packets(first))
    assert len(tail) > 400
    assert tail == old[-len(tail) :]
    if at < 5.0:
        assert packets(rest[0]) == packets(day / f"000005_{plan}")


def test_a_mission_is_changed_on_its_way(day: Path, tmp_path: Path) -> None:
    change = "Plan.Engine:State Report Frequency=20"
    done = shoal("rewind", day / "000005_one", "--at", "9s", "--for", "5s", "--set", change, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (log,) = tmp_path.glob("log/*/*/*")
    assert imc.Log(log).counts()["PlanControlState"] == pytest.approx(100, abs=4)


@pytest.mark.heavy
def test_a_log_that_is_not_of_its_configuration_is_refused(day: Path, tmp_path: Path) -> None:
    copy = tmp_path / day.parent.name / day.name
    shutil.copytree(day, copy, ignore=shutil.ignore_patterns("State-*", "*_[23]", "*_two"))
    for path in copy.glob("*/Config.ini"):
        path.write_text(path.read_text().replace("State Report Frequency", "State Report Frequency = 5\n#"))
        path.write_text(path.read_text() + "\n[Plan.Engine]\nState Report Frequency = 5\n")
    done = shoal("rewind", copy / "000005_one", "--at", "9s", cwd=tmp_path)
    assert done.returncode == 2
    assert "cannot be repeated from the start of its run" in done.stderr


def test_a_state_that_is_damaged_is_named(day: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(day / "000005_one", copy)
    state = copy / "State-6.msgpack"
    data = bytearray(state.read_bytes())
    data[len(data) // 2] ^= 1
    state.write_bytes(data)
    done = shoal("rewind", copy, "--at", "8s", cwd=tmp_path)
    assert done.returncode == 2
    assert "State-6.msgpack: this snapshot is damaged" in done.stderr


def test_a_mission_goes_on_from_a_saved_state(day: Path, tmp_path: Path) -> None:
    done = shoal("run", "--from-snapshot", day / "000005_one" / "State-6.msgpack", "--for", "2s", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (log,) = tmp_path.glob("log/*/*/*")
    after, whole = without_head(packets(log)), packets(day / "000005_one")
    begin, lasting = whole.index(after[0]), len(after) - 100  # it is closed where the other continued
    assert whole[begin : begin + lasting] == after[:lasting]


@pytest.mark.heavy
def test_a_run_that_begins_a_plan_by_itself_is_repeated(tmp_path: Path) -> None:
    options = ("-p", "Simulation", "--clock", "virtual", "--for", "12s", "--snapshot-every", "8s")
    done = shoal("run", "lauv-noptilus-1", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (state,) = tmp_path.glob("log/*/*/*/State-8.msgpack")
    done = shoal("rewind", state.parent, "--at", "10s", "--log-dir", "again", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (log,) = tmp_path.glob("again/*/*/*")
    tail, whole = without_head(packets(log)), packets(state.parent)
    assert len(tail) > 1000
    assert tail == whole[-len(tail) :]
