"""Relays, lights and the buttons of a joystick, as the profile names them."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import imc
from mavlink.vehicle.command.request import DONE, CommandResult, MavResult

DARK, BRIGHT = 1100.0, 1900.0  # µs of a light, as of ArduSub's
FULL = 255  # of SetLedBrightness
STEP = FULL // 5  # of a button
FORGOTTEN = 2.0  # s without a joystick, after which a pressed button counts as new
BUTTONS = 32
MODES = ("hold", "return", "mission", "manual", "disarm", "abort")
Op = imc.PowerChannelControl.Op


class Light(NamedTuple):
    """The servo output by which ground stations call a light, and the name of its LED."""

    servo: int
    name: str


class Button(NamedTuple):
    """Function of a button: one of MODES, or "relay", "brighter", "darker" with the number of relay or servo."""

    number: int
    action: str
    which: int


def parse_light(text: str) -> Light:
    """Parses "SERVO=NAME", such as "9=Front". Raises ValueError."""
    found = re.fullmatch(r"\s*(\d{1,3})\s*=\s*(\S.*?)\s*", text)
    if found is None or not 1 <= int(found[1]) <= FULL:
        raise ValueError(f"{text!r}: write SERVO=NAME, such as 9=Front")
    return Light(int(found[1]), found[2])


def parse_button(text: str) -> Button:
    """Parses "NUMBER=ACTION", such as "3=hold" or "4=relay 0". Raises ValueError."""
    found = re.fullmatch(r"\s*(\d{1,2})\s*=\s*(\w+)(?:\s+(\d{1,3}))?\s*", text)
    numbered = found is not None and found[2] in ("relay", "brighter", "darker")
    if found is None or int(found[1]) >= BUTTONS or numbered != bool(found[3]) or not (numbered or found[2] in MODES):
        raise ValueError(
            f"{text!r}: write NUMBER=ACTION with a number below {BUTTONS} and one of {', '.join(MODES)}, relay N, "
            "brighter SERVO, darker SERVO"
        )
    return Button(int(found[1]), found[2], int(found[3] or 0))


class RelayNames(NamedTuple):
    """The names of power channels, by number, and the texts of lights and buttons."""

    relays: Sequence[str] = ()
    lights: Sequence[str] = ()
    buttons: Sequence[str] = ()


class Relays:
    """Relays and lights that a ground station switches; `publish` sends a message to the vehicle.

    `act(mode)` carries out one of MODES.
    """

    def __init__(
        self,
        publish: Callable[[imc.Message], object],
        names: RelayNames,
    ) -> None:
        self._publish = publish
        self._relays = [name.strip() for name in names.relays]
        self._lights: Mapping[int, str] = dict(map(parse_light, names.lights))
        self._buttons = [parse_button(button) for button in names.buttons]
        self._brightness: dict[str, int] = {}
        self._pressed: dict[object, tuple[float, int]] = {}

    def set_relay(self, number: int | None, state: int | None) -> CommandResult:
        """DO_SET_RELAY: 0 off, 1 on."""
        if number is None or not 0 <= number < len(self._relays):
            there = f"there are {len(self._relays)}" if self._relays else "there is none"
            return CommandResult(MavResult.DENIED, f"Relay denied: no relay {number}, {there}")
        if state not in (0, 1):
            return CommandResult(MavResult.DENIED, "Relay denied: it is neither 0 (off) nor 1 (on)")
        self._switch(number, Op.TURN_ON if state else Op.TURN_OFF)
        return DONE

    def set_light_brightness(self, number: int | None, width: float) -> CommandResult:
        """DO_SET_SERVO: the brightness of a light, by the width of a pulse in µs."""
        name = self._lights.get(number or 0)
        if name is None:
            return CommandResult(MavResult.DENIED, f"Servo denied: output {number} is no light of this vehicle")
        if not 800.0 <= width <= 2200.0:
            return CommandResult(MavResult.DENIED, f"Servo denied: {width:g} µs is not between 800 and 2200 µs")
        share = max(0.0, min(1.0, (width - DARK) / (BRIGHT - DARK)))
        self._shine(name, round(share * FULL))
        return DONE

    def execute_button_actions(self, who: object, pressed: int, now: float, act: Callable[[str], object]) -> None:
        """Take the buttons of a joystick, one bit each; each acts as it goes down."""
        at, before = self._pressed.get(who, (now, 0))
        self._pressed = {key: seen for key, seen in self._pressed.items() if now - seen[0] < FORGOTTEN}
        self._pressed[who] = now, pressed
        new = pressed & ~(before if now - at < FORGOTTEN else 0)
        for number, action, which in self._buttons:
            if new >> number & 1:
                self._carry_out(action, which, act)

    def _carry_out(self, action: str, which: int, act: Callable[[str], object]) -> None:
        if action in MODES:
            act(action)
        elif action == "relay" and which < len(self._relays):
            self._switch(which, Op.TOGGLE)
        elif which in self._lights:
            name = self._lights[which]
            step = STEP if action == "brighter" else -STEP
            self._shine(name, max(0, min(FULL, self._brightness.get(name, 0) + step)))

    def _switch(self, number: int, op: Op) -> None:
        self._publish(imc.PowerChannelControl(name=self._relays[number], op=op))

    def _shine(self, name: str, value: int) -> None:
        self._brightness[name] = value
        self._publish(imc.SetLedBrightness(name=name, value=value))
