"""The monitors of the vehicle."""

import math

import pytest
from flying import CCU, OWN, changes, place

import imc
from runtime import ParameterError, State, Task, periodic
from runtime.testing import simulate
from tasks.monitors.entities import Entities
from tasks.monitors.fuel_level import FuelLevel
from tasks.monitors.medium import Medium
from tasks.monitors.operational_limits import OperationalLimits

Where = imc.VehicleMedium.Medium
Limit = imc.OpLimitsMask


def states(run):
    """The states of the first task's entity, with their descriptions."""
    entity = run.task.entity.id
    return changes((State(m.state).name, m.description) for m in run.of(imc.EntityState) if m.src_ent == entity)


class Patient(Task):
    """Is well, then in error, then well."""

    def start(self):
        self.set_entity_state(State.NORMAL, "active")
        self.after(3.5, self.set_entity_state, State.ERROR, "no data")
        self.after(6.5, self.set_entity_state, State.NORMAL, "active")


def test_entities_are_watched_and_silence_is_failure():
    run = simulate([(Entities, {"default_monitoring": ["Patient", "Ghost"]}), Patient], seconds=9)
    reports = run.of(imc.EntityMonitoringState)
    first, last = reports[0], reports[-1]
    assert (first.mcount, first.mnames) == (3, "Daemon,Patient,Ghost")
    assert (first.last_error, first.last_error_time) == ("", -1.0)
    seen = [(r.cnames, r.enames) for r in reports]
    assert [s for i, s in enumerate(seen) if not i or s != seen[i - 1]][-4:] == [
        ("", "Ghost"),
        ("Patient", "Ghost"),
        ("Patient,Ghost", ""),
        ("Ghost", ""),
    ]
    assert last.last_error == "Ghost: no report for 5 s"
    error = next(r for r in reports if r.cnames == "Patient")
    assert error.timestamp - run.vehicle.start_time == pytest.approx(3.5)
    assert error.last_error == "Patient: no data"


@pytest.mark.parametrize(
    ("feed", "expected"),
    [
        ([], Where.UNKNOWN),
        ([imc.EstimatedState(depth=2.0)], Where.UNDERWATER),
        ([imc.EstimatedState(depth=0.1)], Where.UNKNOWN),
        ([imc.EstimatedState(depth=0.1), imc.GpsFix(timestamp=9.0, validity=4)], Where.WATER),
        ([imc.EstimatedState(depth=0.1), imc.SoundSpeed(timestamp=9.0, value=1500)], Where.WATER),
        ([imc.EstimatedState(depth=0.1), imc.SoundSpeed(timestamp=9.0, value=340)], Where.GROUND),
        ([imc.EstimatedState(depth=0.1), imc.SoundSpeed(timestamp=9.0, value=-1)], Where.UNKNOWN),
        ([imc.EstimatedState(depth=0.1), imc.Salinity(timestamp=9.0, value=35)], Where.WATER),
    ],
)
def test_the_medium_of_an_underwater_vehicle(feed, expected):
    run = simulate(Medium, feed, seconds=10.5)
    assert run.of(imc.VehicleMedium)[-1].medium == expected


def test_a_vehicle_without_wet_sensors_floats_after_a_while():
    run = simulate(Medium, [imc.EstimatedState(depth=0.1)], seconds=25, initialization_time=20.0)
    assert [m.medium for m in run.of(imc.VehicleMedium)][-6:] == [Where.UNKNOWN] + [Where.WATER] * 5


@pytest.mark.parametrize(
    ("kind", "state", "expected"),
    [
        ("UGV", {}, Where.GROUND),
        ("USV", {}, Where.WATER),
        ("UAV", {"alt": 0.2}, Where.GROUND),
        ("UAV", {"alt": 20.0}, Where.AIR),
        ("UAV", {"alt": -1.0, "vx": 15.0}, Where.AIR),
    ],
)
def test_the_medium_of_other_vehicles(kind, state, expected):
    run = simulate(Medium, [imc.EstimatedState(**state)], seconds=3, vehicle_type=kind)
    assert run.of(imc.VehicleMedium)[-1].medium == expected


def at(seconds, **fields):
    return imc.EstimatedState(timestamp=seconds, **fields)


def test_limits_are_reported_at_the_start_and_when_asked():
    run = simulate(
        OperationalLimits,
        [imc.GetOperationalLimits(timestamp=1.0, src=CCU, dst=OWN)],
        seconds=2,
        maximum_depth=30.0,
        maximum_speed=1.6,
    )
    first, reply = run.of(imc.OperationalLimits)
    assert (first.mask, first.max_depth, first.max_speed) == (
        Limit.MAX_DEPTH | Limit.MAX_SPEED,
        30.0,
        pytest.approx(1.6),
    )
    assert (reply.dst, reply.mask) == (CCU, first.mask)


def test_a_passed_limit_is_an_error_until_it_is_well_inside():
    feed = [at(1.0, depth=29.0), at(2.0, depth=30.5), at(3.0, depth=29.9), at(4.0, depth=29.5)]
    run = simulate(OperationalLimits, feed, seconds=5, maximum_depth=30.0)
    fine = ("NORMAL", "active")
    assert states(run) == [fine, ("ERROR", "violates maximum depth"), fine]


@pytest.mark.parametrize(
    ("limits", "state", "name"),
    [
        ({"mask": Limit.MIN_ALT, "min_altitude": 2.0}, {"depth": 5.0, "alt": 1.0}, "minimum altitude"),
        ({"mask": Limit.MAX_ALT, "max_altitude": 9.0}, {"depth": 5.0, "alt": 10.0}, "maximum altitude"),
        ({"mask": Limit.MAX_ALT, "max_altitude": 9.0}, {"depth": -1.0, "alt": 10.0}, "maximum altitude"),
        ({"mask": Limit.MIN_SPEED, "min_speed": 0.5}, {"vx": 0.1}, "minimum speed"),
        ({"mask": Limit.MAX_SPEED, "max_speed": 1.0}, {"vx": 1.1}, "maximum speed"),
        ({"mask": Limit.MAX_VRATE, "max_vrate": 0.2}, {"vz": -0.3}, "maximum vertical rate"),
        ({"mask": Limit.AREA, **place(0, 0), "length": 100.0, "width": 20.0}, place(0, 11), "area"),
    ],
)
def test_every_limit(limits, state, name):
    feed = [imc.OperationalLimits(timestamp=0.5, src=CCU, dst=OWN, **limits), at(1.0, **state)]
    run = simulate(OperationalLimits, feed, seconds=2)
    assert ("ERROR", f"violates {name}") in states(run)
    inside = [feed[0], at(1.0, depth=0.1, alt=-1.0, vx=0.7, **place(40, 0))]
    assert "ERROR" not in {state for state, _ in states(simulate(OperationalLimits, inside, seconds=2))}


def test_what_flies_may_be_on_the_ground():
    low = imc.OperationalLimits(timestamp=0.5, src=CCU, dst=OWN, mask=Limit.MIN_ALT, min_altitude=5.0)
    run = simulate(OperationalLimits, [low, at(1.0, depth=-1.0, alt=0.0)], seconds=2)
    assert states(run) == [("NORMAL", "active")]


def test_an_area_is_there_from_the_start():
    center = [math.degrees(value) for value in place(0, 0).values()]
    area = {"area_center": center, "area_size": [100.0, 20.0], "area_orientation": 90.0}
    feed = [at(1.0, **place(0, 40)), at(2.0, **place(40, 0))]
    run = simulate(OperationalLimits, feed, seconds=3, **area)
    assert run.of(imc.OperationalLimits)[0].mask == Limit.AREA
    assert states(run) == [("NORMAL", "active"), ("ERROR", "violates area")]
    with pytest.raises(ParameterError):
        simulate(OperationalLimits, seconds=1, area_center=[99.0, 0.0])


def test_limits_that_are_no_numbers_are_refused():
    bad = imc.OperationalLimits(timestamp=1.0, src=CCU, dst=OWN, mask=Limit.MAX_DEPTH, max_depth=math.nan)
    run = simulate(OperationalLimits, [bad, bad.replace(dst=0x1B, max_depth=1.0)], seconds=2, maximum_depth=30.0)
    assert [m.max_depth for m in run.of(imc.OperationalLimits)] == [30.0]
    assert run.log == ["limits from 0x4000 have a value that is not a number"]


@pytest.mark.parametrize(("src", "dst", "limit"), [(0x1B, 0xFFFF, 30.0), (0x1B, OWN, 5.0), (CCU, 0xFFFF, 5.0)])
def test_limits_of_another_vehicle_are_its_own(src, dst, limit):
    told = imc.OperationalLimits(timestamp=1.0, src=src, dst=dst, mask=Limit.MAX_DEPTH, max_depth=5.0)
    run = simulate(OperationalLimits, [told], seconds=2, maximum_depth=30.0)
    assert run.of(imc.OperationalLimits)[-1].max_depth == limit


class Batteries(Task):
    """A battery at 25 V and 72 A: half a watt hour a second."""

    @periodic(1.0)
    def measure(self):
        self.publish(imc.Voltage(value=25.0))
        self.publish(imc.Current(value=72.0))


def test_energy_is_counted_down():
    settings = {"General": {"Battery Capacity": "10"}}
    run = simulate([(FuelLevel, {"execution_frequency": 1.0}), Batteries], seconds=20.5, settings=settings)
    levels = [m.value for m in run.of(imc.FuelLevel)]
    assert levels[0] == 100.0
    assert levels[-1] == pytest.approx(5.0, abs=5.1)
    assert [state for state, _ in states(run)] == ["NORMAL", "FAULT", "ERROR"]


def test_without_capacity_nothing_is_known():
    run = simulate([FuelLevel, Batteries], seconds=15)
    assert run.of(imc.FuelLevel) == []
    assert states(run)[0] == ("FAULT", "the profile has no Battery Capacity")
