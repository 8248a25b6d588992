"""Translates the MAVLink messages of an autopilot to IMC."""

import math
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import imc
from imc.coordinates import displace
from mavlink.dialect import Dialect
from mavlink.frames import Received
from mavlink.meanings import (
    AUTOPILOT,
    BATTERIES,
    DEPTH,
    DOWN,
    FIRST_TIME,
    GPS,
    IMU,
    LAST_TIME,
    LONGEST_EXTRAPOLATION,
    NAVIGATION,
    PRESSURE,
    SUBMARINE,
    Fix,
    Said,
    distance,
    entry,
    magnetic,
    numbered,
    pressure,
    sensed,
    stamped,
    state,
    supply,
    system_type,
)
from mavlink.modes import mode_name

GRAVITY = 9.80665  # m/s²; "mg" are thousandths of it
GROUND_STATION = 6  # type in HEARTBEAT
AUTOPILOT_NONE = 8
MOST_BATTERIES, MOST_TEXTS = 15, 16


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
        self._utc: float | None = None
        self._texts: dict[int, list[str]] = {}
        self._handlers: dict[str, Callable[[Any], Said]] = {
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
            "SCALED_PRESSURE": lambda m: _pressure(PRESSURE, m),
            "SCALED_PRESSURE2": lambda m: _pressure(DEPTH, m),
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
        yield from stamped(self._handlers[received.name](message), time, getattr(message, "time_usec", 0) / 1e6)

    @property
    def system_type(self) -> imc.SystemType:
        """The type of the system in IMC."""
        return system_type(self.type)

    def _heartbeat(self, m: Any) -> Said:
        self.type = m.type
        yield AUTOPILOT, imc.Heartbeat()
        autonomy = imc.AutopilotMode.Autonomy
        level = autonomy.AUTO if m.base_mode & 12 else autonomy.ASSISTED if m.base_mode & 16 else autonomy.MANUAL
        mode = imc.AutopilotMode(
            autonomy=level, mode=mode_name(m.base_mode, m.custom_mode, m.type, m.autopilot, self._enumerations)
        )
        if mode != self._mode:
            self._mode = mode
            yield AUTOPILOT, mode

    def _global_position(self, m: Any) -> Said:
        self._position = m
        return ()

    def _distance(self, m: Any) -> Said:
        valid = m.min_distance < m.current_distance < m.max_distance
        if m.orientation == DOWN:
            self._altitude = m.current_distance / 100.0 if valid else -1.0
        return distance(m.current_distance / 100.0, valid)

    def _range(self, m: Any) -> Said:
        self._altitude = m.distance if m.distance > 0.0 else -1.0
        return ()

    def _attitude(self, m: Any) -> Said:
        position = self._position
        yield IMU, imc.EulerAngles(time=m.time_boot_ms / 1e3, phi=m.roll, theta=m.pitch, psi=m.yaw)
        if position is None or (position.lat == 0 and position.lon == 0):
            return
        age = (m.time_boot_ms - position.time_boot_ms) / 1e3
        age = age if 0.0 <= age <= LONGEST_EXTRAPOLATION else 0.0
        vx, vy, vz = position.vx / 100.0, position.vy / 100.0, position.vz / 100.0
        lat, lon, height = math.radians(position.lat / 1e7), math.radians(position.lon / 1e7), position.alt / 1e3
        lat, lon, height = displace(lat, lon, height, vx * age, vy * age, vz * age)
        depth = max(0.0, vz * age - position.relative_alt / 1e3) if self.type == SUBMARINE else -1.0
        attitude, rates = (m.roll, m.pitch, m.yaw), (m.rollspeed, m.pitchspeed, m.yawspeed)
        yield NAVIGATION, state((lat, lon, height), attitude, (vx, vy, vz), rates, depth, self._altitude)

    def _system_time(self, m: Any) -> Said:
        if FIRST_TIME < m.time_unix_usec / 1e6 < LAST_TIME:
            self._utc = m.time_unix_usec / 1e6
        return ()

    def _gps(self, m: Any) -> Said:
        def known(value: int, scale: float, missing: int = 0xFFFF) -> float | None:
            return value / scale if value != missing else None

        fix = Fix(
            m.fix_type,
            m.lat / 1e7,
            m.lon / 1e7,
            (m.alt_ellipsoid or m.alt) / 1e3,
            utc=self._utc,
            satellites=m.satellites_visible if m.satellites_visible != 0xFF else None,
            sog=known(m.vel, 100.0),
            cog=known(m.cog, 100.0),
            hdop=known(m.eph, 100.0),
            vdop=known(m.epv, 100.0),
            hacc=known(m.h_acc, 1e3, 0),
            vacc=known(m.v_acc, 1e3, 0),
        )
        yield GPS, fix.message()

    def _text(self, m: Any) -> Said:
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
        yield AUTOPILOT, entry(int(m.severity), "STATUSTEXT", text)


def _status(m: Any) -> Said:
    return _supply(BATTERIES, m.voltage_battery, m.current_battery, m.battery_remaining)


def _battery(m: Any) -> Said:
    """Batteries after the first one, which is in SYS_STATUS."""
    if m.id == 0 or m.id > MOST_BATTERIES:
        return ()
    cells = [cell for cell in m.voltages if cell != 0xFFFF]
    total = sum(cells) if cells else 0xFFFF  # integers
    return _supply(numbered(BATTERIES, m.id), total, m.current_battery, m.battery_remaining)


def _supply(label: str, millivolts: int, centiamperes: int, percent: int) -> Said:
    return supply(
        label,
        millivolts / 1e3 if millivolts != 0xFFFF else None,
        centiamperes / 100.0 if centiamperes != -1 else None,
        percent if percent != -1 else None,
    )


def _speeds(m: Any) -> Said:
    yield AUTOPILOT, imc.IndicatedSpeed(value=m.airspeed)
    yield AUTOPILOT, imc.TrueSpeed(value=m.groundspeed)
    yield AUTOPILOT, imc.Throttle(value=m.throttle)


def _pressure(label: str, m: Any) -> Said:
    return pressure(label, m.press_abs, m.temperature / 100.0)


def _imu(m: Any) -> Said:
    g = GRAVITY / 1e3
    gyro, acceleration = (m.xgyro / 1e3, m.ygyro / 1e3, m.zgyro / 1e3), (m.xacc * g, m.yacc * g, m.zacc * g)
    yield from sensed(IMU, gyro, acceleration)
    yield from magnetic(IMU, (m.xmag / 1e3, m.ymag / 1e3, m.zmag / 1e3))
