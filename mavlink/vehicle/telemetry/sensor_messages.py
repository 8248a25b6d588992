"""Measurements of sensors: batteries, pressures, distances, inertia."""

import math
from collections.abc import Sequence

import imc
from mavlink import Fields, Flavor
from mavlink.translate import from_imc, sensors_from_imc
from mavlink.vehicle.latest_values import value_of
from mavlink.vehicle.telemetry.telemetry_context import TelemetryContext

MOST_BATTERIES = 16


def batteries(sources: TelemetryContext, _: Flavor, now: float) -> Sequence[Fields]:
    """One for each entity that measures a voltage; those of batteries, if there are any."""
    model = sources.model
    values = model.latest
    voltages, currents = values.by_entity(imc.Voltage), values.by_entity(imc.Current)
    temperatures = values.by_entity(imc.Temperature)
    labels = sorted(label for label in voltages if model.latest.is_battery(label))[:MOST_BATTERIES]
    return [
        sensors_from_imc.battery(
            number,
            voltages[label].value,
            value_of(currents.get(label)),
            model.latest.fuel if number == 0 else math.nan,
            value_of(temperatures.get(label)),
        )
        for number, label in enumerate(labels)
    ]


def air_pressure(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    return _pressure(sources, now, deep=False)


def water_pressure(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    return _pressure(sources, now, deep=True)


def _pressure(sources: TelemetryContext, now: float, *, deep: bool) -> Fields | None:
    """The pressure of the hull or air, or, if `deep`, that of the depth sensor."""
    model = sources.model
    found = [(label, m) for label, m in model.latest.by_entity(imc.Pressure).items() if ("Depth" in label) == deep]
    if not found:
        return None
    label, latest = found[-1]
    warm = value_of(model.latest.by_entity(imc.Temperature).get(label))
    return sensors_from_imc.pressure(latest.value, warm, from_imc.boot_ms(now, model.boot))


def distance_sensors(sources: TelemetryContext, _: Flavor, now: float) -> Sequence[Fields]:
    """The altitude above the bottom or ground, and what is ahead."""
    model = sources.model
    state, time = model.latest.state, from_imc.boot_ms(now, model.boot)
    found = [sensors_from_imc.distance(state.alt, sensors_from_imc.DOWN, 0, time)] if state is not None else []
    ahead = [m for label, m in model.latest.by_entity(imc.Distance).items() if "Echo Sounder" in label]
    valid = [m.value for m in ahead if m.validity == imc.Distance.Validity.VALID]
    found += [sensors_from_imc.distance(value, sensors_from_imc.FORWARD, 1, time) for value in valid[-1:]]
    return [fields for fields in found if fields is not None]


def _inertial(sources: TelemetryContext) -> list[imc.Message | None]:
    values = sources.model.latest
    return [values.get(imc.Acceleration), values.get(imc.AngularVelocity), values.get(imc.MagneticField)]


def raw_imu(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    return sensors_from_imc.raw_imu(_inertial(sources), now)


def highres_imu(sources: TelemetryContext, _: Flavor, now: float) -> Fields | None:
    return sensors_from_imc.highres_imu(_inertial(sources), now)
