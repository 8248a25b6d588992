"""Simulates leak sensors."""

import imc
from runtime import State, Task, consume, param


class Leaks(Task):
    """Provides an entity for each leak sensor; LeakSimulation makes it wet or dry.

    A LeakSimulation that names no entity is for all. It counts if it is the vehicle's own or addressed to it.
    """

    leak_entities: list[str] = param(["Leak Sensor"], "", "Labels of the sensors.", size=(1, 32), editable=False)

    def configure(self) -> None:
        self._sensors = {label: self.reserve_entity(label) for label in self.leak_entities}

    def start(self) -> None:
        self.set_entity_state(State.NORMAL, "active")
        for sensor in self._sensors.values():
            self.set_entity_state(State.NORMAL, "active", entity=sensor)

    @consume(others=True)
    def on_leak_simulation(self, leak: imc.LeakSimulation) -> None:
        if leak.src != self.system and leak.dst != self.system:
            return
        named = [label.strip() for label in leak.entities.split(",") if label.strip()]
        for label in named or self._sensors:
            sensor = self._sensors.get(label)
            if sensor is None:
                self.log.warning(f"unknown leak sensor {label!r}; the sensors are {', '.join(self._sensors)}")
            elif leak.op == imc.LeakSimulation.Op.ON:
                self.set_entity_state(State.ERROR, "leak detected", entity=sensor)
            else:
                self.set_entity_state(State.NORMAL, "active", entity=sensor)
