"""Expressions on the fields of messages."""

import pytest

import imc
from shoal.network import parse_message_filter

STATE = imc.EstimatedState(depth=3.0, u=1.0, psi=0.5, src=26)
PLAN = imc.PlanControlState(state=imc.PlanControlState.State.EXECUTING, plan_id="survey-1")
BOOK = imc.LogBookEntry(text="plan loaded", type=imc.LogBookEntry.Type.ERROR)
OUTER = imc.PlanDB(arg=imc.PlanSpecification(plan_id="inner"))
VEHICLE = imc.VehicleState(flags=imc.VehicleState.Flags.MANEUVER_DONE)


@pytest.mark.parametrize(
    ("text", "message", "expected"),
    [
        ("", STATE, True),
        ("depth > 2", STATE, True),
        ("depth > 2 and u > 1", STATE, False),
        ("not depth > 2 or src == 26", STATE, True),
        ("(depth<2||u>=1)&&!psi==0", STATE, True),
        ("psi > 20deg", STATE, True),
        ("psi > 30 °", STATE, False),
        ("EstimatedState.depth > 2", STATE, True),
        ("EstimatedState.depth > 2", imc.Depth(value=3.0), False),
        ("depth > 2", imc.Depth(value=3.0), False),
        ("state == EXECUTING", PLAN, True),
        ("state == BOOT", imc.EntityState(state=imc.EntityState.State.BOOT), True),
        ("state == BOOT", PLAN, False),
        ("plan_id == 'survey-1'", PLAN, True),
        ('plan_id ~ "SURVEY"', PLAN, True),
        ("arg.plan_id > 3", OUTER, False),
        ("2 < depth and abs(u - 2 kn) < 0.1", STATE, True),
        ("depth > 2 cm and hypot(u, v) < 1 m/s + 1", STATE, True),
        ("contains(text, 'LOAD')", BOOK, True),
        ("not contains(text, 'leak')", STATE, True),
        ("value > 20 °C", imc.Temperature(value=21.0), True),
        ("value > 20 °C", imc.Depth(value=21.0), False),
        ("distance(EstimatedState, 0°, 0.001°) < 112 m", STATE, True),
        ("distance(GpsFix, 0°, 0.001°) < 112 m", STATE, False),
        ("timestamp > 3 s", STATE, False),
        ("text ~ 'loaded' and type == ERROR", BOOK, True),
        ("arg.plan_id == 'inner'", OUTER, True),
        ("PlanDB.arg.plan_id == 'inner'", imc.PlanDB(), False),
        ("arg.speed + 1 m/s > 2 m/s", imc.PlanControl(arg=imc.Goto(speed=1.5)), True),
        ("1 < arg.speed and not max(-arg.speed, 0) > 0", imc.PlanControl(arg=imc.Goto(speed=1.5)), True),
        ("0 < arg.speed", imc.PlanControl(), False),
        ("0 < arg.speed", imc.PlanControl(arg=imc.PlanSpecification()), False),
        ("0 < arg.points", imc.PlanControl(arg=imc.FollowPath(points=(imc.PathPoint(),))), False),
        ("arg.speed - 1 < 0 or -arg.speed < 1 or abs(arg.speed) < 1", imc.PlanControl(), False),
        ("arg.custom * 2 < 1 or 2 ~ arg.custom or 'a' ~ arg.custom", imc.PlanControl(arg=imc.Goto(custom="b")), False),
        ("flags ~ MANEUVER_DONE", VEHICLE, True),
        ("flags ~ 1", imc.VehicleState(), False),
    ],
)
def test_expressions(text, message, expected):
    assert parse_message_filter(text)(message) is expected


@pytest.mark.parametrize(
    ("text", "kinds", "reason"),
    [
        ("deth > 2", [imc.EstimatedState], "EstimatedState has no field 'deth'; did you mean 'depth'?"),
        ("blub > 2", [], "none of these messages has a field 'blub'"),
        ("Depth.value > 2", [imc.EstimatedState], "Depth is not among the messages asked for"),
        ("depth >", [imc.EstimatedState], "a number or Message.field is missing, at character 8"),
        ("depth", [imc.EstimatedState], "a comparison is missing"),
        ("depth > two", [imc.EstimatedState], "'two' is not a value of it; write a number, or a text in quotes"),
        ("state == FLYING", [imc.PlanControlState], "'FLYING' is not a value of it; known: BLOCKED"),
        ("depth > 2 3", [], "'3' is not expected"),
        ("depth = 2", [], "'=' is not understood; write =="),
        ("depth =>2", [], "'=>2' is not understood; write >="),
        ("depth > 2 & u > 1", [], "'&' is not understood; write and"),
        ("0 < depth < 5", [imc.EstimatedState], "'<' is not expected: join two comparisons by and, at character 11"),
        ("depth == nan", [], "nothing compares with nan, at character 10"),
        ("depth.x > 2", [imc.EstimatedState], "depth has no fields, so there is no depth.x"),
        ("src.x > 2", [], "src has no fields, so there is no src.x"),
        (
            "plan_id > 3",
            [imc.PlanControlState],
            "a text can only be compared with a text, by ==, != or ~, at character 1",
        ),
        ("depth > 2 s", [imc.EstimatedState], "depth is in m, but 2 s is in s, at character 9"),
        ("depth > 2 and u > 1 kmh", [], "there is no unit 'kmh' (did you mean 'km/h'?), at character 21"),
        ("Temperature[CTD].value > 2", [], "write the field alone; VEHICLE and --entities choose whose it is"),
        ("age(GpsFix) > 3 s", [], "age is for scenarios only"),
        ("text ~ 3", [imc.LogBookEntry], "text ~ needs a text in quotes, at character 8"),
        ("state = 2", [], "write =="),
        ("__import__('os')", [], "there is no function '__import__'"),
        ("depth > 2; import os", [], "';' is not understood"),
        ("(" * 400, [], "is nested more than 50 times"),
        ("depth > 2 and " * 100, [], "has more than 1000 characters"),
    ],
)
def test_mistakes_are_named(text, kinds, reason):
    with pytest.raises(ValueError) as mistake:
        parse_message_filter(text, kinds)
    assert reason in str(mistake.value)
