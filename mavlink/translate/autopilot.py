"""Translates the MAVLink messages of an autopilot to IMC."""

import math
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import imc
from mavlink.dialect import Dialect
from mavlink.frames import ReceivedMessage
from mavlink.modes import ARMED, mode_name
from mavlink.translate.measurements_to_imc import (
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
    GpsMeasurement,
    TranslatedMessages,
    battery_messages,
    estimated_state,
    imu_messages,
    log_entry,
    magnetic_field,
    numbered_label,
    pressure_messages,
    range_message,
    system_type,
    with_times,
)
from support.wgs84 import displace

GRAVITY = 9.80665  # m/s²; "mg" are thousandths of it
MOST_BATTERIES, MOST_TEXTS = 15, 16
PIECE = 50  # bytes of a text in one message
UNKNOWN = 0xFFFF
OLDEST_ALTITUDE = 2.0  # s; a range finder that is silent for longer has no valid reading
HAS_ACCELERATION, HAS_GYRO, HAS_FIELD = 0x007, 0x038, 0x1C0  # HIGHRES_IMU_UPDATED_FLAGS


class AutopilotTranslator:
    """Turns the MAVLink messages of one autopilot into IMC, each with the label of the entity that sends it.

    ATTITUDE gives EstimatedState, its position extrapolated from the last GLOBAL_POSITION_INT; the reference is the
    position of the vehicle, so x, y and z are 0. `height` is above mean sea level, as in MAVLink, because the height of
    the geoid is unknown. `depth` is that of a submarine below its start, -1 for other vehicles. type_: MAV_TYPE.
    """

    def __init__(self, dialect: Dialect, type_: int = 0) -> None:
        self.type: int = type_
        self._enumerations = dialect.enumerations
        self._time = 0.0  # of the message at hand
        self._position: Any = None
        self._altitude, self._altitude_at = -1.0, -math.inf
        self._mode: imc.AutopilotMode | None = None
        self._arming: imc.ArmingState | None = None
        self._utc: float | None = None
        self._start = -math.inf  # UTC time at which the autopilot's clock was 0
        self._texts: dict[int, list[bytes]] = {}
        self._handlers: dict[str, Callable[[Any], TranslatedMessages]] = {
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
            "HIGHRES_IMU": _fine_imu,
            "WIND": _wind,
            "WIND_COV": lambda m: _stream(m.wind_x, m.wind_y, m.wind_z),
            "STATUSTEXT": self._text,
        }

    @property
    def message_names(self) -> frozenset[str]:
        """Names of the MAVLink messages that are translated."""
        return frozenset(self._handlers)

    def translate(self, received: ReceivedMessage, time: float) -> Iterator[tuple[str, imc.Message]]:
        """A message in IMC: labels of entities, and messages with `time` (s since 1970 UTC) in their headers."""
        message, self._time = SimpleNamespace(**received.values), time
        yield from with_times(self._handlers[received.name](message), time, getattr(message, "time_usec", 0) / 1e6)

    @property
    def system_type(self) -> imc.SystemType:
        """The type of the system in IMC."""
        return system_type(self.type)

    def _heartbeat(self, m: Any) -> TranslatedMessages:
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
        states = imc.ArmingState.State
        arming = imc.ArmingState(state=states.ARMED if m.base_mode & ARMED else states.DISARMED)
        if arming != self._arming:
            self._arming = arming
            yield AUTOPILOT, arming

    def _global_position(self, m: Any) -> TranslatedMessages:
        self._position = m
        return ()

    def _distance(self, m: Any) -> TranslatedMessages:
        valid = m.min_distance < m.current_distance < m.max_distance
        if m.orientation == DOWN:
            self._measure(m.current_distance / 100.0 if valid else -1.0)
        return range_message(m.current_distance / 100.0, valid)

    def _range(self, m: Any) -> TranslatedMessages:
        self._measure(m.distance if m.distance > 0.0 else -1.0)
        return ()

    def _measure(self, altitude: float) -> None:
        self._altitude, self._altitude_at = altitude, self._time

    def _attitude(self, m: Any) -> TranslatedMessages:
        position = self._position
        yield IMU, imc.EulerAngles(time=m.time_boot_ms / 1e3, phi=m.roll, theta=m.pitch, psi=m.yaw)
        if position is None or (position.lat == 0 and position.lon == 0):
            return
        age = (m.time_boot_ms - position.time_boot_ms) / 1e3
        if age < -LONGEST_EXTRAPOLATION:  # the position is from before a new start
            self._position = None
            return
        age = age if 0.0 <= age <= LONGEST_EXTRAPOLATION else 0.0
        vx, vy, vz = position.vx / 100.0, position.vy / 100.0, position.vz / 100.0
        lat, lon, height = math.radians(position.lat / 1e7), math.radians(position.lon / 1e7), position.alt / 1e3
        lat, lon, height = displace(lat, lon, height, vx * age, vy * age, vz * age)
        depth = max(0.0, vz * age - position.relative_alt / 1e3) if self.type == SUBMARINE else -1.0
        attitude, rates = (m.roll, m.pitch, m.yaw), (m.rollspeed, m.pitchspeed, m.yawspeed)
        altitude = self._altitude if self._time - self._altitude_at <= OLDEST_ALTITUDE else -1.0
        yield NAVIGATION, estimated_state((lat, lon, height), attitude, (vx, vy, vz), rates, depth, altitude)

    def _system_time(self, m: Any) -> TranslatedMessages:
        if FIRST_TIME < m.time_unix_usec / 1e6 < LAST_TIME:
            self._utc = m.time_unix_usec / 1e6
            self._start = self._utc - m.time_boot_ms / 1e3
        return ()

    def _gps(self, m: Any) -> TranslatedMessages:
        def known(value: int, scale: float, missing: int = UNKNOWN) -> float | None:
            return value / scale if value != missing else None

        measured = m.time_usec / 1e6  # since its start, or since 1970
        utc = measured if measured > FIRST_TIME else self._start + measured if measured else self._utc
        fix = GpsMeasurement(
            m.fix_type,
            m.lat / 1e7,
            m.lon / 1e7,
            (m.alt_ellipsoid or m.alt) / 1e3,
            utc=utc,
            satellites=m.satellites_visible if m.satellites_visible != 0xFF else None,
            sog=known(m.vel, 100.0),
            cog=known(m.cog, 100.0),
            hdop=known(m.eph, 100.0),
            vdop=known(m.epv, 100.0),
            hacc=known(m.h_acc, 1e3, 0),
            vacc=known(m.v_acc, 1e3, 0),
        )
        yield GPS, fix.message()

    def _text(self, m: Any) -> TranslatedMessages:
        """A text comes in one piece, or in pieces of 50 bytes, the last of them shorter."""
        text, number = m.text, m.id
        if number:
            if len(self._texts) > MOST_TEXTS:
                self._texts.clear()
            pieces = self._texts.setdefault(number, [])
            pieces += [b""] * (m.chunk_seq + 1 - len(pieces))
            pieces[m.chunk_seq] = text
            if len(text) >= PIECE:
                return
            text = b"".join(self._texts.pop(number))
        yield AUTOPILOT, log_entry(int(m.severity), "STATUSTEXT", text.decode("utf-8", "replace"))


def _status(m: Any) -> TranslatedMessages:
    # Without a battery monitor ArduPilot reports 0 V.
    return _supply(BATTERIES, m.voltage_battery or UNKNOWN, m.current_battery, m.battery_remaining)


def _battery(m: Any) -> TranslatedMessages:
    """Batteries after the first one, which is in SYS_STATUS."""
    if m.id == 0 or m.id > MOST_BATTERIES:
        return ()
    cells = [cell for cell in m.voltages if cell != UNKNOWN]
    total = sum((*cells, *m.voltages_ext)) if cells else UNKNOWN  # integers
    return _supply(numbered_label(BATTERIES, m.id), total, m.current_battery, m.battery_remaining)


def _supply(label: str, millivolts: int, centiamperes: int, percent: int) -> TranslatedMessages:
    return battery_messages(
        label,
        millivolts / 1e3 if millivolts != UNKNOWN else None,
        centiamperes / 100.0 if centiamperes != -1 else None,
        percent if percent != -1 else None,
    )


def _speeds(m: Any) -> TranslatedMessages:
    yield AUTOPILOT, imc.IndicatedSpeed(value=m.airspeed)
    yield AUTOPILOT, imc.TrueSpeed(value=m.groundspeed)
    yield AUTOPILOT, imc.Throttle(value=m.throttle)


def _pressure(label: str, m: Any) -> TranslatedMessages:
    return pressure_messages(label, m.press_abs, m.temperature / 100.0)


def _imu(m: Any) -> TranslatedMessages:
    g = GRAVITY / 1e3
    gyro, acceleration = (m.xgyro / 1e3, m.ygyro / 1e3, m.zgyro / 1e3), (m.xacc * g, m.yacc * g, m.zacc * g)
    yield from imu_messages(IMU, gyro, acceleration)
    yield from magnetic_field(IMU, (m.xmag / 1e3, m.ymag / 1e3, m.zmag / 1e3))


def _fine_imu(m: Any) -> TranslatedMessages:
    """HIGHRES_IMU, which PX4 sends in place of RAW_IMU; `fields_updated` marks the sensors that are there."""
    gyro = (m.xgyro, m.ygyro, m.zgyro) if m.fields_updated & HAS_GYRO else None
    acceleration = (m.xacc, m.yacc, m.zacc) if m.fields_updated & HAS_ACCELERATION else None
    yield from imu_messages(IMU, gyro, acceleration)
    if m.fields_updated & HAS_FIELD:
        yield from magnetic_field(IMU, (m.xmag, m.ymag, m.zmag))


def _wind(m: Any) -> TranslatedMessages:
    """WIND of ArduPilot gives the direction it comes from, and the length of the whole vector."""
    level = math.sqrt(max(0.0, m.speed * m.speed - m.speed_z * m.speed_z))
    toward = math.radians(m.direction + 180.0)
    return _stream(level * math.cos(toward), level * math.sin(toward), m.speed_z)


def _stream(north: float, east: float, down: float) -> TranslatedMessages:
    yield NAVIGATION, imc.EstimatedStreamVelocity(x=north, y=east, z=down)
