"""The texts that `shoal send` takes for the fields of a message."""

import math
import re

import click
import pytest

import imc
from shoal.cli.send import build_message


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("EstimatedState", "psi=90deg", math.pi / 2),
        ("EstimatedState", "depth=-inf", -math.inf),
        ("EstimatedState", "depth=NaN", math.nan),
        ("PlanControl", "op=stop", imc.PlanControl.Op.STOP),
        ("PlanControl", "flags=CALIBRATE|IGNORE_ERRORS", 3),
        ("PlanControl", "flags=0x2|1", 3),
        ("PlanControl", "request_id=010", 10),
        ("PlanControl", "plan_id=12", "12"),
        ("PlanControl", 'arg={"abbrev": "Goto", "speed": 1.5}', imc.Goto(speed=1.5)),
        ("DevDataBinary", "value=12", b"\x12"),
    ],
)
def test_a_text_is_read_as_the_type_of_its_field_asks(name: str, text: str, value: object) -> None:
    found = getattr(build_message(name, (text,), imc.builtin()), text.partition("=")[0])
    assert found == (pytest.approx(value, nan_ok=True) if isinstance(value, float) else value)


@pytest.mark.parametrize(
    ("name", "texts", "reason"),
    [
        ("EstimatedState", "deph=3", "EstimatedState has no field 'deph'; did you mean 'depth'?"),
        ("EstimatedState", "depth=", "depth: '' is not a number"),
        ("EstimatedState", "depth=1e400", "depth: '1e400' is not a number"),
        ("EstimatedState", "psi=15degrees", "psi: '15degrees' is not an angle, such as 0.26 or 15deg"),
        ("Rpm", "value=1.5", "value: '1.5' is not a whole number"),
        ("Rpm", "value=40000", "value: 40000 is not within -32768 to 32767 (int16_t)"),
        ("PlanControl", "op=STRAT", "op: 'STRAT' is not one of START, STOP, LOAD, GET, and no whole number"),
        ("PlanControl", "flags=CALIBRATE|", "flags: 'CALIBRATE|' is not one of CALIBRATE, IGNORE_ERRORS, and"),
        ("DevDataBinary", "value=zz", "value: 'zz' is not bytes in hexadecimal digits, such as 00ff"),
        ("PlanControl", "arg=Goto", 'arg: \'Goto\' is not JSON, such as {"abbrev": "IdleManeuver", "duration": 10}'),
        ("PlanControl", 'arg={"duration": 3}', 'arg: there is no "abbrev", the name of the message'),
        ("PlanControl", "op", "'op' is not FIELD=VALUE"),
        ("PlanControl", "info=a info=b", "info is given twice"),
    ],
)
def test_a_text_that_does_not_fit_is_named_with_its_field(name: str, texts: str, reason: str) -> None:
    given = (texts,) if "{" in texts else tuple(texts.split())
    with pytest.raises(click.UsageError, match=f"^{re.escape(reason)}"):
        build_message(name, given, imc.builtin())
