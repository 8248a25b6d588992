"""Translates the MAVLink messages of an autopilot to IMC."""

import math
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any

import imc
from imc.coordinates import displace
from mavlink.dialect import Dialect
from mavlink.frames import Received
from mavlink.modes import mode_name

GRAVITY = 9.80665  # m/s²; "mg" are thousandths of it
LONGEST_EXTRAPOLATION = 1.0  # s
DOWN = 25  # orientation of a DISTANCE_SENSOR
FIRST_TIME, LAST_TIME = 946_684_800_000_000, 4_102_444_800_000_000  # µs: years 2000 and 2100
GROUND_STATION = 6  # type in HEARTBEAT
SUBMARINE = 12
AUTOPILOT_NONE = 8
ENTITIES = ("Autopilot", "Navigation", "GPS", "Batteries", "IMU", "Pressure Sensor", "Depth Sensor", "Range Finder")
"""Labels of the entities that send messages; their ids count from 1."""

_KINDS = {
    imc.SystemType.UUV: (SUBMARINE,),
    imc.SystemType.USV: (11,),
    imc.SystemType.UGV: (10,),
    imc.SystemType.STATICSENSOR: (0, 5),
}
MOST_BATTERIES, MOST_TEXTS = 15, 16
_Said = Iterable[tuple[str, imc.Message]]


class AutopilotTranslator:
    """Turns the MAVLink messages of one autopilot into IMC, each with the label of the entity that sends it.

    ATTITUDE gives EstimatedState, its position extrapolated from the last GLOBAL_POSITION_INT; the reference is the
    position of the vehicle, so x, y and z are 0. `height` is above mean sea level, as in MAVLink, because the height of
    the geoid is unknown. `depth` is that of a submarine below its start, -1 for other vehicles. type_: MAV_TYPE.
    """

    def __init__(self, dialect: Dialect, type_: int = 0) -> None:
        self.type = type_
        self._enumerations = dialect.enumerations
        self._position: Any = None
        self._altitude = -1.0
        self._mode: imc.AutopilotMode | None = None
        self._date = (0, 0, 0, 0.0)
        self._texts: dict[int, list[str]] = {}
        self._handlers: dict[str, Callable[[Any], _Said]] = {
            "HEARTBEAT": self._heartbeat,
            "ATTITUDE": self._attitude,
            "GLOBAL_POSITION_INT": self._global_position,
            "DISTANCE_SENSOR": self._distance,
            "RANGEFINDER": self._range,
            "GPS_RAW_INT": self._gps,
            "SYSTEM_TIME": self._system_time,
            "SYS_STATUS": _status,
            "BATTERY_STATUS": _battery,
            "VFR_HUD": _speeds,
            "SCALED_PRESSURE": lambda m: _pressure("Pressure Sensor", m),
            "SCALED_PRESSURE2": lambda m: _pressure("Depth Sensor", m),
            "RAW_IMU": _imu,
            "STATUSTEXT": self._text,
        }

    @property
    def kinds(self) -> frozenset[str]:
        """Names of the MAVLink messages that are translated."""
        return frozenset(self._handlers)

    def hear(self, received: Received, time: float) -> Iterator[tuple[str, imc.Message]]:
        """A message in IMC: labels of entities, and messages with `time` (s since 1970 UTC) in their headers."""
        message = SimpleNamespace(**received.values)
        for label, said in self._handlers[received.name](message):
            if isinstance(said, imc.LogBookEntry):
                said = said.replace(htime=time)
            elif isinstance(said, imc.Acceleration | imc.AngularVelocity | imc.MagneticField):
                said = said.replace(time=message.time_usec / 1e6)
            yield label, said.replace(timestamp=time)

    @property
    def system_type(self) -> imc.SystemType:
        """The type of the system in IMC."""
        return next((kind for kind, types in _KINDS.items() if self.type in types), imc.SystemType.UAV)

    def _heartbeat(self, m: Any) -> _Said:
        self.type = m.type
        yield "Autopilot", imc.Heartbeat()
        autonomy = imc.AutopilotMode.Autonomy
        level = autonomy.AUTO if m.base_mode & 12 else autonomy.ASSISTED if m.base_mode & 16 else autonomy.MANUAL
        mode = imc.AutopilotMode(
            autonomy=level, mode=mode_name(m.base_mode, m.custom_mode, m.type, m.autopilot, self._enumerations)
        )
        if mode != self._mode:
            self._mode = mode
            yield "Autopilot", mode

    def _global_position(self, m: Any) -> _Said:
        self._position = m
        return ()

    def _distance(self, m: Any) -> _Said:
        valid = m.min_distance < m.current_distance < m.max_distance
        if m.orientation == DOWN:
            self._altitude = m.current_distance / 100.0 if valid else -1.0
        validity = imc.Distance.Validity
        yield (
            "Range Finder",
            imc.Distance(validity=validity.VALID if valid else validity.INVALID, value=m.current_distance / 100.0),
        )

    def _range(self, m: Any) -> _Said:
        self._altitude = m.distance if m.distance > 0.0 else -1.0
        return ()

    def _attitude(self, m: Any) -> _Said:
        position = self._position
        yield "IMU", imc.EulerAngles(time=m.time_boot_ms / 1e3, phi=m.roll, theta=m.pitch, psi=m.yaw)
        if position is None or (position.lat == 0 and position.lon == 0):
            return
        age = (m.time_boot_ms - position.time_boot_ms) / 1e3
        age = age if 0.0 <= age <= LONGEST_EXTRAPOLATION else 0.0
        vx, vy, vz = position.vx / 100.0, position.vy / 100.0, position.vz / 100.0
        lat, lon, height = math.radians(position.lat / 1e7), math.radians(position.lon / 1e7), position.alt / 1e3
        lat, lon, height = displace(lat, lon, height, vx * age, vy * age, vz * age)
        depth = max(0.0, vz * age - position.relative_alt / 1e3) if self.type == SUBMARINE else -1.0
        u, v, w = _to_body(m.roll, m.pitch, m.yaw, vx, vy, vz)
        yield (
            "Navigation",
            imc.EstimatedState(
                lat=lat,
                lon=lon,
                height=height,
                phi=m.roll,
                theta=m.pitch,
                psi=m.yaw,
                u=u,
                v=v,
                w=w,
                vx=vx,
                vy=vy,
                vz=vz,
                p=m.rollspeed,
                q=m.pitchspeed,
                r=m.yawspeed,
                depth=depth,
                alt=self._altitude,
            ),
        )

    def _system_time(self, m: Any) -> _Said:
        if FIRST_TIME < m.time_unix_usec < LAST_TIME:
            date = datetime.fromtimestamp(m.time_unix_usec / 1e6, UTC)
            seconds = date.hour * 3600 + date.minute * 60 + date.second + date.microsecond / 1e6
            self._date = (date.year, date.month, date.day, seconds)
        return ()

    def _gps(self, m: Any) -> _Said:
        flags, kinds = imc.GpsFix.Validity, imc.GpsFix.Type
        validity, (year, month, day, seconds) = 0, self._date
        if year:
            validity |= flags.VALID_DATE | flags.VALID_TIME
        for good, flag in (
            (m.fix_type >= 2, flags.VALID_POS),
            (m.cog != 0xFFFF, flags.VALID_COG),
            (m.vel != 0xFFFF, flags.VALID_SOG),
            (m.eph != 0xFFFF, flags.VALID_HDOP),
            (m.epv != 0xFFFF, flags.VALID_VDOP),
            (m.h_acc != 0, flags.VALID_HACC),
            (m.v_acc != 0, flags.VALID_VACC),
        ):
            validity |= flag if good else 0
        yield (
            "GPS",
            imc.GpsFix(
                validity=validity,
                type=kinds.DIFFERENTIAL if m.fix_type >= 4 else kinds.STANDALONE,
                utc_year=year,
                utc_month=month,
                utc_day=day,
                utc_time=seconds,
                lat=math.radians(m.lat / 1e7),
                lon=math.radians(m.lon / 1e7),
                height=(m.alt_ellipsoid or m.alt) / 1e3,
                satellites=0 if m.satellites_visible == 0xFF else m.satellites_visible,
                cog=math.radians(m.cog / 100.0) if m.cog != 0xFFFF else 0.0,
                sog=m.vel / 100.0 if m.vel != 0xFFFF else 0.0,
                hdop=m.eph / 100.0 if m.eph != 0xFFFF else 0.0,
                vdop=m.epv / 100.0 if m.epv != 0xFFFF else 0.0,
                hacc=m.h_acc / 1e3,
                vacc=m.v_acc / 1e3,
            ),
        )

    def _text(self, m: Any) -> _Said:
        """A text comes in one piece, or in pieces of 50 characters, the last of them shorter."""
        text, number = m.text.decode("utf-8", "replace"), m.id
        if number:
            if len(self._texts) > MOST_TEXTS:
                self._texts.clear()
            pieces = self._texts.setdefault(number, [])
            pieces += [""] * (m.chunk_seq + 1 - len(pieces))
            pieces[m.chunk_seq] = text
            if len(text) >= 50:
                return
            text = "".join(self._texts.pop(number))
        types = imc.LogBookEntry.Type
        critical, severity = types.CRITICAL, int(m.severity)
        kinds = (critical, critical, critical, types.ERROR, types.WARNING, types.INFO, types.INFO, types.DEBUG)
        yield "Autopilot", imc.LogBookEntry(type=kinds[min(severity, 7)], context="STATUSTEXT", text=text)


def _status(m: Any) -> _Said:
    return _supply("Batteries", m.voltage_battery, m.current_battery, m.battery_remaining)


def _battery(m: Any) -> _Said:
    """Batteries after the first one, which is in SYS_STATUS."""
    if m.id == 0 or m.id > MOST_BATTERIES:
        return ()
    cells = [cell for cell in m.voltages if cell != 0xFFFF]
    total = sum(cells) if cells else 0xFFFF  # integers
    return _supply(f"Batteries {m.id + 1}", total, m.current_battery, m.battery_remaining)


def _supply(label: str, millivolts: int, centiamperes: int, percent: int) -> _Said:
    if millivolts != 0xFFFF:
        yield label, imc.Voltage(value=millivolts / 1e3)
    if centiamperes != -1:
        yield label, imc.Current(value=centiamperes / 100.0)
    if percent != -1:
        yield label, imc.FuelLevel(value=percent)


def _speeds(m: Any) -> _Said:
    yield "Autopilot", imc.IndicatedSpeed(value=m.airspeed)
    yield "Autopilot", imc.TrueSpeed(value=m.groundspeed)
    yield "Autopilot", imc.Throttle(value=m.throttle)


def _pressure(label: str, m: Any) -> _Said:
    yield label, imc.Pressure(value=m.press_abs)
    yield label, imc.Temperature(value=m.temperature / 100.0)


def _imu(m: Any) -> _Said:
    g = GRAVITY / 1e3
    yield "IMU", imc.Acceleration(x=m.xacc * g, y=m.yacc * g, z=m.zacc * g)
    yield "IMU", imc.AngularVelocity(x=m.xgyro / 1e3, y=m.ygyro / 1e3, z=m.zgyro / 1e3)
    if m.xmag or m.ymag or m.zmag:
        yield "IMU", imc.MagneticField(x=m.xmag / 1e3, y=m.ymag / 1e3, z=m.zmag / 1e3)


def _to_body(phi: float, theta: float, psi: float, north: float, east: float, down: float) -> tuple[float, ...]:
    """A north-east-down vector in the body frame; as in `world.attitude`, which this package cannot import."""
    cphi, sphi, ct, st, cpsi, spsi = *_cs(phi), *_cs(theta), *_cs(psi)
    return (
        ct * cpsi * north + ct * spsi * east - st * down,
        (sphi * st * cpsi - cphi * spsi) * north + (sphi * st * spsi + cphi * cpsi) * east + sphi * ct * down,
        (cphi * st * cpsi + sphi * spsi) * north + (cphi * st * spsi - sphi * cpsi) * east + cphi * ct * down,
    )


def _cs(angle: float) -> tuple[float, float]:
    return math.cos(angle), math.sin(angle)
