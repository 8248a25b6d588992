"""Status of the vehicle: its mode, mission, health and abilities."""

from collections.abc import Sequence
from zlib import crc32

import imc
from mavlink import ARMED, CUSTOM_MODE, Fields, Flavor, Mode
from mavlink.missions import first_item_seq, opaque_id
from mavlink.translate import from_imc, sensors_from_imc
from mavlink.vehicle.latest_values import value_of
from mavlink.vehicle.telemetry.telemetry_context import TelemetryContext

NO_MISSION = 0xFFFF


def heartbeat(sources: TelemetryContext, flavor: Flavor, now: float) -> Fields:
    model = sources.model
    mode = model.mode
    armed = ARMED if model.armed_or_moving else 0
    return {
        "type": model.kind.type,
        "autopilot": flavor.autopilot,
        "base_mode": CUSTOM_MODE | mode.flags | armed,
        "custom_mode": model.custom_mode(flavor),
        "system_status": model.health.mav_state(model.latest.vehicle),
        "mavlink_version": 3,
    }


def sys_status(sources: TelemetryContext, _: Flavor, now: float) -> Fields:
    model = sources.model
    bits = _sensors(sources)
    load = value_of(model.latest.get(imc.CpuUsage))
    return from_imc.system_status(bits, load, model.latest.voltage, model.latest.current, model.latest.fuel)


def _sensors(sources: TelemetryContext) -> tuple[int, int]:
    """The bits of what the vehicle has, and of what is well."""
    model = sources.model
    states = [(entity.label, entity.state) for entity in model.entities() if entity.stateful]
    return from_imc.sensor_bits(
        states, located=model.located, fenced=model.is_inside_fence, ready=not model.prearm_failure
    )


def system_time(sources: TelemetryContext, _: Flavor, now: float) -> Fields:
    model = sources.model
    return {
        "time_unix_usec": round(model.utc(now) * 1e6),
        "time_boot_ms": from_imc.boot_ms(now, model.boot),
    }


def mission_current(sources: TelemetryContext, flavor: Flavor, now: float) -> Fields:
    mission, zero = sources.mission, first_item_seq(flavor)
    exists = mission.plan is not None
    return {
        "seq": mission.current + zero if exists else 0,
        "total": len(mission.items(flavor)) - zero if exists else NO_MISSION,
        "mission_state": mission.state,
        "mission_mode": 1 if sources.model.mode is Mode.MISSION else 2,
        "mission_id": mission.id(flavor),
        "fence_id": opaque_id(fence) if (fence := mission.fence()) else 0,
    }


def extended_state(sources: TelemetryContext, _: Flavor, now: float) -> Fields:
    model = sources.model
    medium = model.latest.get(imc.VehicleMedium)
    if model.kind.afloat or model.latest.motors_running is None:
        return from_imc.extended_state(None if medium is None else medium.medium, model.armed_or_moving)
    vehicle = model.latest.vehicle
    kind = vehicle.maneuver_type if vehicle is not None else None
    rises, lands = kind == imc.Takeoff.ID, kind == imc.Land.ID or model.latest.is_landing
    return from_imc.aircraft_extended_state(model.latest.motors_running, rises=rises, lands=lands)


def named_values(sources: TelemetryContext, _: Flavor, now: float) -> Sequence[Fields]:
    model = sources.model
    found = (value.fields(model.latest, now, model.boot) for value in sources.named_values)
    return [fields for fields in found if fields is not None]


def available_modes(sources: TelemetryContext, flavor: Flavor, now: float) -> Sequence[Fields]:
    model = sources.model
    modes = flavor.modes(model.kind)
    return [
        {
            "number_modes": len(modes),
            "mode_index": index,
            "standard_mode": mode.standard,
            "custom_mode": number,
            "properties": model.kind.mode_properties(mode),
            "mode_name": mode.name.capitalize().encode(),
        }
        for index, (mode, number) in enumerate(modes, 1)
    ]


def modes_monitor(sources: TelemetryContext, flavor: Flavor, now: float) -> Fields:
    """A checksum instead of a count: it also differs after a restart with other modes."""
    return {"seq": crc32(repr(available_modes(sources, flavor, now)).encode()) & 0xFF}


def current_mode(sources: TelemetryContext, flavor: Flavor, now: float) -> Fields:
    model = sources.model
    number, intended = model.custom_mode(flavor), model.intended_mode(flavor)
    return {"standard_mode": model.mode.standard, "custom_mode": number, "intended_custom_mode": intended}


def high_latency(sources: TelemetryContext, flavor: Flavor, now: float) -> Fields:
    model = sources.model
    state, place = model.state_and_position() or (None, None)
    measured = sensors_from_imc.high_latency(
        state, place, model.latest.airspeed, model.latest.throttle, model.latest.fuel
    )
    number = model.custom_mode(flavor)
    return {
        "timestamp": from_imc.boot_ms(now, model.boot),
        "type": model.kind.type,
        "autopilot": flavor.autopilot,
        "custom_mode": number if number <= 0xFFFF else number >> 16,  # PX4's modes are in the upper half
        "failure_flags": from_imc.failure_bits(_sensors(sources)),
        "wp_num": mission_current(sources, flavor, now)["seq"],
        **measured,
    }


def autopilot_version(sources: TelemetryContext, flavor: Flavor, now: float) -> Fields:
    model = sources.model
    return {
        "capabilities": flavor.capabilities(model.kind),
        "flight_sw_version": flavor.software_version,
        "uid": int.from_bytes(model.identity.uid[:8], "little"),
        "uid2": tuple(model.identity.uid[:18]),
    }


def component_metadata(sources: TelemetryContext, flavor: Flavor, now: float) -> Fields:
    about = sources.metadata
    return {"time_boot_ms": from_imc.boot_ms(now, sources.model.boot), "file_crc": about.crc, "uri": about.uri.encode()}


def protocol_version(sources: TelemetryContext, flavor: Flavor, now: float) -> Fields:
    return {"version": 200, "min_version": 100, "max_version": 200}
