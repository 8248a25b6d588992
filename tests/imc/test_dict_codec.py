"""Messages as dictionaries and as JSON."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

import imc

PLAN = imc.PlanManeuver(
    timestamp=1.5, src=30, maneuver_id="a", data=imc.Goto(lat=0.5, z_units=1), start_actions=[None, imc.Heartbeat()]
)


def test_dictionary_form() -> None:
    plain = PLAN.to_dict()
    assert plain["abbrev"] == "PlanManeuver"
    assert [plain[name] for name in ("timestamp", "src", "src_ent", "dst", "dst_ent")] == [1.5, 30, 255, 65535, 255]
    assert plain["data"]["abbrev"] == "Goto"
    assert "timestamp" not in plain["data"]
    assert plain["start_actions"] == [None, {"abbrev": "Heartbeat"}]
    assert imc.from_dict(plain) == PLAN
    assert imc.from_dict({"abbrev": "Goto"}) == imc.Goto()


def test_json_is_strict_and_returns() -> None:
    message = imc.DevDataBinary(value=b"\x00\xff", timestamp=math.inf, surplus=b"\x01")
    plain = json.loads(message.to_json(), parse_constant=pytest.fail)
    assert (plain["value"], plain["timestamp"], plain["surplus"]) == ("00ff", "inf", "01")
    assert imc.from_json(message.to_json()) == message
    state = imc.EntityState(description="caf\udce9 ☃")
    assert json.loads(state.to_json())["description"] == {"bytes": "636166e920e29883"}
    assert imc.from_json(state.to_json().encode()) == state
    nan = imc.from_json(imc.Temperature(value=math.nan).to_json())
    assert isinstance(nan, imc.Temperature)
    assert math.isnan(nan.value)
    unknown = imc.Unknown(id=64000, payload=b"abc", byteorder="big", src=3)
    assert imc.from_json(unknown.to_json()) == unknown


def test_names_of_values_are_accepted() -> None:
    assert imc.from_json('{"abbrev": "EntityState", "state": "FAULT"}') == imc.EntityState(state=2)
    assert imc.from_dict({"abbrev": "DesiredZ", "z_units": "ALTITUDE", "value": 3}) == imc.DesiredZ(
        z_units=2, value=3.0
    )


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ("[]", "the message: expected an object, not list"),
        ("{}", 'the message: there is no "abbrev", the name of the message'),
        ('{"abbrev": null}', "the message: unknown message None"),
        ('{"abbrev": "Gotoo"}', "the message: unknown message 'Gotoo'"),
        ('{"abbrev": ["Goto"]}', "the message: unknown message ['Goto']"),
        ('{"abbrev": "Goto", "latitude": 1}', "latitude: Goto has no such field"),
        ('{"abbrev": "Goto", "lat": "north"}', "lat: 'north' is not a number (fp64_t)"),
        ('{"abbrev": "Goto", "lat": true}', "lat: True is not a number (fp64_t)"),
        ('{"abbrev": "Goto", "lat": NaN}', "NaN is not JSON"),
        ('{"abbrev": "Goto", "lat": 1, "lat": 2}', "'lat' occurs twice"),
        ('{"abbrev": "Goto", "timeout": 1e3}', "timeout: 1000.0 is not within 0 to 65535 (uint16_t)"),
        ('{"abbrev": "Goto", "timeout": 65536}', "timeout: 65536 is not within 0 to 65535 (uint16_t)"),
        ('{"abbrev": "Goto", "z_units": "UP"}', "z_units: 'UP' is not within 0 to 255 (uint8_t)"),
        ('{"abbrev": "Goto", "speed": 1e300}', "speed: 1e+300 is not within the range of fp32_t"),
        ('{"abbrev": "Goto", "custom": 5}', "custom: 5 is not text"),
        ('{"abbrev": "Goto", "custom": {"bytes": "0"}}', "custom: {'bytes': '0'} is not text"),
        ('{"abbrev": "Goto", "src": null}', "src: None is not within 0 to 65535"),
        ('{"abbrev": "DevDataBinary", "value": "0g"}', "value: '0g' is not bytes"),
        ('{"abbrev": "MsgList", "msgs": {}}', "msgs: expected a list, not dict"),
        ('{"abbrev": "MsgList", "msgs": [null, 5]}', "msgs[1]: expected an object, not int"),
        ('{"abbrev": "MsgList", "msgs": [{"abbrev": "Goto", "src": 1}]}', "msgs[0].src: Goto has no such field"),
        (
            '{"abbrev": "PlanDB", "arg": {"abbrev": "PlanManeuver", "data": {"abbrev": "Goto", "lon": null}}}',
            "arg.data.lon: None is not a number (fp64_t)",
        ),
        ('{"abbrev": "Unknown", "byteorder": "middle"}', "byteorder: expected 'little' or 'big'"),
        ('{"abbrev": "PlanDB", "arg": {"abbrev": "Unknown"}}', "arg: unknown message 'Unknown'"),
    ],
)
def test_what_is_wrong_is_named(text: str, reason: str) -> None:
    with pytest.raises(imc.DecodeError) as caught:
        imc.from_json(text)
    assert reason in caught.value.reason


def test_deep_nesting_is_refused() -> None:
    plain: dict[str, Any] = {"abbrev": "MsgList"}
    for depth in range(5000):
        plain = {"abbrev": "MsgList", "msgs": [plain]}
        if depth == 150:
            message = imc.from_dict(plain)
            assert imc.from_dict(message.to_dict()) == imc.decode(imc.encode(message)) == message
    with pytest.raises(imc.DecodeError, match="nested too deeply"):
        imc.from_dict(plain)
    with pytest.raises(imc.DecodeError, match="not JSON"):
        imc.from_json('{"abbrev": "MsgList", "msgs": [' * 5000)


def test_messages_of_another_schema() -> None:
    schema = imc.load(Path(imc.__file__).parent / "definitions" / "imc-5.4.31.yaml")
    message: Any = schema["GpioStateGet"](name="led")
    assert imc.from_json(message.to_json(), schema) == message
    with pytest.raises(imc.DecodeError, match="unknown message 'GpioStateGet'"):
        imc.from_json(message.to_json())
