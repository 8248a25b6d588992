"""Simulates the battery of the vehicle."""

import math
from itertools import pairwise

import imc
from runtime import ParameterError, State, Task, consume, param, periodic
from support.interpolation import interpolate
from support.number_parsing import leading_numbers

POWER_MODEL = "Power Model -- Conversion -"


class Battery(Task):
    """Discharges by the power of thrusters and electronics; publishes voltage, current and fuel level.

    The open-circuit voltage follows the charge along `Voltage Curve`; the terminal voltage is lower by
    the drop across the internal resistance. Propulsion power is that of the profile's power model at the commanded
    speed, and grows with the cube of the speed beyond the model. `Capacity` overrides the profile's `Battery Capacity`.
    """

    execution_frequency: float = param(1.0, "Hz", "Rate of Voltage and Current.", minimum=0.1, maximum=10)
    fuel_level_rate: float = param(0.1, "Hz", "Rate of FuelLevel; 0 for never.", minimum=0, maximum=10)
    capacity: float = param(0.0, "Wh", "Energy of a full battery; 0 for the profile's.", minimum=0)
    initial_level: float = param(100.0, "%", "Charge at the start.", minimum=0, maximum=100, editable=False)
    hotel_load: float = param(35.0, "W", "Power of everything but the thrusters.", minimum=0)
    full_speed: float = param(2500.0, "rpm", "Speed of a thruster at full actuation.", minimum=1)
    number_of_thrusters: int = param(
        1, "1", "Thrusters that share the power of the profile's model.", minimum=1, maximum=255
    )
    voltage_curve: list[float] = param(
        [21.0, 24.0, 25.2, 25.9, 26.8, 29.0],
        "V",
        "Open-circuit voltage at equal steps from empty to full.",
        size=(2, 100),
    )
    internal_resistance: float = param(0.1, "Ω", "Internal resistance of the battery.", minimum=0, maximum=10)
    warning_level: float = param(20.0, "%", "Charge below which the entity is in FAULT.", minimum=0, maximum=100)
    error_level: float = param(10.0, "%", "Charge below which the entity is in ERROR.", minimum=0, maximum=100)

    def configure(self) -> None:
        value = self.vehicle.profile.value
        watt, rpm = (
            _numbers(option, value("General", option)) for option in (f"{POWER_MODEL} Watt", f"{POWER_MODEL} RPM")
        )
        if len(watt) == len(rpm) == 1:
            rpm, watt = [0.0, *rpm], [0.0, *watt]  # DUNE's power model of one value is a proportion
        if len(watt) != len(rpm) or any(a >= b for a, b in pairwise(rpm)):
            raise ParameterError(POWER_MODEL, "Watt and RPM must have the same length, and RPM must increase from 0")
        self._rpm, self._watt = (rpm, watt) if rpm else ([0.0, 1400.0], [0.0, 70.0])
        known = _numbers("Battery Capacity", value("General", "Battery Capacity"))
        self._full = 3600.0 * (self.capacity or (known[0] if known else 700.0))  # J
        steps = len(self.voltage_curve) - 1
        self._levels = [k / steps for k in range(steps + 1)]  # of charge, that voltages are given for
        if min(self.voltage_curve) <= 0.0:
            raise ParameterError("Voltage Curve", "must be more than 0")
        if self.error_level > self.warning_level:
            raise ParameterError("Error Level", "is above the warning level")

    def start(self) -> None:
        self._charge = self.initial_level / 100.0
        self._actuations: dict[int, float] = {}
        self._since = self.now_ns
        self._advance()
        self._report_charge()

    @consume
    def on_set_thruster_actuation(self, actuation: imc.SetThrusterActuation) -> None:
        if math.isfinite(actuation.value):
            self._advance()
            self._actuations[actuation.id] = max(-1.0, min(1.0, actuation.value))

    @periodic("execution_frequency")
    def measure(self) -> None:
        self._advance()
        self.publish(imc.Voltage(value=self._voltage))
        self.publish(imc.Current(value=self._current))
        self._report_charge()

    @periodic("fuel_level_rate")
    def publish_fuel_level(self) -> None:
        self._advance()
        self.publish(imc.FuelLevel(value=100.0 * self._charge, confidence=100.0))

    def discharge_to(self, level: float) -> bool:
        """Set this charge (%) from now on; False if it is less already."""
        self._advance()
        if self._charge < level / 100.0:
            return False
        self._charge = level / 100.0
        self._report_charge()
        return True

    def _advance(self) -> None:
        """Draw the energy used since the last call."""
        elapsed, self._since = (self.now_ns - self._since) * 1e-9, self.now_ns
        power = self.hotel_load + math.fsum(self._propulsion(share) for share in self._actuations.values())
        voltage = interpolate(self._charge, self._levels, self.voltage_curve)
        if self._charge <= 0.0:
            self._voltage = self._current = 0.0
            return
        r = self.internal_resistance
        power = min(power, 0.25 * voltage * voltage / r if r else power)  # the battery cannot deliver more
        self._current = (
            power / voltage
            if r == 0.0
            else (voltage - math.sqrt(max(0.0, voltage * voltage - 4.0 * r * power))) / (2.0 * r)
        )
        self._voltage = voltage - r * self._current
        self._charge = max(0.0, self._charge - voltage * self._current * elapsed / self._full)

    def _propulsion(self, share: float) -> float:
        rpm, highest = abs(share) * self.full_speed, self._rpm[-1]
        power = interpolate(min(rpm, highest), self._rpm, self._watt)
        power = power * (rpm / highest) ** 3 if rpm > highest else power
        return power / self.number_of_thrusters

    def _report_charge(self) -> None:
        level = 100.0 * self._charge
        if level <= 0.0:
            self.set_entity_state(State.FAILURE, "empty")
        elif level < self.error_level:
            self.set_entity_state(State.ERROR, "fuel reserve")
        elif level < self.warning_level:
            self.set_entity_state(State.FAULT, "fuel is running low")
        else:
            self.set_entity_state(State.NORMAL, "active")


def _numbers(option: str, text: str) -> list[float]:
    try:
        found = leading_numbers(text)
    except ValueError:
        found = [math.nan]
    if not all(map(math.isfinite, found)):
        raise ParameterError(option, f"[General] has {text!r}, which is not a number or a list of numbers")
    return found
