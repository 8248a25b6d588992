"""The files for Neptus: what its readers look for is there, and a running vehicle answers for what they list."""

from xml.etree import ElementTree as Xml

import pytest

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.neptus import parameter_list, unplannable_maneuvers, vehicle_definition
from tests.command import shoal

KINDS = {"lauv-noptilus-1": "UUV", "otter": "USV", "caravel": "USV", "hexa-00": "UAV"}
# Elements without which Neptus' reader of a maneuver gives up, besides place and speed.
NEEDED = {
    "Loiter": ["duration", "trajectory/radius", "trajectory/type", "trajectory/direction"],
    "StationKeeping": ["duration", "trajectory/radius"],
    "YoYo": ["amplitude", "pitch"],
    "PopUp": ["flags", "duration"],
    "Rows": ["width", "length", "hstep", "bearing"],
    "Elevator": ["startZ", "startZUnits", "radius"],
    "RowsCoverage": ["width", "bearing"],
    "FollowPath": ["path"],
    "FollowReference": ["controlSource", "controlEntity", "timeout", "loiterRadius", "altitudeInterval"],
}


@pytest.fixture(params=KINDS)
def vehicle(request, tmp_path):
    profile = load_profile(request.param)
    clock = VirtualClock(profile.start_time_ns)
    made = build(
        profile, profile.parse_modes("Simulation"), clock=clock, log_root=tmp_path, state_folder=tmp_path
    ).vehicle
    yield made
    made.close()


def text(root, path):
    found = root.find(path)
    assert found is not None, path
    return found.text


def test_the_definition_has_what_neptus_reads(vehicle):
    root = Xml.fromstring(vehicle_definition(vehicle))
    assert root.tag == "system"
    assert text(root, "properties/id") == vehicle.name
    assert text(root, "properties/name") == vehicle.name
    assert text(root, "properties/type") == KINDS[vehicle.name]
    assert all(float(text(root, f"properties/appearance/{axis}-size")) > 0 for axis in "xyz")
    for picture in ("top-image-2D", "side-image-2D", "model-3D"):
        assert text(root, f"properties/appearance/{picture}").startswith("../vehicles-files/")
    assert text(root, "properties/coordinate-system-label") == "SNAME"
    assert 1.0 < float(text(root, "properties/limits/max-speed")) < 20.0
    number = text(root, "communication-means/comm-mean/protocols-args/imc/imc-id")
    assert int(number.replace(":", ""), 16) == vehicle.system
    assert int(text(root, "communication-means/comm-mean/protocols-args/imc/port")) == 6002


def test_the_maneuvers_are_those_that_the_vehicle_registers(vehicle):
    heard = []
    vehicle.observe(imc.RegisterManeuver, lambda m: heard.append(imc.builtin().by_id(m.mid).__name__))
    vehicle.start()
    vehicle.run(0.1)
    root = Xml.fromstring(vehicle_definition(vehicle))
    found = {}
    for maneuver in root.findall("feasibleManeuvers/maneuver/*"):
        implementation = "RowsManeuver" if maneuver.tag == "Rows" else maneuver.tag  # whose getType() is "Rows"
        assert text(maneuver, "annotation/implementation-class") == f"pt.lsts.neptus.mp.maneuvers.{implementation}"
        for needed in NEEDED.get(maneuver.tag, []):
            assert maneuver.find(needed) is not None, (maneuver.tag, needed)
        if maneuver.tag not in ("FollowReference", "Unconstrained"):
            place = maneuver.find("finalPoint") or maneuver.find("basePoint")
            assert (text(place, "point/coordinate/latitude"), text(place, "radiusTolerance")) == ("0N", "5")
            speed = next(s for s in (maneuver.find("speed"), maneuver.find("velocity")) if s is not None)
            assert (float(speed.text) > 0, speed.get("unit")) == (True, "m/s")
        found[maneuver.tag] = maneuver
    assert {"Goto", "Loiter", "StationKeeping", "FollowPath", "Rows"} <= set(found)
    if (elevator := found.get("Elevator")) is not None:
        assert text(elevator, "startZUnits") == ("HEIGHT" if KINDS[vehicle.name] == "UAV" else "DEPTH")
    renamed = {"Unconstrained": "Teleoperation"}
    described = {renamed.get(name, name) for name in found}
    assert described | set(unplannable_maneuvers(vehicle)) == set(heard) - {"IdleManeuver"}


def test_every_listed_parameter_is_answered_with_the_listed_value(vehicle):
    answers = {}
    vehicle.observe(imc.EntityParameters, lambda m: answers.update({m.name: {p.name: p.value for p in m.params}}))
    vehicle.start()
    root = Xml.fromstring(parameter_list(vehicle))
    assert (root.get("format"), root.get("system"), root.get("i18n")) == ("1", vehicle.name, "en_US")
    sections = root.findall("section")
    labels = [section.get("name") for section in sections]
    assert labels[0] == "Daemon"
    assert labels[1:] == sorted(labels[1:])
    for label in labels:
        query = imc.QueryEntityParameters(name=label, visibility="developer", scope="global")
        packet = imc.encode_with_header(query, 0.0, 0x4000, 0, vehicle.system, 255)
        vehicle.bus.deliver(imc.decode(packet), packet)
        vehicle.run(0.2)
    types = {"string", "boolean", "integer", "real", *(f"list:{t}" for t in ("string", "boolean", "integer", "real"))}
    for section in sections:
        listed = {param.get("name"): param.findtext("default") or "" for param in section.findall("param")}
        assert answers[section.get("name")] == listed
        for param in section.findall("param"):
            assert text(param, "type") in types
            # Neptus reads an empty default of a list as one item, or fails to read it as a number.
            assert (param.find("default") is None) == (
                text(param, "type").startswith("list:") and not listed[param.get("name")]
            )
            assert text(param, "visibility") in ("user", "developer")
            assert text(param, "scope") in ("global", "idle", "plan", "maneuver")
            assert text(param, "desc")
            if (least := param.find("min")) is not None and text(param, "type") in ("real", "integer"):
                assert float(least.text) <= float(text(param, "default"))


def test_limits_sizes_and_choices_are_listed(vehicle):
    root = Xml.fromstring(parameter_list(vehicle))
    params = {(s.get("name"), p.get("name")): p for s in root.findall("section") for p in s.findall("param")}
    assert text(params["Operational Limits", "Initial Setting - Area Size"], "size") == "2"
    center = params["Operational Limits", "Initial Setting - Area Center"]
    assert (text(center, "min-size"), text(center, "max-size"), text(center, "units")) == ("0", "2", "°")
    assert text(params["GPS", "Debug Level"], "values") == "None, Debug, Trace, Spew"
    assert params["GPS", "Entity Label"].get("editable") == "false"


def test_the_command_writes_where_neptus_looks(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = shoal("export", "neptus", "otter", "-V", "otter-7", "--out", "there")
    assert result.exit_code == 0, result.output
    names = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file())
    assert names == ["there/conf/params/otter-7.en_US.xml", "there/vehicles-defs/otter-7.nvcl"]
    labels = [s.get("name") for s in Xml.parse(tmp_path / names[0]).getroot().findall("section")]
    assert {"FTP", "LogBook", "Logger", "GPS"} <= set(labels)  # tasks that virtual time skips, too


def test_a_definition_of_neptus_own_is_kept(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    own = tmp_path / "neptus" / "vehicles-defs" / "21-lauv-noptilus-1.nvcl"
    own.parent.mkdir(parents=True)
    own.write_text("theirs")
    result = shoal("export", "neptus", "lauv-noptilus-1")
    assert f"kept {own.relative_to(tmp_path)}" in result.output
    assert [path.name for path in own.parent.iterdir()] == [own.name]
    assert own.read_text() == "theirs"


@pytest.mark.parametrize(
    "arguments", [["nothing"], ["otter", "-p", "Flying"], ["otter", "--set", "General:Vehicle=a/b"]]
)
def test_mistakes_are_named(tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    result = shoal("export", "neptus", *arguments)
    assert result.exit_code == 2
    assert list(tmp_path.iterdir()) == []


def test_what_operators_set_in_the_field_is_visible_to_users(vehicle):
    answers = []
    vehicle.observe(imc.EntityParameters, answers.append)
    vehicle.start()
    shown = {
        section.get("name"): [p.get("name") for p in section.findall("param") if text(p, "visibility") == "user"]
        for section in Xml.fromstring(parameter_list(vehicle)).findall("section")
    }
    assert sorted(shown["Fuel Monitor"]) == ["Error Level", "Warning Level"]
    query = imc.QueryEntityParameters(name="Fuel Monitor", visibility="user", scope="global")
    packet = imc.encode_with_header(query, 0.0, 0x4000, 0, vehicle.system, 255)
    vehicle.bus.deliver(imc.decode(packet), packet)
    vehicle.run(0.2)
    found = [[param.name for param in answer.params] for answer in answers if answer.dst == 0x4000]
    assert found == [["Error Level", "Warning Level"]]
    if vehicle.name != "hexa-00":
        assert shown["Path Control"] == ["Corridor -- Width"]
