"""Valeport miniSVS: a sensor of the speed of sound."""

import imc
from runtime import Task, expect, param
from runtime.devices import Device

IN_WATER = 1375.0, 1900.0  # m/s


class MiniSVS(Task):
    """Publishes SoundSpeed, which is -1 out of the water."""

    external = True
    requires = "drivers"

    port: str = param("", "", "Serial port of the sensor.", name="Serial Port - Device", editable=False)
    baud: int = param(9600, "Bd", "Baud rate of the port.", name="Serial Port - Baud Rate", minimum=1, editable=False)

    def start(self) -> None:
        self.sensor: Device = self.serial(self.port, self.baud, lines=self.measure, opened=self.run_freely)

    def run_freely(self) -> None:
        self.sensor.write(b"#M1\r\n")

    @expect(every=2.0)
    def measure(self, line: str) -> None:
        speed = float(line) if "." in line else float(line) / 1000.0  # m/s, or mm/s as it is delivered
        self.publish(imc.SoundSpeed(value=speed if IN_WATER[0] < speed < IN_WATER[1] else -1.0))
