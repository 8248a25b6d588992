"""Runs of several logs on the command line, and log folders that cannot be written."""

import os
import shutil
import tempfile
from collections.abc import Generator
from pathlib import Path

import pytest

import imc
from tests.command import shoal
from tests.outside import TOO_LARGE, largest_file

PLAN = "plan: box\norigin: 41.185°, -8.7062°\nspeed: 1.2 m/s\nmaneuvers:\n  - goto: {north: 8, depth: 0}\n"


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The logs of a mission: before, during and after its plan."""
    root = tmp_path_factory.mktemp("mission")
    (root / "plan.yaml").write_text(PLAN)
    done = shoal("mission", "otter", root / "plan.yaml", "--log-dir", root / "log")
    assert done.exit_code == 0, done.output
    return root / "log" / "otter" / "20260101"


@pytest.fixture
def total(day: Path) -> int:
    return sum(len(imc.Log(folder)) for folder in day.iterdir())


def grouped(number: int) -> str:
    return f"{number:_}".replace("_", " ")


def test_a_run_is_taken_as_one(day: Path, total: int, tmp_path: Path) -> None:
    plan = next(day.glob("*_box"))
    done = shoal("log", "info", "--run", plan)
    assert f": {day / '000000' / 'IMC.xml.gz'}\n" in done.stdout
    assert done.exit_code == 0, done.output
    assert f"{grouped(total)} messages" in done.output
    assert all(str(folder) in done.output for folder in day.iterdir())
    assert shoal("log", "doctor", "--run", plan).exit_code == 0
    done = shoal("log", "report", "--run", plan, "-o", tmp_path / "page.html")
    assert done.exit_code == 0, done.output
    assert "box" in (tmp_path / "page.html").read_text()
    done = shoal("log", "export", "--run", plan, tmp_path / "out-csv", "-f", "csv")
    assert f"{grouped(total)} messages of the log" in done.output
    done = shoal("log", "cut", "--run", plan, tmp_path / "part", "--messages", "PlanControlState")
    assert done.exit_code == 0, done.output
    assert "EntityState" not in imc.Log(tmp_path / "part").counts()
    done = shoal("log", "diff", "--run", plan, day / "000000")
    assert done.output.startswith(f"equal: {grouped(total)} messages")


def test_a_log_that_was_copied_alone_is_a_run_of_its_own(day: Path, tmp_path: Path) -> None:
    lone = tmp_path / "lone"
    shutil.copytree(next(day.glob("*_box")), lone)
    done = shoal("log", "info", "--run", lone)
    assert done.exit_code == 0, done.output
    assert "log 1 of the run is missing" in done.output


def test_one_log_says_which_of_the_run_it_is(day: Path) -> None:
    assert "log 2 of the run that began with 20260101/000000" in shoal("log", "info", next(day.glob("*_box"))).output


def test_the_newest_log(day: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _, plan, after = sorted(day.iterdir())
    done = shoal("log", "info", "--last", day)
    assert f"log       {plan}" in done.output
    assert f"log: {plan}\n" in done.stderr
    assert f"log       {after}" in shoal("log", "info", after).output
    monkeypatch.chdir(day.parents[2])
    assert plan.name in shoal("log", "info", "--last").output
    assert "3 messages" not in shoal("log", "info", "--last", "--run").output
    monkeypatch.chdir(tmp_path)
    done = shoal("log", "info", "--last")
    assert done.exit_code != 0
    assert "there is no log below it" in done.output
    assert "name a LOG, or use --last" in shoal("log", "info").output
    done = shoal("log", "export", "--last", "out.csv")
    assert "Error: out.csv is not a folder; --last searches one: --last log out.csv\n" in done.output


def test_the_newest_log_is_taken_also_if_it_is_damaged_or_alone(day: Path, tmp_path: Path) -> None:
    shutil.copytree(day, tmp_path / "log" / "otter" / day.name)
    before, plan, after = sorted((tmp_path / "log" / "otter" / day.name).iterdir())
    (after / "Data.lsf.gz").write_bytes(b"rubbish")
    assert f"log: {after}\n" in shoal("log", "doctor", "--last", tmp_path).stderr
    (plan / "Run.json").unlink()
    (after / "Run.json").unlink()
    shutil.copyfile(day / after.name / "Data.lsf.gz", after / "Data.lsf.gz")
    assert f"log: {after}\n" in shoal("log", "info", "--last", tmp_path).stderr
    os.utime(before / "Data.lsf.gz", (2e9, 2e9))
    assert f"log: {before}\n" in shoal("log", "info", "--last", tmp_path).stderr


@pytest.mark.heavy
def test_the_newest_log_is_run_again(day: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(day.parents[2])
    assert "name a LOG, or use --last" in shoal("resim", "-t", "Simulators.GPS").output
    done = shoal("resim", "--last", "-t", "Simulators.GPS")
    assert (done.exit_code, "0 bytes of difference" in done.output) == (0, True), done.output
    assert "_box\n" in done.stderr
    done = shoal("rewind", "--last", "--at", "9", "--for", "1s", "--log-dir", tmp_path)
    assert (done.exit_code, "_box\n" in done.stderr) == (0, True), done.output


def test_a_log_that_is_missing_in_a_run_is_named(day: Path, tmp_path: Path) -> None:
    copy = tmp_path / day.name
    for folder in day.iterdir():
        if not folder.name.endswith("_box"):
            (copy / folder.name).mkdir(parents=True)
            for file in folder.iterdir():
                (copy / folder.name / file.name).write_bytes(file.read_bytes())
    assert "log 2 of the run is missing" in shoal("log", "info", "--run", copy / "000000").output


def test_replay_records_what_it_plays(day: Path, total: int, tmp_path: Path) -> None:
    plan = next(day.glob("*_box"))
    done = shoal("replay", "--run", plan, "--clock", "virtual", "--log-dir", tmp_path)
    assert done.exit_code == 0, done.output
    (again,) = tmp_path.glob("replay/*/*")
    played = [packet for _, packet in imc.Log(again).packets()]
    own = imc.header(played[0]).src
    played = [packet for packet in played if imc.header(packet).src != own]
    assert len(played) == total
    before = [packet for folder in sorted(day.iterdir()) for _, packet in imc.Log(folder).packets()]
    assert played == before


def test_replay_records_nothing_unless_asked(day: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert shoal("replay", day / "000000", "--clock", "virtual").exit_code == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "command",
    [
        ("run", "lauv-noptilus-1", "-p", "Kinematic", "--clock", "virtual", "--for", "2s"),
        ("run", "otter", "-p", "Simulation", "--clock", "virtual", "--for", "2s", "--snapshot-every", "1s"),
    ],
)
def test_a_run_that_cannot_log_is_refused(tmp_path: Path, command: tuple[str, ...]) -> None:
    (tmp_path / "log").write_text("in the way")
    done = shoal(*command, "--log-dir", tmp_path / "log")
    assert done.exit_code == 2
    assert f"no log can be written to {tmp_path / 'log'}" in done.output
    assert "Traceback" not in done.output


def test_a_mission_and_a_replay_that_cannot_log_are_refused(day: Path, tmp_path: Path) -> None:
    (tmp_path / "log").write_text("in the way")
    for command in (("mission", "otter", day.parents[2] / "plan.yaml"), ("replay", day / "000000")):
        done = shoal(*command, "--log-dir", tmp_path / "log")
        assert done.exit_code == 2, done.output
        assert "no log can be written" in done.output


def test_a_run_without_a_logger_needs_no_log_folder(tmp_path: Path) -> None:
    (tmp_path / "log").write_text("in the way")
    never = ("--set", "Transports.Logging:Enabled=Never", "--log-dir", tmp_path / "log")
    done = shoal("run", "otter", "-p", "Simulation", "--clock", "virtual", "--for", "2s", *never)
    assert done.exit_code == 0, done.output


@pytest.fixture
def full() -> Generator[None]:
    """A disk on which no file can have more than 1000 bytes."""
    with largest_file(1000):
        yield


TLOG = Path(__file__).parents[3] / "data" / "logs" / "ardusub.tlog"
SURVEY = TLOG.parents[1] / "missions" / "survey.plan"
FILLING = [
    ("log report LOG -o OUT/page.html", "OUT/page.html"),
    ("log info --run LOG", f"{tempfile.gettempdir()}/shoal-"),
    ("log cut LOG OUT/part", "OUT/part"),
    ("log merge LOG LOG -o OUT/both", tempfile.gettempdir()),
    ("log export LOG OUT/all.csv", "OUT/all.csv"),
    ("log export LOG OUT/euroc -f euroc", "OUT/euroc"),
    ("log export LOG OUT/tum -f tum", "OUT/tum"),
    ("export plan SURVEY OUT/plan.json", "OUT/plan.json"),
    ("log doctor LOG --repair OUT/good", "OUT/good"),
    ("log import DIVE OUT/dive", "OUT/dive"),
    ("resim LOG -t Simulators.GPS -o OUT/again", "OUT/again"),
    ("rewind LOG --at 9 --log-dir OUT/other", "the log of the repeated run is not complete: "),
    ("export neptus otter --out OUT/neptus", "OUT/neptus/vehicles-defs/otter.nvcl"),
    ("service otter -p Simulation -o OUT/otter.service", "OUT/otter.service"),
]


@pytest.mark.usefixtures("full")
@pytest.mark.parametrize(("words", "file"), FILLING, ids=[words for words, _ in FILLING])
def test_a_file_that_cannot_be_written_is_named(words: str, file: str, day: Path, tmp_path: Path) -> None:
    log = next(day.glob("*_box"))
    places = {"LOG": log, "OUT": tmp_path, "DIVE": TLOG, "SURVEY": SURVEY}
    for name, path in places.items():
        words = words.replace(name, str(path))
    done = shoal(*words.split())
    error = done.output.strip().splitlines()[-1]
    assert (done.exit_code, TOO_LARGE in error) == (2, True), done.output
    assert error.startswith(f"Error: {file.replace('OUT', str(tmp_path))}")
    left = [path for path in tmp_path.rglob("*") if path.is_file() and tmp_path / "other" not in path.parents]
    assert not left, "half written"


@pytest.mark.usefixtures("full")
def test_a_replay_names_the_file_that_it_could_not_record(day: Path, tmp_path: Path) -> None:
    done = shoal("replay", day / "000000", "--clock", "virtual", "--log-dir", tmp_path)
    assert done.exit_code == 1
    assert f"not on the disk: {TOO_LARGE}: {tmp_path}/replay/" in done.output
