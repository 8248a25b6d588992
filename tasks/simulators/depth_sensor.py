"""Simulates a depth sensor."""

import imc
from runtime import param, periodic
from tasks.simulators.true_state_sensor import TrueStateSensorTask

GRAVITY = 9.80665  # m/s²
PASCAL = 0.01  # hPa


class DepthSensor(TrueStateSensorTask):
    """Measures the absolute pressure of the water with white noise, and from it depth, never less than zero."""

    execution_frequency: float = param(10.0, "Hz", "Rate of Depth and Pressure.", minimum=0.1, maximum=1000)
    standard_deviation: float = param(0.05, "m", "Standard deviation of the noise.", minimum=0)
    surface_pressure: float = param(1013.25, "hPa", "Pressure of the air at the surface.", minimum=800, maximum=1100)
    water_density: float = param(1025.0, "kg/m³", "Density of the water.", minimum=900, maximum=1300)
    water_temperature: float = param(15.0, "°C", "Temperature of the water.", minimum=-5, maximum=60)

    @periodic("execution_frequency")
    def measure(self) -> None:
        noise = self.standard_deviation * self.random.standard_normal()
        if (truth := self.true_state()) is not None:
            time, z = truth.timestamp, truth.z + noise
            pressure = self.surface_pressure + PASCAL * self.water_density * GRAVITY * z
            self.publish(imc.Depth(timestamp=time, value=max(0.0, z)), keep_time=True)
            self.publish(imc.Pressure(timestamp=time, value=pressure), keep_time=True)

    @periodic(1.0)
    def measure_temperature(self) -> None:
        if (truth := self.true_state()) is not None:
            self.publish(imc.Temperature(timestamp=truth.timestamp, value=self.water_temperature), keep_time=True)
