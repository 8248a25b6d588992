"""Position, motion and desired direction of the vehicle."""

import math

import imc
from mavlink import Fields, Flavor
from mavlink.translate import from_imc, sensors_from_imc
from mavlink.vehicle.telemetry.telemetry_context import TelemetryContext
from support import wgs84


def gps_raw(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    fix = model.latest.get(imc.GpsFix)
    return sensors_from_imc.gps_raw(fix, model.last_fix, model.undulation) if fix is not None else None


def attitude(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    state = model.latest.state
    return from_imc.attitude(state, model.state_boot_time_ms(state)) if state is not None else None


def attitude_quaternion(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    state = model.latest.state
    return sensors_from_imc.attitude_quaternion(state, model.state_boot_time_ms(state)) if state is not None else None


def global_position(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    found = model.state_and_position()
    return from_imc.global_position(*found, model.state_boot_time_ms(found[0])) if found else None


def local_position(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    found = model.state_and_position()
    return (
        from_imc.local_position(*found, model.home, model.state_boot_time_ms(found[0]))
        if found and model.home
        else None
    )


def odometry(sources: TelemetryContext, flavor: Flavor, now: float) -> Fields | None:
    latest = sources.model.latest
    local = local_position(sources, flavor, now)
    if local is None or latest.state is None:
        return None
    return sensors_from_imc.odometry(latest.state, local, latest.get(imc.NavigationUncertainty))


def vfr_hud(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    found = model.state_and_position()
    return from_imc.hud(*found, model.latest.airspeed, model.latest.throttle) if found else None


def altitude(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    found = model.state_and_position()
    return sensors_from_imc.altitude(*found, model.home) if found and model.home else None


def nav_controller_output(sources: TelemetryContext, flavor: Flavor, now: float) -> Fields | None:
    model = sources.model
    path, found = model.latest.get(imc.PathControlState), model.state_and_position()
    if found is None:
        return None
    state, place = found
    if path is None:
        known = all(map(math.isfinite, (state.phi, state.theta, state.psi)))
        return sensors_from_imc.nav_controller_output_without_target(state) if known else None
    try:
        north, east = wgs84.offset(place.lat, place.lon, path.end_lat, path.end_lon)
    except (ArithmeticError, ValueError):
        return None
    if not all(map(math.isfinite, (north, east, path.course_error, path.y, state.phi, state.theta, state.psi))):
        return None
    bearing = math.atan2(east, north), math.hypot(north, east)
    return sensors_from_imc.nav_controller_output(path, state, bearing, (path.z, 0.0))


def estimator_status(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    uncertainty = model.latest.get(imc.NavigationUncertainty)
    if uncertainty is None:
        return None
    return sensors_from_imc.estimator_status(uncertainty, located=model.located, time=now)


def water_depth(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    found = model.state_and_position()
    return (
        sensors_from_imc.water_depth(*found, model.state_boot_time_ms(found[0]))
        if found and model.kind.afloat
        else None
    )


def home_position(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    return from_imc.home_position(model.home, now) if model.home else None


def global_origin(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    model = sources.model
    return from_imc.global_origin(model.home, now) if model.home else None
