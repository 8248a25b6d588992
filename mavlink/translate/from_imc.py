"""IMC values as MAVLink fields; functions return None for unknown values and values that do not fit."""

import math
from collections.abc import Iterable

import imc
from mavlink.dialect import Fields
from mavlink.positions import GlobalPosition, Home, degrees_e7
from support import wgs84
from support.rotations import rotation, to_ned, wrap

State = imc.EntityState.State
UNKNOWN_16 = 0xFFFF
FASTEST = 327.0  # m/s, what an int16 holds in cm/s
NOWHERE = (math.nan,) * 4

GYRO, ACCELEROMETER, MAGNETOMETER, PRESSURE, GPS = 0x01, 0x02, 0x04, 0x08, 0x20
OPTICAL_FLOW, VISION_POSITION = 0x40, 0x80
Z_CONTROL, XY_CONTROL, MOTORS = 0x2000, 0x4000, 0x8000
GEOFENCE, AHRS, LOGGING, BATTERY, PREARM = 0x100000, 0x200000, 0x1000000, 0x2000000, 0x10000000

# MAV_SYS_STATUS_SENSOR bits by a word in the entity label; the first match counts
SENSORS = (
    ("IMU", GYRO | ACCELEROMETER),
    ("AHRS", GYRO | ACCELEROMETER | MAGNETOMETER | AHRS),
    ("Depth Control", Z_CONTROL),
    ("Depth", PRESSURE),
    ("Barometer", PRESSURE),
    ("DVL", OPTICAL_FLOW),
    ("USBL", VISION_POSITION),
    ("LBL", VISION_POSITION),
    ("Batter", BATTERY),
    ("Path Control", XY_CONTROL),
    ("Motor", MOTORS),
    ("Logg", LOGGING),
)

# MAV_SYS_STATUS_SENSOR bit -> HL_FAILURE_FLAG
FAILURES = (
    (GPS, 1),
    (PRESSURE, 4),
    (ACCELEROMETER, 8),
    (GYRO, 16),
    (MAGNETOMETER, 32),
    (BATTERY, 128),
    (MOTORS, 1024),
    (GEOFENCE, 2048),
    (AHRS, 4096),
)


def velocity_of(state: imc.EstimatedState) -> tuple[float, float, float] | None:
    """Velocity over ground, north, east, down in m/s; from the body velocity if only that is known.

    None if it is unknown, or too large for the fields.
    """
    ground, body = (state.vx, state.vy, state.vz), (state.u, state.v, state.w)
    known = _all_finite(*body, state.phi, state.theta, state.psi)
    if _all_finite(*ground) and (any(ground) or not known or not any(body)):
        return ground if _slow(*ground) else None
    if not (known and _slow(*body)):
        return None
    return to_ned(rotation(state.phi, state.theta, state.psi), body)


def boot_ms(time: float, boot: float) -> int:
    """Milliseconds since `boot` (both s since 1970), wrapped like MAVLink's 32-bit field."""
    return max(0, round((time - boot) * 1e3)) & 0xFFFFFFFF if math.isfinite(time) else 0


def attitude(state: imc.EstimatedState, time: int) -> Fields | None:
    angles = state.phi, state.theta, state.psi
    rates = state.p, state.q, state.r
    if not _all_finite(*angles, *rates):
        return None
    return {
        "time_boot_ms": time,
        "roll": wrap(state.phi),
        "pitch": wrap(state.theta),
        "yaw": wrap(state.psi),
        "rollspeed": state.p,
        "pitchspeed": state.q,
        "yawspeed": state.r,
    }


def global_position(state: imc.EstimatedState, place: GlobalPosition | None, time: int) -> Fields | None:
    velocity = velocity_of(state)
    if place is None or velocity is None:
        return None
    return {
        "time_boot_ms": time,
        "lat": degrees_e7(place.lat),
        "lon": degrees_e7(place.lon),
        "alt": round(place.altitude * 1e3),
        "relative_alt": round(place.relative * 1e3),
        "vx": round(velocity[0] * 100),
        "vy": round(velocity[1] * 100),
        "vz": round(velocity[2] * 100),
        "hdg": round(_heading(state.psi) * 100) % 36000 if math.isfinite(state.psi) else UNKNOWN_16,
    }


def local_position(state: imc.EstimatedState, place: GlobalPosition | None, home: Home, time: int) -> Fields | None:
    velocity = velocity_of(state)
    if place is None or velocity is None:
        return None
    if (state.lat, state.lon) == (home.lat, home.lon):
        north, east = state.x, state.y
    else:
        north, east, _ = wgs84.displacement(home.lat, home.lon, home.height, place.lat, place.lon, home.height)
    names = ("x", "y", "z", "vx", "vy", "vz")
    return {"time_boot_ms": time, **dict(zip(names, (north, east, -place.relative, *velocity), strict=True))}


def hud(state: imc.EstimatedState, place: GlobalPosition | None, airspeed: float, throttle: float) -> Fields | None:
    """VFR_HUD. `airspeed` is the speed through water or air in m/s, NaN if unknown; `throttle` is in %."""
    velocity = velocity_of(state)
    if place is None or velocity is None or not math.isfinite(state.psi):
        return None
    return {
        "airspeed": airspeed if math.isfinite(airspeed) else math.hypot(state.u, state.v, state.w),
        "groundspeed": math.hypot(velocity[0], velocity[1]),
        "heading": round(_heading(state.psi)) % 360,
        "throttle": round(min(100.0, abs(throttle))) if math.isfinite(throttle) else 0,
        "alt": place.altitude,
        "climb": -velocity[2],
    }


def home_position(home: Home, now: float) -> Fields:
    return {
        "latitude": degrees_e7(home.lat),
        "longitude": degrees_e7(home.lon),
        "altitude": round(home.altitude * 1e3),
        "q": NOWHERE,
        "approach_x": math.nan,
        "approach_y": math.nan,
        "approach_z": math.nan,
        "time_usec": round(now * 1e6),
    }


def global_origin(home: Home, now: float) -> Fields:
    position = home_position(home, now)
    return {name: position[name] for name in ("latitude", "longitude", "altitude", "time_usec")}


def extended_state(medium: int | None, armed: bool) -> Fields:
    media = imc.VehicleMedium.Medium
    landed = 0
    if medium == media.GROUND or (medium == media.WATER and not armed):
        landed = 1
    elif medium in (media.AIR, media.UNDERWATER, media.WATER):
        landed = 2
    return {"vtol_state": 0, "landed_state": landed}


def aircraft_extended_state(motors: bool, *, rises: bool, lands: bool) -> Fields:
    """EXTENDED_SYS_STATE of an aircraft: on the ground without `motors`, else taking off, landing, or in the air."""
    return {"vtol_state": 0, "landed_state": 1 if not motors else 3 if rises else 4 if lands else 2}


def sensor_bits(
    states: Iterable[tuple[str, State]], *, located: bool, fenced: bool | None, ready: bool
) -> tuple[int, int]:
    """MAV_SYS_STATUS_SENSOR bits that are present, and the healthy ones, from labels and states of entities.

    The GPS bit means that the position is known, by any means. `fenced`: whether the vehicle is inside its fence, None
    if there is none, which is healthy: MAVProxy reports a breach otherwise.
    """
    present = GPS | PREARM | (0 if fenced is None else GEOFENCE)
    ill = (0 if located else GPS) | (0 if ready else PREARM)
    for label, state in states:
        bits = next((bits for word, bits in SENSORS if word in label), 0)
        present |= bits
        ill |= 0 if state == State.NORMAL else bits
    return present, present & ~ill & ~GEOFENCE | (0 if fenced is False else GEOFENCE)


def failure_bits(bits: tuple[int, int]) -> int:
    """HL_FAILURE_FLAG bits of HIGH_LATENCY2: what is present and not healthy."""
    present, healthy = bits
    ill = present & ~healthy
    return sum(flag for sensor, flag in FAILURES if ill & sensor)  # integers


def system_status(bits: tuple[int, int], load: float, voltage: float, current: float, fuel: float) -> Fields:
    """SYS_STATUS; load and fuel in %, voltage in V, current in A; NaN: unknown."""
    present, healthy = bits
    return {
        "onboard_control_sensors_present": present,
        "onboard_control_sensors_enabled": present,
        "onboard_control_sensors_health": healthy,
        "load": round(min(100.0, max(0.0, load)) * 10) if math.isfinite(load) else 0,
        "voltage_battery": round(min(65.534, max(0.0, voltage)) * 1e3) if math.isfinite(voltage) else UNKNOWN_16,
        "current_battery": round(min(327.67, max(0.0, current)) * 100) if math.isfinite(current) else -1,
        "battery_remaining": round(fuel) if 0.0 <= fuel <= 100.0 else -1,
    }


def _heading(psi: float) -> float:
    return math.degrees(psi) % 360.0


def _slow(*speeds: float) -> bool:
    return all(abs(speed) <= FASTEST for speed in speeds)


def _all_finite(*values: float) -> bool:
    return all(map(math.isfinite, values))
