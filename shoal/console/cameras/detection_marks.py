"""Positions of the detections of a vehicle in its pictures."""

import math
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

import imc
from shoal.console.cameras.camera_picture import CameraPicture
from shoal.logs.export import DETECTION_FIELDS, MapOrigin, SystemDetections, first_origin
from support.terminal_text import printable

BEFORE = 1.0  # s before a picture, from when on detections are drawn in it
MOST_STATES, MOST_DETECTIONS = 512, 1024
MOST_MARKS = 64
STATE, DETECTION = DETECTION_FIELDS

Mark = dict[str, Any]
Label = Callable[[int], str]


class RecentDetections:
    """The last states and detections of a vehicle, as they come."""

    def __init__(self) -> None:
        self._states = deque[imc.EstimatedState](maxlen=MOST_STATES)
        self._found = deque[imc.EstimatedMugState](maxlen=MOST_DETECTIONS)

    def add(self, message: imc.Message) -> None:
        if isinstance(message, imc.EstimatedState):
            self._states.append(message)
        elif isinstance(message, imc.EstimatedMugState):
            self._found.append(message)

    def marks(self, picture: CameraPicture, label: Label) -> list[Mark]:
        """The marks in a picture; empty without its lens, a position or a detection."""
        if picture.lens is None or not self._states or not self._found:
            return []
        states = _rows(self._states, DETECTION_FIELDS[STATE])
        origin = first_origin(states)
        if origin is None:
            return []
        detections = SystemDetections(MapOrigin(*origin), states, _rows(self._found, DETECTION_FIELDS[DETECTION]))
        return picture_marks(picture, detections, label)


def picture_marks(picture: CameraPicture, detections: SystemDetections, label: Label) -> list[Mark]:
    """Column `u` and row `v` (px of the picture) of each detection, its `size` (px) and `label`."""
    lens, (_, width, height, _) = picture.lens, picture.header
    if lens is None:
        return []
    across, down = width / lens.model.width, height / lens.model.height
    found: list[Mark] = []
    for spot, (u, v), size in detections.project_into_photo(picture.time, lens.model, lens.camera, BEFORE):
        numbers = float(u) * across, float(v) * down, size * across
        if all(map(math.isfinite, numbers)) and len(found) < MOST_MARKS:
            column, row, diameter = (round(number, 1) for number in numbers)
            text = printable(f"{label(spot.entity)} {spot.id}")
            found.append({"u": column, "v": row, "size": diameter, "label": text})
    return found


def _rows(messages: Iterable[imc.Message], names: list[str]) -> Any:
    rows = [tuple(getattr(message, name) for name in names) for message in messages]
    return np.array(rows, [(name, np.int64 if name in ("src", "src_ent", "id") else np.float64) for name in names])
