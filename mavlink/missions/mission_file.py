"""Mission files of ground stations: .plan of QGroundControl, and .waypoints, which all of them read."""

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, cast

from mavlink.missions.enums import MissionCommand
from mavlink.missions.item import DEGREES, WITHOUT_POSITION, Item
from mavlink.modes import Flavor, VehicleKind
from support.diagnostics import LocatedError
from support.foreign_json import load_json_of_file
from support.number_parsing import number_at

HEADER = "QGC WPL"
VERSION = 110
COLUMNS = 12
MOST_LINES = 4096
LARGEST = 2.0**31
KEY, ITEMS = "TransectStyleComplexItem", "Items"


class MissionFileError(LocatedError):
    """A file that does not hold a mission; the text gives place and reason."""


class MissionFile(NamedTuple):
    """The items of a file without home.

    `home` is in degrees and m above mean sea level, `vehicle_type` a MAV_TYPE or 0, `speed` in m/s or 0; `remarks` list
    what the file has besides.
    """

    items: list[Item]
    home: tuple[float, float, float] | None = None
    vehicle_type: int = 0
    speed: float = 0.0
    remarks: tuple[str, ...] = ()


def read_waypoints(text: str, name: str) -> MissionFile:
    """The items of a .waypoints file, whose item 0 is home. Raises MissionFileError naming file and line."""
    lines = text.splitlines()
    if not lines or lines[0].split() != [*HEADER.split(), str(VERSION)]:
        raise MissionFileError(f"expected {HEADER} {VERSION!s}", f"{name}:1")
    if len(lines) > MOST_LINES:
        raise MissionFileError(f"{len(lines)} lines are more than {MOST_LINES}", name)
    rows = [_read_row(line, f"{name}:{number}") for number, line in enumerate(lines[1:], 2) if line.strip()]
    if not rows:
        raise MissionFileError("there are no items", name)
    home, place = rows[0]
    known = home.command == MissionCommand.NAV_WAYPOINT and (home.x, home.y) != (0, 0)
    return MissionFile([item for item, _ in rows[1:]], (*place, home.z) if known else None)


def write_waypoints(items: Sequence[Item]) -> str:
    """The text of a .waypoints file; item 0 is home."""
    lines = [f"{HEADER} {VERSION}"]
    for seq, item in enumerate(items):
        factor = 1.0 if item.command in WITHOUT_POSITION else DEGREES
        parameters = (0.0 if math.isnan(p) else p for p in (item.param1, item.param2, item.param3, item.param4))
        words = [seq, int(seq == 0), _legacy(item.frame), int(item.command), *(f"{value:.9g}" for value in parameters)]
        words += [f"{item.x / factor:.8f}", f"{item.y / factor:.8f}", f"{item.z:.9g}", item.autocontinue]
        lines.append("\t".join(map(str, words)))
    return "\n".join(lines) + "\n"


def read_qgc_plan(text: str, name: str) -> MissionFile:
    """The items of a .plan file, those of surveys included. Raises MissionFileError naming file and item."""
    root = load_json_of_file(text, name, MissionFileError)
    if not isinstance(root, dict) or cast(Any, root).get("fileType") != "Plan":
        raise MissionFileError("is not a plan of QGroundControl (fileType is not Plan)", name)
    mission = _part(cast(Any, root), "mission", name)
    entries = mission.get("items")
    if not isinstance(entries, list):
        raise MissionFileError("mission.items is not a list", name)
    kind = mission.get("vehicleType")
    vehicle_type = kind if isinstance(kind, int) else 0
    hovers = vehicle_type in (2, 3, 4, 13, 14, 15, 29)  # MAV_TYPE of multirotors and helicopters
    speed = mission.get("hoverSpeed" if hovers else "cruiseSpeed")
    items = [_read_simple(entry, f"{name}: item {place}") for place, entry in _flatten(cast(list[Any], entries), name)]
    home = mission.get("plannedHomePosition")
    return MissionFile(
        items,
        _read_home(home, name) if home is not None else None,
        vehicle_type,
        _number(speed, f"{name}: mission speed") if speed is not None else 0.0,
        tuple(_remarks(cast(Any, root))),
    )


def write_qgc_plan(items: Sequence[Item], kind: VehicleKind, flavor: Flavor, speed: float) -> str:
    """The text of a .plan file; item 0 is home."""
    home, *others = items
    entries = [
        {
            "type": "SimpleItem",
            "autoContinue": bool(item.autocontinue),
            "command": int(item.command),
            "doJumpId": number,
            "frame": _legacy(item.frame),
            "params": [
                *(None if math.isnan(p) else p for p in (item.param1, item.param2, item.param3, item.param4)),
                *(value / (1.0 if item.command in WITHOUT_POSITION else DEGREES) for value in (item.x, item.y)),
                item.z,
            ],
        }
        for number, item in enumerate(others, 1)
    ]
    mission = {
        "cruiseSpeed": speed,
        "hoverSpeed": speed,
        "firmwareType": flavor.autopilot,
        "globalPlanAltitudeMode": 1,
        "items": entries,
        "plannedHomePosition": [home.x / DEGREES, home.y / DEGREES, home.z],
        "vehicleType": kind.type,
        "version": 2,
    }
    fence: dict[str, Any] = {"circles": [], "polygons": [], "version": 2}
    rally: dict[str, Any] = {"points": [], "version": 2}
    plan: dict[str, Any] = {"fileType": "Plan", "geoFence": fence, "groundStation": "Shoal", "mission": mission}
    return json.dumps({**plan, "rallyPoints": rally, "version": 1}, indent=4) + "\n"


def _read_row(line: str, where: str) -> tuple[Item, tuple[float, float]]:
    words = line.split()
    if len(words) != COLUMNS:
        raise MissionFileError(f"{len(words)} columns instead of {COLUMNS}", where)
    values = [number_at(word, where, MissionFileError) for word in words]
    frame, command = (_whole(value, where) for value in values[2:4])
    item = _item(frame, command, values[4:8], values[8], values[9], values[10], where)
    return item._replace(autocontinue=int(values[11] != 0)), (values[8], values[9])


def _flatten(entries: Sequence[Any], name: str) -> Iterator[tuple[str, Any]]:
    """The simple items with their numbers, in order; those of a survey are in it."""
    for number, entry in enumerate(entries):
        if not isinstance(entry, dict):
            raise MissionFileError(f"item {number} is not an object", name)
        values = cast(dict[str, Any], entry)
        if values.get("type") != "ComplexItem":
            yield str(number), values
            continue
        inner: Any = values.get(KEY)
        simple: Any = cast(dict[str, Any], inner).get(ITEMS) if isinstance(inner, dict) else None
        if not isinstance(simple, list):
            what = values.get("complexItemType", "of unknown type")
            raise MissionFileError(
                f"item {number} ({what!s:.40}) has no items of its own: save it as waypoints, or upload it", name
            )
        for place, item in enumerate(cast(list[Any], simple)):
            if not isinstance(item, dict) or cast(dict[str, Any], item).get("type") == "ComplexItem":
                raise MissionFileError(f"item {number}.{place} is not a simple item", name)
            yield f"{number}.{place}", item


def _read_simple(values: dict[str, Any], where: str) -> Item:
    parameters: Any = values.get("params")
    if not isinstance(parameters, list) or len(cast(list[Any], parameters)) != 7:
        raise MissionFileError("params are not seven numbers", where)
    numbers = [math.nan if p is None else _number(p, where) for p in cast(list[Any], parameters)]
    frame, command = (_whole(_number(values.get(key), f"{where}: {key}"), where) for key in ("frame", "command"))
    x, y = (0.0 if math.isnan(value) else value for value in numbers[4:6])
    return _item(frame, command, numbers[:4], x, y, 0.0 if math.isnan(numbers[6]) else numbers[6], where)


def _item(frame: int, command: int, parameters: Sequence[float], x: float, y: float, z: float, where: str) -> Item:
    if not 0 <= frame <= 0xFF or not 0 <= command <= 0xFFFF:
        raise MissionFileError(f"frame {frame} or command {command} does not exist", where)
    for number, value in enumerate(parameters, 1):
        if math.isinf(value):
            raise MissionFileError(f"parameter {number} is infinite", where)
    factor = 1.0 if command in WITHOUT_POSITION else DEGREES
    for word, value in (("latitude", x), ("longitude", y)):
        if not abs(factor * value) < LARGEST:
            raise MissionFileError(f"{word} {value:g} is out of range", where)
    one, two, three, four = parameters
    return Item(frame, command, 0, 1, one, two, three, four, round(factor * x), round(factor * y), z)


def _read_home(value: object, name: str) -> tuple[float, float, float]:
    if not isinstance(value, list) or len(cast(list[Any], value)) != 3:
        raise MissionFileError("plannedHomePosition is not latitude, longitude and altitude", name)
    lat, lon, altitude = (0.0 if v is None else _number(v, f"{name}: home") for v in cast(list[Any], value))
    return lat, lon, altitude


def _remarks(root: dict[str, Any]) -> Iterator[str]:
    fence, rally = (root.get(key) for key in ("geoFence", "rallyPoints"))
    if isinstance(fence, dict) and any(cast(dict[str, Any], fence).get(key) for key in ("polygons", "circles")):
        yield "the fence in the file is not used"
    if isinstance(rally, dict) and cast(dict[str, Any], rally).get("points"):
        yield "the rally points in the file are not used"


def _part(root: dict[str, Any], key: str, name: str) -> dict[str, Any]:
    found = root.get(key)
    if not isinstance(found, dict):
        raise MissionFileError(f"has no {key}", name)
    return cast(dict[str, Any], found)


def _number(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise MissionFileError(f"{value!r:.40} is not a number", where)
    return float(value)


def _whole(value: float, where: str) -> int:
    if not value.is_integer():
        raise MissionFileError(f"{value:g} is not a whole number", where)
    return int(value)


def _legacy(frame: int) -> int:
    """The number of a frame in files: its first one."""
    return {5: 0, 6: 3, 11: 10}.get(frame, frame)
