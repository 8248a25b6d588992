"""The definition of a vehicle for Neptus: `vehicles-defs/<vehicle>.nvcl`. Without it Neptus offers no plans for it."""

from collections.abc import Mapping
from typing import NamedTuple
from xml.etree import ElementTree as Xml

from runtime.profile import split_list
from runtime.vehicle import Vehicle
from tasks.maneuver import Maneuver

Tree = Mapping[str, "str | Tree"]

CLASSES = "pt.lsts.neptus.mp.maneuvers"
UDP_PORT, TCP_PORT = "6002", "7001"
FASTEST = 2.0  # m/s, Neptus' own default
SIZES = {"UUV": (2.0, 0.2, 0.2), "USV": (2.0, 1.0, 0.5), "UAV": (0.8, 0.8, 0.4)}  # m, if the profile has none
# Pictures that every Neptus has.
LOOKS = {"UUV": ("lauv/lauv-seacon0", "lauv/lauv-xtreme-2.x3d"), "UAV": ("cularis/cularis", "cularis/cularis.3ds")}


class ManeuverFormat(NamedTuple):
    """Description of a maneuver in Neptus: its type there, the elements of its place and speed, and the others.

    `implementation` is its class there, if that is not called like the type.
    """

    name: str
    place: str
    speed: str
    others: Tree
    implementation: str = ""


TOLERANCE: Tree = {"trajectoryTolerance": {"radiusTolerance": "1"}}
CIRCLE: Tree = {
    "radius": "15",
    "radiusTolerance": "5",
    "type": "Circular",
    "length": "50",
    "bearing": "0",
    "direction": "Clockwise",
}
AREA: Tree = {"width": "100", "length": "200", "bearing": "0"}
SHAPES = {
    "Goto": ManeuverFormat("Goto", "finalPoint", "velocity", TOLERANCE),
    "ScheduledGoto": ManeuverFormat("ScheduledGoto", "finalPoint", "velocity", TOLERANCE),
    "Launch": ManeuverFormat("Launch", "finalPoint", "velocity", TOLERANCE),
    "Loiter": ManeuverFormat("Loiter", "basePoint", "velocity", {"duration": "60", "trajectory": CIRCLE}),
    "StationKeeping": ManeuverFormat(
        "StationKeeping", "basePoint", "speed", {"duration": "60", "trajectory": {"radius": "15"}}
    ),
    "YoYo": ManeuverFormat("YoYo", "finalPoint", "speed", {"amplitude": "1", "pitch": "0.2618"}),
    "Elevator": ManeuverFormat("Elevator", "finalPoint", "speed", {"startZ": "0", "startZUnits": "", "radius": "15"}),
    "PopUp": ManeuverFormat("PopUp", "finalPoint", "speed", {"duration": "60", "flags": ""}),
    "FollowPath": ManeuverFormat("FollowPath", "basePoint", "speed", {"path": ""}),
    "Rows": ManeuverFormat("Rows", "basePoint", "speed", {**AREA, "hstep": "27"}, "RowsManeuver"),
    "RowsCoverage": ManeuverFormat(
        "RowsCoverage", "basePoint", "speed", {**AREA, "angleAperture": "120", "range": "30", "overlapPercentage": "0"}
    ),
    "Takeoff": ManeuverFormat("Takeoff", "basePoint", "speed", {"takeoffPitch": "10"}),
    "Land": ManeuverFormat(
        "Land", "basePoint", "speed", {"bearing": "0", "glideSlope": "10", "glideSlopeAltitude": "10"}
    ),
    "FollowReference": ManeuverFormat(
        "FollowReference",
        "",
        "",
        {
            "controlSource": "65535",
            "controlEntity": "255",
            "timeout": "60",
            "loiterRadius": "15",
            "altitudeInterval": "5",
        },
    ),
    "Teleoperation": ManeuverFormat("Unconstrained", "", "", {}),
}


def vehicle_definition(vehicle: Vehicle) -> bytes:
    """The XML with name, type, size, IMC id and maneuvers of a vehicle."""
    kind = _kind(vehicle)
    root = Xml.Element("system")
    properties = _add(root, "properties", {"id": vehicle.name, "name": vehicle.name, "type": kind, "model": "Shoal"})
    look = _add(properties, "appearance", dict(zip(("x-size", "y-size", "z-size"), _size(vehicle, kind), strict=True)))
    pictures, model = LOOKS.get(kind, LOOKS["UUV"])
    for view in ("top", "side", "back", "presentation"):
        Xml.SubElement(look, f"{view}-image-2D").text = f"../vehicles-files/{pictures}-{view}.png"
    Xml.SubElement(look, "model-3D").text = f"../vehicles-files/{model}"
    Xml.SubElement(properties, "coordinate-system-label").text = "SNAME"
    speeds = split_list(vehicle.profile.value("General", "Speed Conversion -- MPS"))
    fastest = _number(speeds[-1]) if speeds else FASTEST
    _add(properties, "limits", {"max-speed": f"{fastest:g}"})
    maneuvers = Xml.SubElement(root, "feasibleManeuvers")
    for shape in [SHAPES[name] for name in _maneuvers(vehicle) if name in SHAPES]:
        _add_maneuver(maneuvers, shape, kind, f"{0.6 * fastest:.2g}")
    _add_link(root, vehicle)
    Xml.SubElement(root, "consoles")
    Xml.indent(root)
    return Xml.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def unplannable_maneuvers(vehicle: Vehicle) -> list[str]:
    """The maneuvers of a vehicle that Neptus cannot plan."""
    return [name for name in _maneuvers(vehicle) if name not in (*SHAPES, "IdleManeuver")]


def _maneuvers(vehicle: Vehicle) -> list[str]:
    return sorted({type(task).message_type().__name__ for task in vehicle.tasks if isinstance(task, Maneuver)})


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return FASTEST


def _kind(vehicle: Vehicle) -> str:
    """The System Type that the vehicle's tasks announce, in capitals."""
    for task in vehicle.tasks:
        if (parameter := task.parameter_set.find("System Type")) is not None:
            return task.parameter_set.text(parameter).upper()
    return "UUV"


def _size(vehicle: Vehicle, kind: str) -> list[str]:
    """Length, width and height (m): of the simulated model, if it has them."""
    model = f"VSIM/Model/{vehicle.profile.value('General', 'Vehicle Type')}"
    sides = split_list(vehicle.profile.value(model, "Volume"))
    return sides if len(sides) == 3 else [f"{side:g}" for side in SIZES.get(kind, SIZES["USV"])]


def _add_maneuver(parent: Xml.Element, shape: ManeuverFormat, kind: str, speed: str) -> None:
    mode = "automatic" if shape != SHAPES["Teleoperation"] else "manual"
    maneuver = Xml.SubElement(Xml.SubElement(parent, "maneuver"), shape.name, kind=mode)
    if shape.place:
        depth: Tree = {"height": "50"} if kind == "UAV" else {"depth": "0" if kind == "USV" else "2"}
        where: Tree = {"id": shape.name, "coordinate": {"latitude": "0N", "longitude": "0E", **depth}}
        _add(maneuver, shape.place, {"point": where, "radiusTolerance": "5"}).set("type", "pointType")
    if shape.speed:
        Xml.SubElement(maneuver, shape.speed, type="float", unit="m/s", tolerance="5").text = speed
    _grow(maneuver, shape.others)
    if (flags := maneuver.find("flags")) is not None:
        flags.attrib.update(CurrPos="false", WaitAtSurface="true")
    if (units := maneuver.find("startZUnits")) is not None:  # Neptus' own default, NONE, has no depth
        units.text = "HEIGHT" if kind == "UAV" else "DEPTH"
    implementation = f"{CLASSES}.{shape.implementation or shape.name}"
    _add(maneuver, "annotation", {"documentation": "", "implementation-class": implementation})


def _add_link(root: Xml.Element, vehicle: Vehicle) -> None:
    address = vehicle.profile.value("General", "Network Address", "127.0.0.1")
    host = "127.0.0.1" if address == "0.0.0.0" else address  # Neptus learns the address from the Announce
    number = f"{vehicle.system >> 8:02x}:{vehicle.system & 0xFF:02x}"
    imc: Tree = {
        "port": vehicle.profile.value("Transports.UDP", "Local Port", UDP_PORT),
        "port-tcp": vehicle.profile.value("Transports.TCP.Server", "Port", TCP_PORT),
        "udp-on": "true",
        "tcp-on": "false",
        "imc-id": number,
        "imc3-id": number,  # its name in older versions
    }
    mean = _add(
        Xml.SubElement(root, "communication-means"),
        "comm-mean",
        {"name": "ethernet", "type": "ethernet", "host-address": host},
    )
    Xml.SubElement(mean, "credentials", username="")
    Xml.SubElement(mean, "protocols").text = "imc"
    Xml.SubElement(mean, "latency", value="100M", unit="bps")
    _add(mean, "protocols-args", {"imc": imc})


def _add(parent: Xml.Element, name: str, content: Tree) -> Xml.Element:
    return _grow(Xml.SubElement(parent, name), content)


def _grow(element: Xml.Element, content: Tree) -> Xml.Element:
    for name, value in content.items():
        if isinstance(value, str):
            Xml.SubElement(element, name).text = value
        else:
            _add(element, name, value)
    return element
