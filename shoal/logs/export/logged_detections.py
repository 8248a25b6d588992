"""Positions of the detections of a log: on the map, and in its pictures."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from imc.lsf import positions
from runtime.logs import Array
from shoal.logs.export.camera_calibration import LoggedCamera
from shoal.logs.export.ros_standard_conversion import MapOrigin
from support.rotations import rotation
from support.wgs84_arrays import displacement
from world.optics import CameraModel, Floats, project_by_row

STATE, MUG = "EstimatedState", "EstimatedMugState"
FIELDS = {
    STATE: ["timestamp", "src", "src_ent", "lat", "lon", "height", "x", "y", "z", "phi", "theta", "psi", "alt"],
    MUG: ["timestamp", "src_ent", "id", "x", "y"],
}
OLDEST = 1.0  # s, beyond which a state is too old for a detection
LATEST = 0.5  # s after a picture, within which what is seen in it is published
DIAMETER = 0.8  # m, the length of a mini glider
LEAST = 8.0  # px


class DetectionPoint(NamedTuple):
    """A detection: the entity that it comes from, when (s since 1970), its number, its place (m north, east, down)."""

    entity: int
    time: float
    id: int
    place: tuple[float, float, float]


class DetectionCollector:
    """The states and detections of a log as they come, by system; those of fixed size."""

    def __init__(self) -> None:
        self._found: dict[int, dict[str, list[Array]]] = {}

    def add_rows(self, name: str, src: int, rows: Array) -> None:
        if name in FIELDS:
            kept = rows[FIELDS[name]].copy()
            self._found.setdefault(src, {}).setdefault(name, []).append(kept)

    def by_system(self, origin: MapOrigin | None) -> dict[int, "SystemDetections"]:
        """The detections of each system that has published its estimated position."""
        if origin is None:
            return {}
        return {
            src: SystemDetections(origin, np.concatenate(parts[STATE]), np.concatenate(parts[MUG]))
            for src, parts in self._found.items()
            if len(parts) == len(FIELDS)
        }


class SystemDetections:
    """The detections of one system, which are relative to its estimated position.

    Their height is not in the log: they are on the bottom below the vehicle by its altitude, or without one at the
    surface below it.
    """

    def __init__(self, origin: MapOrigin, states: Array, found: Array):
        states = states[states["src_ent"] == states["src_ent"][0]]
        states = states[np.argsort(states["timestamp"], kind="stable")]
        places = positions(states)
        down = displacement(origin, places["lat"], places["lon"], places["height"])
        angles = [np.unwrap(states[name].astype(float)) for name in ("phi", "theta", "psi")]
        alt, z = states["alt"].astype(float), states["z"].astype(float)
        below = np.where(alt > 0.0, alt, np.maximum(0.0, -z))
        columns = np.stack([*down, *angles, below], axis=-1)
        good = np.isfinite(columns).all(axis=1) & np.isfinite(states["timestamp"])
        self._times, self._columns = states["timestamp"][good], columns[good]
        found = found[np.isfinite(found["timestamp"] + found["x"] + found["y"])]
        self.spots: list[DetectionPoint] = list(self._spots(found[np.argsort(found["timestamp"], kind="stable")]))
        self._spot_times = np.array([spot.time for spot in self.spots])

    def _spots(self, found: Array) -> Iterator[DetectionPoint]:
        rows = zip(*(found[name].tolist() for name in ("src_ent", "timestamp", "id", "x", "y")), strict=True)
        for entity, time, number, x, y in rows:
            state = self._at(time)
            if state is not None:
                yield DetectionPoint(entity, time, number, (state[0] + x, state[1] + y, state[2] + state[6]))

    def _at(self, time: float) -> list[float] | None:
        """Place, angles, and the height above the ground at a time; None where no state is near."""
        if not len(self._times) or not self._times[0] - OLDEST <= time <= self._times[-1] + OLDEST:
            return None
        return [float(np.interp(time, self._times, self._columns[:, n])) for n in range(self._columns.shape[1])]

    def project_into_photo(
        self, time: float, model: CameraModel, camera: LoggedCamera, before: float = 0.0
    ) -> Iterator[tuple[DetectionPoint, Array, float]]:
        """First detection of each object after a picture that shows it, its pixel, and its size (px).

        Without one, the last detection counts that was at most `before` s earlier.
        """
        state = self._at(time)
        if state is None:
            return
        oldest, first, last = np.searchsorted(self._spot_times, (time - before, time, time + LATEST)).tolist()
        seen: dict[tuple[int, int], DetectionPoint] = {}
        for spot in (*self.spots[first:last], *reversed(self.spots[oldest:first])):
            seen.setdefault((spot.entity, spot.id), spot)
        pose, readout = camera.pose, _readout(camera)

        for spot in seen.values():

            def points_at(offset: Floats, place: tuple[float, float, float] = spot.place) -> Floats:
                now = self._at(time + float(offset)) or state
                turn = np.array(rotation(now[3], now[4], now[5]))
                return ((np.array(place) - now[:3]) @ turn - pose[:3, 3]) @ pose[:3, :3]

            pixel, valid = project_by_row(model, readout, points_at, ())
            distance = float(np.linalg.norm(points_at(np.zeros(()))))
            if valid and distance > 0.0:
                yield spot, pixel, max(LEAST, model.fx * DIAMETER / distance)


def _readout(camera: LoggedCamera) -> float:
    """s that pass over all rows of a rolling shutter; 0 if it does not roll."""
    seconds = camera.model.get("readout_time", 0.0)
    return float(seconds) if isinstance(seconds, (int, float)) and 0.0 < seconds < OLDEST else 0.0
