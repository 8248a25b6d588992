"""The world: objects and their tracks, waves, sun, and what the section [World] of a profile says."""

import math
import subprocess
import sys

import pytest

from support.wgs84 import displace, offset
from world import Sun, Waypoint, World, WorldError, WorldObject, make_gliders, read_world
from world.sea import Bathymetry, SeaState

BASIN = {"Latitude (degrees)": "41.185", "Longitude (degrees)": "-8.7062", "Data": "0 0 5, 40 0 9"}


def world(**sections):
    """The world of sections, whose names are written with _ for a dot and __ for a slash."""
    named = {name.replace("__", "/").replace("_", "."): options for name, options in sections.items()}
    return read_world(lambda section, option: named.get(section, {}).get(option, ""), offset)


def test_a_glider_lies_where_it_is_put_and_takes_the_depth_of_the_bottom():
    basin = Bathymetry([(0.0, 0.0, 5.0), (40.0, 0.0, 9.0)], 60.0, 120.0)
    lying, floating = (World(seabed=basin, objects=make_gliders([(40.0, 0.0)], depth)) for depth in (None, 0.0))
    assert lying.object_position(lying.objects[0], 7.0) == (40.0, 0.0, 9.0, 0.0)
    assert floating.object_position(floating.objects[0], 7.0) == (40.0, 0.0, 0.0, 0.0)
    assert World(objects=make_gliders([(1.0, 2.0)])).object_position(lying.objects[0], 0.0).down is None
    assert [thing.id for thing in make_gliders([(1.0, 2.0), (3.0, 4.0)])] == [1, 2]


def test_an_object_moves_evenly_along_its_track_and_looks_ahead():
    track = Waypoint(10.0, 0.0, 0.0), Waypoint(20.0, 10.0, 0.0), Waypoint(40.0, 10.0, -10.0)
    thing = WorldObject(1, track)
    assert thing.pose_at(0.0) == (0.0, 0.0, 0.0)
    assert thing.pose_at(15.0) == (5.0, 0.0, 0.0)
    assert thing.pose_at(30.0) == pytest.approx((10.0, -5.0, -math.pi / 2))
    assert thing.pose_at(90.0) == pytest.approx((10.0, -10.0, -math.pi / 2))
    assert WorldObject(1, track, heading=1.0).pose_at(15.0) == (5.0, 0.0, 1.0)
    for bad in (track[::-1], (track[0], track[0]), ()):
        with pytest.raises(ValueError, match="times of a track"):
            WorldObject(1, bad)
    for size in ((0.1, 0.2), (1.0, 0.0), (math.inf, 1.0), (math.nan, 0.1)):
        with pytest.raises(ValueError, match="length and a diameter"):
            WorldObject(1, track, length=size[0], diameter=size[1])


def test_light_comes_down_steeper_under_water():
    low = Sun(math.pi / 2, math.radians(30.0))
    assert low.direction == pytest.approx((0.0, math.sqrt(0.75), -0.5))
    north, east, down = low.direction_under_water
    assert (north, east) == pytest.approx((0.0, math.sqrt(0.75) / 1.34)), "Snell's law"
    assert low.path_factor_under_water == pytest.approx(-1.0 / down) == pytest.approx(1.311, abs=1e-3)
    assert Sun().path_factor_under_water == 1.0
    assert Sun(0.0, -0.3).direction == pytest.approx((1.0, 0.0, 0.0)), "where it went down"
    for elevation in (-1.6, 1.6, math.nan):
        with pytest.raises(ValueError, match="has no elevation"):
            Sun(0.0, elevation)


def test_higher_waves_are_steeper():
    slight = SeaState()
    assert slight.wind_speed == pytest.approx(6.4, abs=0.05)
    assert slight.roughness == 1.0
    assert SeaState(0.0).rms_slope == pytest.approx(math.sqrt(0.003)), "that of a calm sea"
    assert SeaState(4.0).roughness > 1.3
    with pytest.raises(ValueError, match="height of waves"):
        SeaState(-1.0)


def test_without_a_section_there_is_one_glider_and_no_bottom():
    empty = world()
    assert not empty.waves_move_boats
    assert empty == World(objects=make_gliders([(1.0, 0.3)]))


def test_all_options_of_the_section():
    found = world(
        World={
            "Origin": "41.185, -8.7062",
            "Tide Level": "0.5",
            "Wave Height": "2",
            "Wave Direction": "90",
            "Marine Snow": "300",
            "Caustics": "0.5",
            "Water Visibility": "12",
            "Air Visibility": "5000",
            "Sun Azimuth": "90",
            "Sun Elevation": "45",
            "Gliders": "1 2, 3 4",
            "Gliders Lie On": "Depth",
            "Gliders Depth": "3",
            "Objects": "Tug, Drifter",
        },
        World__Tug={"Position": "5, 6", "Id": "9", "Heading": "90", "Length": "2", "Diameter": "0.5"},
        World__Drifter={"Track": "0 1 1, 60 20 5", "Lies On": "Surface"},
        Bathymetry=BASIN,
    )
    assert found.origin == (math.radians(41.185), math.radians(-8.7062))
    assert found.seabed_depth(40.0, 0.0) == 9.5
    assert (found.waves, found.sun) == (SeaState(2.0), Sun(math.pi / 2, math.pi / 4))
    assert (found.marine_snow, found.caustics) == (300.0, 0.5)
    assert (found.waves_move_boats, found.wave_bearing) == (True, math.pi / 2)
    assert (found.water_visibility, found.air_visibility) == (12.0, 5000.0)
    assert [(thing.id, thing.depth) for thing in found.objects] == [(1, 3.0), (2, 3.0), (9, None), (4, 0.0)]
    tug, drifter = found.objects[2:]
    assert (tug.length, tug.diameter, found.object_position(tug, 0.0)) == (
        2.0,
        0.5,
        (5.0, 6.0, found.seabed_depth(5.0, 6.0), 1.5707963267948966),
    )
    assert drifter.pose_at(30.0)[:2] == (10.5, 3.0)
    assert world(World={"Gliders": "none"}).objects == ()


def test_places_count_from_the_origin_and_soundings_are_where_they_were():
    lat, lon = math.radians(41.185), math.radians(-8.7062)
    north, east, _ = displace(lat, lon, 0.0, -300.0, 200.0, 0.0)
    there = {"Origin": f"{math.degrees(north)}, {math.degrees(east)}", "Sounding Radius": "60"}
    near, far = world(Bathymetry=BASIN, World={"Sounding Radius": "60"}), world(Bathymetry=BASIN, World=there)
    assert near.origin == (lat, lon)
    for n, e in ((0.0, 0.0), (20.0, 5.0), (40.0, 0.0)):
        assert far.seabed_depth(n + 300.0, e - 200.0) == pytest.approx(near.seabed_depth(n, e), abs=5e-3)
    assert far.seabed_depth(0.0, 0.0) == 120.0


def test_the_older_places_of_options_still_count():
    found = world(
        Simulators_Environment={"Enabled": "Always", "Sounding Radius": "60", "Out Of Bounds Depth": "30"},
        Simulators_MUGDetectionCamera={"MUGs": "2 3", "Target Plane": "Surface"},
    )
    assert found.seabed_depth(0.0, 0.0) == 30.0
    (glider,) = found.objects
    assert found.object_position(glider, 0.0) == (2.0, 3.0, 0.0, 0.0)
    assert world(Simulators_EstimatedState={"Bottom Depth": "13"}).seabed_depth(0.0, 0.0) == 13.0
    assert world(Simulators_EstimatedState={"Bottom Depth": "-1"}).seabed is None
    kinematic = {"Simulators_EstimatedState": {"Bottom Depth": "13"}}
    assert world(**kinematic, Bathymetry=BASIN).seabed_depth(0.0, 0.0) == 5.0
    assert world(**kinematic, World={"Out Of Bounds Depth": "30"}).seabed_depth(0.0, 0.0) == 30.0
    assert world(Vision_FisheyeCamera={"MUGs": "2 3"}).objects == make_gliders([(2.0, 3.0)])
    agreeing = {"World": {"Gliders": "2.0, 3.0"}, "Simulators_MUGDetectionCamera": {"MUGs": "2 3"}}
    assert world(**agreeing).objects == make_gliders([(2.0, 3.0)])


@pytest.mark.parametrize(
    ("sections", "words"),
    [
        ({"World": {"Origin": "91, 0"}}, r"\[World\] Origin = 91, 0 is not a latitude"),
        ({"World": {"Origin": "41"}}, r"\[World\] Origin = 41 is not 2 numbers"),
        ({"World": {"Wave Height": "high"}}, r"\[World\] Wave Height = high is not a number"),
        ({"World": {"Wave Height": "nan"}}, r"\[World\] Wave Height = nan is not a number"),
        ({"World": {"Water Visibility": "0"}}, r"\[World\] Water Visibility = 0 is not within 0.1"),
        ({"World": {"Sun Elevation": "90.5"}}, r"\[World\] Sun Elevation = 90.5 is not within"),
        ({"World": {"Gliders": "1"}}, r"\[World\] Gliders = 1 is wrong: '1': expected north and east"),
        ({"World": {"Gliders Lie On": "Moon"}}, r"\[World\] Gliders Lie On = Moon is not one of Seabed, Surface"),
        ({"World": {"Objects": "Tug"}}, r"\[World\] Objects has Tug, so \[World/Tug\] must have"),
        ({"World": {"Objects": "A"}, "World__A": {"Position": "1, 2", "Class": "Ship"}}, "Class = Ship is not one of"),
        ({"World": {"Objects": "A"}, "World__A": {"Position": "1, 2", "Length": "0.1"}}, "Diameter .* is not a length"),
        ({"World": {"Objects": "A"}, "World__A": {"Position": "1, 2", "Id": "1"}}, r"\[World/A\] Id = 1 is taken"),
        ({"World": {"Objects": "A"}, "World__A": {"Track": "0 1"}}, "Track = 0 1 is not time, north and east"),
        ({"World": {"Objects": "A"}, "World__A": {"Track": "0 1 1, 0 2 2"}}, "Track the times of a track must grow"),
        ({"World": {"Objects": "A"}, "World__A": {"Track": "0 1 1", "Position": "1, 2"}}, "either Position or Track"),
        ({"Bathymetry": {"Data": "1 2 3"}}, r"\[Bathymetry\] .* are needed"),
        (
            {"World": {"Tide Level": "1"}, "Simulators_Environment": {"Tide Level": "2"}},
            r"\[Simulators.Environment\] Tide Level = 2, but \[World\] Tide Level = 1: there is one world",
        ),
        (
            {"Simulators_MUGDetectionCamera": {"MUGs": "1 1"}, "Vision_FisheyeCamera": {"MUGs": "2 2"}},
            r"\[Vision.FisheyeCamera\] MUGs = 2 2, but .* set \[World\] Gliders alone",
        ),
    ],
)
def test_what_is_wrong_is_named(sections, words):
    with pytest.raises(WorldError, match=words):
        world(**sections)


def test_a_notebook_needs_nothing_but_the_world():
    code = (
        "import sys, world\n"
        "here = world.World(objects=world.make_gliders([(1.0, 0.3)]))\n"
        "assert here.object_position(here.objects[0], 0.0).north == 1.0\n"
        "print([name for name in ('runtime', 'tasks', 'shoal', 'imc', 'mavlink') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
