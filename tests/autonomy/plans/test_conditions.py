"""Conditions of transitions."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

import imc
from autonomy.plans.conditions import parse_condition

LATEST = {imc.FuelLevel: imc.FuelLevel(value=30.0), imc.EstimatedState: imc.EstimatedState(depth=5.0)}


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
    ],
)
def test_comparisons(text, expected):
    assert parse_condition(text).holds(LATEST, False) is expected


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("FuelLevel.valu < 2", "FuelLevel has no numeric field 'valu'"),
        ("LogBookEntry.text < 2", "LogBookEntry has no numeric field 'text'"),
        ("Foo.x < 3", "'Foo.x' is neither ManeuverIsDone nor Message.field"),
        ("FuelLevel.value", "a comparison is missing"),
        ("FuelLevel.value = 3", "'=' is not understood"),
        ("FuelLevel.value <", "needs a number"),
        ("FuelLevel.value < x", "needs a number"),
        ("(true", r"a \) is missing"),
        ("true true", "'true' is not expected"),
        ("true and", "a condition is missing"),
        ("(" * 400, "is nested more than 50 times"),
        ("true and " * 200, "has more than 1000 characters"),
        ("__import__('os')", "is not"),
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
