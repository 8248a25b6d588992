"""Relays, lights and buttons of a joystick, by the options of a profile."""

import pytest

import imc
from mavlink.vehicle.command.relays_lights_buttons import parse_button, parse_light
from tests.tasks.transports.test_mavlink_manual import Helmsman
from tests.tasks.transports.test_mavlink_vehicles import Commanded

ACCEPTED, DENIED = 0, 2
SWITCHES = {
    "relays": ["Pump", "Camera Power"],
    "lights": ["9=Front", "10=Rear"],
    "buttons": ["0=relay 1", "1=brighter 9", "2=darker 9", "3=return", "17=hold", "4=abort", "5=disarm", "6=relay 7"],
}


@pytest.fixture
def lit(tmp_path):
    flown = Commanded("lauv-noptilus-1", tmp_path, **SWITCHES)
    flown.switched = []
    for kind in (imc.PowerChannelControl, imc.SetLedBrightness):
        flown.vehicle.observe(kind, flown.switched.append)
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    yield flown, Helmsman(flown)
    flown.vehicle.close()


def test_relays_are_power_channels_by_number(lit):
    flown, console = lit
    assert [console.order(*params, command=181) for params in ((0, 1), (1, 0))] == [ACCEPTED] * 2
    assert [(m.name, m.op) for m in flown.switched] == [("Pump", 1), ("Camera Power", 0)]
    assert {m.dst for m in flown.switched} == {flown.vehicle.system}
    nan = float("nan")
    assert [console.order(*params, command=181) for params in ((2, 1), (-1, 1), (nan, 1), (0, 2))] == [DENIED] * 4
    assert len(flown.switched) == 2


def test_lights_are_servo_outputs(lit):
    flown, console = lit
    assert [console.order(9, width, command=183) for width in (1100, 1500, 2000)] == [ACCEPTED] * 3
    assert [(m.name, m.value) for m in flown.switched] == [("Front", 0), ("Front", 128), ("Front", 255)]
    assert [console.order(*params, command=183) for params in ((11, 1500), (9, 0), (9, float("nan")))] == [DENIED] * 3


def test_buttons_act_once_as_they_go_down(lit):
    flown, console = lit

    def press(buttons, seconds=0.4, **more):
        console.say("MANUAL_CONTROL", target=console.mine, z=500, buttons=buttons, **more)
        flown.vehicle.run(seconds)

    for buttons in (1, 1, 0, 1):
        press(buttons)
    assert [(m.name, m.op) for m in flown.switched] == [("Camera Power", 2)] * 2
    flown.switched.clear()
    for buttons in (2, 0, 2, 0, 4, 64):
        press(buttons)
    assert [(m.name, m.value) for m in flown.switched] == [("Front", 51), ("Front", 102), ("Front", 51)]
    press(8, 3.0)
    assert flown.modes[-1] == "RETURN"
    press(0, buttons2=2)
    flown.vehicle.run(3.0)
    assert flown.modes[-1] == "HOLD"
    press(32, 3.0)
    assert not flown.link.endpoint.model.armed_or_moving
    press(16, 1.0)
    assert flown.link.endpoint.model.health.aborted
    console.say("MANUAL_CONTROL", target=console.mine + 1, buttons=1)
    assert len(flown.switched) == 3


@pytest.mark.parametrize("text", ["", "9", "0=Front", "256=Front", "9=", "x=Front"])
def test_lights_that_are_refused(text):
    with pytest.raises(ValueError, match="SERVO=NAME"):
        parse_light(text)


@pytest.mark.parametrize("text", ["", "3", "32=hold", "3=dance", "3=relay", "3=hold 2", "hold=3"])
def test_buttons_that_are_refused(text):
    with pytest.raises(ValueError, match="NUMBER=ACTION"):
        parse_button(text)
