"""Common parts of the translators of autopilots' own logs."""

from collections.abc import Callable, Iterator, Mapping
from types import SimpleNamespace
from typing import Any, ClassVar

import imc
from mavlink.log_record_scanner import LogRecord
from mavlink.translate.measurements_to_imc import (
    LONGEST_EXTRAPOLATION,
    LoggedFlight,
    ParameterBatch,
    TranslatedMessages,
    with_times,
)
from support.rotations import Vector
from support.wgs84 import displace


class LogTranslator:
    """Turns the records of one log into IMC, each with the label of the entity that sends it.

    Subclasses give handlers by the names of records; `parameter_record` is the name of those with a parameter.
    """

    parameter_record: ClassVar[str]

    def __init__(self, flight: LoggedFlight, handlers: Mapping[str, Callable[[Any], TranslatedMessages]]) -> None:
        self._flight = flight
        self._handlers = handlers
        self._parameters = ParameterBatch()
        self._rates: Vector = (0.0, 0.0, 0.0)
        self._altitude = -1.0
        self._time = 0.0

    @property
    def record_names(self) -> frozenset[str]:
        """Names of the records that are translated."""
        return frozenset(self._handlers)

    def translate(self, record: LogRecord) -> Iterator[tuple[str, imc.Message]]:
        """A record in IMC: labels of entities, and messages with their time in s since 1970 UTC.

        Without a GPS, times count from the start of the autopilot. Raises AttributeError if it lacks a field.
        """
        self._time = record.time
        time = record.time + (self._flight.start or 0.0)
        messages = self._handlers[record.name](self._fields(record))
        waiting = self._parameters.flush() if record.name != self.parameter_record else ()
        yield from with_times([*waiting, *messages], time, record.time)

    def finish(self, time: float) -> Iterator[tuple[str, imc.Message]]:
        """Remaining messages at the end of the log."""
        yield from with_times(self._parameters.flush(), time, self._time)

    def _fields(self, record: LogRecord) -> SimpleNamespace:
        """The fields of a record as its handler takes them."""
        return SimpleNamespace(**record.values)

    def _extrapolated(self, since: float, place: Vector, velocity: Vector) -> tuple[Vector, float]:
        """The place (rad, m) now, from an earlier one and the velocity (m/s), and how far down it leads (m)."""
        age = self._time - since
        north, east, down = (speed * (age if 0.0 <= age <= LONGEST_EXTRAPOLATION else 0.0) for speed in velocity)
        return displace(*place, north, east, down), down
