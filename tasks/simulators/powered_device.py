"""Base class of simulated devices that need electric power."""

import imc
from runtime import Task, consume, param


class PoweredDeviceTask(Task):
    """Loses power while the battery's voltage is 0; a silent battery supplies it."""

    batteries: str = param(
        "Batteries", "", "Entity of the battery that supplies it.", name="Entity Label - Batteries", editable=False
    )

    has_power = True

    def on_power_loss(self) -> None:
        """Called when the power fails."""

    @consume
    def on_voltage(self, voltage: imc.Voltage) -> None:
        if self.vehicle.entities.label(self.system, voltage.src_ent) != self.batteries:
            return
        before = self.has_power
        self.has_power: bool = voltage.value > 0.0
        if before and not self.has_power:
            self.log.error("no power: the battery is empty")
            self.on_power_loss()
