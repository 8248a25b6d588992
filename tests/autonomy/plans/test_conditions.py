"""Conditions of transitions."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

import imc
from autonomy.plans.conditions import parse_condition

LATEST = {
    imc.FuelLevel: imc.FuelLevel(value=30.0),
    imc.EstimatedState: imc.EstimatedState(depth=5.0),
    imc.LogBookEntry: imc.LogBookEntry(text="leak of the fore hull"),
    imc.VehicleState: imc.VehicleState(flags=imc.VehicleState.Flags.MANEUVER_DONE),
}


@pytest.mark.parametrize("text", ["", "true", "ManeuverIsDone", " maneuverisdone() "])
def test_what_consoles_write_is_done(text):
    condition = parse_condition(text)
    assert condition.holds({}, True)
    assert not condition.holds({}, False)
    assert condition.kinds == frozenset()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("FuelLevel.value < 40", True),
        ("FuelLevel.value >= 40", False),
        ("FuelLevel.value == 30 and EstimatedState.depth > 4", True),
        ("FuelLevel.value == 30, EstimatedState.depth > 5", False),
        ("FuelLevel.value != 30 || EstimatedState.depth <= 5e0", True),
        ("not (FuelLevel.value < 40 or ManeuverIsDone)", False),
        ("!ManeuverIsDone && FuelLevel.value < 40", True),
        ("Temperature.value > -1000", False),
        ("FuelLevel.value < 40 %", True),
        ("EstimatedState.depth > 0.004 km and EstimatedState.depth < 400 cm + 2 m", True),
        ("abs(EstimatedState.depth - 7) == 2", True),
        ("VehicleState.op_mode == ERROR", False),
        ("LogBookEntry.text ~ 'LEAK' and contains(LogBookEntry.text, 'fore')", True),
        ("VehicleState.flags ~ MANEUVER_DONE", True),
        ("distance(EstimatedState, 0°, 0.001°) < 112 m", True),
        ("distance(EstimatedState, 0°, 0.001°) < 0.05 nmi", False),
    ],
)
def test_comparisons(text, expected):
    assert parse_condition(text).holds(LATEST, False) is expected


def test_a_product_beyond_any_float_is_infinite():
    text = "*".join(["SmsTx.seq"] * 40)
    for condition in (f"{text} > 1", f"hypot({text}, 1) > 1", f"-{text} < inf"):
        assert parse_condition(condition).holds({imc.SmsTx: imc.SmsTx(seq=2**32 - 1)}, True)


@pytest.mark.parametrize(
    "text",
    [
        "0.5 < PlanControl.arg.speed",
        "PlanControl.arg.speed + 1 < 9",
        "PlanControl.arg.plan_id + 1 < 9",
        "-PlanControl.arg.speed < 9",
        "abs(PlanControl.arg.speed) < 9",
        "2 ~ PlanControl.arg.speed",
    ],
)
@pytest.mark.parametrize("inner", [None, imc.PlanSpecification(plan_id="a")])
def test_a_comparison_with_a_field_that_the_message_inside_does_not_have_is_false(text, inner):
    assert not parse_condition(text).holds({imc.PlanControl: imc.PlanControl(arg=inner)}, True)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("FuelLevel.valu < 2", "FuelLevel has no numeric field 'valu'"),
        ("LogBookEntry.text < 2", "a text can only be compared with a text"),
        ("Foo.x < 3", "'Foo.x' is neither ManeuverIsDone nor Message.field"),
        ("FuelLevel.value", "a comparison is missing"),
        ("FuelLevel.value = 3", "'=' is not understood"),
        ("FuelLevel.value <", "a number or Message.field is missing, at character 18"),
        ("FuelLevel.value < x", "'x' is neither a number nor Message.field .*, at character 19"),
        ("FuelLevel.value < 20 m", "FuelLevel.value is in %, but 20 m is in m, at character 19"),
        ("FuelLevel.value < 20 percent", r"there is no unit 'percent' \(did you mean '%'\?\), at character 22"),
        ("FuelLvel.value < 2", r"nor Message.field \(did you mean 'FuelLevel'\?\), at character 1"),
        ("EstimatedState.depth@other > 2", "a plan compares its own vehicle's messages"),
        ("age(GpsFix) > 3 s", "age is for scenarios only"),
        ("$depth > 3", "only scenarios capture values"),
        ("(true", r"a \) is missing"),
        ("true true", "'true' is not expected"),
        ("true and", "a number or Message.field is missing"),
        ("(" * 400, "is nested more than 50 times"),
        ("true and " * 200, "has more than 1000 characters"),
        ("__import__('os')", "there is no function '__import__'"),
    ],
)
def test_mistakes_are_named(text, reason):
    with pytest.raises(ValueError, match=reason):
        parse_condition(text)


@given(st.text(alphabet="aTrueManIsDone.<>=!&|() 0123456789,xFuelLvV_-", max_size=60))
def test_any_text_is_a_condition_or_a_value_error(text):
    try:
        parse_condition(text).holds(LATEST, True)
    except ValueError:
        pass
