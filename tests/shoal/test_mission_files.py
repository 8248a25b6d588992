"""Mission files of QGroundControl, KML, GPX and GeoJSON as plans, and plans as such files."""

import json
import math
from pathlib import Path

import pytest

import imc
from shoal import fly
from shoal.missions import PlanFileError, announced_context, load_plan, parse_plan, plan_file_text
from tests.command import shoal

DATA = Path(__file__).parents[1] / "data" / "missions"
KML = """<?xml version="1.0" encoding="UTF-8"?>
<kml:kml xmlns:kml="http://www.opengis.net/kml/2.2"><kml:Document><kml:Placemark><kml:name>way</kml:name>
<kml:LineString><kml:altitudeMode>absolute</kml:altitudeMode><kml:coordinates>
-8.7062,41.1853,-2
-8.7066,41.1853,5 </kml:coordinates></kml:LineString></kml:Placemark></kml:Document></kml:kml>
"""
GPX = """<gpx version="1.1" creator="x" xmlns="http://www.topografix.com/GPX/1/1">
<wpt lat="1" lon="1"/><rte><rtept lat="41.1853" lon="-8.7062"><ele>-2</ele></rtept>
<rtept lat="41.1853" lon="-8.7066"/></rte></gpx>
"""
HUGE = "1" + 400 * "0"  # beyond any float
WPL = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t41.185\t-8.7062\t0\t1\n"
PLAN = """plan: demo
origin: 41.185°, -8.7062°
speed: 1.2 m/s
depth: 2
maneuvers:
  - goto: {north: 40}
  - loiter: {north: 80, radius: 15, duration: 60s}
  - goto: {north: 80, east: 40, depth: 3}
"""


def places(plan):
    """Latitude, longitude (degrees) and z of each maneuver."""
    rounded = [(math.degrees(m.data.lat), math.degrees(m.data.lon), m.data.z) for m in plan.maneuvers]
    return [(round(lat, 5), round(lon, 5), round(z, 3)) for lat, lon, z in rounded]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("dive.plan", [(41.1853, -8.7062, 2.0)]),
        ("dive.waypoints", [(41.1853, -8.7062, 2.0), (41.1853, -8.7066, 2.0)]),
        ("survey.plan", [(41.1853, -8.7062, 2.0), (41.1853, -8.7066, 3.0), (41.1856, -8.7066, 1.0)]),
        ("route.geojson", [(41.1853, -8.7062, 0.0), (41.1853, -8.7066, 0.0)]),
    ],
)
def test_a_mission_file_is_a_plan(name, expected):
    plan = load_plan(DATA / name)
    assert plan.plan_id == Path(name).stem
    assert places(plan) == expected
    assert [m.maneuver_id[-1] for m in plan.maneuvers] == ["1", "2", "3"][: len(expected)]


def test_speed_and_what_is_not_used_of_a_qgc_plan():
    remarks = []
    plan = load_plan(DATA / "survey.plan", remark=remarks.append)
    assert [m.data.speed for m in plan.maneuvers] == [pytest.approx(1.2)] * 3
    assert (type(plan.maneuvers[2].data), plan.maneuvers[2].data.duration) == (imc.StationKeeping, 20)
    assert remarks == ["the fence in the file is not used"]


@pytest.mark.parametrize(("suffix", "text"), [(".kml", KML), (".gpx", GPX)])
def test_routes_of_maps_and_receivers(tmp_path, suffix, text):
    (tmp_path / f"way{suffix}").write_text(text)
    assert places(load_plan(tmp_path / f"way{suffix}")) == [(41.1853, -8.7062, 2.0), (41.1853, -8.7066, 0.0)]


@pytest.mark.parametrize("suffix", [".plan", ".waypoints", ".kml", ".gpx", ".geojson", ".yaml", ".json"])
def test_a_plan_is_written_and_read_back(tmp_path, suffix):
    plan = parse_plan(PLAN)
    path = tmp_path / f"demo{suffix}"
    text, remarks, missing = plan_file_text(plan, path)
    path.write_text(text)
    back = load_plan(path)
    assert places(back) == places(plan)
    if suffix in (".plan", ".waypoints"):
        assert [type(m.data) for m in back.maneuvers] == [imc.Goto, imc.Loiter, imc.Goto]
        assert back.maneuvers[1].data.duration == pytest.approx(60, abs=1)
    assert bool(remarks) == (suffix in (".kml", ".gpx", ".geojson"))
    assert missing == []


BILLION = '<!DOCTYPE kml [<!ENTITY a "aaaa">]><kml><Point><coordinates>&a;</coordinates></Point></kml>'


def qgc(item):
    """A .plan file with one item."""
    return f'{{"fileType": "Plan", "mission": {{"items": [{item}]}}}}'


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.waypoints", "QGC WPL 120\n", "a.waypoints:1: expected QGC WPL 110"),
        ("a.waypoints", WPL + "1\t0\t3\t16\n", "a.waypoints:3: 4 columns instead of 12"),
        ("a.waypoints", WPL + "1 0 3 16 0 0 0 0 north 1 0 1\n", "a.waypoints:3: 'north' is not a number"),
        ("a.waypoints", WPL + "1 0 3 16 0 0 0 0 400 1 0 1\n", "a.waypoints:3: latitude 400 is out of range"),
        ("a.waypoints", WPL + "1 0 3 16 0 0 0 0 100 1 0 1\n", r"item 1 \(NAV_WAYPOINT\): latitude \d+ is out of range"),
        ("a.waypoints", WPL + "1 0 3 177 1 1 0 0 0 0 0 1\n", r"item 1 \(command 177\)"),
        ("a.waypoints", WPL, "has no item that moves"),
        ("a.plan", "{", "a.plan: not JSON"),
        ("a.plan", "[" * 100_000, "a.plan: not JSON"),
        ("a.plan", '{"fileType": "Other"}', "is not a plan of QGroundControl"),
        ("a.plan", qgc('{"type": "ComplexItem", "complexItemType": "StructureScan"}'),
         r"item 0 \(StructureScan\) has no items of its own"),
        ("a.plan", qgc('{"command": 16, "frame": 3, "params": [NaN, 0, 0, 0, 0, 0, 0]}'), "item 0: nan is not a"),
        ("a.plan", qgc('{"command": 16, "frame": 3, "params": [' + HUGE + ", 0, 0, 0, 0, 0, 0]}"), "too large"),
        ("a.plan", qgc('{"command": 16, "frame": 3, "params": [1, 2]}'),
         "item 0: params are not seven numbers"),
        ("a.kml", BILLION, "a.kml:1: document types and entities are not accepted"),
        ("a.kml", "<kml><LineString><coordinates>1,2 x,3</coordinates></LineString></kml>", "a.kml:1: 'x' is not"),
        ("a.kml", "<kml><Point><coordinates>200,2</coordinates></Point></kml>", "200° is not a place on Earth"),
        ("a.kml", "<kml/>", "has no line and no points"),
        ("a.gpx", "<gpx><rte><rtept lat='1'/></rte></gpx>", "a.gpx:1: <rtept> has no 'lon'"),
        ("a.gpx", "<gpx><rte><rtept lat='1' lon='1'/></rte><rte><rtept lat='1' lon='1'/></rte></gpx>", "has 2 lines"),
        ("a.geojson", '{"type": "Polygon", "coordinates": [[[1, 1], [2, 2], [3, 1]]]}', "has an area, not a line"),
        ("a.geojson", '{"type": "LineString", "coordinates": [[1, "a"]]}', r"is not \[longitude, latitude\]"),
        ("a.geojson", '{"type": "Point", "coordinates": [' + HUGE + ", 1]}", "a.geojson: .* too large a number"),
        ("a.geojson", '{"type": "Point", "coordinates": [1, 1, ' + HUGE + "]}", "a.geojson: .* too large a number"),
        ("a.kml", f"<kml><Point><coordinates>1,{HUGE}</coordinates></Point></kml>", "is not a number"),
        ("a.waypoints", WPL + f"1 0 3 16 0 0 0 0 {HUGE} 1 0 1\n", "a.waypoints:3: .* is not a number"),
        ("a.yaml", "plan: a\nmaneuvers:\n- idle: {duration: " + HUGE + "}\n", "a.yaml:3: .* is not a value"),
        ("a.geojson", '{"type": "Circle"}', "'Circle' is not a type of GeoJSON"),
        ("a.kmz", "PK", "unzip it, the KML is inside"),
        ("a.shp", "", "known are .yaml, .yml, .json, .plan, .waypoints, .kml, .gpx, .geojson"),
    ],
)  # fmt: skip
def test_what_is_no_mission_is_rejected_with_its_place(tmp_path, name, text, reason):
    (tmp_path / name).write_text(text)
    with pytest.raises(PlanFileError, match=reason):
        load_plan(tmp_path / name)


def test_nested_geojson_ends(tmp_path):
    deep = '{"type": "GeometryCollection", "geometries": [' * 300 + "]}" * 300
    (tmp_path / "a.geojson").write_text(deep)
    with pytest.raises(PlanFileError):
        load_plan(tmp_path / "a.geojson")


def test_a_boat_stays_at_the_surface_and_an_aircraft_needs_its_home():
    boat = announced_context(imc.Announce(sys_type=imc.SystemType.USV))
    with pytest.raises(PlanFileError, match="is below the surface, and a boat stays there"):
        load_plan(DATA / "dive.waypoints", boat)
    assert len(load_plan(DATA / "route.geojson", boat).maneuvers) == 2
    with pytest.raises(PlanFileError, match="home is not known yet"):
        load_plan(DATA / "route.geojson", announced_context(imc.Announce(sys_type=imc.SystemType.UAV)))
    assert announced_context(imc.Announce(sys_type=99)) is None


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("profile", "name"),
    [("lauv-noptilus-1", "survey.plan"), ("lauv-noptilus-1", "dive.waypoints"), ("otter", "route.geojson")],
)
def test_shipped_vehicles_fly_mission_files(profile, name):
    report = fly(DATA / name, profile, limit=600)
    assert report.outcome == "SUCCESS"
    assert report.reason.startswith("plan completed")


@pytest.mark.heavy
def test_a_multirotor_flies_a_mission_above_its_home(tmp_path):
    takeoff = "1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t10\t1\n2\t0\t3\t16\t0\t0\t0\t0\t41.1853\t-8.7062\t10\t1\n"
    land = "3\t0\t3\t21\t0\t0\t0\t0\t0\t0\t0\t1\n"
    (tmp_path / "up.waypoints").write_text(WPL + takeoff + land)
    report = fly(tmp_path / "up.waypoints", "hexa-00", limit=600)
    assert (report.outcome, report.reason) == ("SUCCESS", "plan completed")


def test_the_commands_read_and_write_mission_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = shoal("export", "plan", str(DATA / "dive.waypoints"), "dive.kml")
    assert (done.exit_code, done.output) == (0, "wrote dive.kml\n")
    assert places(load_plan(tmp_path / "dive.kml")) == places(load_plan(DATA / "dive.waypoints"))
    again = shoal("export", "plan", "dive.kml", "dive.kml")
    assert again.exit_code != 0
    wrong = shoal("export", "plan", "dive.kml", "dive.txt")
    assert wrong.exit_code == 2
    assert "use one of .yaml, .yml, .json, .plan" in wrong.output


def test_the_qgc_plan_that_is_written_has_what_qgroundcontrol_needs():
    text, *_ = plan_file_text(parse_plan(PLAN), Path("demo.plan"))
    root = json.loads(text)
    assert {"fileType", "geoFence", "groundStation", "mission", "rallyPoints", "version"} == set(root)
    assert root["mission"]["vehicleType"] == 12
    assert all(len(item["params"]) == 7 for item in root["mission"]["items"])
    assert root["mission"]["plannedHomePosition"][:2] == pytest.approx([41.18536, -8.7062], abs=1e-4)
