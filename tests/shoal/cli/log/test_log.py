"""`shoal log` as users run it."""

import os
import re
from pathlib import Path

import pytest

import imc
from tests import command

LOGS = Path(__file__).parents[3] / "data" / "logs"
IDLE = str(LOGS / "dune-idle")
COMMANDS = ("info", "ls", "cut", "merge", "diff", "report", "doctor", "export", "render", "import")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A log of ten seconds of a simulated vehicle."""
    root = tmp_path_factory.mktemp("logs")
    arguments = ["run", "lauv-noptilus-1", "-p", "Kinematic", "--clock", "virtual", "--for", "10s"]
    result = command.shoal(*arguments, "--log-dir", str(root))
    assert result.exit_code == 0, result.output
    return root / "lauv-noptilus-1" / "20260101" / "000000"


@pytest.fixture
def shoal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: command.shoal("log", *arguments)


def test_help_names_all_commands(shoal):
    text = shoal("-h").output
    assert all(f"  {name} " in text for name in COMMANDS)
    assert "Did you mean info?" in shoal("inf").output


def test_info(shoal, recorded):
    result = shoal("info", recorded)
    assert result.exit_code == 0
    rows = {line.split()[0]: line.split() for line in result.output.splitlines() if line}
    assert rows["system"][1:] == ["lauv-noptilus-1"]
    assert rows["damage"][1:] == ["none"]
    assert "000000/IMC.xml.gz" in shoal("info", recorded / "Data.lsf.gz").output
    assert rows["schema"][1:3] == ["IMC", "5.4.31:"]
    assert rows["EulerAngles"][1:4] == [str(imc.Log(recorded).counts()["EulerAngles"]), "100", "Hz"]
    assert rows["GPS"][2] == "lauv-noptilus-1"
    assert "GPS" not in shoal("info", recorded, "--no-entities").output


def test_info_of_a_log_of_dune(shoal):
    text = shoal("info", IDLE).output
    assert "lauv-noptilus-1, also messages from ccu-ref" in text
    assert "6 647 messages of 38 types" in text
    assert "built-in, none beside the log" in text


def test_ls(shoal, recorded):
    text = shoal("ls", recorded.parents[2]).output
    assert "lauv-noptilus-1/20260101/000000" in text
    assert "10.0 s" in text
    assert shoal("ls", "nowhere").exit_code == 2
    assert shoal("ls", ".").exit_code == 2


def test_cut_merge_diff(shoal, recorded):
    for name, times in (("a", ["--to", "4s"]), ("b", ["--from", "4", "--to", "7"]), ("c", ["--from", "7"])):
        result = shoal("cut", recorded, name, *times)
        assert result.exit_code == 0, result.output
        assert "that describe the log" in result.output or name == "a"
    result = shoal("merge", "a", "b", "c", "-o", "whole")
    assert result.exit_code == 0, result.output
    result = shoal("diff", recorded, "whole")
    assert "equal:" in result.output or "the same messages in a different order" in result.output
    result = shoal("diff", recorded, recorded)
    assert (result.exit_code, result.output.split()[0]) == (0, "equal:")
    result = shoal("diff", recorded, "a")
    assert result.exit_code == 1
    assert "They first differ at message" in result.output or "ends after message" in result.output


def test_diff_says_what_changed(shoal, recorded, tmp_path):
    log = imc.Log(recorded)
    changed = [m.replace(depth=m.depth + 2.0) if isinstance(m, imc.EstimatedState) else m for m in log]
    (tmp_path / "Data.lsf").write_bytes(b"".join(map(imc.encode, changed)))
    result = shoal("diff", recorded, tmp_path)
    assert result.exit_code == 1
    assert "Both have EstimatedState of Simulation Engine of lauv-noptilus-1" in result.output
    assert "depth: 0.0 in A, 2.0 in B" in result.output
    row = next(line for line in result.output.splitlines() if line.startswith("EstimatedState.depth"))
    assert row.split()[1:4] == [str(log.counts()["EstimatedState"]), "2", "2"]


def test_cut_by_names(shoal, recorded):
    assert shoal("cut", recorded, "out", "-m", "gpsfix,EstimatedState", "-e", "gps").exit_code == 0
    counts = imc.Log("out").counts()
    assert counts["GpsFix"] == imc.Log(recorded).counts()["GpsFix"]
    assert set(counts) == {"GpsFix", "Announce", "EntityInfo", "LoggingControl"}


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["-m", "EstimatedStat"], "did you mean EstimatedState"),
        (["-e", "GSP"], "did you mean GPS"),
        (["-s", "lauv-noptilus-2"], "did you mean lauv-noptilus-1"),
        (["--from", "1h"], "the log covers only 2026-01-01 00:00:00.000 UTC to"),
        (["--from", "soon"], "'soon' is not a time"),
        (["--from", "5", "--to", "4"], "--to must be after --from"),
        (["-m", "Abort"], "nothing is written"),
    ],
)
def test_cut_refuses_in_words(shoal, recorded, arguments, text):
    result = shoal("cut", recorded, "out", *arguments)
    assert result.exit_code == 2
    assert text in result.output
    assert not Path("out").exists()


def test_report(shoal, recorded):
    result = shoal("report", recorded, "-o", "page.html")
    assert result.exit_code == 0, result.output
    text = Path("page.html").read_text()
    assert text.startswith("<!DOCTYPE html>")
    assert "MUG detections" in text


def test_doctor(shoal, recorded, tmp_path):
    assert shoal("doctor", recorded).exit_code == 0
    assert "healthy: " in shoal("doctor", recorded).output
    data = imc.Log(recorded).path.read_bytes()
    (tmp_path / "Data.lsf.gz").write_bytes(data[: len(data) // 2])
    result = shoal("doctor", tmp_path, "--repair", "clean")
    assert result.exit_code == 1
    assert "warning: damage: cut compressed data" in result.output
    assert "repaired: " in result.output
    assert shoal("doctor", "clean").exit_code == 0


@pytest.mark.parametrize("command", ["info", "cut", "report", "doctor", "merge"])
@pytest.mark.parametrize(
    ("content", "text"), [(b"", "empty"), (b"hello " * 200, "bytes belongs to a message"), (None, "no such log")]
)
def test_files_that_are_no_logs(shoal, tmp_path, command, content, text):
    path = tmp_path / "Data.lsf"
    if content is not None:
        path.write_bytes(content)
    more = {"cut": ["out"], "merge": ["-o", "out"]}.get(command, [])
    result = shoal(command, path, *more)
    assert result.exit_code == (1 if command == "doctor" and content is not None else 2)
    assert not isinstance(result.exception, OSError | ValueError)
    assert text in result.output or command in ("merge", "report")
    assert not (tmp_path / "out").exists()


def test_diff_of_what_is_no_log(shoal):
    assert shoal("diff", IDLE, "nowhere").exit_code == 2


def test_bad_definitions_lead_to_the_doctor(shoal, tmp_path):
    (tmp_path / "IMC.xml").write_text("<messages><")
    (tmp_path / "Data.lsf").write_bytes(imc.encode(imc.Heartbeat(timestamp=1.0, src=26)))
    result = shoal("info", tmp_path)
    assert result.exit_code == 2
    assert "shoal log doctor" in result.output
    shoal("doctor", tmp_path, "--repair", "clean")
    assert shoal("info", "clean").exit_code == 0


def test_text_of_a_log_cannot_steer_the_terminal(shoal, tmp_path):
    evil = "\x1b]0;owned\x07[red]x[/nonsense]\udcff"
    messages = [
        imc.Announce(timestamp=1.0, src=26, src_ent=1, sys_name=evil),
        imc.EntityInfo(timestamp=1.0, src=26, src_ent=1, id=1, label=evil),
        imc.EntityInfo(timestamp=2.0, src=26, src_ent=1, id=1, label=evil + "2"),
        imc.EntityState(timestamp=3.0, src=26, src_ent=1, description=evil),
    ]
    (tmp_path / "Data.lsf").write_bytes(b"".join(map(imc.encode, messages)))
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "Data.lsf").write_bytes(imc.encode(messages[0].replace(sys_name=evil + "3")))
    for arguments in (["info", "."], ["ls", "."], ["doctor", "."], ["diff", ".", "b"], ["cut", ".", "out"]):
        result = shoal(*arguments)
        assert not isinstance(result.exception, UnicodeError | ValueError), arguments
        assert not {"\x1b", "\x07"} & set(result.output), arguments
        assert "[red]x[/nonsense]" in result.output or arguments[0] in ("ls", "cut")


def test_a_long_name_is_shortened_wherever_it_is_shown(shoal, tmp_path):
    messages = [
        imc.Announce(timestamp=1.0, src=0x1234, src_ent=1, sys_name="n" * 5000),
        imc.EntityInfo(timestamp=1.0, src=0x1234, src_ent=1, id=1, label="e" * 5000),
        imc.EntityInfo(timestamp=2.0, src=0x1234, src_ent=1, id=1, label="f" * 5000),
        imc.EstimatedState(timestamp=3.0, src=0x1234, src_ent=1),
    ]
    for name, some in (("a", messages), ("b", messages[:-1])):
        (tmp_path / name).mkdir()
        (tmp_path / name / "Data.lsf").write_bytes(b"".join(map(imc.encode, some)))
    pages = [shoal(*words.split()).output for words in ("info a", "info a --json", "ls .", "doctor a", "diff a b")]
    assert shoal("report", "a", "-o", "page.html").exit_code == 0
    pages.append((tmp_path / "page.html").read_text())
    for page in pages:
        assert max(map(len, re.findall("n+|e+|f+", page))) < 64
    assert "n" * 63 + "…" in pages[0]


def test_a_pipe_in_the_place_of_a_log_is_not_waited_for(shoal, tmp_path):
    (tmp_path / "log").mkdir()
    os.mkfifo(tmp_path / "log/Data.lsf")
    os.mkfifo(tmp_path / "log/Run.json")
    assert "not a file" in shoal("ls", "log").output
    assert "no log in the folder" in shoal("info", "log").output
