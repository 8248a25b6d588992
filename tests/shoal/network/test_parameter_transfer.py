"""Parameters to a file and back, with a station that keeps them as a DUNE does."""

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeVar

import pytest

import imc
from runtime.profile import read_config
from shoal.network import (
    AsyncRemoteVehicle,
    FileSection,
    FileValue,
    Network,
    ParameterDescription,
    ParameterFileError,
    ParameterOutcome,
    UDPLink,
    UnfitParameters,
    VehicleParameters,
    check_parameters,
    describe_parameters,
    dump_parameters,
    load_parameters,
    parameter_file_text,
    read_parameter_file,
)
from tests.shoal.network.parameter_station import ParameterStation
from tests.shoal.network.station import discovery_ports, living

T = TypeVar("T")
WIDTH = "Corridor -- Width"


@pytest.fixture(autouse=True)
def in_a_hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.network.system_table.PATIENCE", 0.6)
    monkeypatch.setattr("shoal.network.parameters.QUIET", 0.25)
    monkeypatch.setattr("shoal.network.parameters.ROUNDS", 5)
    monkeypatch.setattr("shoal.network.parameter_transfer.SETTLING", 0.2)


def with_station(
    act: Callable[[AsyncRemoteVehicle], Awaitable[T]], change: Callable[[ParameterStation], object] = lambda _: None
) -> tuple[T, ParameterStation]:
    async def run() -> tuple[T, ParameterStation]:
        ports = discovery_ports()
        station = ParameterStation(ports)
        change(station)
        async with living(station), Network([UDPLink(ports=ports)]) as network:
            return await act(AsyncRemoteVehicle(network, await network.find_system("station"))), station

    return asyncio.run(run())


def load(
    path: Path, change: Callable[[ParameterStation], object] = lambda _: None
) -> tuple[list[ParameterOutcome], ParameterStation]:
    async def act(vehicle: AsyncRemoteVehicle) -> list[ParameterOutcome]:
        return await load_parameters(vehicle, await check_parameters(vehicle, read_parameter_file(path)))

    return with_station(act, change)


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.heavy
def test_a_dump_has_the_sections_of_a_profile_and_is_loaded_unchanged(tmp_path: Path) -> None:
    found, _ = with_station(dump_parameters)
    assert found.unknown == ()
    path = written(tmp_path / "dump.ini", parameter_file_text(found, ".ini"))
    config = read_config(path)
    assert not config.problems
    assert config.value("Control.Path.LOSNSMC", WIDTH) == "1.5"
    assert config.value("Control.Path.LOSNSMC", "Entity Label") == "Path Control"
    outcomes, station = load(path)
    assert {one.outcome for one in outcomes} == {"unchanged"}
    assert not any(isinstance(message, imc.SetEntityParameters) for message in station.heard)


@pytest.mark.heavy
def test_each_parameter_is_read_back_and_the_order_is_sent_once(tmp_path: Path) -> None:
    text = (
        "[Path Control]\nCorridor -- Width = 3.0\nCourse Control = wide\n[Sensors.GPS]\nSerial Port - Device = /dev/x\n"
    )
    outcomes, station = load(written(tmp_path / "some.ini", text))
    assert [(one.name, one.outcome) for one in outcomes] == [
        (WIDTH, "set"),
        ("Course Control", "rejected"),
        ("Serial Port - Device", "set"),
    ]
    assert station.values["Path Control"] == {WIDTH: "3.0", "Course Control": "false"}
    orders = [message.name for message in station.heard if isinstance(message, imc.SetEntityParameters)]
    assert orders == ["Path Control", "GPS"]


@pytest.mark.heavy
def test_an_order_that_is_not_answered_has_no_answer_and_was_sent_once(tmp_path: Path) -> None:
    path = written(tmp_path / "some.ini", "[Path Control]\nCorridor -- Width = 3\n")
    outcomes, station = load(path, lambda station: station.deaf.add(imc.SetEntityParameters))
    assert [(one.outcome, one.value, one.reason) for one in outcomes] == [("no answer", "1.5", "it is still 1.5")]
    assert sum(isinstance(message, imc.SetEntityParameters) for message in station.heard) == 1


@pytest.mark.heavy
def test_a_vehicle_that_falls_silent_after_the_order_leaves_the_value_unknown(tmp_path: Path) -> None:
    path = written(tmp_path / "some.ini", "[Path Control]\nCorridor -- Width = 3\n")

    def silence(station: ParameterStation) -> None:
        station.mute_after = (imc.SetEntityParameters,)

    outcomes, station = load(path, silence)
    assert [(one.outcome, one.value) for one in outcomes] == [("no answer", None)]
    assert station.values["Path Control"][WIDTH] == "3"


@pytest.mark.heavy
def test_nothing_is_sent_if_one_value_does_not_fit(tmp_path: Path) -> None:
    text = "[Path Control]\nCorridor -- Width = 3\nCoridor = 3\n[Nothing]\nRate = 3\n"
    path = written(tmp_path / "some.ini", text)

    async def act(vehicle: AsyncRemoteVehicle) -> str:
        with pytest.raises(UnfitParameters) as raised:
            await check_parameters(vehicle, read_parameter_file(path))
        return str(raised.value)

    reasons, station = with_station(act)
    assert reasons.split("\n") == [
        f"{path}:4: no entity 'Nothing'; known: Path Control, GPS",
        f"{path}:3: Path Control has no parameter 'Coridor'; known: Corridor -- Width, Course Control",
    ]
    assert not any(isinstance(message, imc.SetEntityParameters) for message in station.heard)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("text", "second"),
    [
        (f"[Control.Path.LOSNSMC]\n{WIDTH} = 2\n[Path Control]\n{WIDTH} = 3\n", 3),
        (f"[First]\nEntity Label = Path Control\n{WIDTH} = 2\n[Second]\nEntity Label = Path Control\n{WIDTH} = 3\n", 4),
    ],
)
def test_two_sections_of_one_entity_are_rejected_and_nothing_is_sent(tmp_path: Path, text: str, second: int) -> None:
    path = written(tmp_path / "twice.ini", text)

    async def act(vehicle: AsyncRemoteVehicle) -> str:
        with pytest.raises(UnfitParameters) as raised:
            await check_parameters(vehicle, read_parameter_file(path))
        return str(raised.value)

    reasons, station = with_station(act)
    assert reasons == f"{path}:{second}: the parameters of Path Control are already in {path}:1"
    assert not any(isinstance(message, imc.SetEntityParameters) for message in station.heard)


@pytest.mark.heavy
def test_the_ranges_of_the_vehicle_count(tmp_path: Path) -> None:
    def typed(station: ParameterStation) -> None:
        station.types = True

    async def describe(vehicle: AsyncRemoteVehicle) -> tuple[object, ...]:
        found = (await describe_parameters(vehicle, ["Path Control"]))["Path Control"]
        width, course = found[WIDTH], found["Course Control"]
        assert (width.refusal("50.3"), width.refusal("0.1")) == ("", "")  # they are sent in single precision
        assert width.refusal("0.05") == "0.05 is below the minimum (expects real, 0.1 to 50.3, m)"
        assert course.refusal("true") == "cannot be changed while the vehicle runs"
        return width.type, width.unit, width.minimum, width.maximum, width.scope, width.visibility, width.source

    assert with_station(describe, typed)[0] == ("real", "m", 0.1, 50.3, "maneuver", "user", "vehicle")

    async def of_an_older_one(vehicle: AsyncRemoteVehicle) -> tuple[object, ...]:
        width = (await describe_parameters(vehicle, ["Path Control"]))["Path Control"][WIDTH]
        return width.value, width.type, width.source, width.default, width.refusal("wide")

    assert with_station(of_an_older_one)[0] == ("1.5", "", "", None, ""), "nothing is made up"


@pytest.mark.parametrize(
    ("kind", "choices", "text", "reason"),
    [
        ("integer", ("1", "2.0"), "2", ""),
        ("integer", ("1", "2"), "3", "3 is not one of 1, 2"),
        ("integer", ("1.5", "2"), "3", ""),
        ("integer", ("inf", "2"), "3", ""),
        ("list:integer", ("auto", "2"), "3, 4", ""),
        ("boolean", ("true", "false"), "true", ""),
        ("real", ("0.5", "1"), "0.7", "0.7 is not one of 0.5, 1.0"),
    ],
)
def test_choices_that_are_no_values_of_the_type_refuse_nothing(
    kind: str, choices: tuple[str, ...], text: str, reason: str
) -> None:
    """A vehicle of another make may list them as it likes."""
    assert ParameterDescription("GPS", "Rate", "1", type=kind, choices=choices).refusal(text) == reason


@pytest.mark.heavy
def test_an_entity_that_does_not_answer_is_marked_as_unknown() -> None:
    found, _ = with_station(
        dump_parameters, lambda station: station.deaf.add(imc.QueryEntityInfo) or station.values.pop("GPS")
    )
    assert found.unknown == ()  # a DUNE does not answer for an entity without parameters
    assert found.components == {}
    assert "[Path Control]" in parameter_file_text(found, ".ini"), "its task is unknown"


def test_a_file_says_what_is_unknown(tmp_path: Path) -> None:
    found = VehicleParameters("station", 5, 0.0, {"GPS": {"Rate": "1"}}, {"GPS": "Sensors.GPS"}, ("IMU",))
    ini = parameter_file_text(found, ".ini")
    assert ini.splitlines()[:2] == [
        "# Parameters of station (0x0005), received 1970-01-01 00:00:00 UTC.",
        "# unknown: IMU did not answer",
    ]
    path = written(tmp_path / "dump.yaml", parameter_file_text(found, ".yaml"))
    assert "unknown:\n- IMU\n" in path.read_text()
    (section,) = read_parameter_file(path)
    assert section == FileSection("GPS", True, f"{path}:7", {"Rate": FileValue("1", f"{path}:8")})


def test_no_section_of_an_ini_replaces_that_of_another_entity(tmp_path: Path) -> None:
    """As of a DUNE, where a task without a label is called as its section."""
    values = {"Backup": {"Port": "1"}, "Transports.UDP": {"Port": "2"}, "Third": {"Port": "3"}}
    found = VehicleParameters("station", 0x0B01, 0.0, values, dict.fromkeys(values, "Transports.UDP"))
    path = written(tmp_path / "all.ini", parameter_file_text(found, ".ini"))
    read = {section.name: section.values["Port"].text for section in read_parameter_file(path)}
    assert read == {"Backup": "1", "Transports.UDP": "2", "Third": "3"}


def test_a_value_that_an_ini_cannot_hold_goes_to_yaml(tmp_path: Path) -> None:
    text = "a; b # c\nd"
    found = VehicleParameters("station", 5, 0.0, {"GPS": {"Init": text}})
    with pytest.raises(ParameterFileError, match=r"write to a \.yaml"):
        parameter_file_text(found, ".ini")
    path = written(tmp_path / "dump.yaml", parameter_file_text(found, ".yaml"))
    assert read_parameter_file(path)[0].values["Init"].text == text


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.txt", "x", "a file of parameters ends with .ini, .yaml, .yml"),
        ("a.yaml", "parameters: {}", "no parameters are in it"),
        ("a.yaml", "parameters:\n  GPS:\n    Rate: [1]\n", "a.yaml:3: expected text"),
        ("a.yaml", "parameter: {}", "unknown key 'parameter'"),
        ("a.yaml", "parameters:\n  GPS: {Rate: 1}\n  GPS: {Rate: 2}\n", "a.yaml:3: 'GPS' occurs twice"),
        ("a.ini", "[GPS]\nRate = 3\n[GPS]\nRate = 4\n", "a.ini:4: [GPS] Rate is already in line 2"),
        ("a.ini", "Rate = 3\n", "a.ini:1: "),
        ("a.ini", "", "no parameters are in it"),
    ],
)
def test_a_file_that_is_wrong_is_named_with_its_line(tmp_path: Path, name: str, text: str, reason: str) -> None:
    with pytest.raises(ParameterFileError) as raised:
        read_parameter_file(written(tmp_path / name, text))
    assert reason in str(raised.value)
