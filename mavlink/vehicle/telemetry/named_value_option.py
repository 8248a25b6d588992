"""Any figure of the bus as NAMED_VALUE_FLOAT, chosen by the profile; ground stations plot these."""

import math
from typing import NamedTuple

import imc
from imc.schema import message_named
from mavlink import Fields
from mavlink.translate import sensors_from_imc
from mavlink.vehicle.latest_values import LatestValues

LONGEST = 10  # bytes of a name
NUMBERS = frozenset(
    ("fp32_t", "fp64_t", "int8_t", "int16_t", "int32_t", "int64_t", "uint8_t", "uint16_t", "uint32_t", "uint64_t")
)


class NamedValue(NamedTuple):
    """A field of a message, of one entity or any, and the name under which it is sent."""

    name: str
    kind: type[imc.Message]
    field: str
    label: str

    def fields(self, values: LatestValues, now: float, boot: float) -> Fields | None:
        """NAMED_VALUE_FLOAT; None if the value is unknown."""
        found = values.by_entity(self.kind)
        message = found.get(self.label) if self.label else next(reversed(found.values()), None)
        value = float(getattr(message, self.field)) if message is not None else math.nan
        return sensors_from_imc.named_value(self.name, value, now, boot) if math.isfinite(value) else None


def parse_named_value(text: str) -> NamedValue:
    """Parses "[NAME=]Message[.field][:Entity Label]", such as "salt=Salinity:CTD". Raises ValueError."""
    given, equals, rest = text.strip().rpartition("=")
    place, _, label = (part.strip() for part in rest.partition(":"))
    message, _, field = place.partition(".")
    kind = message_named(message)
    field = field or "value"
    numbers = [info.name for info in imc.fields(kind) if info.type in NUMBERS]
    if field not in numbers:
        there = f"; it has {', '.join(numbers)}" if numbers else ""
        raise ValueError(f"{text!r}: {message} has no number {field!r}{there}")
    name = given.strip() if equals else field if field != "value" else message
    if not 0 < len(name.encode()) <= LONGEST or not name.isascii():
        raise ValueError(f"{text!r}: give it a name of 1 to {LONGEST} letters: NAME={rest}")
    return NamedValue(name, kind, field, label)
