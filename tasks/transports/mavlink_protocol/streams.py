"""The messages that the vehicle streams or sends on request: one entry each."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple
from zlib import crc32

import imc
from mavlink import ARMED, CUSTOM_MODE, Fields, Flavor, Mode
from mavlink.missions import first_item, opaque_id
from mavlink.translate import from_imc, sensors_from_imc
from support import wgs84
from tasks.transports.mavlink_protocol.figures import value_of
from tasks.transports.mavlink_protocol.system import MavlinkSystem

MOST_BATTERIES = 16
NO_MISSION = 0xFFFF
RAW, STATUS, POSITION, EXTRA_1, EXTRA_2, EXTRA_3 = 1, 2, 6, 10, 11, 12  # MAV_DATA_STREAM

Built = Fields | Sequence[Fields] | None


class Stream(NamedTuple):
    """A message: `rate` is its default in Hz, 0 for one that is only sent on request, or the option of the task that
    gives it; `low` the default on slow links. `group` is that of the older REQUEST_DATA_STREAM. `sources` says what it
    is made of. `build` gives the fields of each instance, and none while they are unknown; the second parameter of
    REQUEST_MESSAGE chooses the instance by the field `numbered`.
    """

    name: str
    rate: float | str
    group: int
    sources: str
    build: Callable[[MavlinkSystem, Flavor, float], Built]
    low: float = 0.0
    numbered: str = ""

    def instances(self, system: MavlinkSystem, flavour: Flavor, now: float, number: int = 0) -> Sequence[Fields]:
        """The fields of all messages that can be sent now, or of the one with a number (from 1)."""
        built = self.build(system, flavour, now)
        found = () if built is None else (built,) if isinstance(built, Mapping) else built
        if self.numbered and number > 0:
            return [fields for fields in found if fields[self.numbered] == number]
        return found


def _heartbeat(system: MavlinkSystem, flavour: Flavor, now: float) -> Fields:
    mode = system.mode
    armed = ARMED if system.armed_or_moving else 0
    return {
        "type": system.kind.type,
        "autopilot": flavour.autopilot,
        "base_mode": CUSTOM_MODE | mode.flags | armed,
        "custom_mode": system.custom_mode(flavour),
        "system_status": system.health.status(system.figures.vehicle),
        "mavlink_version": 3,
    }


def _sys_status(system: MavlinkSystem, _: Flavor, now: float) -> Fields:
    bits = _sensors(system)
    load = value_of(system.figures.latest(imc.CpuUsage))
    return from_imc.system_status(bits, load, system.figures.voltage, system.figures.current, system.figures.fuel)


def _sensors(system: MavlinkSystem) -> tuple[int, int]:
    """The bits of what the vehicle has, and of what is well."""
    states = [(entity.label, entity.state) for entity in system.entities() if entity.stateful]
    return from_imc.sensor_bits(states, located=system.located, fenced=system.is_inside, ready=not system.obstacle)


def _system_time(system: MavlinkSystem, _: Flavor, now: float) -> Fields:
    return {"time_unix_usec": round(system.utc(now) * 1e6), "time_boot_ms": from_imc.boot_ms(now, system.boot)}


def _gps_raw(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    fix = system.figures.latest(imc.GpsFix)
    return sensors_from_imc.gps_raw(fix, system.last_fix, system.undulation) if fix is not None else None


def _attitude(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    state = system.figures.state
    return from_imc.attitude(state, system.time(state)) if state is not None else None


def _attitude_quaternion(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    state = system.figures.state
    return sensors_from_imc.attitude_quaternion(state, system.time(state)) if state is not None else None


def _global_position(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    found = system.place()
    return from_imc.global_position(*found, system.time(found[0])) if found else None


def _local_position(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    found = system.place()
    return from_imc.local_position(*found, system.home, system.time(found[0])) if found and system.home else None


def _hud(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    found = system.place()
    return from_imc.hud(*found, system.figures.airspeed, system.figures.throttle) if found else None


def _altitude(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    found = system.place()
    return sensors_from_imc.altitude(*found, system.home) if found and system.home else None


def _mission_current(system: MavlinkSystem, flavour: Flavor, now: float) -> Fields:
    mission, zero = system.mission, first_item(flavour)
    exists = mission.plan is not None
    return {
        "seq": mission.current + zero if exists else 0,
        "total": len(mission.listed(flavour)) - zero if exists else NO_MISSION,
        "mission_state": mission.state,
        "mission_mode": 1 if system.mode is Mode.MISSION else 2,
        "mission_id": mission.id(flavour),
        "fence_id": opaque_id(fence) if (fence := mission.fence()) else 0,
    }


def _path_control(system: MavlinkSystem, flavour: Flavor, now: float) -> Fields | None:
    path, found = system.figures.latest(imc.PathControlState), system.place()
    if path is None or found is None:
        return None
    state, place = found
    try:
        north, east, _ = wgs84.displacement(place.lat, place.lon, 0.0, path.end_lat, path.end_lon, 0.0)
    except (ArithmeticError, ValueError):
        return None
    if not all(map(math.isfinite, (north, east, path.course_error, path.y, state.phi, state.theta, state.psi))):
        return None
    bearing = math.atan2(east, north), math.hypot(north, east)
    return sensors_from_imc.path_control(path, state, bearing, (path.z, 0.0))


def _batteries(system: MavlinkSystem, _: Flavor, now: float) -> Sequence[Fields]:
    """One for each entity that measures a voltage; those of batteries, if there are any."""
    figures = system.figures
    voltages, currents = figures.by_label(imc.Voltage), figures.by_label(imc.Current)
    temperatures = figures.by_label(imc.Temperature)
    labels = sorted(label for label in voltages if system.figures.powers(label))[:MOST_BATTERIES]
    return [
        sensors_from_imc.battery(
            number,
            voltages[label].value,
            value_of(currents.get(label)),
            system.figures.fuel if number == 0 else math.nan,
            value_of(temperatures.get(label)),
        )
        for number, label in enumerate(labels)
    ]


def _extended_state(system: MavlinkSystem, _: Flavor, now: float) -> Fields:
    medium = system.figures.latest(imc.VehicleMedium)
    if system.kind.afloat or system.figures.motors is None:
        return from_imc.extended_state(None if medium is None else medium.medium, system.armed_or_moving)
    vehicle = system.figures.vehicle
    kind = vehicle.maneuver_type if vehicle is not None else None
    rises, lands = kind == imc.Takeoff.ID, kind == imc.Land.ID or system.figures.lands
    return from_imc.flying_state(system.figures.motors, rises=rises, lands=lands)


def _air_pressure(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    return _pressure(system, now, deep=False)


def _water_pressure(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    return _pressure(system, now, deep=True)


def _pressure(system: MavlinkSystem, now: float, *, deep: bool) -> Fields | None:
    """The pressure of the hull or air, or, if `deep`, that of the depth sensor."""
    found = [(label, m) for label, m in system.figures.by_label(imc.Pressure).items() if ("Depth" in label) == deep]
    if not found:
        return None
    label, latest = found[-1]
    warm = value_of(system.figures.by_label(imc.Temperature).get(label))
    return sensors_from_imc.pressure(latest.value, warm, from_imc.boot_ms(now, system.boot))


def _distances(system: MavlinkSystem, _: Flavor, now: float) -> Sequence[Fields]:
    """The altitude above the bottom or ground, and what is ahead."""
    state, time = system.figures.state, from_imc.boot_ms(now, system.boot)
    found = [sensors_from_imc.distance(state.alt, sensors_from_imc.DOWN, 0, time)] if state is not None else []
    ahead = [m for label, m in system.figures.by_label(imc.Distance).items() if "Echo Sounder" in label]
    valid = [m.value for m in ahead if m.validity == imc.Distance.Validity.VALID]
    found += [sensors_from_imc.distance(value, sensors_from_imc.FORWARD, 1, time) for value in valid[-1:]]
    return [fields for fields in found if fields is not None]


def _inertial(system: MavlinkSystem) -> list[imc.Message | None]:
    figures = system.figures
    return [figures.latest(imc.Acceleration), figures.latest(imc.AngularVelocity), figures.latest(imc.MagneticField)]


def _raw_imu(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    return sensors_from_imc.raw_imu(_inertial(system), now)


def _highres_imu(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    return sensors_from_imc.highres_imu(_inertial(system), now)


def _estimator(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    uncertainty = system.figures.latest(imc.NavigationUncertainty)
    if uncertainty is None:
        return None
    return sensors_from_imc.estimator_status(uncertainty, located=system.located, time=now)


def _water_depth(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    found = system.place()
    return sensors_from_imc.water_depth(*found, system.time(found[0])) if found and system.kind.afloat else None


def _named_values(system: MavlinkSystem, _: Flavor, now: float) -> Sequence[Fields]:
    found = (value.fields(system.figures, now, system.boot) for value in system.named_values)
    return [fields for fields in found if fields is not None]


def _modes(system: MavlinkSystem, flavour: Flavor, now: float) -> Sequence[Fields]:
    modes = flavour.modes(system.kind)
    return [
        {
            "number_modes": len(modes),
            "mode_index": index,
            "standard_mode": mode.standard,
            "custom_mode": number,
            "properties": system.kind.properties(mode),
            "mode_name": mode.name.capitalize().encode(),
        }
        for index, (mode, number) in enumerate(modes, 1)
    ]


def _modes_monitor(system: MavlinkSystem, flavour: Flavor, now: float) -> Fields:
    """A checksum instead of a count: it also differs after a restart with other modes."""
    return {"seq": crc32(repr(_modes(system, flavour, now)).encode()) & 0xFF}


def _current_mode(system: MavlinkSystem, flavour: Flavor, now: float) -> Fields:
    number, intended = system.custom_mode(flavour), system.intended_mode(flavour)
    return {"standard_mode": system.mode.standard, "custom_mode": number, "intended_custom_mode": intended}


def _high_latency(system: MavlinkSystem, flavour: Flavor, now: float) -> Fields:
    state, place = system.place() or (None, None)
    measured = sensors_from_imc.high_latency(
        state, place, system.figures.airspeed, system.figures.throttle, system.figures.fuel
    )
    number = system.custom_mode(flavour)
    return {
        "timestamp": from_imc.boot_ms(now, system.boot),
        "type": system.kind.type,
        "autopilot": flavour.autopilot,
        "custom_mode": number if number <= 0xFFFF else number >> 16,  # PX4's modes are in the upper half
        "failure_flags": from_imc.failure_bits(_sensors(system)),
        "wp_num": _mission_current(system, flavour, now)["seq"],
        **measured,
    }


def _version(system: MavlinkSystem, flavour: Flavor, now: float) -> Fields:
    return {
        "capabilities": flavour.capabilities(system.kind),
        "flight_sw_version": flavour.software_version,
        "uid": int.from_bytes(system.uid[:8], "little"),
        "uid2": tuple(system.uid[:18]),
    }


def _metadata(system: MavlinkSystem, flavour: Flavor, now: float) -> Fields:
    about = system.metadata
    return {"time_boot_ms": from_imc.boot_ms(now, system.boot), "file_crc": about.crc, "uri": about.uri.encode()}


def _protocol(system: MavlinkSystem, flavour: Flavor, now: float) -> Fields:
    return {"version": 200, "min_version": 100, "max_version": 200}


def _home(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    return from_imc.home_position(system.home, now) if system.home else None


def _origin(system: MavlinkSystem, _: Flavor, now: float) -> Fields | None:
    return from_imc.global_origin(system.home, now) if system.home else None


STREAMS: Mapping[str, Stream] = {
    stream.name: stream
    for stream in (
        Stream("HEARTBEAT", 1.0, 0, "VehicleState, PlanControlState, states of the entities", _heartbeat, low=1.0),
        Stream(
            "SYS_STATUS",
            "status_rate",
            STATUS,
            "states of the entities, Voltage, Current, FuelLevel, CpuUsage",
            _sys_status,
            low=0.2,
        ),
        Stream("SYSTEM_TIME", 1.0, STATUS, "the clock", _system_time),
        Stream("GPS_RAW_INT", 2.0, STATUS, "GpsFix", _gps_raw),
        Stream("ATTITUDE", "attitude_rate", EXTRA_1, "EstimatedState", _attitude),
        Stream("ATTITUDE_QUATERNION", 0.0, EXTRA_1, "EstimatedState", _attitude_quaternion),
        Stream("LOCAL_POSITION_NED", "position_rate", POSITION, "EstimatedState", _local_position),
        Stream("GLOBAL_POSITION_INT", "position_rate", POSITION, "EstimatedState", _global_position, low=1.0),
        Stream("MISSION_CURRENT", 1.0, STATUS, "the mission, PlanControlState", _mission_current, low=0.2),
        Stream("NAV_CONTROLLER_OUTPUT", 1.0, STATUS, "PathControlState, EstimatedState", _path_control),
        Stream(
            "VFR_HUD",
            "position_rate",
            EXTRA_2,
            "EstimatedState, IndicatedSpeed, Throttle or SetThrusterActuation",
            _hud,
        ),
        Stream("ALTITUDE", 1.0, EXTRA_3, "EstimatedState", _altitude),
        Stream("BATTERY_STATUS", 0.5, EXTRA_3, "Voltage, Current, FuelLevel, Temperature of each battery", _batteries),
        Stream("HOME_POSITION", 1.0, EXTRA_3, "the first EstimatedState", _home),
        Stream("GPS_GLOBAL_ORIGIN", 0.0, 0, "the first EstimatedState", _origin),
        Stream("EXTENDED_SYS_STATE", 1.0, EXTRA_3, "VehicleMedium; ArmingState of aircraft", _extended_state),
        Stream("SCALED_PRESSURE", 1.0, RAW, "Pressure, Temperature of a barometer or hull", _air_pressure),
        Stream("SCALED_PRESSURE2", 1.0, RAW, "Pressure, Temperature of the depth sensor", _water_pressure),
        Stream("DISTANCE_SENSOR", 2.0, EXTRA_3, "EstimatedState, Distance of the echo sounder", _distances),
        Stream("RAW_IMU", 0.0, RAW, "Acceleration, AngularVelocity, MagneticField", _raw_imu),
        Stream("HIGHRES_IMU", 0.0, 0, "Acceleration, AngularVelocity, MagneticField", _highres_imu),
        Stream("CURRENT_MODE", 0.5, 0, "VehicleState, PlanControlState", _current_mode),
        Stream("ESTIMATOR_STATUS", 0.5, 0, "NavigationUncertainty", _estimator),
        Stream("WATER_DEPTH", 0.5, 0, "EstimatedState of vessels", _water_depth),
        Stream("NAMED_VALUE_FLOAT", 1.0, EXTRA_3, "`Named Values`", _named_values),
        Stream(
            "HIGH_LATENCY2",
            0.0,
            0,
            "EstimatedState, FuelLevel, states of the entities",
            _high_latency,
            low=0.2,
        ),
        Stream("AVAILABLE_MODES", 0.0, 0, "`Vehicle Kind`", _modes, numbered="mode_index"),
        Stream("AVAILABLE_MODES_MONITOR", 0.3, 0, "`Vehicle Kind`", _modes_monitor),
        Stream("AUTOPILOT_VERSION", 0.0, 0, "Shoal's version, the name of the vehicle", _version),
        Stream("COMPONENT_METADATA", 0.0, 0, "the parameters of all tasks", _metadata),
        Stream("PROTOCOL_VERSION", 0.0, 0, "MAVLink 2", _protocol),
    )
}
"""The streams by name."""
