"""The simulated multirotor, its barometer and its GPS receiver, compared with elementary physics."""

import math

import numpy as np
import pytest

import imc
from runtime import State
from runtime.testing import simulate
from tasks.simulators.barometer import Barometer, pressure_at
from tasks.simulators.gps import GPS
from tasks.simulators.imu import IMU
from tasks.simulators.stream_velocity import StreamVelocity
from tasks.simulators.uav import UAV
from world.bodies import Airframe, Multirotor
from world.bodies.multirotor import GRAVITY

FIX = imc.GpsFix(type=imc.GpsFix.Type.MANUAL_INPUT, lat=0.7188, lon=-0.1519, timestamp=0.0)
NO_DRAG = Airframe(linear_drag=0.0, quadratic_drag=0.0)
STEP = 0.01


def airborne(airframe=NO_DRAG, height=100.0):
    craft = Multirotor(airframe)
    craft.z, craft.on_ground, craft.rotor_speed = -height, False, airframe.hover_speed
    craft.command_rotor_speed(airframe.hover_speed)
    return craft


def run(craft, seconds):
    for _ in range(round(seconds / STEP)):
        craft.step(STEP)
    return craft


def test_rotors_that_carry_the_weight_keep_the_height():
    craft = run(airborne(), 60.0)
    assert (craft.x, craft.y, craft.z) == pytest.approx((0.0, 0.0, -100.0), abs=1e-6)


def test_it_stands_until_thrust_exceeds_weight():
    craft = Multirotor(NO_DRAG)
    craft.command_rotor_speed(0.999 * NO_DRAG.hover_speed)
    craft.command_pitch(-0.3)
    craft.command_yaw_rate(1.0)
    run(craft, 5.0)
    assert (craft.x, craft.z, craft.theta, craft.psi, craft.on_ground) == (0.0, 0.0, 0.0, 0.0, True)
    craft.command_rotor_speed(1.05 * NO_DRAG.hover_speed)
    craft.command_pitch(0.0)
    run(craft, 2.0)
    assert craft.z < -0.5
    assert not craft.on_ground


def test_a_tilt_accelerates_by_its_tangent():
    craft = airborne()
    tilt = math.radians(20.0)
    craft.command_pitch(-tilt)
    run(craft, 2.0)
    craft.command_rotor_speed(NO_DRAG.hover_speed / math.sqrt(math.cos(tilt)))
    run(craft, 1.0)
    before = craft.vn, craft.vd
    run(craft, 1.0)
    assert craft.vn - before[0] == pytest.approx(GRAVITY * math.tan(tilt), rel=1e-3)
    assert craft.vd - before[1] == pytest.approx(0.0, abs=1e-2)
    assert craft.ve == pytest.approx(0.0, abs=1e-9)


def test_a_roll_to_starboard_of_a_vehicle_that_looks_east_leads_south():
    craft = airborne()
    craft.psi = 0.5 * math.pi
    craft.command_roll(0.2)
    run(craft, 2.0)
    assert craft.vn < -1.0
    assert craft.ve == pytest.approx(0.0, abs=1e-9)


def test_thrust_climbs_as_newton_says():
    craft = airborne()
    craft.rotor_speed = 1.1 * NO_DRAG.hover_speed
    craft.command_rotor_speed(craft.rotor_speed)
    run(craft, 1.0)
    assert craft.vd == pytest.approx(-0.21 * GRAVITY, rel=1e-9)
    assert craft.z == pytest.approx(-100.0 - 0.5 * 0.21 * GRAVITY, rel=1e-9)


def test_wind_carries_a_level_vehicle_along_and_drag_limits_its_speed():
    craft = airborne(Airframe())
    craft.wind = (3.0, -4.0, 0.0)
    run(craft, 120.0)
    assert (craft.vn, craft.ve) == pytest.approx((3.0, -4.0), abs=1e-3)
    assert craft.air_velocity == pytest.approx((0.0, 0.0, 0.0), abs=1e-2)

    craft = airborne(Airframe(quadratic_drag=0.0))
    tilt = math.radians(10.0)
    craft.command_pitch(-tilt)
    craft.command_rotor_speed(Airframe().hover_speed / math.sqrt(math.cos(tilt)))
    run(craft, 120.0)
    assert craft.vn == pytest.approx(3.0 * GRAVITY * math.tan(tilt) / 0.35, rel=1e-3)


def test_roll_pitch_and_heading_rate_follow_their_commands():
    craft = airborne()
    craft.command_pitch(0.1)
    craft.command_yaw_rate(0.5)
    run(craft, 3.0)
    assert craft.theta == pytest.approx(0.1, abs=1e-4)
    assert (craft.q, craft.r) == pytest.approx((0.0, 0.5 * math.cos(0.1)), abs=1e-3)
    craft.command_pitch(3.0)
    craft.command_yaw_rate(9.0)
    run(craft, 3.0)
    assert craft.theta == pytest.approx(math.radians(45.0), abs=1e-3)


def test_it_falls_without_rotors_and_the_ground_stops_it():
    craft = airborne(height=5.0)
    craft.rotor_speed = 0.0
    craft.command_rotor_speed(0.0)
    run(craft, 1.0)
    assert craft.vd == pytest.approx(GRAVITY, rel=1e-3)
    run(craft, 1.0)
    assert craft.touchdown_speed == pytest.approx(math.sqrt(2.0 * GRAVITY * 5.0), rel=0.02)
    assert (craft.z, craft.vd, craft.on_ground) == (0.0, 0.0, True)


def test_what_has_no_bounds_is_an_error():
    craft = airborne()
    craft.vn = math.inf
    with pytest.raises(ArithmeticError):
        craft.step(STEP)


def test_the_task_flies_and_says_how_it_landed():
    hover = Airframe().hover_speed
    feed = [
        FIX,
        imc.SetThrusterActuation(timestamp=1.0, value=1.1 * hover),
        imc.SetThrusterActuation(timestamp=1.9, value=0.0),
    ]
    run = simulate(UAV, feed=feed, seconds=6.0, ground_height=60.0)
    states = run.of(imc.SimulatedState)
    assert len(states) == pytest.approx(600, abs=2)
    assert {(m.lat, m.lon, m.height) for m in states} == {(FIX.lat, FIX.lon, 60.0)}
    assert min(m.z for m in states) < -0.5
    assert states[-1].z == 0.0
    assert run.log[-1].startswith("touchdown at ")
    assert run.task.entity.state is State.NORMAL


def test_wind_blows_around_a_vehicle_that_stands():
    tasks = [UAV, (StreamVelocity, {"default_speed_north": 5.0})]
    run = simulate([(UAV, {"wind_source": "StreamVelocity"}), tasks[1]], feed=[FIX], seconds=3.0)
    last = run.of(imc.SimulatedState)[-1]
    assert (last.svx, last.x, last.u) == (5.0, 0.0, -5.0)


def test_without_commands_it_descends_level_and_rests():
    feed = [
        FIX,
        *(imc.SetThrusterActuation(timestamp=1.0 + 0.5 * i, value=1.02 * Airframe().hover_speed) for i in range(12)),
    ]
    feed += [imc.DesiredPitch(timestamp=6.9, value=-0.3)]
    run = simulate(UAV, feed=sorted(feed, key=lambda m: m.timestamp), seconds=40.0)
    states = run.of(imc.SimulatedState)
    assert min(m.z for m in states) < -4.0
    assert states[-1].z == 0.0
    assert run.task.craft.rotor_speed == pytest.approx(0.0, abs=1e-6)
    assert float(run.log[-1].split()[-2]) < 2.0
    assert "no commands for the rotors: descending level" in run.log


@pytest.mark.parametrize(
    "command",
    [
        imc.DesiredRoll(value=math.nan),
        imc.DesiredPitch(value=math.inf),
        imc.DesiredHeadingRate(value=math.nan),
        imc.SetThrusterActuation(value=math.nan),
    ],
)
def test_commands_that_are_no_numbers_are_said_once_and_have_no_effect(command):
    feed = [FIX, *(command.replace(timestamp=0.5 + 0.1 * i) for i in range(5))]
    run = simulate(UAV, feed=feed, seconds=2.0)
    assert len([text for text in run.log if text.endswith("is not a number")]) == 1
    assert run.of(imc.SimulatedState)[-1].z == 0.0


def test_a_fix_that_is_nowhere_places_nothing():
    run = simulate(UAV, feed=[FIX.replace(lat=9.0)], seconds=1.0)
    assert run.of(imc.SimulatedState) == []
    assert run.task.entity.state is State.BOOT


def test_an_accelerometer_feels_the_thrust_alone():
    feed = [FIX, imc.SetThrusterActuation(timestamp=1.0, value=1.1 * Airframe().hover_speed)]
    frame = {"linear_drag": 0.0, "quadratic_drag": 0.0, "command_timeout": 9.0}
    run = simulate([(UAV, frame), (IMU, {"generate_noise": False})], feed=feed, seconds=3.0)
    force = [m.z for m in run.of(imc.Acceleration)]
    assert force[50] == pytest.approx(-GRAVITY, abs=1e-3)
    assert force[-1] == pytest.approx(-1.21 * GRAVITY, abs=0.02)


def truths(seconds, height, z=0.0):
    return [imc.SimulatedState(timestamp=0.01 * i, height=height, z=z) for i in range(round(100 * seconds))]


def test_a_barometer_measures_the_standard_atmosphere():
    assert pressure_at(0.0, 1013.25) == 1013.25
    assert pressure_at(1000.0, 1013.25) == pytest.approx(898.74, abs=0.01)  # ISO 2533
    assert pressure_at(11000.0, 1013.25) == pytest.approx(226.32, abs=0.05)
    run = simulate(Barometer, feed=truths(20.0, 50.0, z=-950.0), drift=0.0)
    values = [m.value for m in run.of(imc.Pressure)]
    assert len(values) == pytest.approx(400, abs=2)
    assert np.mean(values) == pytest.approx(898.74, abs=0.01)
    assert np.std(values) == pytest.approx(0.012, rel=0.15)
    assert [m.value for m in run.of(imc.Temperature)] == [pytest.approx(8.5, abs=0.01)] * 19


@pytest.mark.parametrize("height", [math.nan, math.inf, -1e38])
def test_a_barometer_does_not_measure_at_an_impossible_height(height):
    run = simulate(
        Barometer, feed=[*truths(1.0, 50.0), *(m.replace(timestamp=1.5) for m in truths(0.01, height))], seconds=2.5
    )
    assert run.task.entity.state == State.FAULT
    assert run.of(imc.Pressure)[-1].timestamp - run.vehicle.start_time < 1.6


def test_a_position_has_the_noise_that_is_asked_for():
    run = simulate(GPS, feed=truths(40.0, 50.0), execution_frequency=20.0, position_noise=0.6, height_noise=1.2)
    fixes = run.of(imc.GpsFix)
    north = np.array([m.lat for m in fixes]) * 6335439.0
    assert north.std() == pytest.approx(0.6, rel=0.1)
    assert np.std([m.height for m in fixes]) == pytest.approx(1.2, rel=0.1)
    exact = simulate(GPS, feed=truths(3.0, 50.0)).of(imc.GpsFix)
    assert {(m.lat, m.lon, m.height) for m in exact} == {(0.0, 0.0, 50.0)}
