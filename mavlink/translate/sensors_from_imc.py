"""Measurements of sensors and batteries in IMC as MAVLink fields; unknown values are those of MAVLink for unknown."""

import math
from collections.abc import Mapping, Sequence
from typing import TypeAlias

import imc
from mavlink.dialect import Fields
from mavlink.positions import GlobalPosition, Home, degrees_e7
from mavlink.translate.from_imc import UNKNOWN_16, boot_ms, velocity_of
from support.rotations import quaternion_from_euler, rotation, to_body, wrap

GRAVITY = 9.80665  # m/s²; "mg" are thousandths of it
DOWN, FORWARD = 25, 0  # MAV_SENSOR_ORIENTATION
ULTRASOUND = 1  # MAV_DISTANCE_SENSOR
UNKNOWN_TEMPERATURE = 0x7FFF
CELLS, MORE_CELLS = 10, 4
Validity: TypeAlias = imc.GpsFix.Validity
FixType: TypeAlias = imc.GpsFix.Type
NO_FIX, FIX_2D, FIX_3D, FIX_DGPS, FIX_STATIC = 1, 2, 3, 4, 7
FIXES: Mapping[int, int] = {
    FixType.DIFFERENTIAL: FIX_DGPS,
    FixType.MANUAL_INPUT: FIX_STATIC,
    FixType.DEAD_RECKONING: NO_FIX,
}
ACCELERATIONS, GYROS, MAGNETIC = 0x07, 0x38, 0x1C0  # HIGHRES_IMU_UPDATED
ATTITUDE_OK, VELOCITY_OK, POSITION_OK, DEPTH_OK = 0x001, 0x006, 0x018, 0x020  # ESTIMATOR_STATUS_FLAGS

LOCAL_NED, BODY_FRD, AUTOPILOT_ESTIMATOR = 1, 12, 8  # MAV_FRAME, MAV_ESTIMATOR_TYPE
COVARIANCES, VARIANCES = 21, (0, 6, 11)  # the upper triangle by rows; the places of x, y, z


def has_position(fix: imc.GpsFix) -> bool:
    """Whether a fix has a valid and finite latitude and longitude."""
    return bool(fix.validity & Validity.VALID_POS) and math.isfinite(fix.lat) and math.isfinite(fix.lon)


def gps_raw(fix: imc.GpsFix, last: imc.GpsFix | None, undulation: float) -> Fields:
    """GPS_RAW_INT. `last` is the last fix with a position, `undulation` the height of the geoid above the ellipsoid."""
    valid, flags = fix.validity, Validity
    values: dict[str, int] = {
        "time_usec": round(fix.timestamp * 1e6),
        "fix_type": _fix_type(fix),
        "eph": _hundredths(fix.hdop) if valid & flags.VALID_HDOP else UNKNOWN_16,
        "epv": _hundredths(fix.vdop) if valid & flags.VALID_VDOP else UNKNOWN_16,
        "vel": _hundredths(fix.sog) if valid & flags.VALID_SOG else UNKNOWN_16,
        "cog": _hundredths(math.degrees(fix.cog) % 360.0) % 36000 if valid & flags.VALID_COG else UNKNOWN_16,
        "satellites_visible": fix.satellites,
    }
    if last is not None:
        height = last.height if math.isfinite(last.height) else undulation
        values |= {
            "lat": degrees_e7(last.lat),
            "lon": degrees_e7(last.lon),
            "alt": round((height - undulation) * 1e3),
            "alt_ellipsoid": round(height * 1e3),
            "h_acc": round(last.hacc * 1e3) if last.validity & flags.VALID_HACC and math.isfinite(last.hacc) else 0,
            "v_acc": round(last.vacc * 1e3) if last.validity & flags.VALID_VACC and math.isfinite(last.vacc) else 0,
        }
    return values


def _fix_type(fix: imc.GpsFix) -> int:
    """GPS_FIX_TYPE; a fix whose height is unknown is two-dimensional."""
    if not has_position(fix):
        return NO_FIX
    return FIXES.get(fix.type, FIX_3D) if math.isfinite(fix.height) else FIX_2D


def attitude_quaternion(state: imc.EstimatedState, time: int) -> Fields | None:
    """ATTITUDE_QUATERNION: from north, east, down to the body; rotations about z, then y, then x."""
    if not all(map(math.isfinite, (state.phi, state.theta, state.psi, state.p, state.q, state.r))):
        return None
    q1, q2, q3, q4 = quaternion_from_euler(state.phi, state.theta, state.psi)
    return {
        "time_boot_ms": time,
        "q1": q1,
        "q2": q2,
        "q3": q3,
        "q4": q4,
        "rollspeed": state.p,
        "pitchspeed": state.q,
        "yawspeed": state.r,
    }


def odometry(state: imc.EstimatedState, local: Fields, uncertainty: imc.NavigationUncertainty | None) -> Fields | None:
    """ODOMETRY from LOCAL_POSITION_NED: position from home in north, east, down, velocities along the body's axes.

    Of the covariances only the variances of x, y, z are filled in, and NaN where nothing is known, as in MAVLink.
    """
    angles, over_ground = (state.phi, state.theta, state.psi), velocity_of(state)
    if over_ground is None or not all(map(math.isfinite, (*angles, state.p, state.q, state.r))):
        return None
    velocity = to_body(rotation(*angles), over_ground)
    covariance = [math.nan] * COVARIANCES
    if uncertainty is not None:
        for place, variance in zip(VARIANCES, (uncertainty.x, uncertainty.y, uncertainty.z), strict=True):
            covariance[place] = variance if 0.0 <= variance < math.inf else math.nan
    return {
        "time_usec": round(state.timestamp * 1e6),
        "frame_id": LOCAL_NED,
        "child_frame_id": BODY_FRD,
        **{name: local[name] for name in ("x", "y", "z")},
        "q": quaternion_from_euler(*angles),
        **dict(zip(("vx", "vy", "vz"), velocity, strict=True)),
        "rollspeed": state.p,
        "pitchspeed": state.q,
        "yawspeed": state.r,
        "pose_covariance": covariance,
        "velocity_covariance": [math.nan] * COVARIANCES,
        "estimator_type": AUTOPILOT_ESTIMATOR,
    }


def altitude(state: imc.EstimatedState, place: GlobalPosition, home: Home) -> Fields:
    """ALTITUDE; the clearance is that above the bottom or ground, NaN if unknown."""
    clearance = state.alt if state.alt >= 0.0 and math.isfinite(state.alt) else math.nan
    return {
        "time_usec": round(state.timestamp * 1e6),
        "altitude_monotonic": place.altitude,
        "altitude_amsl": place.altitude,
        "altitude_local": place.altitude - home.altitude,
        "altitude_relative": place.relative,
        "altitude_terrain": place.altitude - clearance,
        "bottom_clearance": clearance,
    }


def battery(number: int, voltage: float, current: float, fuel: float, temperature: float) -> Fields:
    """BATTERY_STATUS of a whole pack; V, A, %, °C; NaN: unknown."""
    pack = round(min(65.534, max(0.0, voltage)) * 1e3) if math.isfinite(voltage) else UNKNOWN_16
    known_temperature = math.isfinite(temperature) and abs(temperature) < 300.0
    return {
        "id": number,
        "voltages": (pack, *[UNKNOWN_16] * (CELLS - 1)),
        "voltages_ext": (0,) * MORE_CELLS,
        "temperature": round(temperature * 100) if known_temperature else UNKNOWN_TEMPERATURE,
        "current_battery": round(min(327.67, max(0.0, current)) * 100) if math.isfinite(current) else -1,
        "current_consumed": -1,
        "energy_consumed": -1,
        "battery_remaining": round(fuel) if 0.0 <= fuel <= 100.0 else -1,
    }


def nav_controller_output(
    path: imc.PathControlState, state: imc.EstimatedState, bearing: tuple[float, float], errors: tuple[float, float]
) -> Fields:
    """NAV_CONTROLLER_OUTPUT. `bearing`: to the target in rad, and its distance in m; `errors`: of height and speed."""
    angle, distance = bearing
    return {
        "nav_roll": math.degrees(state.phi),
        "nav_pitch": math.degrees(state.theta),
        "nav_bearing": round(math.degrees(wrap(state.psi + path.course_error))),
        "target_bearing": round(math.degrees(wrap(angle))),
        "wp_dist": round(min(65535.0, distance)),
        "alt_error": errors[0],
        "aspd_error": errors[1],
        "xtrack_error": path.y,
    }


def nav_controller_output_without_target(state: imc.EstimatedState) -> Fields:
    """NAV_CONTROLLER_OUTPUT where no path is followed: no distance and no errors, as ArduPilot sends it."""
    heading = round(math.degrees(wrap(state.psi)))
    return {
        "nav_roll": math.degrees(state.phi),
        "nav_pitch": math.degrees(state.theta),
        "nav_bearing": heading,
        "target_bearing": heading,
    }


def pressure(value: float, temperature: float, time: int) -> Fields | None:
    """SCALED_PRESSURE or SCALED_PRESSURE2, from hPa and °C (NaN: unknown)."""
    if not math.isfinite(value):
        return None
    known = math.isfinite(temperature) and abs(temperature) < 300.0
    return {"time_boot_ms": time, "press_abs": value, "temperature": round(temperature * 100) if known else 0}


def distance(meters: float, orientation: int, number: int, time: int) -> Fields | None:
    """DISTANCE_SENSOR of a sonar; None if nothing is in its range."""
    if not 0.0 < meters < 655.0:
        return None
    return {
        "time_boot_ms": time,
        "min_distance": 10,
        "max_distance": 20000,
        "current_distance": round(meters * 100),
        "type": ULTRASOUND,
        "id": number,
        "orientation": orientation,
        "covariance": 255,
    }


def water_depth(state: imc.EstimatedState, place: GlobalPosition, time: int) -> Fields | None:
    """WATER_DEPTH: how deep the water is, in m below the surface, with the attitude in degrees."""
    known = math.isfinite(state.alt) and state.alt >= 0.0
    angles = state.phi, state.theta, state.psi
    if not (known and all(map(math.isfinite, angles))):
        return None
    names = ("roll", "pitch", "yaw")
    return {
        "time_boot_ms": time,
        "healthy": 1,
        "lat": degrees_e7(place.lat),
        "lng": degrees_e7(place.lon),
        "alt": place.altitude,
        **{name: math.degrees(angle) for name, angle in zip(names, angles, strict=True)},
        "distance": max(0.0, -place.relative) + state.alt,
        "temperature": math.nan,
    }


def raw_imu(sensors: Sequence[imc.Message | None], time: float) -> Fields | None:
    """RAW_IMU of acceleration, angular velocity and magnetic field, in thousandths of g, rad/s and gauss."""
    scales = (1e3 / GRAVITY, 1e3, 1e3)
    found = _vectors(sensors)
    if not found:
        return None
    values: dict[str, int] = {}
    for kind, scale in zip(("acc", "gyro", "mag"), scales, strict=True):
        for axis, value in zip("xyz", found.get(kind, ()), strict=False):
            values[f"{axis}{kind}"] = round(max(-32768.0, min(32767.0, value * scale)))
    return {"time_usec": round(time * 1e6), **values}


def highres_imu(sensors: Sequence[imc.Message | None], time: float) -> Fields | None:
    """HIGHRES_IMU of acceleration (m/s²), angular velocity (rad/s) and magnetic field (gauss)."""
    found = _vectors(sensors)
    if not found:
        return None
    bits = {"acc": ACCELERATIONS, "gyro": GYROS, "mag": MAGNETIC}
    values = {
        f"{axis}{kind}": value for kind, vector in found.items() for axis, value in zip("xyz", vector, strict=True)
    }
    return {"time_usec": round(time * 1e6), "fields_updated": sum(bits[kind] for kind in found), **values}  # integers


def estimator_status(uncertainty: imc.NavigationUncertainty, *, located: bool, time: float) -> Fields:
    """ESTIMATOR_STATUS: standard deviations of the position in m, NaN if unknown."""

    def deviation(*variances: float) -> float:
        return math.sqrt(math.fsum(variances)) if all(0.0 <= v < math.inf for v in variances) else math.nan

    flags = ATTITUDE_OK | VELOCITY_OK | DEPTH_OK | (POSITION_OK if located else 0)
    return {
        "time_usec": round(time * 1e6),
        "flags": flags,
        **dict.fromkeys(("vel_ratio", "pos_horiz_ratio", "pos_vert_ratio", "mag_ratio"), 0.0),
        "hagl_ratio": math.nan,
        "tas_ratio": math.nan,
        "pos_horiz_accuracy": deviation(uncertainty.x, uncertainty.y),
        "pos_vert_accuracy": deviation(uncertainty.z),
    }


def named_value(name: str, value: float, now: float, boot: float) -> Fields:
    """NAMED_VALUE_FLOAT; the name is cut to 10 bytes."""
    return {"time_boot_ms": boot_ms(now, boot), "name": name.encode()[:10], "value": value}


def high_latency(
    state: imc.EstimatedState | None, place: GlobalPosition | None, airspeed: float, throttle: float, fuel: float
) -> Fields:
    """The measured part of HIGH_LATENCY2; altitudes in m, headings in 2 degrees, speeds in 0.2 m/s."""
    values: dict[str, int] = {"battery": round(fuel) if 0.0 <= fuel <= 100.0 else -1}
    if math.isfinite(throttle):
        values["throttle"] = round(min(100.0, abs(throttle)))
    if state is None or place is None:
        return values
    velocity = velocity_of(state) or (0.0, 0.0, 0.0)
    speed = math.hypot(velocity[0], velocity[1])
    through = abs(airspeed) if math.isfinite(airspeed) else speed
    heading = math.degrees(state.psi) % 360.0 if math.isfinite(state.psi) else 0.0
    return values | {
        "latitude": degrees_e7(place.lat),
        "longitude": degrees_e7(place.lon),
        "altitude": round(place.altitude),
        "heading": round(heading / 2.0) % 180,
        "groundspeed": round(min(255.0, speed * 5.0)),
        "airspeed": round(min(255.0, through * 5.0)),
        "climb_rate": round(max(-127.0, min(127.0, -velocity[2] * 10.0))),
        "eph": 255,
        "epv": 255,
    }


def _hundredths(value: float) -> int:
    return round(min(655.34, max(0.0, value)) * 100) if math.isfinite(value) else UNKNOWN_16


def _vectors(sensors: Sequence[imc.Message | None]) -> dict[str, tuple[float, float, float]]:
    """The finite vectors among messages with x, y and z, by MAVLink's abbreviation."""
    kinds = {imc.Acceleration: "acc", imc.AngularVelocity: "gyro", imc.MagneticField: "mag"}
    found: dict[str, tuple[float, float, float]] = {}
    for message in sensors:
        if isinstance(message, imc.Acceleration | imc.AngularVelocity | imc.MagneticField):
            vector = message.x, message.y, message.z
            if all(map(math.isfinite, vector)):
                found[kinds[type(message)]] = vector
    return found
