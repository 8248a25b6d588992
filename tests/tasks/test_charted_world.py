"""A shipped vehicle over a chart: altimeter, DVL, ground and reports follow the depths of a file."""

import math
from bisect import bisect_right

import numpy as np
import pytest
from lean import UNLOGGED

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from support.diagnostics import ProfileError
from support.wgs84 import displace
from tasks.simulated_world import world_of
from tests.world.charts.sea_floor import (
    LATITUDE,
    ORIGIN,
    STEP,
    floor,
    floor_of_grid,
    write_geotiff,
    write_netcdf,
)


@pytest.fixture
def profile(tmp_path):
    """The shipped AUV in a profile of its own, beside which a chart has depths of some 9 m."""
    write_geotiff(tmp_path / "chart.tif", (31.0 - floor_of_grid()).astype("f4"))
    path = tmp_path / "mine.ini"
    path.write_text(
        "[Require lauv-noptilus-1.ini]\n[Bathymetry]\nData = chart.tif\nChart Radius = 300\n"
        "Chart Positive = up\n[World]\nTide Level = 0.5\n"
    )
    return path


def sailed(path, seconds, *overrides, modes="Simulation"):
    """The vehicle, what it measured and where it was, and its log book."""
    profile = load_profile(path, overrides=(UNLOGGED, *overrides))
    vehicle = build(profile, profile.parse_modes(modes), clock=VirtualClock(profile.start_time_ns)).vehicle
    heard = {kind: [] for kind in (imc.Distance, imc.SimulatedState, imc.LogBookEntry)}
    for kind, messages in heard.items():
        vehicle.observe(kind, messages.append)
    vehicle.start()
    vehicle.run(seconds)
    vehicle.close()
    return vehicle, *heard.values()


def water(state):
    """Depth (m) of the water of the chart, with the tide, where a vehicle is."""
    lat, lon, _ = displace(state.lat, state.lon, 0.0, state.x, state.y)
    return floor(math.degrees(lon), math.degrees(lat)) - 31.0 + 0.5


@pytest.mark.heavy
def test_the_sonars_of_a_shipped_vehicle_measure_the_depths_of_a_chart(profile):
    vehicle, distances, states, book = sailed(profile, 20.0, "Simulators.DVL:Beams=4")
    times = [state.timestamp for state in states]
    slant = math.cos(math.radians(30.0))
    for label, share, tolerance in (("Altimeter", 1.0, 0.4), ("DVL Beam", slant, 1.0)):
        errors = [
            share * distance.value + state.z - water(state)
            for distance in distances
            if vehicle.entities.label(distance.src, distance.src_ent).startswith(label)
            and distance.validity == imc.Distance.Validity.VALID
            and abs((state := states[bisect_right(times, distance.timestamp) - 1]).theta) < 0.03
        ]
        assert len(errors) > 20, label
        assert abs(np.mean(errors)) < 0.15, label
        assert np.max(np.abs(errors)) < tolerance, label
    texts = [entry.text for entry in book]
    assert any(text.startswith("the bottom is that of chart.tif: ") for text in texts)
    assert not any("Out Of Bounds Depth" in text for text in texts)


def test_the_light_vehicle_swims_above_the_chart(profile):
    vehicle, _, states, book = sailed(profile, 5.0, modes="Kinematic")
    seabed = world_of(vehicle.task("Simulators.EstimatedState")).seabed
    assert seabed.depth(states[-1].x, states[-1].y) == pytest.approx(water(states[-1]), abs=0.05)
    assert any(entry.text.startswith("the bottom is that of chart.tif: ") for entry in book)


@pytest.mark.parametrize("modes", ["Simulation", "Kinematic"])
def test_a_vehicle_beyond_the_depths_of_its_chart_says_so(profile, modes):
    depths = floor_of_grid() - 31.0
    depths[:, 60:] = np.nan
    write_geotiff(profile.with_name("chart.tif"), -depths.astype("f4"))
    east = math.degrees(displace(*ORIGIN, 0.0, 0.0, 200.0)[1])
    start = [f"Simulators.GPS:Initial Position={LATITUDE}, {east}"]
    if modes == "Kinematic":
        start = [f"Simulators.EstimatedState:Start Longitude={east}"]
    _, _, _, book = sailed(profile, 3.0, *start, modes=modes)
    warnings = [entry.text for entry in book if entry.type == imc.LogBookEntry.Type.WARNING]
    assert "chart.tif has no depth here: the bottom is at Out Of Bounds Depth, 120.5 m" in warnings
    assert any("chart.tif has no depths for" in text for text in warnings)


def test_a_chart_is_searched_beside_the_ini_file_that_names_it(tmp_path, profile, monkeypatch):
    (tmp_path / "vehicles").mkdir()
    mine = tmp_path / "vehicles" / "other.ini"
    mine.write_text("[Require ../mine.ini]\n")
    monkeypatch.chdir("/")
    for path in (profile, mine):
        read = load_profile(path)
        assert read.find_file("Bathymetry", "Data").samefile(tmp_path / "chart.tif")
    elsewhere = tmp_path / "charts"
    elsewhere.mkdir()
    write_netcdf(elsewhere / "sea.nc", -floor_of_grid())
    found = load_profile(mine, [elsewhere], overrides=["Bathymetry:Data=sea.nc"]).find_file("Bathymetry", "Data")
    assert found == elsewhere / "sea.nc"


def test_a_chart_that_cannot_be_read_is_an_error_at_its_line_and_no_flat_bottom(profile):
    profile.with_name("chart.tif").unlink()
    loaded = load_profile(profile)
    with pytest.raises(ProfileError, match=r"mine\.ini:3: error: \[Bathymetry\] Data = chart\.tif is not there"):
        build(loaded, loaded.parse_modes("Simulation"), clock=VirtualClock(loaded.start_time_ns))
    profile.write_text(profile.read_text() + "[Bathymetry]\nChart Coordinates = banana\n")
    loaded = load_profile(profile)
    with pytest.raises(
        ProfileError, match=r"mine\.ini:9: error: \[Bathymetry\] Chart Coordinates = banana is no known"
    ):
        build(loaded, loaded.parse_modes("Simulation"), clock=VirtualClock(loaded.start_time_ns))


def test_the_sounding_radius_of_a_grid_is_that_of_its_cells_whatever_the_profile_says(profile):
    vehicle, *_ = sailed(profile, 0.1, "World:Sounding Radius=1")
    seabed = world_of(vehicle.task("Simulators.VSIM")).seabed
    assert seabed.sampling_step == pytest.approx(2 * STEP * 111e3 / 4, rel=0.02)
