"""Routes in files of maps and receivers: KML, GPX and GeoJSON."""

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, cast

from autonomy.plans.yaml import PlanFileError
from support.foreign_json import load_json_of_file
from support.located_xml import Element, parse_xml_tree
from support.number_parsing import number_at
from support.wgs84 import is_on_earth

MOST = 4096  # points
NEAR_GROUND = "relativeToGround"


class RoutePoint(NamedTuple):
    """Latitude and longitude (degrees); altitude (m) or None, above the ground if `above_ground`, else the sea."""

    lat: float
    lon: float
    altitude: float | None = None
    above_ground: bool = False


Route = list[RoutePoint]


def read_kml(text: str, name: str) -> Route:
    """The one line of a KML file, or else its points in order. Raises PlanFileError."""
    root = _xml(text, name, ("coordinates", "altitudeMode"))
    lines, points, areas = list[Route](), Route(), 0
    for element in _descendants(root):
        tag = _local(element)
        if tag in ("LineString", "Point", "LinearRing"):
            mode = next((c.text.strip() for c in element.children if _local(c) == "altitudeMode"), "")
            found = [p for c in element.children if _local(c) == "coordinates" for p in _kml_points(c, mode)]
            if tag == "LineString":
                lines.append(found)
            elif tag == "Point":
                points += found
            else:
                areas += 1
    return _only_route(lines, points, areas, name)


def read_gpx(text: str, name: str) -> Route:
    """The one route of a GPX file, else its one track, else its waypoints. Raises PlanFileError."""
    root = _xml(text, name, ("ele",))
    routes, tracks = (
        [[_gpx_point(p) for p in _descendants(e) if _local(p) == inner] for e in root.children if _local(e) == outer]
        for outer, inner in (("rte", "rtept"), ("trk", "trkpt"))
    )
    points = [_gpx_point(e) for e in root.children if _local(e) == "wpt"]
    return _only_route(routes or tracks, points, 0, name)


def read_geojson(text: str, name: str) -> Route:
    """The one LineString of a GeoJSON file (RFC 7946), or else its points in order. Raises PlanFileError."""
    root = load_json_of_file(text, name, PlanFileError)
    lines, points, areas = list[Route](), Route(), 0
    for kind, coordinates, where in _geometries(root, name):
        if kind == "LineString":
            lines.append(_positions(coordinates, where))
        elif kind == "MultiPoint":
            points += _positions(coordinates, where)
        elif kind == "Point":
            points += _positions([coordinates], where)
        elif kind == "MultiLineString":
            lines += [_positions(line, where) for line in _list(coordinates, where)]
        else:
            areas += 1
    return _only_route(lines, points, areas, name)


def write_kml(route: Sequence[RoutePoint], name: str) -> str:
    """A KML file with one line; depths are negative altitudes."""
    from xml.sax.saxutils import escape  # slow to import, and rarely needed

    mode = NEAR_GROUND if any(point.above_ground for point in route) else "absolute"
    words = " ".join(f"{p.lon:.8f},{p.lat:.8f},{p.altitude or 0.0:g}" for p in route)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="http://www.opengis.net/kml/2.2"><Document>\n'
        f"<Placemark><name>{escape(name)}</name><LineString><altitudeMode>{mode}</altitudeMode>\n"
        f"<coordinates>{words}</coordinates></LineString></Placemark>\n</Document></kml>\n"
    )


def write_gpx(route: Sequence[RoutePoint], name: str) -> str:
    """A GPX file with one route; depths are negative elevations."""
    from xml.sax.saxutils import escape  # slow to import, and rarely needed

    points = "".join(
        f'<rtept lat="{p.lat:.8f}" lon="{p.lon:.8f}">'
        + (f"<ele>{p.altitude:g}</ele>" if p.altitude is not None else "")
        + "</rtept>\n"
        for p in route
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<gpx version="1.1" creator="Shoal" xmlns="http://www.topografix.com/GPX/1/1">\n'
        f"<rte><name>{escape(name)}</name>\n{points}</rte>\n</gpx>\n"
    )


def write_geojson(route: Sequence[RoutePoint], name: str) -> str:
    """A GeoJSON file with one LineString; depths are negative altitudes."""
    line = [[p.lon, p.lat, *([p.altitude] if p.altitude is not None else [])] for p in route]
    kind, line = ("LineString", line) if len(line) > 1 else ("Point", line[0] if line else [])
    feature = {
        "type": "Feature",
        "properties": {"name": name},
        "geometry": {"type": kind, "coordinates": line},
    }
    return json.dumps({"type": "FeatureCollection", "features": [feature]}, indent=2) + "\n"


ROUTE_READERS: Mapping[str, Callable[[str, str], Route]] = {
    ".kml": read_kml,
    ".gpx": read_gpx,
    ".geojson": read_geojson,
}
ROUTE_WRITERS: Mapping[str, Callable[[Sequence[RoutePoint], str], str]] = {
    ".kml": write_kml,
    ".gpx": write_gpx,
    ".geojson": write_geojson,
}


def _only_route(lines: list[Route], points: Route, areas: int, name: str) -> Route:
    if len(lines) > 1:
        raise PlanFileError(f"has {len(lines)} lines, and a plan follows one", name)
    route = lines[0] if lines else points
    if not route and areas:
        raise PlanFileError("has an area, not a line or points; a plan covers an area with Rows", name)
    if not route:
        raise PlanFileError("has no line and no points", name)
    if len(route) > MOST:
        raise PlanFileError(f"{len(route)} points are more than the {MOST} that a plan may have", name)
    return route


def _point(lat: float, lon: float, altitude: float | None, where: str, *, above_ground: bool = False) -> RoutePoint:
    if not is_on_earth(math.radians(lat), math.radians(lon)):
        raise PlanFileError(f"latitude {lat:g}°, longitude {lon:g}° is not a place on Earth", where)
    if altitude is not None and not math.isfinite(altitude):
        raise PlanFileError(f"altitude {altitude} is not a number", where)
    return RoutePoint(lat, lon, altitude, above_ground)


def _kml_points(element: Element, mode: str) -> Iterator[RoutePoint]:
    for words in element.text.split():
        numbers = [number_at(word, element.where, PlanFileError) for word in words.split(",")]
        if len(numbers) not in (2, 3):
            raise PlanFileError(f"{words!r:.40} is not longitude,latitude[,altitude]", element.where)
        altitude = numbers[2] if len(numbers) == 3 and mode in (NEAR_GROUND, "absolute") else None
        yield _point(numbers[1], numbers[0], altitude, element.where, above_ground=mode == NEAR_GROUND)


def _gpx_point(element: Element) -> RoutePoint:
    lat, lon = (number_at(element.require(key), element.where, PlanFileError) for key in ("lat", "lon"))
    heights = [
        number_at(child.text, child.where, PlanFileError) for child in element.children if _local(child) == "ele"
    ]
    return _point(lat, lon, heights[0] if heights else None, element.where)


def _geometries(value: object, where: str) -> Iterator[tuple[str, object, str]]:
    """Kind, coordinates and place of each geometry."""
    if not isinstance(value, dict):
        raise PlanFileError("is not GeoJSON", where)
    part = cast(dict[str, Any], value)
    kind: Any = part.get("type")
    for group, inner in (("FeatureCollection", "features"), ("GeometryCollection", "geometries")):
        if kind == group:
            for number, item in enumerate(_list(part.get(inner), f"{where}: {inner}")):
                yield from _geometries(item, f"{where}: {inner}[{number}]" if where.count(":") < 4 else where)
            return
    if kind == "Feature":
        if part.get("geometry") is not None:
            yield from _geometries(part["geometry"], where)
    elif kind in ("Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon"):
        yield kind, part.get("coordinates"), where
    else:
        raise PlanFileError(f"{kind!r:.40} is not a type of GeoJSON", where)


def _positions(value: object, where: str) -> Route:
    return [_position(item, where) for item in _list(value, where)]


def _position(value: object, where: str) -> RoutePoint:
    numbers = _list(value, where)
    if not 2 <= len(numbers) <= 4 or not all(isinstance(n, int | float) and not isinstance(n, bool) for n in numbers):
        raise PlanFileError(f"{value!r:.60} is not [longitude, latitude] or with an altitude", where)
    return _point(numbers[1], numbers[0], float(numbers[2]) if len(numbers) > 2 else None, where)


def _list(value: object, where: str) -> list[Any]:
    if not isinstance(value, list):
        raise PlanFileError("expected a list", where)
    return cast(list[Any], value)


def _xml(text: str, name: str, text_of: Sequence[str]) -> Element:
    prefixes = ("", "kml:", "gpx:", "ns0:")
    return parse_xml_tree(
        text.encode(), name, PlanFileError, text_of=[prefix + tag for prefix in prefixes for tag in text_of]
    )


def _descendants(element: Element) -> Iterator[Element]:
    waiting = [element]
    while waiting:
        found = waiting.pop()
        yield found
        waiting += reversed(found.children)


def _local(element: Element) -> str:
    """The tag without its prefix."""
    return element.tag.rpartition(":")[2]
