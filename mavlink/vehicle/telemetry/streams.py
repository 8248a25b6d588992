"""The messages that the vehicle streams or sends on request: one entry each."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple
from zlib import crc32

import imc
from mavlink import ARMED, CUSTOM_MODE, Fields, Flavour, Mode, from_imc, instruments
from mavlink.missions import first_item, opaque_id
from mavlink.vehicle.latest_values import value_of
from mavlink.vehicle.telemetry.sources import TelemetrySources
from support import wgs84

MOST_BATTERIES = 16
NO_MISSION = 0xFFFF
RAW, STATUS, POSITION, EXTRA_1, EXTRA_2, EXTRA_3 = 1, 2, 6, 10, 11, 12  # MAV_DATA_STREAM

Built = Fields | Sequence[Fields] | None


class MessageStream(NamedTuple):
    """A message: `rate` is its default in Hz, 0 for one that is only sent on request, or the option of the task that
    gives it; `low` the default on slow links. `group` is that of the older REQUEST_DATA_STREAM. `sources` says what it
    is made of. `build` gives the fields of each instance, and none while they are unknown; the second parameter of
    REQUEST_MESSAGE chooses the instance by the field `numbered`.
    """

    name: str
    rate: float | str
    group: int
    sources: str
    build: Callable[[TelemetrySources, Flavour, float], Built]
    low: float = 0.0
    numbered: str = ""

    def instances(self, sources: TelemetrySources, flavor: Flavour, now: float, number: int = 0) -> Sequence[Fields]:
        """The fields of all messages that can be sent now, or of the one with a number (from 1)."""
        built = self.build(sources, flavor, now)
        found = () if built is None else (built,) if isinstance(built, Mapping) else built
        if self.numbered and number > 0:
            return [fields for fields in found if fields[self.numbered] == number]
        return found


def _heartbeat(sources: TelemetrySources, flavor: Flavour, now: float) -> Fields:
    model = sources.model
    mode = model.mode
    armed = ARMED if model.armed_or_moving else 0
    return {
        "type": model.kind.type,
        "autopilot": flavor.autopilot,
        "base_mode": CUSTOM_MODE | mode.flags | armed,
        "custom_mode": model.custom_mode(flavor),
        "system_status": model.health.status(model.latest.vehicle),
        "mavlink_version": 3,
    }


def _sys_status(sources: TelemetrySources, _: Flavour, now: float) -> Fields:
    model = sources.model
    bits = _sensors(sources)
    load = value_of(model.latest.get(imc.CpuUsage))
    return from_imc.system_status(bits, load, model.latest.voltage, model.latest.current, model.latest.fuel)


def _sensors(sources: TelemetrySources) -> tuple[int, int]:
    """The bits of what the vehicle has, and of what is well."""
    model = sources.model
    states = [(entity.label, entity.state) for entity in model.entities() if entity.stateful]
    return from_imc.sensors(states, located=model.located, fenced=model.inside_fence, ready=not model.prearm_failure)


def _system_time(sources: TelemetrySources, _: Flavour, now: float) -> Fields:
    model = sources.model
    return {
        "time_unix_usec": round(model.utc(now) * 1e6),
        "time_boot_ms": from_imc.boot_ms(now, model.boot),
    }


def _gps_raw(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    fix = model.latest.get(imc.GpsFix)
    return instruments.gps_raw(fix, model.last_fix, model.undulation) if fix is not None else None


def _attitude(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    state = model.latest.state
    return from_imc.attitude(state, model.time(state)) if state is not None else None


def _attitude_quaternion(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    state = model.latest.state
    return instruments.attitude_quaternion(state, model.time(state)) if state is not None else None


def _global_position(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    found = model.place()
    return from_imc.global_position(*found, model.time(found[0])) if found else None


def _local_position(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    found = model.place()
    return from_imc.local_position(*found, model.home, model.time(found[0])) if found and model.home else None


def _hud(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    found = model.place()
    return from_imc.hud(*found, model.latest.airspeed, model.latest.throttle) if found else None


def _altitude(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    found = model.place()
    return instruments.altitude(*found, model.home) if found and model.home else None


def _mission_current(sources: TelemetrySources, flavor: Flavour, now: float) -> Fields:
    mission, zero = sources.mission, first_item(flavor)
    exists = mission.plan is not None
    return {
        "seq": mission.current + zero if exists else 0,
        "total": len(mission.items(flavor)) - zero if exists else NO_MISSION,
        "mission_state": mission.state,
        "mission_mode": 1 if sources.model.mode is Mode.MISSION else 2,
        "mission_id": mission.id(flavor),
        "fence_id": opaque_id(fence) if (fence := mission.fence()) else 0,
    }


def _path_control(sources: TelemetrySources, flavor: Flavour, now: float) -> Fields | None:
    model = sources.model
    path, found = model.latest.get(imc.PathControlState), model.place()
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
    return instruments.path_control(path, state, bearing, (path.z, 0.0))


def _batteries(sources: TelemetrySources, _: Flavour, now: float) -> Sequence[Fields]:
    """One for each entity that measures a voltage; those of batteries, if there are any."""
    model = sources.model
    values = model.latest
    voltages, currents = values.by_entity(imc.Voltage), values.by_entity(imc.Current)
    temperatures = values.by_entity(imc.Temperature)
    labels = sorted(label for label in voltages if model.latest.is_battery(label))[:MOST_BATTERIES]
    return [
        instruments.battery(
            number,
            voltages[label].value,
            value_of(currents.get(label)),
            model.latest.fuel if number == 0 else math.nan,
            value_of(temperatures.get(label)),
        )
        for number, label in enumerate(labels)
    ]


def _extended_state(sources: TelemetrySources, _: Flavour, now: float) -> Fields:
    model = sources.model
    medium = model.latest.get(imc.VehicleMedium)
    if model.kind.afloat or model.latest.motors_running is None:
        return from_imc.extended_state(None if medium is None else medium.medium, model.armed_or_moving)
    vehicle = model.latest.vehicle
    kind = vehicle.maneuver_type if vehicle is not None else None
    rises, lands = kind == imc.Takeoff.ID, kind == imc.Land.ID or model.latest.is_landing
    return from_imc.flying_state(model.latest.motors_running, rises=rises, lands=lands)


def _air_pressure(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    return _pressure(sources, now, deep=False)


def _water_pressure(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    return _pressure(sources, now, deep=True)


def _pressure(sources: TelemetrySources, now: float, *, deep: bool) -> Fields | None:
    """The pressure of the hull or air, or, if `deep`, that of the depth sensor."""
    model = sources.model
    found = [(label, m) for label, m in model.latest.by_entity(imc.Pressure).items() if ("Depth" in label) == deep]
    if not found:
        return None
    label, latest = found[-1]
    warm = value_of(model.latest.by_entity(imc.Temperature).get(label))
    return instruments.pressure(latest.value, warm, from_imc.boot_ms(now, model.boot))


def _distances(sources: TelemetrySources, _: Flavour, now: float) -> Sequence[Fields]:
    """The altitude above the bottom or ground, and what is ahead."""
    model = sources.model
    state, time = model.latest.state, from_imc.boot_ms(now, model.boot)
    found = [instruments.distance(state.alt, instruments.DOWN, 0, time)] if state is not None else []
    ahead = [m for label, m in model.latest.by_entity(imc.Distance).items() if "Echo Sounder" in label]
    valid = [m.value for m in ahead if m.validity == imc.Distance.Validity.VALID]
    found += [instruments.distance(value, instruments.FORWARD, 1, time) for value in valid[-1:]]
    return [fields for fields in found if fields is not None]


def _inertial(sources: TelemetrySources) -> list[imc.Message | None]:
    values = sources.model.latest
    return [values.get(imc.Acceleration), values.get(imc.AngularVelocity), values.get(imc.MagneticField)]


def _raw_imu(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    return instruments.raw_imu(_inertial(sources), now)


def _highres_imu(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    return instruments.highres_imu(_inertial(sources), now)


def _estimator(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    uncertainty = model.latest.get(imc.NavigationUncertainty)
    if uncertainty is None:
        return None
    return instruments.estimator_status(uncertainty, located=model.located, time=now)


def _water_depth(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    found = model.place()
    return instruments.water_depth(*found, model.time(found[0])) if found and model.kind.afloat else None


def _named_values(sources: TelemetrySources, _: Flavour, now: float) -> Sequence[Fields]:
    model = sources.model
    found = (value.fields(model.latest, now, model.boot) for value in sources.named_values)
    return [fields for fields in found if fields is not None]


def _modes(sources: TelemetrySources, flavor: Flavour, now: float) -> Sequence[Fields]:
    model = sources.model
    modes = flavor.modes(model.kind)
    return [
        {
            "number_modes": len(modes),
            "mode_index": index,
            "standard_mode": mode.standard,
            "custom_mode": number,
            "properties": model.kind.properties(mode),
            "mode_name": mode.name.capitalize().encode(),
        }
        for index, (mode, number) in enumerate(modes, 1)
    ]


def _modes_monitor(sources: TelemetrySources, flavor: Flavour, now: float) -> Fields:
    """A checksum instead of a count: it also differs after a restart with other modes."""
    return {"seq": crc32(repr(_modes(sources, flavor, now)).encode()) & 0xFF}


def _current_mode(sources: TelemetrySources, flavor: Flavour, now: float) -> Fields:
    model = sources.model
    number, intended = model.custom_mode(flavor), model.intended_mode(flavor)
    return {"standard_mode": model.mode.standard, "custom_mode": number, "intended_custom_mode": intended}


def _high_latency(sources: TelemetrySources, flavor: Flavour, now: float) -> Fields:
    model = sources.model
    state, place = model.place() or (None, None)
    measured = instruments.high_latency(state, place, model.latest.airspeed, model.latest.throttle, model.latest.fuel)
    number = model.custom_mode(flavor)
    return {
        "timestamp": from_imc.boot_ms(now, model.boot),
        "type": model.kind.type,
        "autopilot": flavor.autopilot,
        "custom_mode": number if number <= 0xFFFF else number >> 16,  # PX4's modes are in the upper half
        "failure_flags": from_imc.failures(_sensors(sources)),
        "wp_num": _mission_current(sources, flavor, now)["seq"],
        **measured,
    }


def _version(sources: TelemetrySources, flavor: Flavour, now: float) -> Fields:
    model = sources.model
    return {
        "capabilities": flavor.capabilities(model.kind),
        "flight_sw_version": flavor.software_version,
        "uid": int.from_bytes(model.identity.uid[:8], "little"),
        "uid2": tuple(model.identity.uid[:18]),
    }


def _metadata(sources: TelemetrySources, flavor: Flavour, now: float) -> Fields:
    about = sources.metadata
    return {"time_boot_ms": from_imc.boot_ms(now, sources.model.boot), "file_crc": about.crc, "uri": about.uri.encode()}


def _protocol(sources: TelemetrySources, flavor: Flavour, now: float) -> Fields:
    return {"version": 200, "min_version": 100, "max_version": 200}


def _home(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    return from_imc.home_position(model.home, now) if model.home else None


def _origin(sources: TelemetrySources, _: Flavour, now: float) -> Fields | None:
    model = sources.model
    return from_imc.global_origin(model.home, now) if model.home else None


STREAMS: Mapping[str, MessageStream] = {
    stream.name: stream
    for stream in (
        MessageStream(
            "HEARTBEAT", 1.0, 0, "VehicleState, PlanControlState, states of the entities", _heartbeat, low=1.0
        ),
        MessageStream(
            "SYS_STATUS",
            "status_rate",
            STATUS,
            "states of the entities, Voltage, Current, FuelLevel, CpuUsage",
            _sys_status,
            low=0.2,
        ),
        MessageStream("SYSTEM_TIME", 1.0, STATUS, "the clock", _system_time),
        MessageStream("GPS_RAW_INT", 2.0, STATUS, "GpsFix", _gps_raw),
        MessageStream("ATTITUDE", "attitude_rate", EXTRA_1, "EstimatedState", _attitude),
        MessageStream("ATTITUDE_QUATERNION", 0.0, EXTRA_1, "EstimatedState", _attitude_quaternion),
        MessageStream("LOCAL_POSITION_NED", "position_rate", POSITION, "EstimatedState", _local_position),
        MessageStream("GLOBAL_POSITION_INT", "position_rate", POSITION, "EstimatedState", _global_position, low=1.0),
        MessageStream("MISSION_CURRENT", 1.0, STATUS, "the mission, PlanControlState", _mission_current, low=0.2),
        MessageStream("NAV_CONTROLLER_OUTPUT", 1.0, STATUS, "PathControlState, EstimatedState", _path_control),
        MessageStream(
            "VFR_HUD",
            "position_rate",
            EXTRA_2,
            "EstimatedState, IndicatedSpeed, Throttle or SetThrusterActuation",
            _hud,
        ),
        MessageStream("ALTITUDE", 1.0, EXTRA_3, "EstimatedState", _altitude),
        MessageStream(
            "BATTERY_STATUS", 0.5, EXTRA_3, "Voltage, Current, FuelLevel, Temperature of each battery", _batteries
        ),
        MessageStream("HOME_POSITION", 1.0, EXTRA_3, "the first EstimatedState", _home),
        MessageStream("GPS_GLOBAL_ORIGIN", 0.0, 0, "the first EstimatedState", _origin),
        MessageStream("EXTENDED_SYS_STATE", 1.0, EXTRA_3, "VehicleMedium; ArmingState of aircraft", _extended_state),
        MessageStream("SCALED_PRESSURE", 1.0, RAW, "Pressure, Temperature of a barometer or hull", _air_pressure),
        MessageStream("SCALED_PRESSURE2", 1.0, RAW, "Pressure, Temperature of the depth sensor", _water_pressure),
        MessageStream("DISTANCE_SENSOR", 2.0, EXTRA_3, "EstimatedState, Distance of the echo sounder", _distances),
        MessageStream("RAW_IMU", 0.0, RAW, "Acceleration, AngularVelocity, MagneticField", _raw_imu),
        MessageStream("HIGHRES_IMU", 0.0, 0, "Acceleration, AngularVelocity, MagneticField", _highres_imu),
        MessageStream("CURRENT_MODE", 0.5, 0, "VehicleState, PlanControlState", _current_mode),
        MessageStream("ESTIMATOR_STATUS", 0.5, 0, "NavigationUncertainty", _estimator),
        MessageStream("WATER_DEPTH", 0.5, 0, "EstimatedState of vessels", _water_depth),
        MessageStream("NAMED_VALUE_FLOAT", 1.0, EXTRA_3, "`Named Values`", _named_values),
        MessageStream(
            "HIGH_LATENCY2",
            0.0,
            0,
            "EstimatedState, FuelLevel, states of the entities",
            _high_latency,
            low=0.2,
        ),
        MessageStream("AVAILABLE_MODES", 0.0, 0, "`Vehicle Kind`", _modes, numbered="mode_index"),
        MessageStream("AVAILABLE_MODES_MONITOR", 0.3, 0, "`Vehicle Kind`", _modes_monitor),
        MessageStream("AUTOPILOT_VERSION", 0.0, 0, "Shoal's version, the name of the vehicle", _version),
        MessageStream("COMPONENT_METADATA", 0.0, 0, "the parameters of all tasks", _metadata),
        MessageStream("PROTOCOL_VERSION", 0.0, 0, "MAVLink 2", _protocol),
    )
}
"""The streams by name."""
