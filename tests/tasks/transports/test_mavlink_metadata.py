"""What ground stations are told about the parameters of shipped vehicles."""

import json
import lzma
import math
import re

import pytest
from pymavlink.mavftp import MAVFTP

from mavlink.vehicle.files.ftp_messages import FtpOpcode, checksum
from mavlink.vehicle.files.ftp_server import FtpServer
from mavlink.vehicle.files.virtual_files import VirtualFiles
from mavlink.vehicle.parameters.metadata import ComponentMetadata, packed_parameters, parameter_metadata
from mavlink.vehicle.parameters.table import ParameterTable
from runtime import Task, param
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from tasks.transports.mavlink_links.ftp_folders import DiskFolders
from tasks.transports.mavlink_links.parameters_and_cameras import task_parameters
from tests.tasks.transports.mavlink_files import request, taken

# github.com/mavlink/mavlink, component_metadata/parameter.schema.json and general.schema.json
KINDS = {
    **dict.fromkeys(("name", "type", "shortDesc", "longDesc", "units", "group", "category"), str),
    **dict.fromkeys(("default", "min", "max", "increment"), (int, float)),
    **dict.fromkeys(("rebootRequired", "volatile", "readOnly"), bool),
    "decimalPlaces": int,
    "values": list,
}
GENERAL = {"version", "vendorName", "modelName", "firmwareVersion", "hardwareVersion", "metadataTypes"}


@pytest.fixture(scope="module", params=["lauv-noptilus-1", "otter", "hexa-00"])
def vehicle(request, tmp_path_factory):
    profile = load_profile(request.param)
    folder = tmp_path_factory.mktemp("log")
    return build(profile, profile.parse_modes("Simulation"), clock=VirtualClock(0), log_root=folder).vehicle


@pytest.fixture(scope="module")
def metadata(vehicle):
    return ComponentMetadata(vehicle.name, ParameterTable(task_parameters(vehicle.tasks)))


def download(files, uri):
    """The file and its checksum, as a station gets them."""
    server = FtpServer(VirtualFiles(files, DiskFolders({})))
    path = uri.removeprefix("mftp://").encode()
    value = taken(server.receive(1, request(FtpOpcode.CHECKSUM, path), 0.0) or next_answer(server))[-1]
    server.receive(1, request(FtpOpcode.OPEN, path), 0.0)
    server.receive(1, request(FtpOpcode.BURST), 0.0)
    data = b""
    while server.is_busy(1):
        data += taken(server.next_payload(1, 0.0))[-1]
    return data, int.from_bytes(value, "little")


def next_answer(server):
    while (payload := server.next_payload(1, 0.0)) is None:
        pass
    return payload


def test_a_station_gets_from_the_message_to_the_parameters(metadata, vehicle):
    general, value = download(metadata.files, metadata.uri)
    assert (value, checksum(general)) == (metadata.crc, metadata.crc)
    found = json.loads(general)
    assert (found.keys() <= GENERAL, found["version"], found["modelName"]) == (True, 1, vehicle.name)
    [described] = found["metadataTypes"]
    assert described.keys() == {"type", "uri", "fileCrc"}
    assert (described["type"], len(described["uri"]) < 100) == (1, True)
    compressed, value = download(metadata.files, described["uri"])
    assert (value, checksum(compressed)) == (described["fileCrc"], described["fileCrc"])
    assert lzma.decompress(compressed) == metadata.parameters == metadata.files["parameters.json"]()
    assert len(compressed) < 20_000


def test_every_parameter_fits_the_schema(metadata, vehicle):
    found = json.loads(metadata.parameters)
    table = ParameterTable(task_parameters(vehicle.tasks))
    assert (found.keys(), found["version"]) == ({"version", "parameters"}, 1)
    assert [item["name"] for item in found["parameters"]] == [entry.id for entry in table]
    for item in found["parameters"]:
        assert all(isinstance(value, KINDS[name]) for name, value in item.items()), item
        assert re.fullmatch(r"[.\-a-zA-Z0-9_{}]{1,16}", item["name"])
        assert item["type"] in ("Int32", "Float")
        assert item.get("min", item["default"]) <= item["default"] <= item.get("max", item["default"]), item
        assert item.get("decimalPlaces", 0) >= 0
        for choice in item.get("values", ()):
            assert (choice.keys(), type(choice["description"])) == ({"value", "description"}, str)


def test_every_parameter_has_its_names_of_the_profile(metadata, vehicle):
    named = {item["name"]: item for item in json.loads(metadata.parameters)["parameters"]}
    for entry in ParameterTable(task_parameters(vehicle.tasks)):
        item, name = named[entry.id], entry.declaration.name
        assert (item["group"], item["shortDesc"]) == (entry.view.label, f"{entry.view.label}: {name}")
        assert item["longDesc"].endswith(f" In the profile: [{entry.view.section}] {name}")
        assert item["longDesc"].startswith(entry.declaration.description)


class Sonar(Task):
    """Has a parameter of each kind."""

    gain: float = param(0.00025, "1", "Gain.", minimum=0, maximum=10, visibility="user")
    pings: int = param(-7, "Hz", "Pings.", minimum=-(2**40), maximum=2**40)
    window: str = param("hann", "", "Window.", choices=("none", "hann", "hamming"))
    beams: bool = param(True, "", "On.")
    depth: float = param(0.0, "m", "Depth.", minimum=0, maximum=math.inf)
    count: int = param(1, "1", "Count.", minimum=-math.inf, maximum=5)
    resolution: int = param(4, "m", "Resolution.", choices=(4, 2, 8))


def test_descriptions():
    table = ParameterTable(task_parameters(simulate(Sonar, seconds=0.0, section="Sonars.Sonar/Front").vehicle.tasks))
    found = {
        entry.declaration.name: parameter_metadata(entry)
        for entry in table
        if entry.view.section == "Sonars.Sonar/Front"
    }
    label = found["Gain"]["group"]
    assert found["Gain"] == {
        "name": table.find_entity_parameter(label, "Gain").id,
        "type": "Float",
        "shortDesc": f"{label}: Gain",
        "longDesc": "Gain. In the profile: [Sonars.Sonar/Front] Gain",
        "group": label,
        "category": "Standard",
        "min": 0,
        "max": 10,
        "default": 0.00025,
        "decimalPlaces": 6,
    }
    assert ("max" in found["Depth"], found["Depth"]["decimalPlaces"], "min" in found["Count"]) == (False, 3, False)
    pings = found["Pings"]
    assert [pings[name] for name in ("type", "units", "min", "max", "default")] == [
        "Int32",
        "Hz",
        -(2**31),
        2**31 - 1,
        -7,
    ]
    assert (pings["category"], "decimalPlaces" in pings) == ("Developer", False)
    choices = {
        name: [tuple(item.values()) for item in found[name]["values"]] for name in ("Window", "Beams", "Resolution")
    }
    assert choices == {
        "Window": [(0, "none"), (1, "hann"), (2, "hamming")],
        "Beams": [(0, "false"), (1, "true")],
        "Resolution": [(2, "2"), (4, "4"), (8, "8")],
    }
    limits = {name: tuple(found[name][key] for key in ("min", "default", "max")) for name in choices}
    assert limits == {"Window": (0, 1, 2), "Beams": (0, 1, 1), "Resolution": (2, 4, 8)}


@pytest.mark.parametrize("query", ["", "?withdefaults=1"])
def test_packed_parameters_as_pymavlink_reads_them(metadata, vehicle, query):
    table = ParameterTable(task_parameters(vehicle.tasks))
    found = MAVFTP.ftp_param_decode(metadata.files[f"@PARAM/param.pck{query}"]())
    kinds = {6: 3, 9: 4}  # MAV_PARAM_TYPE to AP_PARAM
    expected = [(entry.id.encode(), pytest.approx(entry.value), kinds[entry.type]) for entry in table]
    assert found.params == expected
    defaults = [(e.id.encode(), pytest.approx(e.to_number(e.declaration.default)), kinds[e.type]) for e in table]
    assert found.defaults == (defaults if query else None)


def test_packed_parameters_are_those_of_now():
    vehicle = simulate(Sonar, seconds=0.0).vehicle
    table = ParameterTable(task_parameters(vehicle.tasks))
    before = packed_parameters(table, with_defaults=False)
    vehicle.task_by_label("Sonar").gain = 2.0
    assert len(packed_parameters(table, with_defaults=False)) == len(before)
    assert packed_parameters(table, with_defaults=False) != before
