"""Commands for several vehicles at once, on two vehicles in processes of their own; and all parameters of one."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import imc
from runtime.profile import load_profile
from shoal.cli.vehicle_selection import parse_selection
from tests.command import shoal
from tests.outside import until
from tests.shoal.cli.test_lossy_network import entity_id, lose
from tests.shoal.network.running import running

NAME, SECOND = "lauv-noptilus-1", "second"
WIDTH = "Path Control:Corridor -- Width"


@pytest.fixture(scope="module", params=["zenoh", "udp"])
def both(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[object]:
    folder = tmp_path_factory.mktemp("vehicles")
    with (
        running(folder, network=request.param) as first,
        running(folder, "-V", SECOND, port=first.port, network=request.param) as second,
    ):
        until(lambda: shoal("plan", f"{NAME},{SECOND}", "status").exit_code == 0, 30.0)
        yield second


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Iterator[object]:
    with running(tmp_path_factory.mktemp("vehicle"), network="tcp") as vehicle:
        until(lambda: shoal("plan", NAME, "status").exit_code == 0, 30.0)
        yield vehicle


def lines_of(*words: object, status: int = 0) -> list[Any]:
    result = shoal(*words)
    assert result.exit_code == status, result.output
    return [json.loads(line) for line in result.stdout.splitlines()]


def test_names_are_separated_by_commas_or_match_a_pattern() -> None:
    selection = parse_selection(["a, b", "lauv-*", "b"])
    assert (selection.names, selection.patterns, selection.single_name) == (("a", "b"), ("lauv-*",), "")
    assert selection.matches("lauv-1")
    assert not selection.matches("Lauv-1")
    assert parse_selection(["a b"]).single_name == "a_b"


@pytest.mark.heavy
@pytest.mark.parametrize("words", [("abort", "a,,b"), ("abort",), ("plan", "a,b", "get", "x", "-o", "x.yaml")])
def test_an_empty_name_or_one_file_for_several_is_wrong_use(words: tuple[str, ...]) -> None:
    assert shoal(*words).exit_code == 2


@pytest.mark.heavy
def test_each_vehicle_is_named_in_what_comes_of_it(both: object, tmp_path: Path) -> None:
    found = lines_of("param", f"{NAME},nobody,{SECOND}", "get", WIDTH, "--json", status=1)
    assert [line["vehicle"] for line in found] == [NAME, "nobody", SECOND]
    assert [line["result"] for line in found] == [
        {"Path Control": {"Corridor -- Width": "1.5"}},
        None,
        {"Path Control": {"Corridor -- Width": "1.5"}},
    ]
    assert "no vehicle 'nobody' on the network" in found[1]["error"]
    shown = shoal("param", "*", "get", WIDTH)
    assert shown.exit_code == 0
    assert shown.stdout.splitlines() == [f"{NAME}: {WIDTH} = 1.5", f"{SECOND}: {WIDTH} = 1.5"]
    path = tmp_path / "pause.yaml"
    path.write_text("plan: pause\nmaneuvers:\n- idle: {duration: 1}\n")
    assert shoal("plan", "s*,l*", "put", path).exit_code == 0
    flown = shoal("plan", f"{SECOND},{NAME}", "start", "pause")
    assert flown.exit_code == 0, flown.output
    assert {line.partition(",")[0] for line in flown.stdout.splitlines()} == {
        f"{name}: {text}"
        for name in (NAME, SECOND)
        for text in ("pause: plan completed", "energy: 0.0 % of the battery used")
    }
    heard = lines_of("spy", "*", "VehicleState", "--count", 2, "--json")
    assert sorted(line["vehicle"] for line in heard) == [NAME, NAME, SECOND, SECOND]
    nobody = shoal("param", "x*", "list")
    assert (nobody.exit_code, nobody.output) == (1, f"Error: no vehicle matches x*; there are {NAME}, {SECOND}\n")


@pytest.mark.heavy
def test_a_file_is_loaded_by_all_vehicles_or_by_none(both: object, tmp_path: Path) -> None:
    path = tmp_path / "some.ini"
    path.write_text("[Path Control]\nCorridor -- Width = 2.5\n[GPS]\nActivation Depth = 0.30\n")
    refused = shoal("param", f"{NAME},nobody,{SECOND}", "load", path)
    assert refused.exit_code == 1
    assert refused.stderr.count("nothing was sent") == 3
    found = lines_of("param", "*", "load", path, "--json")
    for line in found:
        assert [(each["name"], each["outcome"], each["value"]) for each in line["result"]] == [
            ("Corridor -- Width", "set", "2.5"),
            ("Activation Depth", "set", "0.3"),
        ]
    path.write_text(path.read_text() + "[Supervisors.Nothing]\nRate = 3\n[IMU]\nActivation Time = 4\n")
    wrong = shoal("param", SECOND, "load", path)
    assert wrong.exit_code == 1
    assert f"{path}:5: no entity 'Supervisors.Nothing'" in wrong.stderr
    shoal("param", "*", "set", f"{WIDTH}=1.5")


@pytest.mark.heavy
def test_a_message_is_sent_to_several_vehicles_at_a_rate(both: object) -> None:
    asked = ("QueryEntityState", "--wait", "2s")
    replies = lines_of("send", f"{SECOND},{NAME}", *asked, "--rate", 5, "--count", 3, "--json")
    states = [line["vehicle"] for line in replies if line["abbrev"] == "EntityState"]
    assert {name: states.count(name) > 3 for name in (NAME, SECOND)} == {NAME: True, SECOND: True}
    shown = shoal("send", "*", "DesiredSpeed", "value=1", "--rate", 20, "--count", 4)
    assert shown.exit_code == 0, shown.output
    assert {line.rpartition(" in ")[0] for line in shown.stdout.splitlines()} == {
        f"sent DesiredSpeed to {name} 4 times" for name in (NAME, SECOND)
    }
    partly = shoal("send", f"{NAME},nobody", "Heartbeat", "--wait", "1s")
    assert partly.exit_code == 1
    assert f"sent Heartbeat to {NAME}" in partly.stdout
    assert "no vehicle 'nobody' on the network" in partly.stderr
    assert f"{NAME} sent no reply within 1 s" in partly.stderr


@pytest.mark.heavy
def test_an_abort_reaches_those_that_are_there(both: object) -> None:
    result = shoal("abort", SECOND, "nobody", "l*")
    assert result.exit_code == 1
    assert result.stdout.splitlines() == [f"{SECOND}: has aborted", f"{NAME}: has aborted"]
    assert result.stderr.startswith("Error: nobody: no vehicle 'nobody'")


@pytest.mark.heavy
def test_a_dump_is_an_overlay_of_the_profile(one: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "{vehicle}.ini"
    assert shoal("param", NAME, "set", f"{WIDTH}=2.25").exit_code == 0
    assert shoal("param", NAME, "dump", "-o", path).exit_code == 0
    dumped = tmp_path / f"{NAME}.ini"
    assert load_profile(dumped).value("Control.Path.VectorField", "Corridor -- Width") == "2.25"
    assert shoal("param", NAME, "set", f"{WIDTH}=1.5").exit_code == 0
    loaded = lines_of("param", NAME, "load", dumped, "--json")[0]
    assert [each["name"] for each in loaded if each["outcome"] == "set"] == ["Corridor -- Width"]
    assert {each["outcome"] for each in loaded} == {"set", "unchanged"}
    with monkeypatch.context() as patch:
        patch.setattr("shoal.network.parameters.ROUNDS", 3)
        lose(patch, 1.0, imc.EntityParameters, of=entity_id(NAME, "GPS"))
        partial = shoal("param", NAME, "dump", "-o", tmp_path / "part.yaml")
    assert partial.exit_code == 1
    assert "not whole: no answer from 1 entities (GPS)" in partial.stderr
    assert "unknown:\n- GPS\n" in (tmp_path / "part.yaml").read_text()


@pytest.mark.heavy
def test_a_parameter_is_described(one: object) -> None:
    ((width,),) = lines_of("param", NAME, "describe", WIDTH, "--json")
    assert (width["type"], width["unit"], width["minimum"], width["maximum"]) == ("real", "m", 0.1, None)
    assert (width["scope"], width["visibility"], width["default"], width["source"]) == (
        "global",
        "user",
        "5.0",
        "vehicle",
    )
    unknown = shoal("param", NAME, "describe", "Path Control:Zzz")
    assert unknown.exit_code == 1
    assert "Path Control has no parameter 'Zzz'" in unknown.stderr
