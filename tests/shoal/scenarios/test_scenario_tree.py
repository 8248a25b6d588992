"""Scenario documents: the places of values, values in their place, and digests."""

import pytest

from shoal.scenarios import load_document

TEXT = """
vehicle:
  profile: otter
  parameters:
    Simulators.GPS: {HACC: 3}
    Simulators.IMU/AHRS: {Standard Deviation - Euler: 0.1}
world:
  current: {north: 0.3, east: 0}
expect:
  - {name: near, finally: distance(SimulatedState, EstimatedState) < 10 m}
metrics:
  drift: {max: distance(SimulatedState, EstimatedState)}
  speed: {rms: "hypot(SimulatedState.u, SimulatedState.v)"}
limit: 2 s
"""


@pytest.fixture
def trial(document):
    return document(begin=TEXT.replace("    Simulators.IMU/AHRS: {Standard Deviation - Euler: 0.1}\n", ""))


def settings(scenario):
    return {(s.section, s.option): s.value for s in scenario.vehicles[0].settings}


def test_values_have_places(trial):
    places = trial.scalars_by_path()
    assert {"vehicle/parameters/Simulators.GPS/HACC", "world/current/north", "expect/0/name", "limit"} <= set(places)
    assert places["world/current/north"].content == "0.3"
    assert places["world/current/north"].line == 7


def test_texts_that_yaml_cuts_at_commas_are_whole(trial):
    assert trial.scalars_by_path()["expect/0/finally"].content == "distance(SimulatedState, EstimatedState) < 10 m"
    assert trial.scalars_by_path()["metrics/drift/max"].content == "distance(SimulatedState, EstimatedState)"
    assert [metric.name for metric in trial.scenario().metrics] == ["drift", "speed"]


@pytest.mark.parametrize("value", [0.25, 1e-05, 3, 1e22, -0.0])
def test_a_number_arrives_unchanged(trial, value):
    found = settings(
        trial.scenario({"world/current/north": min(value, 9.0), "vehicle/parameters/Simulators.GPS/HACC": abs(value)})
    )
    assert float(found["Simulators.StreamVelocity", "Default Speed North"]) == min(value, 9.0)
    assert float(found["Simulators.GPS", "HACC"]) == abs(value)


def test_values_replace_others_and_add_to_mappings(trial):
    changed = trial.scenario(
        {
            "vehicle/parameters/Simulators.GPS/HACC": 7.5,
            "vehicle/parameters/Simulators.IMU/AHRS/Entity Label": "Compass",
            "vehicle/start/heading": 45.0,
            "world/current/down": 0.1,
            "limit": 5.0,
            "expect/0/name": "close",
        }
    )
    found = settings(changed)
    assert found["Simulators.GPS", "HACC"] == "7.5"
    assert found["Simulators.IMU/AHRS", "Entity Label"] == "Compass"
    assert found["Simulators.VSIM", "Initial Heading"] == "45.0"
    assert found["Simulators.StreamVelocity", "Default Speed Down"] == "0.1"
    assert changed.limit == 5.0
    assert changed.expectations[0].name == "close"
    assert settings(trial.scenario())["Simulators.GPS", "HACC"] == "3"


def test_the_digest_is_that_of_the_values(document, tmp_path):
    first = document(begin=TEXT.replace("Standard Deviation - Euler: 0.1", "Entity Label: AHRS"))
    again = load_document(first.path)
    assert first.digest == again.digest
    first.path.write_text("# a comment\n" + first.path.read_text())
    assert load_document(first.path).digest == first.digest
    first.path.write_text(first.path.read_text().replace("0.3", "0.4"))
    assert load_document(first.path).digest != first.digest


def test_the_digest_knows_plans_and_profiles(document, tmp_path):
    (tmp_path / "own.ini").write_text("[Require otter.ini]\n[General]\nVehicle = own\n")
    (tmp_path / "plan.yaml").write_text("origin: 41.185°, -8.7062°\nmaneuvers:\n  - goto: {north: 3, speed: 1}\n")
    first = document(begin="vehicle: {profile: own.ini, plan: plan.yaml}\n")
    before = first.digest
    (tmp_path / "plan.yaml").write_text("origin: 41.185°, -8.7062°\nmaneuvers:\n  - goto: {north: 4, speed: 1}\n")
    planned = load_document(first.path).digest
    (tmp_path / "own.ini").write_text("[Require otter.ini]\n[General]\nVehicle = own\nBattery Capacity = 1000\n")
    assert len({before, planned, load_document(first.path).digest}) == 3
