"""Braking before obstacles: detection, begin and end, and a vehicle before a wall."""

import math

import pytest
from lean import BLIND, UNLOGGED

import imc
from runtime import State, param
from runtime.testing import simulate
from shoal.missions import Mission, prepare
from support.wgs84 import displace
from tasks.control.auv.brakes import Brakes
from tasks.control.auv.speed import Speed

Loops = imc.CLoopsMask
Op = imc.Brake.Op
START = (math.radians(41.185), math.radians(-8.7062))


class Sonar(Brakes):
    """Reserves the entity of the echo sounder, as its simulator does."""

    other: str = param("Altimeter", "", "Another entity.")

    def configure(self) -> None:
        super().configure()
        self.reserve_entity(self.echo_sounder)
        self.reserve_entity(self.other)


def braked(ranges, *more, label="Echo Sounder", seconds=None, depth=3.0, validity=1, **parameters):
    """When (s) braking begins and ends, for one range every 0.2 s from 1 s on."""
    entity = simulate(Sonar, seconds=0.1).vehicle.entities.find(label).id
    feed = [imc.ControlLoops(timestamp=0.1, enable=1, mask=Loops.PATH, scope_ref=1), *more]
    for k, reach in enumerate(ranges):
        time = 1.0 + 0.2 * k
        feed += [imc.EstimatedState(timestamp=time + late, depth=depth, alt=4.0) for late in (-0.05, 0.01)]
        feed.append(imc.Distance(timestamp=time, value=reach, validity=validity, src_ent=entity))
    feed.sort(key=lambda m: m.timestamp)
    run = simulate(Sonar, feed, seconds=seconds or feed[-1].timestamp + 0.1, **parameters)
    return run, [(round(m.timestamp - run.vehicle.start_time, 1), Op(m.op)) for m in run.of(imc.Brake)]


def test_three_near_echoes_brake_and_three_far_ones_release():
    _, found = braked([20.0, 7.0, 7.0, 20.0, 7.0, 6.9, 6.8, 6.7, 9.0, 20.0, 20.0, 20.0])
    assert found == [(2.2, Op.START), (3.2, Op.STOP)]


def test_a_brake_goes_with_the_path():
    off = imc.ControlLoops(timestamp=2.5, enable=0, mask=Loops.ALL, scope_ref=2)
    _, found = braked([7.0] * 10, off)
    assert found == [(1.4, Op.START), (2.5, Op.STOP)]
    assert braked([7.0] * 10, off.replace(timestamp=0.5))[1] == []


def test_a_brake_ends_with_its_task():
    assert braked([7.0] * 5)[1] == [(1.4, Op.START), (1.9, Op.STOP)]


def test_what_does_not_count():
    assert braked([7.0] * 10, label="Altimeter")[1] == []
    assert braked([7.0] * 10, validity=0)[1] == []
    assert braked([math.nan, -1.0, math.inf] * 5)[1] == []
    assert braked([3.0] * 10, depth=0.1)[1] == [], "at the surface"
    assert braked([])[1] == []


@pytest.mark.parametrize(("before", "after"), [(0.0, 0.5), (0.5, 0.0)])
def test_the_surface_is_no_obstacle_for_a_vehicle_that_pitches_between_two_states(before, after):
    entity = simulate(Sonar, seconds=0.1).vehicle.entities.find("Echo Sounder").id
    feed = [imc.ControlLoops(timestamp=0.1, enable=1, mask=Loops.PATH, scope_ref=1)]
    for k in range(10):
        time = 1.0 + k
        feed.append(imc.EstimatedState(timestamp=time - 0.3, depth=2.0, alt=20.0, theta=before))
        feed.append(imc.Distance(timestamp=time, value=4.0, validity=1, src_ent=entity))
        feed.append(imc.EstimatedState(timestamp=time + 0.3, depth=2.0, alt=20.0, theta=after))
    run = simulate(Sonar, feed, seconds=12.0)
    assert run.of(imc.Brake) == []
    level = [m.replace(theta=0.0) if isinstance(m, imc.EstimatedState) else m for m in feed]
    assert len(simulate(Sonar, level, seconds=12.0).of(imc.Brake)) == 2


def test_an_echo_far_from_all_states_does_not_count():
    late = [imc.EstimatedState(timestamp=time, depth=3.0, alt=4.0) for time in (0.2, 5.0)]
    entity = simulate(Sonar, seconds=0.1).vehicle.entities.find("Echo Sounder").id
    feed = [imc.ControlLoops(timestamp=0.1, enable=1, mask=Loops.PATH, scope_ref=1)]
    feed += [imc.Distance(timestamp=2.0 + k / 5, value=7.0, validity=1, src_ent=entity) for k in range(100)]
    run = simulate(Sonar, sorted([*feed, *late], key=lambda m: m.timestamp), seconds=6.0)
    assert run.of(imc.Brake) == []


def test_an_obstacle_that_stays_is_an_error():
    run, _ = braked([7.0] * 30, longest_brake=3.0)
    assert (State.ERROR, "an obstacle is in the way") in [(m.state, m.description) for m in run.of(imc.EntityState)]


def test_the_speed_is_not_integrated_while_braking():
    feed = [
        imc.ControlLoops(timestamp=0.1, enable=1, mask=Loops.SPEED, scope_ref=1),
        imc.DesiredSpeed(timestamp=0.2, value=1.2, speed_units=imc.SpeedUnits.METERS_PS),
        imc.Brake(timestamp=20.0, op=Op.START),
        imc.Brake(timestamp=60.0, op=Op.STOP),
    ]
    for k in range(20 * 100):
        time = 0.3 + 0.05 * k
        feed += [imc.EstimatedState(timestamp=time, u=1.2 if time < 20.0 else 0.0), imc.Rpm(timestamp=time + 0.01)]
    run = simulate(Speed, sorted(feed, key=lambda m: m.timestamp), seconds=62.0, rpm_acceleration=1e6)
    thrusts = [(m.timestamp - run.vehicle.start_time, m.value) for m in run.of(imc.SetThrusterActuation)]
    before, after = ([v for t, v in thrusts if a < t < b] for a, b in ((19.0, 20.0), (60.2, 61.0)))
    assert {v for t, v in thrusts if 20.1 < t < 60.0} == {0.0}
    assert max(after) == pytest.approx(before[-1], abs=0.03)


@pytest.mark.heavy
@pytest.mark.parametrize(("north", "braking"), [(50.0, True), (150.0, False)])
def test_a_vehicle_stops_before_a_wall(tmp_path, north, braking):
    ends = [number for east in (-40.0, 40.0) for number in displace(*START, 0.0, north, east)[:2]]
    wall = f"Simulators.Environment:Pier Points={', '.join(map(repr, ends))}"
    made = prepare(
        "lauv-noptilus-1",
        overrides=(UNLOGGED, BLIND, wall, "Simulators.Environment:Simulate Pier=true"),
        log_root=tmp_path / "log",
        state_folder=tmp_path / "db",
    )
    places, brakes = list[float](), list[int]()
    made.vehicle.observe(imc.SimulatedState, lambda m: places.append(m.x))
    made.vehicle.observe(imc.Brake, lambda m: brakes.append(m.op))
    lat, lon, _ = displace(*START, 0.0, 80.0, 0.0)
    goto = imc.Goto(lat=lat, lon=lon, z=2.0, z_units=imc.ZUnits.DEPTH, speed=1.2)
    item = imc.PlanManeuver(maneuver_id="a", data=goto)
    report = Mission(made.vehicle, imc.PlanSpecification(plan_id="p", start_man_id="a", maneuvers=(item,))).fly(120.0)
    assert brakes == ([Op.START, Op.STOP] if braking else [])
    assert report.completed is not braking
    if braking:
        assert report.reason == "vehicle errors: Brakes: an obstacle is in the way"
        assert max(places) + 1.0 < north, "the nose is 1 m ahead"
