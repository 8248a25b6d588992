"""An AUV that has become too heavy to rise by its buoyancy comes up with motor and fins."""

import math
from dataclasses import replace
from functools import cache

import pytest
from flying import goto, plan_of
from lean import BLIND, UNLOGGED

import imc
from shoal.missions import prepare
from tests.repeats import all_but, repeat
from tests.tasks.mission.lies import AHRS, DEEP, DEPTH, FAULT, Flight, Mode, all_of, lies
from tests.tasks.mission.underway import underway

pytestmark = [pytest.mark.heavy, pytest.mark.computing]


@pytest.fixture(scope="module")
def fly():
    """Flies on from where the vehicle dives; its plan ends soon."""
    state = cache(lambda: underway("lauv-noptilus-1", plan_of(goto(30, 0, 10.0)), FAULT, DEEP, BLIND))
    return lambda folder, inject, seconds: Flight(state(), folder, inject, seconds)


def ballast(kilograms, *silent, jammed=None):
    """The vehicle takes on weight; tasks fall silent 10 s later, and its horizontal fins jam at an angle (rad)
    after its plan."""

    def inject(vehicle):
        craft = vehicle.task("Simulators.VSIM").craft
        craft.model = replace(craft.model, mass=craft.model.mass + kilograms)
        for task in silent:
            vehicle.kernel.after(10.0, vehicle.task(task).cancel_callbacks).owner = vehicle
        if jammed is not None:
            deflect = craft.set_deflection

            def jam():
                craft.set_deflection = lambda fin, angle: deflect(fin, jammed if fin in (1, 2) else angle)

            vehicle.kernel.after(30.0, jam).owner = vehicle

    return inject


@pytest.mark.parametrize(
    "silent",
    [
        (),
        repeat((("Plan.Engine",),)),
        ("Supervisors.Vehicle",),
        repeat((("Navigation.AUV.Navigation",),)),
        ("Simulators.IMU/AHRS",),
        ("Simulators.DepthSensor",),
    ],
)
def test_a_vehicle_that_is_too_heavy_comes_up_with_its_motor_whoever_is_silent(silent, fly, tmp_path):
    flight = fly(tmp_path, ballast(0.6, *silent), 125.0)
    assert max(flight.depths) < 16.0
    assert max(flight.depths[-1000:]) < 1.6
    assert flight.modes[-1] is Mode.ERROR or silent == ("Supervisors.Vehicle",)


def test_a_vehicle_that_is_too_heavy_comes_up_although_its_depth_is_that_of_the_surface(fly, tmp_path):
    drifts = lies(DEPTH, imc.Depth, ("value", lambda depth, t: depth - 0.06 * t))
    flight = fly(tmp_path, all_of(ballast(0.6), drifts), 200.0)
    assert max(flight.depths) < 25.0
    assert max(flight.depths[-3000:]) < 1.6
    assert min(flight.depths[-3000:]) < 0.3


def test_a_vehicle_that_sinks_slowly_comes_up_although_its_depth_is_that_of_the_surface(fly, tmp_path):
    """With 0.3 kg it sinks by 4 cm/s, and its depth, 8 m too small, drifts on by 3 cm/s."""
    drifts = lies(DEPTH, imc.Depth, ("value", lambda depth, t: depth - 0.2 * min(t, 40.0) - 0.03 * t))
    flight = fly(tmp_path, all_of(ballast(0.3), drifts), 200.0)
    assert 7.0 < max(flight.depths) < 8.3
    assert max(flight.depths[-1000:]) < 1.6


def test_a_vehicle_that_is_too_heavy_is_helped_before_it_is_on_the_bottom(tmp_path):
    """There fins have no effect. Its plan ends 1.5 m above it, and it sinks by 2 m in the time that buoyancy has."""
    low = goto(50, 0, 1.5).replace(z_units=imc.ZUnits.ALTITUDE)
    state = underway("lauv-noptilus-1", plan_of(low), FAULT, DEEP.replace("120", "8"), BLIND)
    flight = Flight(state, tmp_path, ballast(0.6), 150.0)
    assert 6.5 < max(flight.depths) < 7.6
    assert max(flight.depths[-1000:]) < 1.6


@pytest.mark.parametrize("scale", [1.0, 0.001], ids=["depth", "depth in kilometers"])
def test_a_vehicle_that_sinks_before_its_first_plan_comes_up(scale, tmp_path):
    """That it sinks, a bench cannot show: its altitude decreases as its depth increases, or as it sinks by the velocity
    log."""
    depths, driven = [], []
    places = {"log_root": tmp_path / "log", "state_folder": tmp_path / "db"}
    vehicle = prepare("lauv-noptilus-1", overrides=(UNLOGGED, DEEP, BLIND), **places).vehicle
    vehicle.observe(imc.SimulatedState, lambda truth: depths.append(truth.z))
    vehicle.observe(imc.SetThrusterActuation, lambda command: driven.append(command.value))
    vehicle.start()
    vehicle.run(10.0)
    lies(DEPTH, imc.Depth, ("value", lambda depth, t: scale * depth))(vehicle)
    ballast(0.3)(vehicle)
    vehicle.run(110.0)
    vehicle.close()
    assert any(driven)
    assert 1.0 < max(depths) < 3.0
    assert max(depths[-1000:]) < 1.0


def test_a_vehicle_that_is_too_heavy_comes_up_although_its_depth_shows_three_times_its_way(fly, tmp_path):
    """With 0.18 kg it rises by 0.8 cm/s, which a depth in feet shows as 2.7."""
    feet = lies(DEPTH, imc.Depth, ("value", lambda depth, t: depth * 3.2808))
    flight = fly(tmp_path, all_of(ballast(0.18), feet), 100.0)
    assert max(flight.depths) > 4.0
    assert max(flight.depths[-1000:]) < 1.0


@pytest.mark.parametrize("kilograms", all_but([0.6], [0.3, 0.6]))
def test_a_vehicle_that_is_too_heavy_comes_up_although_its_depth_is_in_kilometers(kilograms, fly, tmp_path):
    """That of 5 m is that of the surface: without a fix there, the vertical speed shows that it sinks again."""
    kilometers = lies(DEPTH, imc.Depth, ("value", lambda depth, t: depth * 0.001))
    flight = fly(tmp_path, all_of(ballast(kilograms), kilometers), 150.0)
    assert max(flight.depths) > 4.0
    assert max(flight.depths[-4000:]) < 1.3


@pytest.mark.parametrize(("kilograms", "wrong"), [(0.3, 0.5), repeat((0.18, 0.37))])
def test_a_vehicle_that_is_too_heavy_comes_up_although_its_pitch_is_wrong(kilograms, wrong, fly, tmp_path):
    """A pitch that shows the bow 28° too far up has the fins turn it down; with 21° too much it keeps its depth."""
    drifts = lies(AHRS, imc.EulerAngles, ("theta", lambda pitch, t: pitch + min(wrong, 0.01 * t)))
    flight = fly(tmp_path, all_of(ballast(kilograms), drifts), 150.0)
    assert max(flight.depths) < 16.0
    assert max(flight.depths[-1000:]) < 1.6


def test_a_vehicle_that_is_too_heavy_comes_up_although_its_pitch_is_in_degrees(fly, tmp_path):
    """Fins that follow such a pitch, mostly beyond 90 degrees, turn the bow up and down."""
    degrees = lies(AHRS, imc.EulerAngles, ("theta", lambda pitch, t: math.degrees(pitch)))
    flight = fly(tmp_path, all_of(ballast(0.18), degrees), 100.0)
    assert max(flight.depths) < 8.0
    assert max(flight.depths[-1000:]) < 1.6


def test_a_wrong_pitch_and_depth_do_not_make_it_dive_on(fly, tmp_path):
    """The vertical speed, computed with that pitch, says that it climbs."""
    pitch = lies(AHRS, imc.EulerAngles, ("theta", lambda pitch, t: pitch + 0.01 * t))
    kilometers = lies(DEPTH, imc.Depth, ("value", lambda depth, t: depth * 0.001))
    flight = fly(tmp_path, all_of(ballast(0.18), pitch, kilometers), 200.0)
    assert max(flight.depths) < 30.0
    assert max(flight.depths[-1000:]) < 5.0


@pytest.mark.parametrize(("kilograms", "degrees"), [(0.6, 20.0), repeat((0.3, 8.0))])
def test_fins_that_are_jammed_downward_bring_it_up_astern(kilograms, degrees, fly, tmp_path):
    """It goes ahead while its bow is up: astern alone would take 70 s at 8 degrees."""
    flight = fly(tmp_path, ballast(kilograms, jammed=math.radians(degrees)), 150.0)
    assert max(flight.depths) < 8.0
    assert max(flight.depths[6000:]) < 1.6, flight.depths[::1000]


def test_fins_that_are_jammed_downward_do_not_make_a_light_vehicle_dive_whose_depth_drifts(fly, tmp_path):
    drifts = lies(DEPTH, imc.Depth, ("value", lambda depth, t: depth - 0.06 * t))
    flight = fly(tmp_path, all_of(ballast(0.0, jammed=math.radians(20.0)), drifts), 260.0)
    assert max(flight.depths) < 12.0
    assert flight.depths[-1] < 1.0


@pytest.mark.parametrize("wrong", [0.0, -0.15], ids=["sound", "with a wrong pitch in a current"])
def test_a_vehicle_that_rises_by_itself_needs_no_motor(wrong, tmp_path):
    """A pitch 9° too small makes the vertical speed in a current wrong; the altitude shows that it rises."""
    driven = []

    def inject(vehicle):
        motor = vehicle.task("Simulators.VSIM").craft
        actuate = motor.set_actuation

        def note(engine, share):
            if vehicle.kernel.now_ns * 1e-9 - vehicle.start_time > 45.0:
                driven.append(share)
            actuate(engine, share)

        motor.set_actuation = note

    water = DEEP.replace("120", "15"), "Simulators.StreamVelocity:Default Speed North=0.4"
    state = underway("lauv-noptilus-1", plan_of(goto(30, 0, 10.0)), FAULT, *water, BLIND)
    pitch = lies(AHRS, imc.EulerAngles, ("theta", lambda true, t: true + (wrong if t > 15.0 else 0.0)))
    flight = Flight(state, tmp_path, all_of(inject, pitch), 100.0)
    assert set(driven) <= {0.0}
    assert flight.depths[-1] < max(flight.depths) - 1.0
    assert wrong or not flight.errors
