"""A plan that is drawn on the page: shapes of places become maneuvers in the YAML of plans."""

import json
import math
from collections.abc import Mapping
from typing import cast

from support.wgs84 import offset

PLACES = {"goto": 1, "rows": 3, "loiter": 1, "station_keeping": 1}
"""Number of places of each kind of shape."""
REFERENCES = ("depth", "altitude", "height")
MOST_SHAPES = 500


def drawn_plan_text(name: object, shapes: object) -> str:
    """The YAML of a plan with a maneuver for each shape.

    A shape is an object of JSON with a `kind` of PLACES, `places` ([latitude, longitude], degrees), its `reference` of
    REFERENCES with `z` (m), `speed` (m/s), `radius` (m), `seconds`, and the `spacing` (m) of rows. The places of rows
    are the ends of the first row and one on the far side. Raises ValueError for what is none.
    """
    if not isinstance(name, str) or not isinstance(shapes, list):
        raise ValueError("a drawn plan has a name and shapes")
    given = cast(list[object], shapes)
    if len(given) > MOST_SHAPES:
        raise ValueError(f"a drawn plan has at most {MOST_SHAPES} shapes")
    lines = [_maneuver(number, shape) for number, shape in enumerate(given, 1)]
    return f"plan: {json.dumps(name, ensure_ascii=False)}\nmaneuvers:\n{''.join(lines)}"


def _maneuver(number: int, given: object) -> str:
    shape = cast(dict[str, object], given) if isinstance(given, dict) else {}
    kind, reference = shape.get("kind"), shape.get("reference")
    if not isinstance(kind, str) or kind not in PLACES or reference not in REFERENCES:
        raise ValueError(f"shape {number} is of no known kind or reference")
    places = _places(number, shape.get("places"), PLACES[kind])
    lat, lon = places[0]
    words = [f"lat: {lat:.7f}°", f"lon: {lon:.7f}°", f"{reference}: {_number(number, shape, 'z')}"]
    words.append(f"speed: {_number(number, shape, 'speed')} m/s")
    if kind == "rows":
        words += [*_rows(places), f"hstep: {_number(number, shape, 'spacing')}"]
    elif kind != "goto":
        words += [f"radius: {_number(number, shape, 'radius')}", f"duration: {_number(number, shape, 'seconds')}"]
    return f"- {kind}: {{{', '.join(words)}}}\n"


def _rows(places: list[tuple[float, float]]) -> list[str]:
    """Words for rows from the ends of the first one, and a place on the far side, at least 1 m away."""
    (lat, lon), end, far = places
    x, y = _offset(lat, lon, end)
    u, v = _offset(lat, lon, far)
    length = max(1.0, math.hypot(x, y))
    across = (x * v - y * u) / length
    flags = "SQUARE_CURVE, CURVE_RIGHT" if across >= 0.0 else "SQUARE_CURVE"
    words = [f"bearing: {math.degrees(math.atan2(y, x)):.2f}°", f"length: {length:.1f}"]
    return [*words, f"width: {max(1.0, abs(across)):.1f}", "alternation: 100", f"flags: [{flags}]"]


def _offset(lat: float, lon: float, to: tuple[float, float]) -> tuple[float, float]:
    """Meters to the north and east."""
    return offset(math.radians(lat), math.radians(lon), math.radians(to[0]), math.radians(to[1]))


def _places(number: int, value: object, count: int) -> list[tuple[float, float]]:
    found: list[tuple[float, float]] = []
    for place in cast(list[object], value) if isinstance(value, list) else []:
        pair = cast(list[object], place) if isinstance(place, list) else []
        lat, lon = (float(cast(float, each)) if _is_finite(each) else math.nan for each in (*pair, None, None)[:2])
        if not (abs(lat) <= 90.0 and abs(lon) <= 360.0):
            raise ValueError(f"shape {number}: a place has a latitude and a longitude in degrees")
        found.append((lat, (lon + 180.0) % 360.0 - 180.0))
    if len(found) != count:
        raise ValueError(f"shape {number} has {count} place{'s' if count > 1 else ''}")
    return found


def _number(number: int, shape: Mapping[str, object], name: str) -> float:
    value = shape.get(name)
    if not _is_finite(value):
        raise ValueError(f"shape {number}: its {name} is no number")
    return cast(float, value)


def _is_finite(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
