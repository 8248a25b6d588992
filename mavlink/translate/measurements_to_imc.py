"""Measurements of autopilots, in IMC: one place for the telemetry and for both kinds of logs, all in SI units."""

import math
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime

import imc
from support.rotations import Vector, rotation, to_body

ENTITIES = ("Autopilot", "Navigation", "GPS", "Batteries", "IMU", "Pressure Sensor", "Depth Sensor", "Range Finder")
"""Labels of the entities that send messages; their ids count from 1."""

AUTOPILOT, NAVIGATION, GPS, BATTERIES, IMU, PRESSURE, DEPTH, RANGE = ENTITIES
DOWN = 25  # orientation of what measures distances
LONGEST_EXTRAPOLATION = 1.0  # s
FIRST_TIME, LAST_TIME = 946_684_800.0, 4_102_444_800.0  # s: years 2000 and 2100
SUBMARINE = 12  # MAV_TYPE
MOST_TOGETHER = 100  # parameters in one message
TranslatedMessages = Iterable[tuple[str, imc.Message]]

_KINDS = {
    imc.SystemType.UUV: (SUBMARINE,),
    imc.SystemType.USV: (11,),
    imc.SystemType.UGV: (10,),
    imc.SystemType.STATICSENSOR: (0, 5),
}
_ENTRY = imc.LogBookEntry.Type
_SEVERITIES = (*3 * (_ENTRY.CRITICAL,), _ENTRY.ERROR, _ENTRY.WARNING, _ENTRY.INFO, _ENTRY.INFO, _ENTRY.DEBUG)


def system_type(type_: int) -> imc.SystemType:
    """The type in IMC of a vehicle with this MAV_TYPE."""
    return next((kind for kind, types in _KINDS.items() if type_ in types), imc.SystemType.UAV)


def estimated_state(
    place: Vector, attitude: Vector, velocity: Vector, rates: Vector, depth: float = -1.0, altitude: float = -1.0
) -> imc.EstimatedState:
    """A state whose reference is the vehicle itself, so x, y and z are 0.

    place: latitude, longitude (rad), height (m). attitude: roll, pitch, yaw (rad). velocity: north, east, down (m/s).
    rates: of the body (rad/s). depth and altitude above the ground in m, -1 if unknown.
    """
    u, v, w = to_body(rotation(*attitude), velocity)
    return imc.EstimatedState(
        lat=place[0],
        lon=place[1],
        height=place[2],
        phi=attitude[0],
        theta=attitude[1],
        psi=attitude[2],
        u=u,
        v=v,
        w=w,
        vx=velocity[0],
        vy=velocity[1],
        vz=velocity[2],
        p=rates[0],
        q=rates[1],
        r=rates[2],
        depth=depth,
        alt=altitude,
    )


@dataclass(frozen=True, slots=True)
class GpsMeasurement:
    """Measurement of a GPS, None where missing: degrees, m, m/s; `utc` in s since 1970; `fix` as in GPS_RAW_INT."""

    fix: int
    lat: float
    lon: float
    height: float
    utc: float | None = None
    satellites: int | None = None
    sog: float | None = None
    cog: float | None = None
    hdop: float | None = None
    vdop: float | None = None
    hacc: float | None = None
    vacc: float | None = None

    def message(self) -> imc.GpsFix:
        flags, kinds = imc.GpsFix.Validity, imc.GpsFix.Type
        validity, (year, month, day, seconds) = 0, _date(self.utc)
        if year:
            validity |= flags.VALID_DATE | flags.VALID_TIME
        for good, flag in (
            (self.fix >= 2, flags.VALID_POS),
            (self.cog is not None, flags.VALID_COG),
            (self.sog is not None, flags.VALID_SOG),
            (self.hdop is not None, flags.VALID_HDOP),
            (self.vdop is not None, flags.VALID_VDOP),
            (self.hacc is not None, flags.VALID_HACC),
            (self.vacc is not None, flags.VALID_VACC),
        ):
            validity |= flag if good else 0
        return imc.GpsFix(
            validity=validity,
            type=kinds.DIFFERENTIAL if self.fix >= 4 else kinds.STANDALONE,
            utc_year=year,
            utc_month=month,
            utc_day=day,
            utc_time=seconds,
            lat=math.radians(self.lat),
            lon=math.radians(self.lon),
            height=self.height,
            satellites=self.satellites or 0,
            cog=math.radians(self.cog or 0.0),
            sog=self.sog or 0.0,
            hdop=self.hdop or 0.0,
            vdop=self.vdop or 0.0,
            hacc=self.hacc or 0.0,
            vacc=self.vacc or 0.0,
        )


def battery_messages(
    label: str, volts: float | None, amperes: float | None, percent: float | None
) -> TranslatedMessages:
    """Messages of a battery; None for missing values."""
    if volts is not None:
        yield label, imc.Voltage(value=volts)
    if amperes is not None:
        yield label, imc.Current(value=amperes)
    if percent is not None:
        yield label, imc.FuelLevel(value=percent)


def imu_messages(label: str, gyro: Vector | None = None, acceleration: Vector | None = None) -> TranslatedMessages:
    """rad/s and m/s² of the body."""
    for kind, vector in ((imc.Acceleration, acceleration), (imc.AngularVelocity, gyro)):
        if vector is not None:
            yield label, kind(x=vector[0], y=vector[1], z=vector[2])


def magnetic_field(label: str, gauss: Vector) -> TranslatedMessages:
    if any(gauss):  # all zeros: there is no sensor
        yield label, imc.MagneticField(x=gauss[0], y=gauss[1], z=gauss[2])


def pressure_messages(label: str, hectopascals: float, celsius: float) -> TranslatedMessages:
    yield label, imc.Pressure(value=hectopascals)
    yield label, imc.Temperature(value=celsius)


def range_message(meters: float, valid: bool) -> TranslatedMessages:
    validity = imc.Distance.Validity
    yield RANGE, imc.Distance(validity=validity.VALID if valid else validity.INVALID, value=meters)


def log_entry(severity: int, context: str, text: str) -> imc.LogBookEntry:
    """A text with a MAV_SEVERITY."""
    return imc.LogBookEntry(type=_SEVERITIES[min(max(severity, 0), 7)], context=context, text=text)


def numbered_label(label: str, instance: int) -> str:
    """The label of a further sensor of a kind, counted from 0."""
    return label if instance == 0 else f"{label} {instance + 1}"


def with_times(messages: TranslatedMessages, time: float, measured: float) -> Iterator[tuple[str, imc.Message]]:
    """Messages with `time` (s since 1970 UTC) in their headers, `measured` (s since the start) where they have it."""
    for label, message in messages:
        if isinstance(message, imc.LogBookEntry):
            message = message.replace(htime=time)
        elif isinstance(message, imc.Acceleration | imc.AngularVelocity | imc.MagneticField):
            message = message.replace(time=measured)
        yield label, message.replace(timestamp=time)


@dataclass(slots=True)
class LoggedFlight:
    """Description of a vehicle before its log is translated; `start` is the UTC time at which its clock was 0."""

    system: int = 1
    type: int = 0
    start: float | None = None

    @property
    def system_type(self) -> imc.SystemType:
        return system_type(self.type)


@dataclass
class ParameterBatch:
    """Collects parameters, which come in hundreds, into few messages."""

    waiting: dict[str, float] = field(default_factory=dict[str, float])

    def add(self, name: str, value: float) -> TranslatedMessages:
        """A value; a message if many have come, or this one comes again."""
        if name in self.waiting or len(self.waiting) >= MOST_TOGETHER:
            yield from self.flush()
        self.waiting[name] = value

    def flush(self) -> TranslatedMessages:
        """A message with those that came since the last one."""
        if self.waiting:
            params = tuple(
                imc.EntityParameter(name=name, value=number_text(value)) for name, value in self.waiting.items()
            )
            self.waiting = {}
            yield AUTOPILOT, imc.EntityParameters(name=AUTOPILOT, params=params)


def known_accuracy(value: float | None) -> float | None:
    """A dilution of precision, or an accuracy (m), of a flight log; None for 99.99, which means unknown."""
    return value if value is not None and 0.0 < value < 99.0 else None


def number_text(value: float) -> str:
    """The shortest text for an integer, or a number of 32 bits: 0.1, not 0.10000000149."""
    if isinstance(value, int):
        return str(value)
    digits = next((digits for digits in (6, 7, 8) if _float32(float(f"{value:.{digits}g}")) == _float32(value)), 9)
    return f"{value:.{digits}g}"


def _float32(value: float) -> bytes:
    return struct.pack("<f", value)


def _date(utc: float | None) -> tuple[int, int, int, float]:
    if utc is None or not FIRST_TIME < utc < LAST_TIME:
        return 0, 0, 0, 0.0
    date = datetime.fromtimestamp(utc, UTC)
    return date.year, date.month, date.day, date.hour * 3600 + date.minute * 60 + date.second + date.microsecond / 1e6
