"""The commands for running vehicles, on one vehicle in a process of its own."""

import json
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.shell_completion import ShellComplete

from shoal.cli import main
from tests.command import shoal
from tests.outside import until
from tests.shoal.network.running import Running, running

NAME = "lauv-noptilus-1"
PLAN = "plan: pause\nmaneuvers:\n- idle: {duration: %d}\n"


@pytest.fixture(scope="module")
def process(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("vehicle")) as found:
        until(lambda: json_of("plan", NAME, "status", "--json")["state"] == "READY", 30.0)
        yield found


def json_of(*words: object, status: int = 0) -> Any:
    result = shoal(*words)
    assert result.exit_code == status, result.output
    return json.loads(result.stdout)


def lines_of(*words: object) -> list[Any]:
    result = shoal(*words)
    assert result.exit_code == 0, result.output
    return [json.loads(line) for line in result.stdout.splitlines()]


@pytest.mark.heavy
def test_ls(process: Running) -> None:
    (found,) = json_of("ls", "--json")
    assert (found["name"], found["id"], found["mode"], found["network"]) == (NAME, 26, "SERVICE", ["zenoh"])
    assert found["lat"] == pytest.approx(0.7188, abs=1e-3)
    assert found["errors"] == []
    assert found["age"] < 5.0
    words = shoal("ls").output
    assert NAME in words
    assert "41.185" in words


@pytest.mark.heavy
def test_spy(process: Running) -> None:
    shown = lines_of(
        "spy", NAME, "EstimatedState", "--fields", "depth,x", "--where", "depth < 5", "--count", 3, "--json"
    )
    assert [set(line) for line in shown] == [{"abbrev", "timestamp", "entity", "depth", "x"}] * 3
    (state,) = lines_of("spy", NAME, "vehiclestate", "--where", "op_mode == SERVICE", "--count", 1, "--json")
    assert (state["abbrev"], state["op_mode"]) == ("VehicleState", 0)
    rates = {
        (row["message"], row["entity"]): row["hz"] for row in json_of("spy", NAME, "--hz", "--for", "1s", "--json")
    }
    assert rates["EstimatedState", "Navigation"] > 10.0
    two = lines_of("spy", NAME, "EntityState", "-e", "GPS,AHRS", "--count", 6, "--json")
    assert {line["entity"] for line in two} == {"GPS", "AHRS"}
    words = shoal("spy", NAME, "VehicleState", "--count", 1).output
    assert "op_mode=SERVICE" in words
    nothing = shoal("spy", NAME, "EstimatedState", "--where", "depth > 500", "--for", "0.3s")
    assert nothing.exit_code == 1
    assert nothing.output.startswith(f"Error: {NAME}: none of ")
    assert nothing.output.endswith(" messages within 0.3 s matched --where 'depth > 500'\n")
    silent = shoal("spy", NAME, "Sms", "--for", "0.3s")
    assert (silent.exit_code, silent.output) == (1, f"Error: {NAME}: nothing came within 0.3 s\n")


@pytest.mark.heavy
def test_plans(process: Running, tmp_path: Path) -> None:
    path = tmp_path / "pause.yaml"
    path.write_text(PLAN % 1)
    stored = shoal("plan", NAME, "put", path).output.splitlines()
    assert stored[0] == "stored as pause"
    assert re.fullmatch(r"estimated time 1 s, energy 0\.\d % of the battery, which has \d+\.\d %", stored[1]), stored
    assert len(stored) == 2
    assert [plan["name"] for plan in json_of("plan", NAME, "list", "--json")] == ["pause"]
    assert "pause" in shoal("plan", NAME, "list").output
    copy = tmp_path / "copy.yaml"
    assert shoal("plan", NAME, "get", "pause", "-o", copy).exit_code == 0
    assert "plan: pause" in copy.read_text()
    flown = shoal("plan", NAME, "start", "pause")
    assert flown.exit_code == 0
    assert "pause: plan completed" in flown.stdout
    assert "EXECUTING  pause" in flown.stderr
    assert stored[1].partition(", which")[0] in flown.stderr
    assert re.search(r"^energy: -?0\.\d % of the battery used$", flown.stdout, re.MULTILINE), flown.stdout
    deep = tmp_path / "deep.yaml"
    deep.write_text(
        "origin: 41.185°, -8.7062°\nmaneuvers:\n- idle: {duration: 1}\n- goto: {north: 9, depth: 200, speed: 1}\n"
    )
    refused = shoal("plan", NAME, "start", deep)
    assert (refused.exit_code, f"{deep}:4: Goto2: maneuver depth beyond" in refused.output) == (1, True), refused.output
    assert [plan["name"] for plan in json_of("plan", NAME, "list", "--json")] == ["pause"]
    path.write_text(PLAN % 600)
    before = json_of("plan", NAME, "status", "--json")
    foreseen = json_of("plan", NAME, "put", deep, "--json")
    assert "Goto2: maneuver depth beyond" in foreseen["rejected"]
    assert shoal("plan", NAME, "put", deep).output.splitlines()[2].startswith("it would not start now: Goto2: ")
    assert shoal("plan", NAME, "delete", "deep").output == "deleted\n"
    status = json_of("plan", NAME, "status", "--json")
    names = "plan", "last_outcome"
    assert [status[name] for name in names] == [before[name] for name in names], "a check is no plan"
    begun = json_of("plan", NAME, "start", path, "--no-wait", "--json")
    assert (begun["done"], begun["estimated_seconds"]) == (True, 600.0)
    assert 0.0 < begun["estimated_energy"] < begun["battery"] <= 100.0
    meanwhile = json_of("plan", NAME, "put", path, "--json")
    assert (meanwhile["done"], meanwhile["estimated_seconds"], meanwhile["rejected"]) == (True, None, None)
    status = json_of("plan", NAME, "status", "--json")
    assert (status["state"], status["plan"]) == ("EXECUTING", "pause")
    assert shoal("plan", NAME, "stop").output == "stopped\n"
    assert shoal("plan", NAME, "delete", "pause").output == "deleted\n"
    for words in (("start", "pause"), ("get", "pause"), ("delete", "pause"), ("stop",)):
        result = shoal("plan", NAME, *words)
        assert result.exit_code == 1
        assert "undefined plan" in result.output or "no plan is running" in result.output
    assert shoal("plan", NAME, "put", path).exit_code == 0
    result = shoal("plan", NAME, "start", "pase")
    assert result.output == "Error: pase: undefined plan; did you mean 'pause'?\n"
    result = shoal("plan", NAME, "get", "Zzz")
    assert result.output == "Error: Zzz: undefined plan; known: pause\n"


@pytest.mark.heavy
def test_ctrl_c_ends_the_command_and_not_the_plan(process: Running, tmp_path: Path) -> None:
    path = tmp_path / "long.yaml"
    path.write_text(PLAN % 600)
    command = [sys.executable, "-m", "shoal.cli", "plan", NAME, "start", str(path)]
    try:
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as start:
            try:
                assert start.stderr is not None
                assert any("pause" in start.stderr.readline() for _ in range(2))  # the estimate is first
                start.send_signal(signal.SIGINT)
                assert f"`shoal plan {NAME} stop` stops it" in start.stderr.read()
            finally:
                start.kill()  # nothing, if it has ended
        assert start.returncode == 130
        assert json_of("plan", NAME, "status", "--json")["state"] == "EXECUTING"
    finally:
        stopped = shoal("plan", NAME, "stop").output  # the vehicle is that of all tests here
    assert stopped == "stopped\n"


@pytest.mark.heavy
def test_parameters(process: Running) -> None:
    place = "Path Control:Corridor -- Width"
    assert json_of("param", NAME, "get", place, "--json") == {"Path Control": {"Corridor -- Width": "1.5"}}
    assert shoal("param", NAME, "set", f"{place}=2.5").output == f"{place} = 2.5\n"
    assert shoal("param", NAME, "save", "Path Control").output == "Path Control saved\n"
    refused = shoal("param", NAME, "set", f"{place}=wide")
    assert refused.exit_code == 1
    assert "'wide' is not a number" in refused.output
    for words in (("get", "Path Control:Zzz"), ("set", "Path Control:Zzz=3"), ("get", "Zzz")):
        result = shoal("param", NAME, *words)
        assert result.exit_code == 1
        assert "lists them" in result.output, "all are too many to name"


@pytest.mark.heavy
def test_send_and_abort(process: Running) -> None:
    (reply,) = lines_of("send", NAME, "EntityList", "op=QUERY", "--wait", "1s", "--json")
    assert reply["abbrev"] == "EntityList"
    silent = shoal("send", NAME, "Sms", "number=1", "--wait", "0.2s")
    assert (silent.exit_code, silent.stderr) == (1, f"{NAME} sent no reply within 0.2 s\n")
    assert shoal("abort", NAME).output == f"{NAME} has aborted\n"


@pytest.mark.heavy
def test_link(process: Running) -> None:
    found = json_of("link", NAME, "--for", "1s", "--json", status=1)
    (contact,) = [contact for contact in found["contacts"] if contact["name"] == NAME]
    assert contact["answered"] == contact["asked"] == 5
    texts = [finding["text"] for finding in found["findings"]]
    assert len(texts) == 1, texts
    assert texts[0].startswith("its clock is"), "this vehicle runs four times as fast as ours"
    assert "docs" not in found["findings"][0]["advice"]


@pytest.mark.parametrize(
    "words",
    [
        ("spy", NAME, "EstimatedStat"),
        ("spy", NAME, "EstimatedState", "--where", "deth > 2"),
        ("spy", NAME, "EstimatedState", "--fields", "deth"),
        ("spy", NAME, "--fields", "deth"),
        ("spy", NAME, "--hz", "--count", "3"),
        ("spy", NAME, "--for", "soon"),
        ("send", NAME, "Goto", "latt=3"),
        ("send", NAME, "Goto", "lat"),
        ("send", NAME, "Goto", "lat=north"),
        ("send", NAME, "EntityList", "op=QUER"),
        ("plan", NAME, "start"),
        ("plan", NAME, "stop", "x"),
        ("plan", NAME, "get", "x", "--no-wait"),
        ("plan", NAME, "start", "x", "--output", "x.yaml"),
        ("plan", NAME, "fly", "x"),
        ("plan", NAME, "put", "missing.yaml"),
        ("param", NAME, "set", "GPS:Rate"),
        ("param", NAME, "get"),
        ("ls", "--connect", "here"),
        ("ls", "--connect", "imc+udp://224.0.0.1:6002/"),
    ],
)
def test_wrong_use_is_status_2(words: tuple[str, ...]) -> None:
    result = shoal(*words)
    assert result.exit_code == 2, result.output
    assert "Error:" in result.output
    assert "Traceback" not in result.output


def test_a_rate_has_its_unit_and_an_output_called_mcap_needs_the_format(tmp_path: Path) -> None:
    too_fast = shoal("send", NAME, "Sms", "--rate", "2000 Hz")
    assert (too_fast.exit_code, "2000" in too_fast.output, "not a valid" in too_fast.output) == (2, True, False)
    unknown = shoal("send", NAME, "Smss", "--rate", "2Hz", "--count", 3)
    assert "Smss" in unknown.output, "the rate is accepted"
    result = shoal("record", NAME, "-o", tmp_path / "a.mcap", "--for", "1s")
    assert result.exit_code == 2
    assert "add -f mcap" in " ".join(result.output.split())
    assert not (tmp_path / "a.mcap").exists()


@pytest.mark.parametrize("where", ["rate(EstimatedState) > 5", "rate > 5 Hz", "EstimatedState.hz < 10"])
def test_a_condition_about_rates_points_to_the_option_for_them(where: str) -> None:
    result = shoal("spy", NAME, "--where", where)
    assert result.exit_code == 2
    assert "spy --hz shows the rates of messages" in " ".join(result.output.split())
    assert "--hz" not in shoal("spy", NAME, "EstimatedState", "--where", "deth > 2").output.replace("\n", "")


@pytest.mark.heavy
@pytest.mark.parametrize("words", [("ls",), ("abort", NAME)])
def test_nobody_there_is_status_1(words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_CONNECT", "tcp/127.0.0.1:9")
    result = shoal(*words)
    expected = "Error: no vehicle is on the network (nothing listens at tcp/127.0.0.1:9)\n"
    assert (result.exit_code, result.output) == (1, expected)


def completed(*words: str) -> list[str]:
    complete = ShellComplete(main, {}, "shoal", "_SHOAL_COMPLETE")
    return [item.value for item in complete.get_completions(list(words[:-1]), words[-1])]


def pressed_tab(*words: str) -> list[str]:
    """What bash offers for the last word."""
    program = shlex.quote(str(Path(sys.executable).with_name("shoal")))
    script = f"""
        compopt() {{ :; }}  # it works only while a key is handled
        eval "$(_SHOAL_COMPLETE=bash_source {program})"
        COMP_LINE={shlex.quote(shlex.join(["shoal", *words]))}
        COMP_POINT=${{#COMP_LINE}}
        _shoal_completion {program}
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert done.stderr == "", "it would be on the line that is written"
    return [line for line in done.stdout.splitlines() if line]


@pytest.mark.heavy
def test_the_shell_completes_vehicles_messages_and_plans(
    process: Running, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert completed("spy", "lauv") == [NAME], "of the network: none was found before"
    path = tmp_path / "pause.yaml"
    path.write_text(PLAN % 1)
    shoal("plan", NAME, "put", path)
    assert completed("spy", "lauv") == [NAME]
    assert completed("spy", NAME, "EstimatedS") == ["EstimatedState", "EstimatedStreamVelocity"]
    assert completed("spy", NAME, "--entities", "path c") == ["Path Control"]
    assert completed("plan", NAME, "st") == ["start", "stop", "status"]
    assert "pause" in completed("plan", NAME, "start", "pau")
    assert pressed_tab("plan", NAME, "start", "pau") == ["pause"]
    assert pressed_tab("plan", "nobody", "start", "pau") == []
    assert completed("param", NAME, "get", "Path") == ["Path Control"]
    assert "Path Control:Corridor -- Width" in completed("param", NAME, "get", "Path Control:Cor")


@pytest.mark.heavy
def test_birth_and_death_are_seen(process: Running, tmp_path: Path) -> None:
    """The last test of this module: it kills the vehicle."""
    with running(tmp_path, "-V", "second", port=process.port) as second:
        command = [sys.executable, "-u", "-m", "shoal.cli", "ls", "--watch", "--json"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as watch:
            assert watch.stdout is not None
            events = (json.loads(line) for line in watch.stdout)
            seen = [next(events)["name"], next(events)["name"]]
            assert {NAME, "second"} >= set(seen)
            second.kill()
            assert any(event["event"] == "gone" and event["name"] == "second" for event in events)
            watch.terminate()
