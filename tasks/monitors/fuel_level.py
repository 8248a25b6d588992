"""Estimates the energy left in the battery."""

import imc
from runtime import State, Task, consume, param, periodic
from runtime.task import ParameterError
from runtime.vehicle import general_number

BELOW = 0.9  # of the error level: all that is known of a battery that only says that it is below


class FuelLevel(Task):
    """Integrates the energy used, from Voltage and Current of the battery's entity.

    The capacity is the profile's `Battery Capacity` (W h). The entity is in FAULT below the warning level and in ERROR
    below the error level; also in FAULT while the battery is silent. While the battery's entity itself is in ERROR, the
    level is at most just below the error level.
    """

    execution_frequency: float = param(0.1, "Hz", "Rate of FuelLevel.", minimum=0.001, maximum=1000)
    entity_label_batteries: str = param("Batteries", "", "Entity of the battery.", name="Entity Label - Batteries")
    initial_level: float = param(100.0, "%", "Level at the start.", minimum=0, maximum=100)
    initial_confidence: float = param(80.0, "%", "Confidence of the published level.", minimum=0, maximum=100)
    warning_level: float = param(
        20.0, "%", "Below it the entity is in FAULT.", minimum=0, maximum=100, visibility="user"
    )
    error_level: float = param(10.0, "%", "Below it the entity is in ERROR.", minimum=0, maximum=100, visibility="user")
    battery_timeout: float = param(10.0, "s", "The entity is in FAULT after this time without Current.", minimum=0.1)

    def configure(self) -> None:
        if self.error_level > self.warning_level:
            raise ParameterError("Error Level", "is above the Warning Level")
        self._capacity = 3600.0 * general_number(self.vehicle.profile, "Battery Capacity", 0.0)  # J

    def start(self) -> None:
        self._energy = self._capacity * self.initial_level / 100.0
        self._voltage: float | None = None
        self._sampled: int | None = None
        self._most, self._complaint = 100.0, ""
        if not self._capacity:
            self.set_entity_state(State.FAULT, "the profile has no Battery Capacity")

    @consume
    def on_voltage(self, voltage: imc.Voltage) -> None:
        if self._is_battery(voltage):
            self._voltage = voltage.value

    @consume
    def cap_level_by_battery(self, battery: imc.EntityState) -> None:
        """Accept that a battery reports itself low: it may be more accurate than the sum of its discharge."""
        if not self._is_battery(battery):
            return
        before, low = self._most, battery.state == imc.EntityState.State.ERROR  # FAILURE is a task that failed
        self._most = BELOW * self.error_level if low else 100.0
        self._complaint = f"{self.entity_label_batteries}: {battery.description}"
        if self._most != before:
            self.publish_level()

    @consume
    def on_current(self, current: imc.Current) -> None:
        """Subtract the energy used since the last sample."""
        if not self._is_battery(current):
            return
        if self._sampled is not None and self._voltage is not None:
            drawn = self._voltage * current.value * (self.now_ns - self._sampled) * 1e-9
            self._energy = min(self._capacity, max(0.0, self._energy - drawn))
        first, self._sampled = self._sampled is None, self.now_ns
        if first:
            self.publish_level()

    @periodic("execution_frequency")
    def publish_level(self) -> None:
        if not self._capacity or self._sampled is None:
            return
        if self.age(self._sampled * 1e-9) > self.battery_timeout:
            self.set_entity_state(State.FAULT, f"no Current for {self.battery_timeout:g} s")
            return
        empty = self._voltage is not None and self._voltage <= 0.0
        level = 0.0 if empty else 100.0 * self._energy / self._capacity
        contradicted, level = level > self._most, min(level, self._most)
        self.publish(imc.FuelLevel(value=level, confidence=self.initial_confidence))
        if level < self.error_level:
            self._report_level(State.ERROR, self._complaint if contradicted else "fuel reserve", level)
        elif level < self.warning_level:
            self._report_level(State.FAULT, "fuel is running low", level)
        else:
            self.set_entity_state(State.NORMAL, "active")

    def _report_level(self, state: State, description: str, level: float) -> None:
        if self.entity.description != description:
            write = self.log.error if state is State.ERROR else self.log.warning
            write(f"{description}: {level:.0f} %")
        self.set_entity_state(state, description)

    def _is_battery(self, sample: imc.Message) -> bool:
        return self.vehicle.entities.label(sample.src, sample.src_ent) == self.entity_label_batteries
