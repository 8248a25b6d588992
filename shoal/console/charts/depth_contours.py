"""Depth contours of a profile's bathymetry, for a map without tiles."""

import asyncio
import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from starlette.requests import Request
from starlette.responses import Response

from runtime.profile import load_profile
from shoal.console.json_request import Answer, json_response, refusal_response
from shoal.console.page_part import PagePart
from shoal.console.plans.plan_flights import PROFILE_NAME
from support.diagnostics import ProfileError
from support.file_errors import describe_os_error
from support.terminal_text import printable
from support.wgs84 import displace, offset
from world import WorldError, read_world
from world.sea import Bathymetry

CELLS = 100  # along the longer side of the area with soundings
MARGIN = 0.5  # of the range of a sounding
MOST_KNOWN = 16  # profiles
STEPS = 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0  # m between contours
MOST_LEVELS = 10
DECIMALS = 6  # of degrees

Floats = NDArray[np.float64]
Line = dict[str, Any]


def depth_contours(profile: str | Path) -> list[Line]:
    """Lines of equal depth in the world of a profile: `depth` (m), and `places` (latitude and longitude in degrees).

    Empty without soundings. Raises ProfileError, WorldError, OSError; ImportError without contourpy.
    """
    loaded = load_profile(profile)
    seabed = read_world(loaded.value, offset, loaded.find_file).seabed
    return contour_lines(seabed) if seabed is not None and seabed.has_soundings else []


def contour_lines(seabed: Bathymetry) -> list[Line]:
    """Lines of equal depth of a bottom with soundings, as `depth_contours`. Raises ImportError without contourpy."""
    return list(_lines(seabed))


def _lines(seabed: Bathymetry) -> Iterator[Line]:
    import contourpy  # only where a map needs it

    north, east = _grid(seabed)
    rows, columns = np.meshgrid(north, east, indexing="ij")
    depths = seabed.depths(rows.ravel(), columns.ravel()).reshape(rows.shape)
    depths = np.where(_is_surveyed(seabed, rows, columns), depths, np.nan)
    least, most = float(np.nanmin(depths)), float(np.nanmax(depths))
    step = next((step for step in STEPS if (most - least) / step <= MOST_LEVELS), STEPS[-1])
    made: Any = contourpy.contour_generator(east, north, np.ma.masked_invalid(depths))
    for number in range(math.ceil(least / step), math.floor(most / step) + 1):
        for line in made.lines(number * step):
            places = [displace(*seabed.reference, 0.0, n, e)[:2] for e, n in line.tolist()]
            yield {"depth": round(number * step, 1), "places": [[_degrees(lat), _degrees(lon)] for lat, lon in places]}


def _grid(seabed: Bathymetry) -> tuple[Floats, Floats]:
    """North and east (m) of the rows and columns of a grid over all soundings."""
    least_north, most_north, least_east, most_east = seabed.extent
    margin = MARGIN * 4.0 * seabed.sampling_step
    cell = max(most_north - least_north, most_east - least_east, margin) / CELLS
    return (
        np.arange(least_north - margin, most_north + margin, cell),
        np.arange(least_east - margin, most_east + margin, cell),
    )


def _is_surveyed(seabed: Bathymetry, rows: Floats, columns: Floats) -> NDArray[np.bool_]:
    places = zip(rows.ravel().tolist(), columns.ravel().tolist(), strict=True)
    return np.array([seabed.is_known(north, east) for north, east in places]).reshape(rows.shape)


def _degrees(angle: float) -> float:
    return round(math.degrees(angle), DECIMALS)


class ContourAnswers(PagePart):
    """Answers to the page with the contours of profiles, each made once, in a thread of its own.

    `find_profile` returns the profile of a vehicle by its name; None if there is no such vehicle. Contours of others
    are not made: they take a second of a processor.
    """

    def __init__(self, find_profile: Callable[[str], str | Path | None]) -> None:
        self._find_profile = find_profile
        self._known: dict[str, Response] = {}  # encoded once: it takes 12 ms
        self._making = asyncio.Lock()
        self.questions: Mapping[str, Answer] = {"/api/contours": self._answer}

    async def _answer(self, request: Request) -> Response:
        """`lines`: see `depth_contours`; empty for a vehicle without a profile here, and `text` has the reason."""
        name = request.query_params.get("vehicle", "")
        profile = self._find_profile(name)
        if profile is None:
            return refusal_response("there is no such vehicle", lines=[])
        async with self._making:
            if name not in self._known:
                if len(self._known) >= MOST_KNOWN:
                    self._known.clear()
                self._known[name] = json_response(await asyncio.to_thread(_make, profile))
            return self._known[name]


def _make(profile: str | Path) -> dict[str, Any]:
    if isinstance(profile, str) and not PROFILE_NAME.fullmatch(profile):
        return {"ok": False, "text": "no name of a profile", "lines": []}
    try:
        return {"ok": True, "lines": depth_contours(profile)}
    except (ProfileError, WorldError, ImportError) as error:
        return {"ok": False, "text": printable(str(error)), "lines": []}
    except OSError as error:
        return {"ok": False, "text": printable(describe_os_error(error)), "lines": []}
