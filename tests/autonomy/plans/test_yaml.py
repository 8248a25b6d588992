"""Plans as files: short to write, exact when read back, with clear errors."""

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from autonomy.plans.yaml import PlanFileError, parse_plan, plan_text
from autonomy.plans.yaml.value_codec import format_degrees, parse_quantity
from shoal.missions import load_plan
from support import wgs84

PLANS = Path(__file__).parents[2] / "data" / "plans"
DEMO = """
plan: demo
origin: 41.185°, -8.7062°
speed: 1.2 m/s
depth: 3
maneuvers:
  - goto: {north: 60}
  - loiter: {north: 60, east: 30, radius: 15, duration: 2min, direction: CCLOCKW}
    then: [{to: SK, when: FuelLevel.value < 20}, Path]
  - follow_path: {north: 0, points: [[0, 0], [10, 0, 1]]}
    id: Path
    on_start: {Sidescan: {Active: true, Range: 30}}
  - rows: {at: "41.185°, -8.7°", width: 40, length: 60, hstep: 20, bearing: 30°, flags: [SQUARE_CURVE, CURVE_RIGHT]}
    then: end
  - station_keeping: {north: 0, radius: 15, duration: 30, altitude: 4 m, speed: 1200 rpm}
    id: SK
"""


def test_a_short_plan_is_a_plan():
    plan = parse_plan(DEMO)
    names = [m.maneuver_id for m in plan.maneuvers]
    assert (plan.plan_id, plan.start_man_id) == ("demo", "Goto1")
    assert names == ["Goto1", "Loiter2", "Path", "Rows4", "SK"]
    goto, loiter, path, rows, station = (m.data for m in plan.maneuvers)
    north, east, _ = wgs84.displacement(math.radians(41.185), math.radians(-8.7062), 0.0, goto.lat, goto.lon, 0.0)
    assert (north, east) == pytest.approx((60.0, 0.0), abs=1e-3)
    assert (goto.z, goto.z_units, goto.speed, goto.speed_units) == (3.0, imc.ZUnits.DEPTH, 1.2, 0)
    assert (loiter.duration, loiter.direction) == (120, imc.Loiter.Direction.CCLOCKW)
    assert [(p.x, p.z) for p in path.points] == [(0.0, 0.0), (10.0, 1.0)]
    assert (rows.flags, rows.bearing) == (3, math.radians(30))
    assert (station.z, station.z_units, station.speed, station.speed_units) == (4.0, imc.ZUnits.ALTITUDE, 1200.0, 1)


def test_names_stay_as_they_are_written():
    text = (
        "plan: 007\norigin: 41.185°, -8.7062°\nspeed: 1.2 m/s\nmaneuvers:\n"
        "  - goto: {north: 40}\n    id: 12:30\n    then: [{to: 1_0, when: ManeuverIsDone}]\n"
        "  - goto: {north: 50}\n    id: 0x10\n    then: 12:30\n"
        "  - goto: {north: 60}\n    id: 1_0\n    on_start: {Modem: {Code: 010, Time: 12:30, Active: yes}}\n"
    )
    plan = parse_plan(text)
    assert (plan.plan_id, plan.start_man_id) == ("007", "12:30")
    assert [m.maneuver_id for m in plan.maneuvers] == ["12:30", "0x10", "1_0"]
    assert [(t.source_man, t.dest_man) for t in plan.transitions] == [("12:30", "1_0"), ("0x10", "12:30")]
    assert [p.value for p in plan.maneuvers[2].start_actions[0].params] == ["010", "12:30", "true"]
    assert imc.encode(parse_plan(plan_text(plan))) == imc.encode(plan)
    with pytest.raises(PlanFileError, match=r"plan:1: plan: expected a text, not False"):
        parse_plan(text.replace("007", "no"))


def test_transitions_follow_the_list_unless_they_are_written():
    arrows = [(t.source_man, t.dest_man, t.conditions) for t in parse_plan(DEMO).transitions]
    assert arrows == [
        ("Goto1", "Loiter2", "ManeuverIsDone"),
        ("Loiter2", "SK", "FuelLevel.value < 20"),
        ("Loiter2", "Path", "ManeuverIsDone"),
        ("Path", "Rows4", "ManeuverIsDone"),
    ]


def test_actions_are_parameters_of_entities():
    (action,) = parse_plan(DEMO).maneuvers[2].start_actions
    assert action.name == "Sidescan"
    assert [(p.name, p.value) for p in action.params] == [("Active", "true"), ("Range", "30")]


@pytest.mark.parametrize("plan", [parse_plan(DEMO), load_plan(PLANS / "three_gotos.json")], ids=["demo", "recorded"])
def test_what_is_written_is_read_back_to_the_byte(plan, tmp_path):
    path = tmp_path / "plan.yaml"
    path.write_text(plan_text(plan), encoding="utf-8")
    assert imc.encode(load_plan(path)) == imc.encode(plan.replace(timestamp=-1.0))


def test_a_name_that_looks_like_a_number_stays_a_name():
    text = DEMO.replace("id: Path", "id: 1e3").replace("Path]", "1e3]").replace("radius: 15", "radius: 15e0")
    plan = parse_plan(text)
    names = [m.maneuver_id for m in plan.maneuvers]
    assert (names[2], plan.maneuvers[1].data.radius) == ("1e3", 15.0)
    assert [m.maneuver_id for m in parse_plan(plan_text(plan)).maneuvers] == names


def test_a_recorded_plan_is_short():
    assert plan_text(load_plan(PLANS / "three_gotos.json")).count("\n") == 7


def test_plans_that_are_not_short_are_written_in_full():
    variable = imc.PlanVariable(name="n", value="3", type=imc.PlanVariable.Type.NUMBER)
    plan = imc.PlanSpecification(plan_id="odd", variables=[variable], maneuvers=[imc.PlanManeuver(maneuver_id="a")])
    text = plan_text(plan)
    assert text.startswith("abbrev: PlanSpecification")
    assert imc.encode(parse_plan(text)) == imc.encode(plan)


@settings(max_examples=60)
@given(st.floats(-1.57, 1.57), st.floats(-3.14, 3.14), st.floats(0, 5, width=32), st.floats(-100, 100, width=32))
def test_every_position_speed_and_depth_is_exact(lat, lon, speed, z):
    goto = imc.Goto(lat=lat, lon=lon, z=z, z_units=1, speed=speed)
    plan = imc.PlanSpecification(
        plan_id="p", start_man_id="a", maneuvers=[imc.PlanManeuver(maneuver_id="a", data=goto)]
    )
    assert imc.encode(parse_plan(plan_text(plan))) == imc.encode(plan)


@given(st.floats(-10, 10))
def test_degrees_are_exact(angle):
    assert parse_quantity(format_degrees(angle), "rad") == angle


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "f.yaml:1: the file is empty"),
        ("- a", "f.yaml:1: a plan must be a mapping of names to values"),
        ("plan: x\nmaneuvers: [", "f.yaml:[23]: not YAML: "),
        ("plan: x\nmaneuvers: []", "f.yaml:2: maneuvers: expected a list"),
        ("plan: x\nmaneuvers:\n  - gotoo: {}", "f.yaml:3: there is no maneuver 'gotoo' .did you mean 'Goto'"),
        ("plan: x\nmaneuvers:\n  - goto: {at: 3}", "f.yaml:3: 3 is not a latitude and a longitude"),
        ("maneuvers:\n  - goto: {at: [41, -8]}", "f.yaml:2: .* write the unit"),
        ("maneuvers:\n  - idle:\n  - station_keeping: {depth: 3}", "f.yaml:3: StationKeeping needs a position: at, or"),
        ("maneuvers:\n  - goto:", "f.yaml:2: Goto needs a position"),
        ("maneuvers:\n  - loiter: {lat: 41°}", "f.yaml:2: lat and lon belong together"),
        ("origin: 41°, -8°\nmaneuvers:\n  - goto: {north: 3, at: '41°, -8°'}", "f.yaml:3: at and north exclude each"),
        ("maneuvers:\n  - goto: {at: '41°, -8°', lat: 41°, lon: -8°}", "f.yaml:2: at and lat exclude each other"),
        ("maneuvers:\n  - goto: {at: '95°, -8°'}", "f.yaml:2: '95°, -8°' is not a place on Earth"),
        ("maneuvers:\n  - goto: {lat: 41.1, lon: -8.7}", "f.yaml:2: lat: 2354.86° is not a place on Earth; plain"),
        ("plan: ''\nmaneuvers:\n  - idle:", "f.yaml:1: plan must not be empty"),
        ("plan:\nmaneuvers:\n  - idle:", "f.yaml:1: plan: expected a text, not None"),
        ("maneuvers:\n  - idle:\n    id: no", "f.yaml:3: id: expected a text, not False"),
        ("maneuvers:\n  - idle:\n    id: A\n  - idle:\n    id: A", "f.yaml:4: the id 'A' is used twice"),
        ("maneuvers:\n  - idle:\n    id: end", "f.yaml:2: 'end' cannot be an id"),
        ("start: x\nmaneuvers:\n  - idle:", "f.yaml:1: there is no maneuver 'x' .known: IdleManeuver1"),
        ("maneuvers:\n  - idle:\n    then:", "f.yaml:3: expected then: NAME"),
        ("maneuvers:\n  - idle:\n    then: [{to: end, when: x < 3}]", "f.yaml:3: when: x < 3: 'x' is neither"),
        ("speed: -1\nmaneuvers:\n  - idle:", "f.yaml:1: speed must be above 0"),
        ("maneuvers:\n  - goto: {depth: .nan}", "f.yaml:2: nan is not a number"),
        ("maneuvers:\n  - loiter: {radius: .inf}", "f.yaml:2: radius: inf is not a number"),
        ("maneuvers:\n  - loiter: {radius: -5}", "f.yaml:2: radius must not be below 0"),
        ("maneuvers:\n  - pop_up: {flags: [WAIT_AT_SURFACE]}", "f.yaml:2: PopUp needs a position"),
        ("maneuvers:\n  - goto: {north: 3}", "f.yaml:2: north and east need an origin"),
        (
            "origin: 41°, -8°\nmaneuvers:\n  - goto: {east: -1e7}",
            "f.yaml:3: -1e.07 m are more than 1000000 m from the o",
        ),
        ("maneuvers:\n  - goto: {speed: 1e309}", "f.yaml:2: '1e309' is too large a number"),
        ("maneuvers:\n  - idle: {duration: 1e300s}", "f.yaml:2: IdleManeuver: duration: 1e.300 is not within 0 to 65"),
        ("maneuvers:\n  - idle: {duration: 1e309s}", "f.yaml:2: '1e309s' is too large a number"),
        (
            "maneuvers:\n  - goto: {speed: 3 knots}",
            "f.yaml:2: '3 knots' is not a number with a unit .did you mean 'kn'?",
        ),
        ("speed: 1.2 furlongs\nmaneuvers:\n  - idle:", "f.yaml:1: '1.2 furlongs' is not a number with a unit .°, deg"),
        ("maneuvers:\n  - goto: {depth: 3°}", "f.yaml:2: '3°' should be in m"),
        ("maneuvers:\n  - goto: {latt: 3}", "f.yaml:2: Goto has no field 'latt' .did you mean 'lat'"),
        ("maneuvers:\n  - idle: {depth: 3}", "f.yaml:2: IdleManeuver has no depth"),
        ("origin: 41°, -8°\nmaneuvers:\n  - idle: {north: 3}", "f.yaml:3: IdleManeuver has no position"),
        ("maneuvers:\n  - goto: {depth: 3, altitude: 2}", "f.yaml:2: depth and altitude exclude each other"),
        ("maneuvers:\n  - goto: {z: 3, depth: 2}", "f.yaml:2: z and depth exclude each other"),
        ("maneuvers:\n  - loiter: {direction: left}", "f.yaml:2: direction: 'left' is not a valid name .*CCLOCKW"),
        ("maneuvers:\n  - idle: {duration: 99999}", "f.yaml:2: IdleManeuver: duration: 99999 is not within"),
        ("maneuvers:\n  - idle:\n    then: x", "f.yaml:3: there is no maneuver 'x' .known: IdleManeuver1"),
        ("maneuvers:\n  - idle:\n    then: {go: x}", "f.yaml:3: expected then: NAME"),
        ("maneuvers:\n  - idle:\n  - 3", "f.yaml:3: a maneuver must be a mapping of names"),
        ("plan: x\nplan: y", "f.yaml:2: 'plan' occurs twice"),
        ("x: &a [*a]\nmaneuvers: *a", "f.yaml:1: anchors and aliases are not allowed"),
        ("maneuvers: [{rows: {flags: [LEFT]}}]", "f.yaml:1: 'LEFT' is not one of SQUARE_CURVE"),
        ("maneuvers: [{follow_path: {points: [1]}}]", "f.yaml:1: expected points as a list of"),
        ("abbrev: Goto", "f.yaml: is a Goto, not a PlanSpecification"),
        ("abbrev: Foo", "f.yaml: .*Foo"),
        ("!!python/object/apply:os.system ['true']", "f.yaml:1: tags such as"),
        ("maneuvers: [{goto: {speed: !!python/name:os.system }}]", "f.yaml:1: tags such as"),
    ],
)
def test_mistakes_are_named_with_their_line(text, reason):
    with pytest.raises(PlanFileError, match=reason):
        parse_plan(text, "f.yaml")


@pytest.mark.parametrize("then", ["end", "[end]", "[{to: end}]", "[{to: end, when: FuelLevel.value < 20}]"])
def test_a_plan_may_end_at_any_maneuver(then):
    plan = parse_plan(f"maneuvers:\n  - idle: {{duration: 1}}\n    then: {then}")
    assert {arrow.dest_man for arrow in plan.transitions} <= {"_done_"}
    assert imc.encode(parse_plan(plan_text(plan)).replace(timestamp=-1.0)) == imc.encode(plan.replace(timestamp=-1.0))


@pytest.mark.parametrize("maneuver", ["elevator: {flags: [CURR_POS]}", "pop_up: {flags: [CURR_POS]}", "idle:"])
def test_maneuvers_that_are_done_anywhere_need_no_position(maneuver):
    assert parse_plan(f"maneuvers:\n  - {maneuver}").maneuvers


def test_a_plan_too_long_for_a_message_is_refused():
    text = "plan: x\nmaneuvers:\n" + "  - idle: {duration: 1}\n" * 10_000
    with pytest.raises(PlanFileError, match=r"f\.yaml:2: 10000 maneuvers are more than the 4096"):
        parse_plan(text, "f.yaml")


def test_files_that_are_no_plans(tmp_path):
    path = tmp_path / "plan.json"
    for content in (b"[", b"\xff", b"{}", b'{"abbrev": "Goto"}'):
        path.write_bytes(content)
        with pytest.raises(PlanFileError, match=r"plan\.json"):
            load_plan(path)
    with pytest.raises(OSError):
        load_plan(tmp_path / "none.yaml")
