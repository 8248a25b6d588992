"""Simulates a barometer."""

import math

import imc
from runtime import param, periodic
from tasks.simulators.true_state_sensor import TrueStateSensorTask

SEA_LEVEL_TEMPERATURE = 288.15  # K
ICE_POINT = 273.15  # K
LAPSE_RATE = 0.0065  # K/m
TROPOPAUSE = 11000.0  # m
EXPONENT = 5.25588


def temperature_at(height: float) -> float:
    """Temperature (K) at a height (m) above the sea; ISO 2533:1975, below 11 km."""
    return SEA_LEVEL_TEMPERATURE - LAPSE_RATE * min(height, TROPOPAUSE)


def pressure_at(height: float, sea_level: float) -> float:
    """Pressure at a height (m) above the sea, in the unit of `sea_level`; ISO 2533:1975, below 11 km."""
    return sea_level * (temperature_at(height) / SEA_LEVEL_TEMPERATURE) ** EXPONENT


class Barometer(TrueStateSensorTask):
    """Measures the standard atmosphere: temperature, and pressure with white noise and a drift like the weather's."""

    execution_frequency: float = param(20.0, "Hz", "Rate of Pressure.", minimum=0.1, maximum=1000)
    sea_level_pressure: float = param(1013.25, "hPa", "Pressure at height 0.", minimum=800, maximum=1100)
    standard_deviation: float = param(0.012, "hPa", "White noise; 0.012 hPa is 0.1 m.", minimum=0)
    drift: float = param(0.06, "hPa", "Standard deviation of the drift, a Gauss-Markov process.", minimum=0)
    drift_time_constant: float = param(600.0, "s", "Time constant of the drift.", minimum=1)

    def start(self) -> None:
        self._wander = self.random.standard_normal()
        super().start()

    @periodic("execution_frequency")
    def measure(self, periods: int) -> None:
        keep = math.exp(-periods / (self.execution_frequency * self.drift_time_constant))
        fresh, noise = self.random.standard_normal(2).tolist()
        self._wander = keep * self._wander + math.sqrt(1.0 - keep * keep) * fresh
        truth = self.true_state()
        if truth is None:
            return
        true = pressure_at(truth.height - truth.z, self.sea_level_pressure)
        value = true + self.standard_deviation * noise + self.drift * self._wander
        self.publish(imc.Pressure(timestamp=truth.timestamp, value=value), keep_time=True)

    @periodic(1.0)
    def measure_temperature(self) -> None:
        truth = self.true_state()
        if truth is not None:
            value = temperature_at(truth.height - truth.z) - ICE_POINT
            self.publish(imc.Temperature(timestamp=truth.timestamp, value=value), keep_time=True)
