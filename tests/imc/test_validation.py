"""Limits of fields in the protocol, and the check of a message."""

import math

import pytest

import imc


def test_fields_are_described() -> None:
    found = {info.name: info for info in imc.fields(imc.EstimatedState)}
    assert list(found) == list(imc.EstimatedState.__struct_fields__[5:-1])
    assert found["lat"] == ("lat", "fp64_t", "rad", -math.pi / 2, math.pi / 2, None, frozenset())
    state, flags, description = imc.fields(imc.EntityState)
    assert (state.enum, flags.enum) == (imc.EntityState.State, imc.EntityState.Flags)
    assert (description.type, description.unit) == ("plaintext", "")
    assert imc.fields(imc.DesiredZ)[1].enum is imc.ZUnits
    assert imc.fields(imc.ControlLoops)[1].enum is imc.CLoopsMask
    assert "Goto" in imc.fields(imc.PlanManeuver)[1].messages
    assert imc.fields(imc.MsgList)[0].messages == frozenset()
    assert imc.fields(imc.Heartbeat) == imc.fields(imc.Unknown) == ()


def test_every_field_of_every_message_is_described() -> None:
    for definition in imc.builtin().messages:
        cls = getattr(imc, definition.abbrev)
        infos = imc.fields(cls)
        assert tuple(info.name for info in infos) == cls.__struct_fields__[5:-1]
        for info, field in zip(infos, definition.fields, strict=True):
            assert (info.enum is not None) == bool(field.values or field.enum_def or field.bitfield_def)


def test_defaults_are_valid() -> None:
    for definition in imc.builtin().messages:
        violations = imc.validate(getattr(imc, definition.abbrev)())
        low = {field.attribute for field in definition.fields if (field.minimum or 0) > 0}
        assert {violation.field for violation in violations} == low


@pytest.mark.parametrize(
    ("message", "texts"),
    [
        (imc.EstimatedState(lat=2.0), ["lat: 2.0 is not within -1.5707963267948966 to 1.5707963267948966 rad"]),
        (imc.EstimatedState(lat=math.nan), ["lat: nan is not within -1.5707963267948966 to 1.5707963267948966 rad"]),
        (imc.CpuUsage(value=101), ["value: 101 is not at most 100 %"]),
        (imc.CpuUsage(value=300), ["value: 300 is not within 0 to 255 (uint8_t)"]),
        (
            imc.Goto(src=-1, speed=1e39),
            ["src: -1 is not within 0 to", "speed: 1e+39 is not within the range of fp32_t"],
        ),
        (imc.EntityState(state=200), []),
        (imc.PlanManeuver(data=imc.Goto(lat=-2.0)), ["data.lat: -2.0 is not within -1.57"]),
        (
            imc.MsgList(msgs=[None, imc.PlanManeuver(data=imc.Heartbeat())]),
            ["msgs[1].data: 'Heartbeat' is not one of Alignment, "],
        ),
        (imc.PlanSpecification(maneuvers=[imc.Heartbeat()]), ["maneuvers[0]: 'Heartbeat' is not one of PlanManeuver"]),
    ],
)
def test_violations(message: imc.Message, texts: list[str]) -> None:
    violations = imc.validate(message)
    assert len(violations) == len(texts)
    for violation, text in zip(violations, texts, strict=True):
        assert text in str(violation)


def test_limits_do_not_bind_the_codec() -> None:
    message = imc.CpuUsage(value=101)
    assert imc.decode(imc.encode(message)) == message
