"""A parameter on the page shows where its value at the start comes from, and whether it differs since."""

import asyncio
import json

import pytest
from starlette.requests import Request

from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.console import ProfileSettings
from shoal.console.parameters.parameter_routes import ParameterRoutes
from shoal.network import ParameterDescription

ENTITY = "Depth Sensor"


class Vehicle:
    name = "lauv-noptilus-1"

    @property
    def system(self) -> "Vehicle":
        return self


@pytest.fixture(scope="module")
def settings(tmp_path_factory: pytest.TempPathFactory) -> ProfileSettings:
    saved = tmp_path_factory.mktemp("db")
    (saved / "lauv-noptilus-1-saved.ini").write_text("[Simulators.DepthSensor]\nExecution Frequency = 7\n")
    profile = load_profile("lauv-noptilus-1", saved=saved, overrides=["Simulators.DepthSensor:Standard Deviation=0.02"])
    vehicle = build(profile, ["Simulation"], clock=VirtualClock(), log_root=saved, state_folder=saved).vehicle
    found = ProfileSettings(vehicle)
    vehicle.profile.override("Simulators.GPS:HDOP=3")  # as an order does
    return found


@pytest.mark.parametrize(
    ("name", "value", "lines"),
    [
        ("Debug Level", "None", ["from the default"]),
        ("Debug Level", "Spew", ["set since the start, when it was None from the default"]),
        ("Entity Label", ENTITY, ["auv/simulation.ini:"]),
        ("Entity Label", "Other", [f"set since the start, when it was {ENTITY} from "]),
        ("Standard Deviation", "0.02", ["from the command line"]),
        ("Standard Deviation", "0.03", ["set since the start, when it was 0.02 from the command line"]),
        ("Execution Frequency", "7", ["lauv-noptilus-1-saved.ini:2", "saved for the next start: 7"]),
        ("Execution Frequency", "8", ["set since the start, when it was 7.0 from ", "saved for the next start: 7"]),
    ],
)
def test_a_parameter_shows_what_set_it_and_whether_it_differs(settings, monkeypatch, name, value, lines):
    async def describe(vehicle, entities):
        return {ENTITY: {name: ParameterDescription(ENTITY, name, value, source="vehicle")}}

    monkeypatch.setattr("shoal.console.parameters.parameter_routes.describe_parameters", describe)
    request = Request({"type": "http", "query_string": b"vehicle=lauv-noptilus-1&entity=Depth+Sensor"})
    answer = json.loads(asyncio.run(ParameterRoutes(lambda _: Vehicle(), settings).details(request)).body)
    shown = [text for text, _ in answer["values"][name]["origin"]]
    assert len(shown) == len(lines), shown
    assert all(expected in text for expected, text in zip(lines, shown, strict=True)), shown


def test_the_present_options_are_those_of_the_command_line_saved_and_ordered(settings):
    found = settings.present_options()
    assert found.profile.endswith("/etc/lauv-noptilus-1.ini")
    assert {option for option in found.overrides if option.startswith("Simulators.")} == {
        "Simulators.DepthSensor:Execution Frequency=7",
        "Simulators.DepthSensor:Standard Deviation=0.02",
        "Simulators.GPS:HDOP=3",
    }
