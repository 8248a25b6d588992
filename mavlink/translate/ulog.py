"""Translates the topics of a PX4 ULog file to IMC."""

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import imc
from mavlink.log_record_scanner import LogRecord
from mavlink.translate.log_translator import LogTranslator
from mavlink.translate.measurements_to_imc import (
    AUTOPILOT,
    BATTERIES,
    DOWN,
    FIRST_TIME,
    GPS,
    IMU,
    LAST_TIME,
    NAVIGATION,
    PRESSURE,
    SUBMARINE,
    GpsMeasurement,
    LoggedFlight,
    TranslatedMessages,
    battery_messages,
    estimated_state,
    imu_messages,
    known_accuracy,
    log_entry,
    magnetic_field,
    numbered_label,
    pressure_messages,
    range_message,
)
from mavlink.ulog import DROPOUT, PARAMETER, TEXT, ULog
from support.rotations import Vector, euler_from_quaternion

MODES = {
    **{0: "MANUAL", 1: "ALTCTL", 2: "POSCTL", 3: "MISSION", 4: "LOITER", 5: "RTL", 6: "POSITION_SLOW", 10: "ACRO"},
    **{12: "DESCEND", 13: "TERMINATION", 14: "OFFBOARD", 15: "STABILIZED", 17: "TAKEOFF", 18: "LAND"},
    **{19: "FOLLOWME", 20: "PRECLAND", 21: "ORBIT", 22: "VTOL_TAKEOFF"},
}
"""vehicle_status.nav_state -> the name of the mode in ground stations."""

BY_HAND, ASSISTED = (0, 10), (1, 2, 6, 15)
ARMED = 2  # vehicle_status.arming_state
PLACES = ("vehicle_gps_position", "sensor_gps")


def scan_ulog(log: ULog) -> LoggedFlight:
    """Read the description of the vehicle from the whole file; the time comes with the first position of a GPS."""
    flight = LoggedFlight()
    for time, name, values, _ in log.read(frozenset({PARAMETER, *PLACES})):
        value = values.get("value")
        if isinstance(value, int) and values["key"] == "MAV_SYS_ID" and 1 <= value <= 255:
            flight.system = value
        elif isinstance(value, int) and values["key"] == "MAV_TYPE":
            flight.type = value
        elif name in PLACES and flight.start is None and values.get("fix_type") in range(3, 9):
            microseconds = values.get("time_utc_usec")
            utc = microseconds / 1e6 if isinstance(microseconds, int) else 0.0
            flight.start = utc - time if FIRST_TIME < utc < LAST_TIME else None
    return flight


class ULogTranslator(LogTranslator):
    """Turns the topics of one log into IMC, each with the label of the entity that sends it.

    vehicle_attitude gives EstimatedState, its position extrapolated from the last vehicle_global_position. Heights are
    above mean sea level, except those of a GPS with a geoid.
    """

    parameter_record = PARAMETER

    def __init__(self, flight: LoggedFlight) -> None:
        self._place: tuple[float, Vector] | None = None
        self._velocity: Vector = (0.0, 0.0, 0.0)
        self._depth = -1.0
        self._mode: imc.AutopilotMode | None = None
        self._armed = False
        self._gps_name = ""
        self.dropped: float = 0.0
        """Seconds that the logger of PX4 has missed."""

        handlers: dict[str, Callable[[Any], TranslatedMessages]] = {
            "vehicle_attitude": self._attitude,
            "vehicle_angular_velocity": self._angular_velocity,
            "vehicle_global_position": self._global_position,
            "vehicle_local_position": self._local_position,
            "vehicle_gps_position": lambda m: self._gps(m, "vehicle_gps_position"),
            "sensor_gps": lambda m: self._gps(m, "sensor_gps"),
            "sensor_combined": self._sensors,
            "vehicle_magnetometer": lambda m: magnetic_field(
                numbered_label(IMU, m.number), _vector(m, "magnetometer_ga")
            ),
            "vehicle_air_data": _air,
            "battery_status": _battery,
            "distance_sensor": self._distance,
            "airspeed_validated": _airspeed,
            "vehicle_status": self._status,
            TEXT: lambda m: [(AUTOPILOT, log_entry(m.level, "PX4", m.text))],
            PARAMETER: lambda m: self._parameters.add(m.key, m.value),
            DROPOUT: self._dropout,
        }
        super().__init__(flight, handlers)

    def _fields(self, record: LogRecord) -> SimpleNamespace:
        return SimpleNamespace(**record.values, number=record.instance)

    def _attitude(self, m: Any) -> TranslatedMessages:
        if m.number:
            return
        attitude = euler_from_quaternion(_vector(m, "q", 4))
        if hasattr(m, "rollspeed"):  # before PX4 1.10
            self._rates = (m.rollspeed, m.pitchspeed, m.yawspeed)
        yield IMU, imc.EulerAngles(time=self._time, phi=attitude[0], theta=attitude[1], psi=attitude[2])
        if self._place is None:
            return
        since, place = self._place
        where, _ = self._extrapolated(since, place, self._velocity)
        yield NAVIGATION, estimated_state(where, attitude, self._velocity, self._rates, self._depth, self._altitude)

    def _angular_velocity(self, m: Any) -> TranslatedMessages:
        self._rates = _vector(m, "xyz")
        return ()

    def _global_position(self, m: Any) -> TranslatedMessages:
        if m.number == 0 and getattr(m, "lat_lon_valid", True):
            self._place = self._time, (math.radians(m.lat), math.radians(m.lon), m.alt)
        if hasattr(m, "vel_n"):  # before PX4 1.12
            self._velocity = (m.vel_n, m.vel_e, m.vel_d)
        return ()

    def _local_position(self, m: Any) -> TranslatedMessages:
        if m.number:
            return ()
        if m.v_xy_valid and m.v_z_valid:
            self._velocity = (m.vx, m.vy, m.vz)
        if getattr(m, "dist_bottom_valid", False):
            self._altitude = m.dist_bottom
        if self._flight.type == SUBMARINE and m.z_valid:
            self._depth = max(0.0, m.z)
        return ()

    def _gps(self, m: Any, name: str) -> TranslatedMessages:
        """Newer files have the receivers as sensor_gps, and both together as vehicle_gps_position: one is enough."""
        self._gps_name = self._gps_name or name
        if name != self._gps_name:
            return
        old = hasattr(m, "lat")  # before PX4 1.14: 1e-7 degrees and mm
        ellipsoid = m.alt_ellipsoid / 1e3 if old else m.altitude_ellipsoid_m
        fix = GpsMeasurement(
            m.fix_type,
            m.lat / 1e7 if old else m.latitude_deg,
            m.lon / 1e7 if old else m.longitude_deg,
            ellipsoid or (m.alt / 1e3 if old else m.altitude_msl_m),
            utc=m.time_utc_usec / 1e6 if m.time_utc_usec else None,
            satellites=m.satellites_used,
            sog=m.vel_m_s if m.vel_ned_valid else None,
            cog=math.degrees(m.cog_rad) % 360.0 if m.vel_ned_valid and math.isfinite(m.cog_rad) else None,
            hdop=known_accuracy(m.hdop),
            vdop=known_accuracy(m.vdop),
            hacc=known_accuracy(m.eph),
            vacc=known_accuracy(m.epv),
        )
        yield numbered_label(GPS, m.number), fix.message()

    def _sensors(self, m: Any) -> TranslatedMessages:
        yield from imu_messages(IMU, _vector(m, "gyro_rad"), _vector(m, "accelerometer_m_s2"))
        if hasattr(m, "magnetometer_ga[0]"):
            yield from magnetic_field(IMU, _vector(m, "magnetometer_ga"))

    def _distance(self, m: Any) -> TranslatedMessages:
        valid = m.min_distance < m.current_distance < m.max_distance and getattr(m, "signal_quality", -1) != 0
        if m.orientation == DOWN:
            self._altitude = m.current_distance if valid else -1.0
        return range_message(m.current_distance, valid)

    def _status(self, m: Any) -> TranslatedMessages:
        levels = imc.AutopilotMode.Autonomy
        level = levels.MANUAL if m.nav_state in BY_HAND else levels.ASSISTED if m.nav_state in ASSISTED else levels.AUTO
        mode = imc.AutopilotMode(autonomy=level, mode=MODES.get(m.nav_state, f"Mode({m.nav_state})"))
        if mode != self._mode:
            self._mode = mode
            yield AUTOPILOT, mode
        armed = m.arming_state == ARMED
        if armed != self._armed:
            self._armed = armed
            yield AUTOPILOT, log_entry(6, "PX4", "armed" if armed else "disarmed")

    def _dropout(self, m: Any) -> TranslatedMessages:
        self.dropped += m.ms / 1e3
        return ()


def _air(m: Any) -> TranslatedMessages:
    celsius = m.ambient_temperature if hasattr(m, "ambient_temperature") else m.baro_temp_celcius
    return pressure_messages(numbered_label(PRESSURE, m.number), m.baro_pressure_pa / 100.0, celsius)


def _battery(m: Any) -> TranslatedMessages:
    if not getattr(m, "connected", True):
        return ()
    amperes, rest = (value if value >= 0.0 else None for value in (m.current_a, m.remaining))
    percent = rest * 100.0 if rest is not None else None
    return battery_messages(
        numbered_label(BATTERIES, m.number), m.voltage_v if m.voltage_v > 0.0 else None, amperes, percent
    )


def _airspeed(m: Any) -> TranslatedMessages:
    if math.isfinite(m.indicated_airspeed_m_s):
        yield AUTOPILOT, imc.IndicatedSpeed(value=m.indicated_airspeed_m_s)


def _vector(m: Any, name: str, count: int = 3) -> Any:
    return tuple(getattr(m, f"{name}[{index}]") for index in range(count))
