"""Conditions and expressions of scenarios: truth, margins, units, names, and the same meaning as in plans."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

import imc
from autonomy.plans import parse_condition
from imc.coordinates import absolute_position
from imc.expressions import NO_NUMBER
from shoal.scenarios.conditions import parse_expression, parse_scenario_condition
from shoal.scenarios.message_names import ExpressionScope
from support.wgs84 import offset

ALONE = ExpressionScope({"lauv": imc.builtin()}, "lauv")
PAIR = ExpressionScope({"a": imc.builtin(), "b-1": imc.builtin()})
MESSAGES = {
    kind: message
    for message in (
        imc.FuelLevel(value=30.0),
        imc.EstimatedState(depth=5.0, psi=0.1, x=-2.0),
        imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER),
        imc.PlanControlState(man_id="Goto1"),
    )
    for kind in [type(message)]
}


def latest(condition):
    return [MESSAGES.get(selector.kind) for selector in condition.selectors]


def margin(text, scope=ALONE):
    condition = parse_scenario_condition(text, scope)
    return condition.margin(latest(condition))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("EstimatedState.depth < 8", 3.0),
        ("EstimatedState.depth < 8 m", 3.0),
        ("3 > EstimatedState.depth", -2.0),
        ("abs(EstimatedState.x) + 1 m <= EstimatedState.depth", 2.0),
        ("(EstimatedState.x + 4) * 2 > 1", 3.0),
        ("-EstimatedState.x - -1 == 3", 0.0),
        ("hypot(EstimatedState.x, 0) != 2", -0.0),
        ("min(EstimatedState.depth, 9 m, 4) / 2 > 1", 1.0),
        ("not EstimatedState.depth < 8", -3.0),
        ("EstimatedState.depth < 8 and FuelLevel.value > 29", 1.0),
        ("EstimatedState.depth > 8 or FuelLevel.value > 29", 1.0),
        ("EstimatedState.depth > 8, FuelLevel.value > 29", -3.0),
        ("(EstimatedState.depth > 8 or FuelLevel.value > 31) and FuelLevel.value > 0", -1.0),
        ("VehicleState.op_mode == MANEUVER", math.inf),
        ("ERROR == VehicleState.op_mode", -math.inf),
        ("PlanControlState.man_id == 'Goto1'", math.inf),
        ('PlanControlState.man_id != "Goto1"', -math.inf),
        ("EstimatedState.depth / 0 < 3", NO_NUMBER),
        ("EstimatedState.depth < inf", math.inf),
        ("distance(EstimatedState, EstimatedState) < 3 m", 3.0),
    ],
)
def test_margins(text, expected):
    assert margin(text) == pytest.approx(expected, abs=1e-12)


def test_angles_are_in_radians_and_wrap():
    assert margin("EstimatedState.psi < 10°") == pytest.approx(math.radians(10.0) - 0.1)
    assert margin("abs(angle(EstimatedState.psi - 360 deg)) < 0.2 rad") == pytest.approx(0.1)


def test_distances_are_those_of_exact_positions():
    a = imc.SimulatedState(lat=0.7, lon=-0.15, height=2.0, x=2000.0, y=-900.0, z=30.0)
    b = imc.EstimatedState(lat=0.7004, lon=-0.1503, height=0.0, x=-300.0, y=400.0, z=3.0)
    expected = math.hypot(*offset(*absolute_position(a)[:2], *absolute_position(b)[:2]))
    found = parse_expression("distance(SimulatedState, EstimatedState)", ALONE)
    assert found.value([a, b]) == pytest.approx(expected, rel=1e-5)
    assert found.value([a.replace(lat=0.7004, lon=-0.1503), b]) == pytest.approx(math.hypot(2300.0, 1300.0), rel=1e-5)
    assert math.isnan(found.value([a.replace(lat=math.inf), b]))


def test_what_is_just_met_is_met_and_what_is_just_missed_is_not():
    assert margin("EstimatedState.depth <= 5") > 0.0 > margin("EstimatedState.depth < 5")
    assert margin("not EstimatedState.depth < 5") > 0.0 > margin("not EstimatedState.depth >= 5")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("Temperature.value > 3", None),
        ("not Temperature.value > 3", None),
        ("Temperature.value > 3 and EstimatedState.depth > 9", -4.0),
        ("Temperature.value > 3 and EstimatedState.depth > 2", None),
        ("Temperature.value > 3 or EstimatedState.depth > 2", 3.0),
        ("Temperature.value > 3 or EstimatedState.depth > 9", None),
    ],
)
def test_a_margin_is_unknown_while_messages_that_decide_it_are_missing(text, expected):
    assert math.isnan(margin(text)) if expected is None else margin(text) == expected


def test_what_a_text_names_is_watched():
    def watches(text):
        return [(w.kind.__name__, w.vehicle, w.entity) for w in parse_scenario_condition(text, PAIR).selectors]

    assert watches("Temperature[CTD 2].value@b-1 > 3") == [("Temperature", "b-1", "CTD 2")]
    assert watches("EstimatedState.x@a > EstimatedState.y@a") == [("EstimatedState", "a", "")]
    assert watches("distance(SimulatedState@a, SimulatedState@b-1) > 5 m") == [
        ("SimulatedState", "a", ""),
        ("SimulatedState", "b-1", ""),
    ]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("EstimatedState.deph > 3", r"has no numeric field 'deph' \(did you mean 'depth'\?\)"),
        ("EstimatdState.depth > 3", r"no message 'EstimatdState' \(did you mean 'EstimatedState'\?\)"),
        ("VehicleState.op_mode == EROR", r"not a value of VehicleState.op_mode \(did you mean 'ERROR'\?\)"),
        ("EstimatedState.depth > 3 s", "EstimatedState.depth is in m, but 3 s is in s"),
        ("EstimatedState.depth + EstimatedState.psi > 3", "is in m, but EstimatedState.psi is in rad"),
        ("EstimatedState.depth = 3", "'=' is not understood; write =="),
        ("EstimatedState.depth", "a comparison is missing"),
        ("EstimatedState.depth > ", "a number or Message.field is missing"),
        ("1 < EstimatedState.depth < 3", "join two comparisons by and"),
        ("EstimatedState > 3", "write which field, such as EstimatedState.lat"),
        ("depth > 3", "'depth' is neither a number nor Message.field"),
        ("squareroot(2) > 1", "there is no function 'squareroot'"),
        ("hypot() > 1", "hypot takes a value at least"),
        ("abs(1, 2) > 1", "abs takes 1 value, not 2"),
        ("distance(EstimatedState) > 1", "takes two messages"),
        ("distance(EstimatedState, Temperature) > 1", "Temperature has no position"),
        ("altitude(GpsFix) > 1", "GpsFix has no position of a vehicle"),
        ("altitude(3) > 1", "takes messages, such as SimulatedState"),
        ("PlanControlState.man_id > 'a'", "only be compared with a text"),
        ("PlanControlState.man_id == 3", "only be compared with a text"),
        ("ManeuverIsDone", "is for plans only"),
        ("(EstimatedState.depth > 3", r"a \) is missing"),
        ("(" * 400 + "EstimatedState.depth", "is nested more than 50 times"),
        ("abs(" * 200 + "EstimatedState.depth", "is nested more than 50 times"),
        ("EstimatedState.depth@c > 3", "there is no vehicle 'c'"),
        ("__import__('os') > 3", "there is no function"),
    ],
)
def test_mistakes_are_named(text, reason):
    with pytest.raises(ValueError, match=reason):
        parse_scenario_condition(text, ALONE)


def test_of_several_vehicles_one_is_named():
    with pytest.raises(ValueError, match="there are several vehicles; write @NAME behind it"):
        parse_scenario_condition("EstimatedState.depth > 3", PAIR)
    assert (
        parse_scenario_condition("EstimatedState.depth > 3", ExpressionScope(PAIR.vehicles, "a")).selectors[0].vehicle
        == "a"
    )


def test_a_number_in_a_message_inside_is_known_where_it_is_one():
    found = parse_expression("2 * PlanControl.arg.speed", ALONE)
    assert found.is_known([imc.PlanControl(arg=imc.Goto(speed=1.5))])
    assert found.value([imc.PlanControl(arg=imc.Goto(speed=1.5))]) == 3.0
    for inside in (None, imc.PlanSpecification()):
        assert not found.needs_all
        assert not found.is_known([imc.PlanControl(arg=inside)])


def test_expressions():
    found = parse_expression("2 * EstimatedState.depth - 1 m", ALONE)
    assert found.value(latest(found)) == 9.0
    assert found.unit == "m"
    with pytest.raises(ValueError, match="is a text"):
        parse_expression("PlanControlState.man_id", ALONE)
    with pytest.raises(ValueError, match="is true or false, not a number"):
        parse_expression("EstimatedState.depth < 3", ALONE)


FIELDS = ("FuelLevel.value", "EstimatedState.depth", "EstimatedState.x", "VehicleState.op_mode", "Temperature.value")
NUMBERS = st.one_of(
    st.sampled_from(["5", "30", "-2", "+4", ".5", "3.", "1e2", "nan", "-1E-3"]), st.floats().map(lambda x: f"{x:g}")
).filter(lambda text: "-inf" not in text and "-nan" not in text)
SINGLE = st.tuples(st.sampled_from(FIELDS), st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), NUMBERS).map(" ".join)
CONDITIONS = st.recursive(
    SINGLE,
    lambda inner: st.one_of(
        inner.map("({})".format),
        inner.map("not ({})".format),
        inner.map("!{}".format),
        st.tuples(inner, st.sampled_from([" and ", "&&", ", ", " or ", " || "]), inner).map("".join),
    ),
    max_leaves=6,
)
VALUES = st.one_of(st.sampled_from([5.0, 30.0, -2.0, math.nan, math.inf, 0.0]), st.floats(width=32))


def states(depth, x, fuel):
    return {
        imc.FuelLevel: imc.FuelLevel(value=fuel),
        imc.EstimatedState: imc.EstimatedState(depth=depth, x=x),
        imc.VehicleState: imc.VehicleState(op_mode=2),
    }


def reference(text, known):
    """What Python makes of the same text, with a comparison that has no message being false."""
    words = text.replace("&&", " and ").replace("||", " or ").replace(",", " and ")
    words = re.sub(r"!(?!=)", " not ", words)
    names = dict(nan=math.nan, inf=math.inf, **{kind.__name__: known.get(kind) for kind in imc_kinds(text)})
    absent = [name for name, message in names.items() if message is None]
    for name in absent:
        words = re.sub(rf"{name}\.\w+ \S+ [^\s()]+", "False", words)
    return bool(eval(words, {"__builtins__": {}}, names))


def imc_kinds(text):
    return {imc.builtin()[name] for name in re.findall(r"([A-Z]\w+)\.", text)}


@given(CONDITIONS, VALUES, VALUES, VALUES)
def test_a_condition_of_a_plan_means_the_same(text, depth, x, fuel):
    known = states(depth, x, fuel)
    ours, plan = parse_scenario_condition(text, ALONE), parse_condition(text)
    given = [known.get(watch.kind) for watch in ours.selectors]
    assert ours.holds(given) == plan.holds(known, False) == reference(text, known)
    assert {selector.kind for selector in ours.selectors} == plan.kinds == imc_kinds(text)


@given(CONDITIONS.filter(lambda text: "Temperature" not in text), VALUES, VALUES, VALUES)
def test_the_sign_of_the_margin_is_the_truth(text, depth, x, fuel):
    known = states(depth, x, fuel)
    ours = parse_scenario_condition(text, ALONE)
    given = [known[watch.kind] for watch in ours.selectors]
    found = ours.margin(given)
    assert found != 0.0
    assert (found > 0.0) == ours.holds(given)


@given(st.text(alphabet="EstimadSe.depthx<>=!&|() 0123456789+-*/,'mabsor_@[]°", max_size=60))
def test_any_text_is_a_condition_or_a_value_error(text):
    try:
        condition = parse_scenario_condition(text, ALONE)
    except ValueError:
        return
    condition.margin([selector.kind() for selector in condition.selectors])
