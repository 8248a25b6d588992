"""Mistakes in scenario files: each is an error with file, line and, if a name is near, a hint."""

import re

import pytest

from shoal.scenarios import ScenarioFileError, load_document, run
from tests.outside import NO_FILE

OTTER = "vehicle: {profile: otter}\n"
PAIR = "vehicles: {a: {profile: otter}, b: {profile: otter}}\nlinks: [{between: [a, b], name: x}]\n"


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("", 1, "the file is empty"),
        ("- a", 1, "expected a mapping"),
        ("seed: 3", 1, "either a vehicle or vehicles"),
        ("vehicel: {profile: otter}", 1, "unknown key 'vehicel' (did you mean 'vehicle'?)"),
        ("vehicles: {}", 1, "there is no vehicle"),
        ("vehicle: {profile: oter}", 1, "there is no profile 'oter'"),
        ("vehicle: {profile: otter, name: a/b}", 1, "'a/b' cannot be the name of a vehicle"),
        ("vehicle: {profile: otter, modes: [Simulaton]}", 1, "(did you mean 'Simulation'?)"),
        (
            "vehicle:\n  profile: otter\n  parameters: {Simulators.GPSS: {HACC: 3}}",
            3,
            "there is no section [Simulators.GPSS] (did you mean 'Simulators.GPS'?)",
        ),
        (
            "vehicle:\n  profile: otter\n  parameters:\n    Simulators.GPS:\n      HACC: 2\n      HACK: 3",
            6,
            "'HACK' is not a parameter of Simulators.GPS (did you mean 'HACC'?)",
        ),
        ("vehicle:\n  profile: otter\n  parameters: {General: {Absolute: 1}}", 3, "[General] has no option 'Absolute'"),
        (
            "vehicle:\n  profile: otter\n  parameters: {General: {Absolute Maximum Dept: 1}}",
            3,
            "(did you mean 'Absolute Maximum Depth'?)",
        ),
        ("vehicle:\n  profile: otter\n  parameters: {Simulators.GPS: {HACC: -3}}", 3, "-3 is below the minimum"),
        ("vehicle:\n  profile: otter\n  parameters: {Simulators.GPS: {HACC: 3 kg}}", 3, "'3 kg' should be in m"),
        ("vehicle:\n  profile: otter\n  start: {at: '3, 4'}", 3, "write the unit"),
        ("vehicle:\n  profile: otter\n  start: {level: 120 %}", 3, "Initial Level: 120 is above the maximum"),
        ("vehicle:\n  profile: otter\n  start: {level: 12 m}", 3, "should be in %"),
        ("vehicle:\n  profile: otter\n  start: {time: yesterday}", 3, "is not a date and time"),
        ("vehicle:\n  profile: otter\n  plan: none.yaml", 3, NO_FILE),
        ("vehicle:\n  profile: otter\n  plan:\n    maneuvers:\n      - got: {}", 5, "there is no maneuver 'got'"),
        (OTTER + "world: {curent: {north: 3}}", 2, "(did you mean 'current'?)"),
        (OTTER + "world: {current: {north: 3 knots}}", 2, "'3 knots' is not a number with a unit (did you mean 'kn'?)"),
        (OTTER + "world: {current: {north: 300}}", 2, "300 is above the maximum"),
        (OTTER + "world: {water type: blue}", 2, "[World] Water Type = blue is not one of"),
        (OTTER + "world: {objects: {a: {clas: Glider}}}", 2, "an object has no 'clas' (did you mean 'class'?)"),
        ("vehicle: {profile: lauv-noptilus-1}\nworld: {wind: {speed: 3}}", 2, "no vehicle has an option for wind"),
        (OTTER + "expect:\n  - always: SimulatedState.zz < 3", 3, "has no numeric field 'zz' (did you mean 'z'?)"),
        (OTTER + "expect:\n  - always: SimulatedState.z < 3 s", 3, "SimulatedState.z is in m, but 3 s is in s"),
        (OTTER + "expect:\n  - allways: SimulatedState.z < 3", 3, "(did you mean 'always'?)"),
        (OTTER + "expect:\n  - {always: SimulatedState.z < 3, within: 3 s}", 3, "unknown key 'within'"),
        (OTTER + "expect:\n  - {until: SimulatedState.z < 3}", 3, "'holds' is missing"),
        (OTTER + "expect:\n  - {after: SimulatedState.z < 3, always: SimulatedState.z < 3}", 3, "within: TIME"),
        (OTTER + "expect:\n  - {always: SimulatedState.z < 3, from: 5 s, to: 3 s}", 3, "ends before it begins"),
        (OTTER + "expect: [{always: SimulatedState.z < 3},\n  {always: SimulatedState.z < 3}]", 3, "is used twice"),
        (OTTER + "expect:\n  - outcome: SUCCESS", 3, "otter has no plan"),
        (OTTER + "expect: [{always: Temperature[CTD].value < 3}]", 2, "needs quotes"),
        (OTTER + "metrics: {a: {maximum: SimulatedState.z}}", 2, "(did you mean 'max'?)"),
        (OTTER + "metrics: {a: {percentile: SimulatedState.z}}", 2, "'of' is missing"),
        (OTTER + "metrics: {a: {percentile: SimulatedState.z, of: 101 %}}", 2, "from 0 to 100"),
        (OTTER + "metrics: {a: {time above: SimulatedState.z, limit: 3 s}}", 2, "should be in m"),
        (OTTER + "metrics: {a: {max: SimulatedState.z < 3}}", 2, "is true or false, not a number"),
        (OTTER + "metrics: {a: {max: VehicleState.op_mode}}", 2, "is an enumeration, whose numbers have no max"),
        (OTTER + "metrics: {a: {time above: VehicleState.op_mode, limit: 1}}", 2, "first or last of it"),
        (OTTER + "metrics: {a: {max: SimulatedState.z, from: 5 s, to: 3 s}}", 2, "ends before it begins"),
        (OTTER + "metrics: {a: {max: 5 * 3 m}}", 2, "5 * 3 m: names no message"),
        (OTTER + "expect:\n  - always: 1 < 2", 3, "1 < 2: names no message"),
        (OTTER + "stop when: 1 < 2", 2, "names no message"),
        (OTTER + "description: [a]", 2, "expected text"),
        (PAIR + "metrics: {'x: sent': {max: SimulatedState.z@a}}", 3, "'x: sent' is a count of a link already"),
        (PAIR.replace("x}", "x, loss: -1 %}"), 2, "loss must be at least 0"),
        (PAIR.replace("x}", "x, rate: 0}"), 2, "rate must be above 0"),
        (OTTER + "events: [{at: 1 s, silent: GPS}]", 2, "no task 'GPS' (did you mean 'Simulators.GPS'?)"),
        (OTTER + "events: [{at: 1 s, silent: AHRS}]", 2, "(did you mean 'Simulators.IMU/AHRS'?)"),
        (OTTER + "events: [{at: 1 s, silent: Simulators.GPS, of: []}]", 2, "names no message"),
        (OTTER + "events: [{at: 1 s, set: {}}]", 2, "sets nothing"),
        (OTTER + "events: [{at: 1 s, set: {GPS: {}}}]", 2, "sets nothing"),
        (OTTER + "limit: soon", 2, "'soon' is not a duration"),
        (OTTER + "limit: 1e300", 2, "1e+300 s is longer than 1e+10 s"),
        (OTTER + "world: {bathymetry: {soundings: []}}", 2, "there is no sounding"),
        (OTTER + "limit: 0", 2, "limit must be above 0"),
        (OTTER + "seed: -1", 2, "expected a whole number"),
        (OTTER + "stop when: ManeuverIsDone", 2, "is for plans only"),
        (
            "vehicles: {a: {profile: otter}, b: {profile: otter}}\nstop when: SimulatedState.z < 3",
            2,
            "several vehicles",
        ),
        ("vehicles: {a: {profile: otter, name: c}}", 1, "unknown key 'name'"),
        (
            "vehicles:\n  a: {profile: otter}\n  b:\n    profile: otter\n    start: {time: 2027-01-01T00:00:00Z}",
            5,
            "b and a start at different times",
        ),
    ],
)
def test_mistakes_are_reported_with_file_and_line(document, text, line, reason):
    with pytest.raises(ScenarioFileError) as caught:
        document(begin=text).scenario()
    assert f"trial.scenario.yaml:{line}: " in str(caught.value)
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("values", "line", "reason"),
    [
        ({"vehicle/parameters/Simulators.GPS/HACC": -1.0}, 4, "-1 is below the minimum"),
        ({"vehicle/parameters/Simulators.GPS/HACC": float("nan")}, 4, "nan is not a value"),
        ({"vehicle/parameters/Simulators.GPS/HACK": 1.0}, 4, "(did you mean 'HACC'?)"),
        ({"vehicle/parameters/Simulators.IMU/AHRS/Gyro Noyse": 1.0}, 4, "Simulators.IMU"),
        ({"expect/0/always": "SimulatedState.q2 < 3"}, 6, "has no numeric field 'q2'"),
        ({"expect/7/always": "SimulatedState.z < 3"}, 5, "there is no item '7'"),
        ({"limit/x": 3}, 7, "has no x: it is a value"),
        ({"wordl/current/north": 0.3}, 1, "unknown key 'wordl' (did you mean 'world'?)"),
        ({"limit": float("inf")}, 7, "not a duration"),
    ],
)
def test_a_wrong_value_is_reported_with_the_line_that_it_replaces(document, values, line, reason):
    begin = (
        "vehicle:\n  profile: otter\n  seed: 3\n  parameters: {Simulators.GPS: {HACC: 3}}\n"
        "expect:\n  - {always: SimulatedState.z < 3}\nlimit: 3 s\n"
    )
    with pytest.raises(ScenarioFileError) as caught:
        document(begin=begin).scenario(values)
    assert f"trial.scenario.yaml:{line}: " in str(caught.value)
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "expect:\n  - always: SimulatedState[GSP].z < 3",
        "metrics:\n  a: {max: 'SimulatedState[GSP].z'}",
        "events:\n  - {when: 'SimulatedState[GSP].z < 3', abort: true}",
    ],
)
def test_an_entity_that_the_vehicle_lacks_is_reported_before_the_run(document, text):
    made, said = document(text), "trial.scenario.yaml:5: otter has no entity with the label 'GSP' (did you mean 'GPS'?)"
    with pytest.raises(ScenarioFileError, match=re.escape(said)):
        made.dry_run()
    with pytest.raises(ScenarioFileError, match=re.escape(said)):
        run(made.scenario())


def test_a_file_that_is_not_there_is_an_error_of_the_system(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_document(tmp_path / "none.scenario.yaml")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("limit: 5 m", "trial.scenario.yaml:3: '5 m': m is for meters; write min for minutes"),
        ("limit: 1h 5m", "trial.scenario.yaml:3: '1h 5m': m is for meters; write min for minutes"),
        ("events: [{at: 1 s, silent: Simulators.GPS, for: 0 s}]", ":3: for must be above 0"),
        ("events: [{at: 1 s, silent: Simulators.GPS, crash: Simulators.GPS}]", "of one kind: silent or crash"),
    ],
)
def test_what_would_mean_something_else_is_refused(document, text, words):
    with pytest.raises(ScenarioFileError, match=re.escape(words)):
        document(text, "\nvehicle: {profile: otter}\n").scenario()


def test_messages_of_a_profile_that_are_wrong_are_an_error_of_the_file(document, tmp_path):
    (tmp_path / "mine.ini").write_text("[Require otter.ini]\n[General]\nMessages = none.yaml\n")
    made = document("limit: 5 s", f"\nvehicle: {{profile: {tmp_path}/mine.ini}}\n")
    words = "mine.ini:3: error: [General] Messages: there is no file 'none.yaml'"
    with pytest.raises(ScenarioFileError, match=f"trial.scenario.yaml:2: .*{re.escape(words)}"):
        made.scenario()
