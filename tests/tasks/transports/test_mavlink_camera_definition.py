"""The camera definition file, read by the documented format, beside what PARAM_EXT and CAMERA_INFORMATION say."""

import re
import struct
from xml.etree import ElementTree

import pytest

from mavlink.vehicle.files.ftp_messages import FtpOpcode
from tests.tasks.transports.mavlink_dive import FISHEYE, INT32, MUG, REAL32, REQUEST_MESSAGE, TEXT, Dive, named

TYPES = {"int32": INT32, "float": REAL32, "custom": TEXT}  # of those that the format has
NAME = re.compile(r"[A-Z0-9_]{1,16}")


@pytest.fixture(scope="module")
def dive(tmp_path_factory):
    made = Dive(tmp_path_factory.mktemp("dive"))
    yield made
    made.vehicle.close()


def download(dive, path, component=1):
    """A file by MAVLink FTP from a component; for all of them, the autopilot answers."""

    def ask(opcode, data=b"", session=0, offset=0):
        size = len(data) if data else 239
        payload = struct.pack("<HBBBBBxI", 0, session, opcode, size, 0, 0, offset) + data
        found = dive.ask("FILE_TRANSFER_PROTOCOL", component, payload=payload.ljust(251, b"\0"), target_network=0)
        (answer,) = named(found, "FILE_TRANSFER_PROTOCOL")
        assert answer.component == (component or 1)
        raw = bytes(answer.values["payload"])
        assert raw[3] == 128, f"{path}: refused"
        return raw[2], raw[12 : 12 + raw[4]]

    session, size = ask(FtpOpcode.OPEN, path.encode())
    data = b""
    while len(data) < struct.unpack("<I", size)[0]:
        data += ask(FtpOpcode.READ, session=session, offset=len(data))[1]
    ask(FtpOpcode.TERMINATE, session=session)
    return data


@pytest.mark.heavy
@pytest.mark.parametrize("asked", [0, 1, FISHEYE, MUG])
def test_a_camera_also_gives_its_files_itself(dive, asked):
    """MAVSDK asks the camera, and leaves the component in the path."""
    named_so = download(dive, f"[;comp=1]/camera-{FISHEYE}.xml", asked)
    assert named_so == download(dive, f"/camera-{FISHEYE}.xml") != b""


def information(dive, camera):
    _, found = dive.order(REQUEST_MESSAGE, 259, component=camera)
    return named(found, "CAMERA_INFORMATION")[0].values


def text_of(letters):
    return bytes(letters).rstrip(b"\0").decode()


@pytest.mark.parametrize("camera", [FISHEYE, MUG])
def test_the_file_describes_the_settings_as_they_are(dive, camera):
    about = information(dive, camera)
    address = about["cam_definition_uri"].decode()
    assert address == f"mftp://[;comp=1]/camera-{camera}.xml"
    root = ElementTree.fromstring(download(dive, address.removeprefix("mftp://[;comp=1]")))
    assert root.tag == "mavlinkcamera"
    assert [child.tag for child in root] == ["definition", "parameters"]
    top = root.find("definition")
    assert int(top.get("version")) == about["cam_definition_version"] > 0
    assert top.findtext("model") == text_of(about["model_name"])
    assert top.findtext("vendor") == text_of(about["vendor_name"])

    listed = named(dive.ask("PARAM_EXT_REQUEST_LIST", camera, seconds=2.0), "PARAM_EXT_VALUE")
    settings = {m.values["param_id"].decode(): m for m in listed}
    described = {parameter.get("name"): parameter for parameter in root.iter("parameter")}
    assert described.keys() == settings.keys()
    for name, parameter in described.items():
        assert NAME.fullmatch(name)
        assert TYPES[parameter.get("type")] == settings[name].values["param_type"], name
        assert parameter.findtext("description")
        assert set(parameter.attrib) <= {"name", "type", "default", "min", "max"}
        check_values(parameter, settings[name])


VALUE = slice(20, 148)  # of PARAM_EXT_VALUE: bytes, of which a text would be cut at the first zero


def check_values(parameter, setting):
    """The default and the present value are among the options, or between the limits."""
    options = {option.get("value"): option.get("name") for option in parameter.iter("option")}
    raw = setting.payload[VALUE]
    present = raw.rstrip(b"\0")
    if parameter.get("type") == "custom":
        if options:
            assert {parameter.get("default"), present.decode()} <= options.keys()
        return
    layout = "<i" if parameter.get("type") == "int32" else "<f"
    (value,) = struct.unpack(layout, raw[:4])
    number = int if layout == "<i" else float
    low, high = number(parameter.get("min", -(1 << 31))), number(parameter.get("max", 1 << 31))
    for one in (value, number(parameter.get("default"))):
        assert low <= one <= high or abs(one - low) < 1e-6 * abs(one)
        assert not options or str(one) in options


def test_choices_and_booleans_are_options(dive):
    root = ElementTree.fromstring(download(dive, f"/camera-{FISHEYE}.xml"))
    found = {p.get("name"): [(o.get("name"), o.get("value")) for o in p.iter("option")] for p in root.iter("parameter")}
    assert found["SAVE_IMAGES"] == [("false", "0"), ("true", "1")]
    assert ("Seabed", "Seabed") in found["SCENE"]
    assert found["MUGS"] == [], "a list of texts"


def test_an_option_of_the_file_can_be_set(dive):
    root = ElementTree.fromstring(download(dive, f"/camera-{FISHEYE}.xml"))
    scene = next(p for p in root.iter("parameter") if p.get("name") == "SCENE")
    for option in scene.iter("option"):
        value = option.get("value").encode()
        (ack,) = named(
            dive.ask("PARAM_EXT_SET", param_id=b"SCENE", param_value=value, param_type=TEXT), "PARAM_EXT_ACK"
        )
        assert (ack.values["param_result"], ack.values["param_value"].rstrip(b"\0")) == (0, value)


def test_hidden_cameras_have_no_file(tmp_path):
    made = Dive(tmp_path, cameras=False)
    with pytest.raises(AssertionError, match="refused"):
        download(made, f"/camera-{FISHEYE}.xml")
    made.vehicle.close()
