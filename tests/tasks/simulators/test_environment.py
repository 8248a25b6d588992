"""DVL, sonars, leaks and water properties of a simulated vehicle."""

import math

import numpy as np
import pytest

import imc
from runtime import ParameterError
from runtime.testing import simulate
from tasks.simulators.dvl import DVL
from tasks.simulators.environment import Environment
from tasks.simulators.gaussian import Gaussian
from tasks.simulators.leaks import Leaks
from world.sea import Bathymetry, BathymetryError, read_bathymetry
from world.sensors import SonarBeam

State = imc.EntityState.State
LAT, LON = math.radians(41.185), math.radians(-8.7062)


def at(time, **fields):
    return imc.SimulatedState(timestamp=time, lat=LAT, lon=LON, **fields)


def states(run, label):
    entity = run.vehicle.entities.find(label).id
    return list(dict.fromkeys(m.state for m in run.of(imc.EntityState) if m.src_ent == entity))


def test_dvl_over_ground_and_through_the_water():
    truth = {"u": 1.2, "v": -0.1, "w": 0.05, "psi": 0.5 * math.pi, "svx": 0.3, "svy": 0.4}
    run = simulate(DVL, [at(0.1 * k, **truth) for k in range(6000)], seed=2, ground_noise=0.01)
    water, ground = run.of(imc.WaterVelocity), run.of(imc.GroundVelocity)
    assert len(water) == len(ground) == pytest.approx(3000, abs=2)
    assert [m.validity for m in water] == [m.validity for m in ground]
    valid = np.array([m.validity for m in water]) == 7
    assert 1.0 - valid.mean() == pytest.approx(0.1, abs=4 * 0.3 / math.sqrt(3000))
    through = np.array([(m.x, m.y, m.z) for m in water])[valid]
    over = np.array([(m.x, m.y, m.z) for m in ground])[valid]
    assert through.mean(0) == pytest.approx([1.2, -0.1, 0.05], abs=4 * 0.002 / 50)
    assert over.mean(0) == pytest.approx([1.2 + 0.4, -0.1 - 0.3, 0.05], abs=4 * 0.01 / 50)
    assert over.std(0) == pytest.approx(0.01, rel=0.06)
    assert {(m.x, m.y, m.z) for m in ground if m.validity == 0} == {(0.0, 0.0, 0.0)}
    assert ground[0].timestamp == water[0].timestamp


def test_dvl_and_what_is_not_finite():
    run = simulate(DVL, [at(0.5, u=1.0), at(1.5, u=math.nan), at(2.5, u=1.0), at(3.3, u=1.0)], seconds=4.0)
    assert states(run, "DVL") == [State.BOOT, State.NORMAL, State.FAULT]
    assert len(run.of(imc.GroundVelocity)) == 12


@pytest.mark.parametrize("theta", [0.0, 0.2, -0.3])
def test_an_altimeter_measures_along_its_beam(theta):
    run = simulate(Environment, [at(0.1 * k, z=3.0, theta=theta) for k in range(2000)], out_of_bounds_depth=13.0)
    label = run.vehicle.entities.find("Altimeter").id
    down = [m for m in run.of(imc.Distance) if m.src_ent == label]
    values = np.array([m.value for m in down])
    assert len(values) == pytest.approx(1000, abs=2)
    assert values.mean() == pytest.approx(10.0 / math.cos(theta), abs=4 * 0.05 / math.sqrt(len(values)))
    assert values.std() == pytest.approx(0.05, rel=0.1)
    (location,), (beam,) = down[0].location, down[0].beam_config
    assert (location.theta, location.x) == (pytest.approx(-0.5 * math.pi), 0.0)
    assert beam.beam_width == pytest.approx(math.radians(-1.0))


def ahead(**options):
    truth = {name: options.pop(name) for name in ("z", "theta", "psi", "phi", "x") if name in options}
    run = simulate(Environment, [at(0.0, **truth)], seconds=1.0, forward_noise=0.0, **options)
    label = run.vehicle.entities.find("Echo Sounder").id
    return next(m.value for m in run.of(imc.Distance) if m.src_ent == label)


def test_an_echo_sounder_sees_surface_bottom_and_nothing():
    edge = math.radians(5.0)
    assert ahead(z=5.0) == 30.0
    assert ahead(z=5.0, theta=0.3) == pytest.approx((5.0 - math.sin(0.3)) / math.sin(0.3), rel=1e-3)
    below = 20.0 - 5.0 - math.sin(0.6)
    assert ahead(z=5.0, theta=-0.6, out_of_bounds_depth=20.0) == pytest.approx(below / math.sin(0.6 + edge), abs=0.02)
    assert ahead(z=5.0, theta=-0.6, out_of_bounds_depth=20.0, bottom_intersection_method=False) == 30.0
    assert ahead(z=0.05, theta=0.13) == pytest.approx(0.2)


def test_an_echo_sounder_sees_a_pier():
    per_metre = math.degrees(1.0 / 6368000.0)
    ends = [LAT + math.radians(20.0 * per_metre), LON - 1e-4, LAT + math.radians(20.0 * per_metre), LON + 1e-4]
    assert ahead(z=5.0, pier_points=ends, simulate_pier=True) == pytest.approx(19.0, abs=0.1)
    assert ahead(z=5.0, pier_points=ends, simulate_pier=True, psi=math.pi) == 30.0
    assert ahead(z=5.0, pier_points=ends) == 30.0


def test_soundings_of_the_profile_and_the_tide():
    section = {"Latitude (degrees)": "41.185", "Longitude (degrees)": "-8.7062", "Data": "0 0 5.0, 100 0 15"}
    options = {"settings": {"Bathymetry": section}, "bottom_noise": 0.0, "sounding_radius": 200.0}
    for x, tide, depth in ((0.0, 0.0, 5.0), (100.0, 0.5, 15.5), (50.0, 0.0, 10.0)):
        run = simulate(Environment, [at(0.0, x=x, z=1.0)], seconds=0.5, tide_level=tide, **options)
        assert run.of(imc.Distance)[0].value == pytest.approx(depth - 1.0, abs=1e-3)
    aground = simulate(Environment, [at(0.0, z=9.0)], seconds=0.5, **options)
    assert aground.of(imc.Distance)[0].value == 0.0


def test_an_altimeter_on_a_slope():
    section = {"Latitude (degrees)": "41.185", "Longitude (degrees)": "-8.7062", "Data": "-20 0 8, 20 0 12"}
    options = {"settings": {"Bathymetry": section}, "bottom_noise": 0.0, "sounding_radius": 200.0}
    run = simulate(Environment, [at(0.0, z=2.0, theta=0.3)], seconds=0.5, **options)
    slant = run.of(imc.Distance)[0].value
    bottom = run.task._bathymetry.depth(slant * math.sin(0.3), 0.0)
    assert slant * math.cos(0.3) + 2.0 == pytest.approx(bottom, abs=0.01)


def test_a_bottom_is_smooth_and_goes_through_its_soundings():
    random = np.random.default_rng(1)
    soundings = [(float(n), float(e), float(d)) for n, e, d in random.uniform([-50, -50, 5], [50, 50, 15], (200, 3))]
    bottom = Bathymetry(soundings, 15.0, 120.0)
    assert all(bottom.depth(n, e) == d for n, e, d in soundings)
    along = np.array([bottom.depth(0.0, 0.001 * k - 20.0) for k in range(40000)])
    assert 5.0 <= along.min() < along.max() <= 15.0
    assert np.abs(np.diff(along)).max() < 0.1
    assert bottom.depth(500.0, 0.0) == 120.0


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ({"Data": "1 2 3"}, "are needed"),
        ({"Data": "1 2 3", "Latitude (degrees)": "91", "Longitude (degrees)": "0"}, "is not a latitude"),
        ({"Data": "1 2", "Latitude (degrees)": "41", "Longitude (degrees)": "0"}, "'1 2' is not north, east and depth"),
        ({"Data": "1 2 inf", "Latitude (degrees)": "41", "Longitude (degrees)": "0"}, "is not north"),
    ],
)
def test_what_is_wrong_with_soundings(section, words):
    with pytest.raises(BathymetryError, match=words):
        read_bathymetry(lambda _, option: section.get(option, ""), 10.0, 120.0)
    with pytest.raises(ParameterError, match=words):
        simulate(Environment, settings={"Bathymetry": section})


def test_a_beam_beside_a_wall_and_one_that_starts_below_the_bottom():
    beam = SonarBeam((0.0, 0.0, 5.0), (1.0, 0.0, 0.0))
    assert beam.distance_to_wall((10.0, 1.0), (10.0, 5.0)) == math.inf
    assert beam.distance_to_wall((-10.0, -1.0), (-10.0, 5.0)) == math.inf
    assert beam.distance_to_wall((5.0, 0.0), (9.0, 0.0)) == math.inf
    assert beam.distance_to_bottom(lambda n, e: 4.0, 30.0) == 0.0
    assert beam.distance_to_surface() == math.inf
    down = SonarBeam((0.0, 0.0, 5.0), (0.8, 0.0, 0.6))
    for shallowest in (0.0, 5.0, 10.9, 11.0):
        assert down.distance_to_bottom(lambda n, e: 11.0, 30.0, shallowest) == pytest.approx(10.0, abs=0.01)
    assert down.distance_to_bottom(lambda n, e: 30.0, 30.0, 23.0) == math.inf


def test_environment_and_what_is_not_finite():
    run = simulate(Environment, [at(0.5), at(1.5, psi=math.inf), at(2.5)], seconds=4.0)
    for label in ("Environment", "Altimeter", "Echo Sounder"):
        assert states(run, label) == [State.BOOT, State.NORMAL, State.FAULT]
    assert len(run.of(imc.Distance)) == 24
    with pytest.raises(ParameterError, match="Pier Points: must be two positions"):
        simulate(Environment, simulate_pier=True)


def test_a_property_of_the_water_has_its_peak():
    peak = [41.185, -8.7062]
    near = simulate(Gaussian, [at(0.0)], seconds=1000.0, seed=5, peak_position=peak)
    values = np.array([m.value for m in near.of(imc.Temperature)])
    assert values.mean() == pytest.approx(20.0, abs=4 / math.sqrt(len(values)))
    assert values.std() == pytest.approx(1.0, rel=0.1)
    bell = simulate(Gaussian, [at(0.0, x=250.0)], seconds=5.0, standard_deviation=0.0, peak_position=peak)
    assert bell.of(imc.Temperature)[0].value == pytest.approx(14.0 + 6.0 * math.exp(-0.5), abs=1e-3)


def test_a_peak_that_is_moved_during_a_run_is_used():
    moved = imc.EntityParameter(name="Peak Position", value="42.0, -8.7062")
    order = imc.SetEntityParameters(timestamp=2.5, name="Gaussian", params=(moved,))
    options = {"standard_deviation": 0.0, "peak_position": [41.185, -8.7062], "section": "Simulators.Gaussian"}
    run = simulate(Gaussian, [at(0.0), order], seconds=5.0, **options)
    values = [m.value for m in run.of(imc.Temperature)]
    assert values[0] == pytest.approx(20.0, abs=1e-3)
    assert values[-1] == pytest.approx(14.0, abs=1e-3)


def test_speed_of_sound_on_the_surface():
    options = {"message_name": "SoundSpeed", "invalid_at_surface": True, "value_at_peak": 1522.0}
    run = simulate(Gaussian, [at(0.5), at(2.5, z=1.0)], seconds=4.5, value_away_from_peak=1500.0, **options)
    values = [m.value for m in run.of(imc.SoundSpeed)]
    assert [v == -1.0 for v in values] == [True, False, True, False, False, False]
    assert all(v == -1.0 or 1495.0 < v < 1530.0 for v in values)
    with pytest.raises(ParameterError, match="Peak Position"):
        simulate(Gaussian, peak_position=[95.0, 0.0])


def test_leaks_come_and_go():
    both = ["Leak Sensor - Tail", "Leak Sensor - Nose"]
    feed = [
        imc.LeakSimulation(timestamp=1.0, op=1, entities="Leak Sensor - Nose"),
        imc.LeakSimulation(timestamp=2.0, op=0, entities="Leak Sensor - Nose"),
        imc.LeakSimulation(timestamp=3.0, op=1, src=0x4001, dst=0x1A),
        imc.LeakSimulation(timestamp=4.0, op=0, src=0x4001),
        imc.LeakSimulation(timestamp=5.0, op=1, entities="Bilge"),
    ]
    run = simulate(Leaks, feed, seconds=6.0, leak_entities=both)
    nose, tail = (run.vehicle.entities.find(label) for label in reversed(both))
    times = [
        (round(m.timestamp - run.vehicle.start_time), m.state) for m in run.of(imc.EntityState) if m.src_ent == nose.id
    ]
    assert [pair for k, pair in enumerate(times) if not k or pair[1] != times[k - 1][1]] == [
        (0, 1),
        (1, 3),
        (2, 1),
        (3, 3),
    ]
    assert (tail.state, tail.description) == (State.ERROR, "leak detected")
    assert any("unknown leak sensor 'Bilge'" in text for text in run.log)
