"""Simulates a sensor of a property of the water, which has a peak at one place."""

import math

import imc
from runtime import ParameterError, param, periodic
from support import wgs84
from support.terminal_text import suggestion
from tasks.simulators.true_state_sensor import TrueStateSensorTask

SURFACE = 0.2  # m, depth below which the sensor is certainly wet


class Gaussian(TrueStateSensorTask):
    """Measures a field that falls off from its peak like a Gaussian bell, with white noise.

    With `Invalid at Surface` each sample there is preceded by one of -1, as in DUNE: receivers take the latest.
    """

    execution_frequency: float = param(1.0, "Hz", "Rate of the samples.", minimum=0.001, maximum=1000)
    message_name: str = param(
        "Temperature",
        "",
        "Message that is published: any with a value, such as Temperature, Salinity or RhodamineDye.",
        name="Name of message to produce",
        editable=False,
    )
    value_at_peak: float = param(20.0, "unit", "Value at the peak, in the message's unit.", name="Value at peak")
    value_away_from_peak: float = param(
        14.0, "unit", "Value far from the peak, in the message's unit.", name="Value away from peak"
    )
    standard_deviation: float = param(1.0, "unit", "White noise, in the message's unit.", minimum=0)
    peak_position: list[float] = param([41.185373, -8.704962], "°", "Latitude and longitude of the peak.", size=2)
    peak_width: float = param(250.0, "m", "Distance from the peak at which 61 % of it is left.", minimum=0.001)
    invalid_at_surface: bool = param(
        False, "", "Whether to publish invalid samples at the surface.", name="Invalid at Surface"
    )

    def configure(self) -> None:
        lat, lon = self._peak = math.radians(self.peak_position[0]), math.radians(self.peak_position[1])
        if not wgs84.is_on_earth(lat, lon):
            raise ParameterError("Peak Position", f"{self.peak_position} is not a latitude and a longitude")
        self._kind = message_with_a_value(self.message_name)
        self._origin = math.nan, math.nan  # the offset is that of another peak

    def start(self) -> None:
        self._offset = 0.0, 0.0
        super().start()

    @periodic("execution_frequency")
    def measure_gaussian_field(self) -> None:
        truth, noise = self.true_state(), self.standard_deviation * self.random.standard_normal()
        if truth is None:
            return
        if self._origin != (truth.lat, truth.lon):
            self._origin = truth.lat, truth.lon
            self._offset = wgs84.offset(*self._peak, truth.lat, truth.lon)
        distance = math.hypot(self._offset[0] + truth.x, self._offset[1] + truth.y) / self.peak_width
        bell = math.exp(-0.5 * distance * distance)
        value = self.value_away_from_peak + (self.value_at_peak - self.value_away_from_peak) * bell + noise
        if self.invalid_at_surface and truth.z < SURFACE:
            self.publish(self._kind().replace(value=-1.0))
        self.publish(self._kind().replace(value=value))


def message_with_a_value(name: str) -> type[imc.Message]:
    """The message of this name whose field `value` is a floating point number. Raises ParameterError."""
    known = {
        kind.__name__.casefold(): kind
        for kind in (imc.builtin()[abbrev] for abbrev in imc.builtin().types)
        if any(field.name == "value" and field.type in ("fp32_t", "fp64_t") for field in imc.fields(kind))
    }
    if (kind := known.get(name.strip().casefold())) is None:
        hint = suggestion(name, [each.__name__ for each in known.values()])
        raise ParameterError("Name of message to produce", f"{name!r} is no message with a value{hint and f'; {hint}'}")
    return kind
