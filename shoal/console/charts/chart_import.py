"""Reads charts of other programs into overlays of the page: S-57, KML, GPX, GeoJSON, and depths as contours."""

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any

from shoal.console.charts.chart_overlays import MOST_PLACES, NESTING, Feature, make_feature, overlay_text, read_features
from shoal.console.charts.depth_contours import contour_lines
from support.terminal_text import printable
from support.wkb import geometries
from world.charts import FORMATS, ChartWindow, read_chart
from world.sea import Bathymetry, BathymetryError

DRIVERS: dict[str, tuple[str, ...]] = {".000": ("S57",), ".kml": ("KML", "LIBKML"), ".gpx": ("GPX",)}
STARTS = {
    ".000": re.compile(rb"\d{5}[ 0-9][ A-Z]"),
    ".kml": re.compile(rb"<(\w+:)?kml\b"),
    ".gpx": re.compile(rb"<gpx\b"),
}
HEAD = 4096  # bytes, in which a file shows what it is
VIRTUAL = b"OGRVRT"  # GDAL opens whatever other file or address such a file names
MOST_INPUT = 256 << 20  # bytes
MOST_READ = 5_000_000  # places of GeoJSON, before they are thinned
S57_KINDS = {
    "DEPCNT": "contour",
    "SOUNDG": "sounding",
    "DEPARE": "area",
    "LNDARE": "land",
    "COALNE": "land",
    "OBSTRN": "obstruction",
    "WRECKS": "obstruction",
    "UWTROC": "obstruction",
    **dict.fromkeys(("ACHARE", "CBLARE", "FAIRWY", "MARCUL", "RESARE", "TSSLPT"), "area"),
    **dict.fromkeys(("BCNCAR", "BCNLAT", "BOYCAR", "BOYISD", "BOYLAT", "BOYSAW", "BOYSPP", "LIGHTS"), "mark"),
}
"""The kinds of the object classes that are drawn, of S-57 (IHO S-57, appendix A)."""
DEPTHS = ("VALDCO", "VALSOU", "DRVAL1")
NAMES = ("OBJNAM", "Name", "name")
LINES = ("LineString", "MultiLineString", "Polygon", "MultiPolygon")
FINEST = 1e-5  # degrees between the places of a line that is thinned
OPTIONS = {"OGR_S57_OPTIONS": "SPLIT_MULTIPOINT=OFF,RETURN_PRIMITIVES=OFF,LNAM_REFS=OFF"}


class ChartImportError(Exception):
    """A chart that cannot be imported; the text is for people."""


@dataclass
class ImportedChart:
    """Features of a chart, and remarks about what they lack of it."""

    features: list[Feature]
    remarks: list[str] = field(default_factory=list[str])

    @property
    def text(self) -> bytes:
        """The content of a file for the folder of the map tiles."""
        return overlay_text(self.features)


def import_chart(path: Path, window: ChartWindow | None = None) -> ImportedChart:
    """Read a chart by its suffix; depths need a window around a place. Raises ChartImportError, OSError."""
    suffix = path.suffix.lower()
    size = path.stat().st_size
    if size > MOST_INPUT:
        raise ChartImportError(f"{path}: has more than {MOST_INPUT >> 20} MB")
    if suffix in FORMATS:
        return _import_depths(path, window)
    if suffix in (".geojson", ".json"):
        try:
            return _thinned(list(read_features(path.read_bytes(), MOST_READ)))
        except (ValueError, RecursionError) as error:
            raise ChartImportError(f"{path}: {printable(str(error))}") from None
    if suffix not in DRIVERS:
        known = ", ".join((*DRIVERS, ".geojson", *FORMATS))
        raise ChartImportError(f"{path}: is in no known format; the known ones: {known}")
    _check_start(path, suffix)
    return _import_layers(path, suffix)


def _check_start(path: Path, suffix: str) -> None:
    """Check the start of a file before GDAL looks, which would open one of any of its formats."""
    data = path.read_bytes()
    if not STARTS[suffix].search(data[:HEAD]) or VIRTUAL in data:
        raise ChartImportError(f"{path}: is no {suffix} file")


def _import_layers(path: Path, suffix: str) -> ImportedChart:
    pyogrio: Any = import_module("pyogrio")  # only for these formats; a vehicle has no GDAL
    raw: Any = import_module("pyogrio.raw")
    errors: Any = import_module("pyogrio.errors")
    pyogrio.set_gdal_config_options(OPTIONS)
    features: list[Feature] = []
    ignored: Counter[str] = Counter()
    failed = 0
    try:
        for layer in (str(row[0]) for row in pyogrio.list_layers(path)):
            kind = S57_KINDS.get(layer) if suffix == ".000" else ""
            if kind is None:
                ignored[layer] += 1
                continue
            meta, _, shapes, columns = raw.read(path, layer=layer)
            values = dict(zip(meta["fields"], columns, strict=True))
            for number, shape in enumerate(shapes if shapes is not None else ()):
                known = {name: column[number] for name, column in values.items()}
                try:
                    features += _features(shape, known, kind) if shape is not None else []
                except ValueError:
                    failed += 1
    except errors.DataSourceError as error:
        raise ChartImportError(f"{path}: {printable(str(error))}") from None
    except (errors.DataLayerError, errors.FeatureError, errors.GeometryError) as error:
        raise ChartImportError(f"{path}: is damaged: {printable(str(error))}") from None
    if not features:
        raise ChartImportError(f"{path}: has nothing that is drawn")
    found = _thinned(features)
    others = [name for name in ignored if name not in ("DSID", "M_COVR")]
    if others:
        found.remarks.append(f"not drawn: {', '.join(map(printable, sorted(others)))}")
    if failed:
        found.remarks.append(f"{failed} features have no valid geometry in degrees")
    return found


def _features(shape: bytes, values: Mapping[str, Any], kind: str) -> Iterator[Feature]:
    """The features of a geometry; each sounding is one of its own. Raises ValueError."""
    depth = next((float(values[name]) for name in DEPTHS if _is_number(values.get(name))), math.nan)
    name = next((values[each] for each in NAMES if isinstance(values.get(each), str)), "")
    for geometry in geometries(bytes(shape)):
        if kind == "sounding":
            parts = geometry["coordinates"] if geometry["type"] == "MultiPoint" else [geometry["coordinates"]]
            for part in parts:
                point = {"type": "Point", "coordinates": _flat(part, 0)}
                yield make_feature(point, {"kind": kind, "depth": part[2] if len(part) > 2 else depth})
        else:
            flat = {"type": geometry["type"], "coordinates": _flat(geometry["coordinates"], NESTING[geometry["type"]])}
            yield make_feature(flat, {"kind": kind, "depth": depth, "name": name})


def _flat(coordinates: list[Any], levels: int) -> list[Any]:
    """Coordinates without heights, rounded. Raises ValueError for places that are not on Earth."""
    if levels:
        return [_flat(each, levels - 1) for each in coordinates]
    lon, lat = coordinates[:2]
    if not (abs(lon) <= 360.0 and abs(lat) <= 90.0):
        raise ValueError("not a place in degrees")
    return [round(lon, 6), round(lat, 6)]


def _is_number(value: Any) -> bool:
    try:
        return math.isfinite(float(value))
    except (TypeError, ValueError):
        return False


def _import_depths(path: Path, window: ChartWindow | None) -> ImportedChart:
    if window is None:
        raise ChartImportError(f"{path}: depths are read around a place: give --around LAT,LON")
    try:
        chart = read_chart(path, window)
        seabed = Bathymetry(chart.soundings.T, chart.radius, math.nan, (window.latitude, window.longitude))
        lines = contour_lines(seabed)
    except BathymetryError as error:
        raise ChartImportError(f"{path}: {printable(str(error))}") from None
    features = [
        make_feature(
            {"type": "LineString", "coordinates": [[lon, lat] for lat, lon in line["places"]]},
            {"kind": "contour", "depth": line["depth"]},
        )
        for line in lines
    ]
    if not features:
        raise ChartImportError(f"{path}: has no contours within {window.radius:g} m of {window}: the bottom is even")
    return _thinned(features)


def _thinned(features: list[Feature]) -> ImportedChart:
    """Keep as few places as a page draws: of lines those that are apart, then soundings at regular intervals."""
    step, remarks = FINEST, list[str]()
    before = total = sum(_count(feature) for feature in features)
    while total > MOST_PLACES and step < 1.0:
        for feature in features:
            geometry = feature["geometry"]
            if geometry["type"] in LINES:
                geometry["coordinates"] = _apart(geometry["coordinates"], step)
        step *= 2.0
        total = sum(_count(feature) for feature in features)
        soundings = [feature for feature in features if feature["properties"]["kind"] == "sounding"]
        if total > MOST_PLACES and len(soundings) > total // 2:
            left = {id(feature) for feature in soundings[1::2]}
            features = [feature for feature in features if id(feature) not in left]
            total -= len(left)
    if total < before:
        remarks.append(f"thinned from {before} to {total} places, of which a page draws {MOST_PLACES} at most")
    return ImportedChart(features, remarks)


def _count(feature: Feature) -> int:
    def count(value: Any) -> int:
        return sum(map(count, value)) if value and isinstance(value[0], list) else 1

    return count(feature["geometry"]["coordinates"])


def _apart(coordinates: list[Any], step: float) -> list[Any]:
    """Lines without the places that are nearer than `step` (degrees) to the one before; their ends stay."""
    if not coordinates or not isinstance(coordinates[0][0], list):
        kept = coordinates[:1]
        for place in coordinates[1:-1]:
            if math.dist(place, kept[-1]) >= step:
                kept.append(place)
        return kept + coordinates[-1:] if len(coordinates) > 1 else kept
    return [_apart(each, step) for each in coordinates]
