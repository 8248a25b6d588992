"""Lines, points and areas of charts that the page draws on its map: GeoJSON files in the folder of the map tiles."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import msgspec

from support.file_errors import describe_os_error
from support.number_parsing import finite_number
from support.regular_files import read_regular_file
from support.terminal_text import printable

SUFFIX = ".geojson"
KINDS = ("contour", "sounding", "land", "obstruction", "area", "line", "mark")
MOST_BYTES = 8 << 20  # of a file
MOST_FILES = 16
MOST_PLACES = 100_000  # of a file
LONGEST_NAME = 80  # characters
DECIMALS = 6  # of degrees
NESTING = {"Point": 0, "MultiPoint": 1, "LineString": 1, "MultiLineString": 2, "Polygon": 2, "MultiPolygon": 3}
"""Levels of lists around the places of each type of geometry."""

Feature = dict[str, Any]


def read_overlays(folder: Path) -> tuple[dict[str, bytes], list[str]]:
    """The overlays of a folder by their names without suffix, and a sentence for each file that cannot be read.

    An overlay is JSON that is safe to draw. A large one takes a second of a core.
    """
    texts, troubles = dict[str, bytes](), list[str]()
    for path in sorted(folder.glob(f"*{SUFFIX}")):
        if len(texts) >= MOST_FILES:
            troubles.append(f"{path}: not shown: there are more than {MOST_FILES} overlays")
            break
        try:
            if path.stat().st_size > MOST_BYTES:
                raise ValueError(f"has more than {MOST_BYTES >> 20} MB: import it again for a smaller area")
            texts[path.stem] = overlay_text(list(read_features(read_regular_file(path))))
        except OSError as error:
            troubles.append(describe_os_error(error, path))
        except (ValueError, RecursionError) as error:
            troubles.append(f"{path}: {error}")
    return texts, troubles


def overlay_text(features: list[Feature]) -> bytes:
    """Features as the content of a file."""
    return msgspec.json.encode({"type": "FeatureCollection", "features": features})


def read_features(data: bytes, most: int = MOST_PLACES) -> Iterator[Feature]:
    """The features in a GeoJSON file, each with `kind`, and `name` and `depth` (m) if it has them.

    Without a kind, a line with a depth is a contour, a point with one a sounding. Raises ValueError for what is no
    GeoJSON in degrees, or has more than `most` places.
    """
    try:
        found = _read_json(data)
    except UnicodeDecodeError:
        raise ValueError("is not in UTF-8") from None
    except json.JSONDecodeError as error:
        raise ValueError(f"line {error.lineno}: {error.msg}") from None
    items = cast(dict[str, Any], found).get("features") if isinstance(found, dict) else None
    if not isinstance(items, list):
        raise ValueError("is no collection of features of GeoJSON")
    places = 0
    for number, item in enumerate(cast(list[Any], items), 1):
        feature = cast(dict[str, Any], item) if isinstance(item, dict) else {}
        geometry, properties = feature.get("geometry"), feature.get("properties")
        if geometry is None:
            continue
        if not isinstance(geometry, dict):
            raise ValueError(f"feature {number}: its geometry is no object")
        shape = cast(dict[str, Any], geometry)
        try:
            coordinates, count = _checked(shape.get("coordinates"), NESTING[str(shape.get("type"))])
        except KeyError:
            raise ValueError(f"feature {number}: geometries of type {shape.get('type')!r} are not drawn") from None
        except ValueError as error:
            raise ValueError(f"feature {number}: {error}") from None
        places += count
        if places > most:
            raise ValueError(f"has more than {most} places")
        known = cast(dict[str, Any], properties) if isinstance(properties, dict) else {}
        yield make_feature({"type": shape["type"], "coordinates": coordinates}, known)


def _read_json(data: bytes) -> Any:
    """The value of a file."""
    try:
        return msgspec.json.decode(data)
    except msgspec.DecodeError:
        return json.loads(data)  # which names the line, and reads NaN as others write it


def make_feature(geometry: Mapping[str, Any], properties: Mapping[str, Any]) -> Feature:
    """A feature with the properties that are drawn."""
    depth, name = properties.get("depth"), properties.get("name")
    found: dict[str, Any] = {}
    if (number := finite_number(depth)) is not None:
        found["depth"] = round(number, 2)
    if isinstance(name, str) and name.strip():
        found["name"] = printable(name.strip())[:LONGEST_NAME]
    kind = properties.get("kind")
    found["kind"] = kind if kind in KINDS else _usual_kind(str(geometry["type"]), has_depth="depth" in found)
    return {"type": "Feature", "geometry": dict(geometry), "properties": found}


def _usual_kind(geometry: str, *, has_depth: bool) -> str:
    if "Polygon" in geometry:
        return "area"
    if "Line" in geometry:
        return "contour" if has_depth else "line"
    return "sounding" if has_depth else "mark"


def _checked(value: object, levels: int) -> tuple[list[Any], int]:
    """Coordinates as longitude and latitude, and the number of places. Raises ValueError."""
    if not isinstance(value, list):
        raise ValueError("its coordinates are no list")
    items = cast(list[object], value)
    if levels == 0:
        numbers = [each for each in items[:2] if not isinstance(each, bool) and isinstance(each, int | float)]
        if len(numbers) < 2 or not (abs(numbers[0]) <= 360.0 and abs(numbers[1]) <= 90.0):
            raise ValueError(f"{items[:3]} is no place in degrees")
        return [round(number, DECIMALS) for number in numbers], 1
    checked = [_checked(item, levels - 1) for item in items]
    return [each for each, _ in checked], sum(count for _, count in checked)
