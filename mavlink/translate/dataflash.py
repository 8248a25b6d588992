"""Translates the records of an ArduPilot DataFlash log to IMC."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import imc
from mavlink.dataflash import DataFlash
from mavlink.modes import ARDUPILOT, CUSTOM_MODE, mode_name
from mavlink.translate.log_translator import LogTranslator
from mavlink.translate.measurements_to_imc import (
    AUTOPILOT,
    BATTERIES,
    DEPTH,
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
from support.rotations import Vector, wrap

BUILDS = {1: 10, 2: 2, 3: 1, 4: 5, 7: SUBMARINE, 12: 7, 13: 4}
"""VER.BU -> MAV_TYPE."""

FIRMWARE = {"Sub": SUBMARINE, "Copter": 2, "Plane": 1, "Rover": 10, "Tracker": 5, "Blimp": 7}
BOAT = 2.0  # FRAME_CLASS of a rover
ROVER, SURFACE_BOAT = 10, 11
GPS_EPOCH = 315_964_800  # s
WEEK = 604_800
LEAP_SECONDS = ((1_483_228_800, 18), (1_435_708_800, 17), (1_341_100_800, 16), (0, 15))
"""UTC from when GPS has been ahead by so many seconds."""

RANGE_GOOD = 4  # RFND.Stat
EVENTS = {10: "armed", 11: "disarmed"}
BY_ITSELF = frozenset(
    {
        *("AUTO", "GUIDED", "RTL", "SMART_RTL", "LAND", "LOITER", "CIRCLE", "BRAKE", "SURFACE", "POSHOLD", "HOLD"),
        *("QLOITER", "QHOVER", "QLAND", "QRTL", "TAKEOFF", "FOLLOW", "AUTOTUNE", "THROW", "AVOID_ADSB"),
    }
)
BY_HAND = frozenset({"MANUAL", "ACRO"})


def scan_dataflash(log: DataFlash) -> LoggedFlight:
    """Read the description of the vehicle from the whole file: parameters and the first good time come late."""
    flight, afloat = LoggedFlight(), False
    for time, name, values, _ in log.read(frozenset({"PARM", "MSG", "VER", "GPS"})):
        value = values.get("Value")
        if name == "PARM" and isinstance(value, float):
            if values.get("Name") in ("SYSID_THISMAV", "MAV_SYSID") and 1 <= value <= 255:
                flight.system = int(value)
            afloat |= values.get("Name") == "FRAME_CLASS" and value == BOAT
        elif name == "VER":
            flight.type = BUILDS.get(values.get("BU", 0), flight.type)
        elif name == "MSG" and not flight.type:
            banner = str(values.get("Message"))
            flight.type = next((kind for word, kind in FIRMWARE.items() if f"{word} V" in banner), 0)
        elif name == "GPS" and flight.start is None:
            flight.start = _start(time, values)
    if flight.type == ROVER and afloat:
        flight.type = SURFACE_BOAT
    return flight


def _start(time: float, values: Mapping[str, Any]) -> float | None:
    """The UTC time at which the clock was 0, by a GPS that has a fix."""
    try:
        utc = _utc(values) if values["Status"] >= 3 else None
    except (KeyError, TypeError, OverflowError):
        return None
    return utc - time if utc is not None and FIRST_TIME < utc < LAST_TIME else None


class DataFlashTranslator(LogTranslator):
    """Turns the records of one log into IMC, each with the label of the entity that sends it.

    ATT gives EstimatedState, its position extrapolated from the last POS, its velocity that of the EKF in use. Heights
    are above mean sea level, except those of a GPS with a geoid. enumerations: those of the dialect.
    """

    parameter_record = "PARM"

    def __init__(self, flight: LoggedFlight, enumerations: Mapping[str, Mapping[int, str]]) -> None:
        self._enumerations = enumerations
        self._place: tuple[float, Any] | None = None
        self._velocity: Vector | None = None
        self._ground_velocity: Vector = (0.0, 0.0, 0.0)
        self._core = 0
        self._accuracy: dict[int, Any] = {}
        handlers: dict[str, Callable[[Any], TranslatedMessages]] = {
            "ATT": self._attitude,
            "POS": self._position,
            "XKF1": self._filter,
            "NKF1": self._filter,
            "XKF4": self._choose_filter,
            "NKF4": self._choose_filter,
            "IMU": lambda m: self._imu(m, getattr(m, "I", 0)),
            "IMU2": lambda m: self._imu(m, 1),
            "IMU3": lambda m: self._imu(m, 2),
            "MAG": lambda m: _magnetic(m, getattr(m, "I", 0)),
            "MAG2": lambda m: _magnetic(m, 1),
            "BARO": lambda m: self._pressure(m, getattr(m, "I", 0)),
            "BAR2": lambda m: self._pressure(m, 1),
            "GPS": lambda m: self._gps(m, getattr(m, "I", 0)),
            "GPS2": lambda m: self._gps(m, 1),
            "GPA": self._gps_accuracy,
            "BAT": lambda m: _battery(m, getattr(m, "I", getattr(m, "Instance", getattr(m, "Inst", 0)))),
            "CURR": lambda m: _battery(m, 0),
            "RFND": self._range,
            "ARSP": _airspeed,
            "MODE": self._mode,
            "MSG": lambda m: [(AUTOPILOT, log_entry(6, "MSG", m.Message))],
            "ERR": lambda m: [(AUTOPILOT, log_entry(3, "ERR", f"error {m.ECode} of subsystem {m.Subsys}"))],
            "EV": lambda m: [(AUTOPILOT, log_entry(6, "EV", EVENTS.get(m.Id, f"event {m.Id}")))],
            "PARM": lambda m: self._parameters.add(m.Name, m.Value),
        }
        super().__init__(flight, handlers)

    def _attitude(self, m: Any) -> TranslatedMessages:
        attitude = (math.radians(m.Roll), math.radians(m.Pitch), wrap(math.radians(m.Yaw)))
        yield IMU, imc.EulerAngles(time=self._time, phi=attitude[0], theta=attitude[1], psi=attitude[2])
        if self._place is None:
            return
        since, place = self._place
        velocity = self._velocity or self._ground_velocity
        before = math.radians(place.Lat), math.radians(place.Lng), place.Alt
        where, down = self._extrapolated(since, before, velocity)
        depth = -1.0
        if self._flight.type == SUBMARINE:
            depth = max(0.0, down - getattr(place, "RelHomeAlt", getattr(place, "RelAlt", place.Alt)))
        yield NAVIGATION, estimated_state(where, attitude, velocity, self._rates, depth, self._altitude)

    def _position(self, m: Any) -> TranslatedMessages:
        self._place = (self._time, m) if m.Lat or m.Lng else None
        return ()

    def _filter(self, m: Any) -> TranslatedMessages:
        if getattr(m, "C", 0) == self._core:
            self._velocity = (m.VN, m.VE, m.VD)
        return ()

    def _choose_filter(self, m: Any) -> TranslatedMessages:
        """Take the filter that the vehicle uses, of those that compute side by side."""
        self._core = getattr(m, "PI", 0)
        return ()

    def _imu(self, m: Any, instance: int) -> TranslatedMessages:
        gyro = (m.GyrX, m.GyrY, m.GyrZ)
        if instance == 0:
            self._rates = gyro
        return imu_messages(numbered_label(IMU, instance), gyro, (m.AccX, m.AccY, m.AccZ))

    def _pressure(self, m: Any, instance: int) -> TranslatedMessages:
        outside = instance == 1 and self._flight.type == SUBMARINE  # ArduSub: 0 is inside the hull
        label = DEPTH if outside else numbered_label(PRESSURE, instance)
        yield from pressure_messages(label, m.Press / 100.0, m.Temp)
        if outside:
            yield DEPTH, imc.Depth(value=-m.Alt)

    def _gps_accuracy(self, m: Any) -> TranslatedMessages:
        self._accuracy[getattr(m, "I", 0)] = m
        return ()

    def _gps(self, m: Any, instance: int) -> TranslatedMessages:
        more = self._accuracy.get(instance)
        geoid = getattr(more, "Und", None)  # ArduPilot's is the height of the ellipsoid above the sea
        fixed = m.Status >= 2
        fix = GpsMeasurement(
            m.Status,
            m.Lat,
            m.Lng,
            m.Alt - (geoid or 0.0) if geoid == geoid else m.Alt,
            utc=_utc(m.__dict__),
            satellites=m.NSats,
            sog=m.Spd if fixed else None,
            cog=m.GCrs % 360.0 if fixed else None,
            hdop=known_accuracy(m.HDop),
            vdop=known_accuracy(getattr(more, "VDop", None)),
            hacc=known_accuracy(getattr(more, "HAcc", None)),
            vacc=known_accuracy(getattr(more, "VAcc", None)),
        )
        if instance == 0:
            course = math.radians(m.GCrs)
            self._ground_velocity = (m.Spd * math.cos(course), m.Spd * math.sin(course), getattr(m, "VZ", 0.0))
        yield numbered_label(GPS, instance), fix.message()

    def _range(self, m: Any) -> TranslatedMessages:
        meters, good = m.Dist, getattr(m, "Stat", RANGE_GOOD) == RANGE_GOOD
        if getattr(m, "Orient", DOWN) == DOWN:
            self._altitude = meters if good else -1.0
        return range_message(meters, good)

    def _mode(self, m: Any) -> TranslatedMessages:
        name = mode_name(
            CUSTOM_MODE, int(getattr(m, "ModeNum", m.Mode)), self._flight.type, ARDUPILOT, self._enumerations
        )
        levels = imc.AutopilotMode.Autonomy
        level = levels.AUTO if name in BY_ITSELF else levels.MANUAL if name in BY_HAND else levels.ASSISTED
        yield AUTOPILOT, imc.AutopilotMode(autonomy=level, mode=name)


def _magnetic(m: Any, instance: int) -> TranslatedMessages:
    return magnetic_field(numbered_label(IMU, instance), (m.MagX / 1e3, m.MagY / 1e3, m.MagZ / 1e3))  # of mG


def _battery(m: Any, instance: int) -> TranslatedMessages:
    percent = getattr(m, "RemPct", None)
    return battery_messages(
        numbered_label(BATTERIES, instance), m.Volt, m.Curr, percent if percent not in (None, 255) else None
    )


def _airspeed(m: Any) -> TranslatedMessages:
    if getattr(m, "U", 1) or getattr(m, "H", 1):
        yield AUTOPILOT, imc.IndicatedSpeed(value=m.Airspeed)


def _utc(values: Mapping[str, Any]) -> float | None:
    """The time of a GPS record in s since 1970 UTC; None without one."""
    week, milliseconds = values.get("GWk", values.get("Week", 0)), values.get("GMS", 0)
    if not week:
        return None
    gps = GPS_EPOCH + week * WEEK + milliseconds / 1e3
    return gps - next(ahead for since, ahead in LEAP_SECONDS if gps >= since + ahead)
