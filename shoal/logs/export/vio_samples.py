"""Content of data sets for visual-inertial navigation: inertial samples, tracks, pictures."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from imc.lsf import ReportProgress, positions
from runtime.logs import Array
from shoal.logs.export.camera_calibration import UNLIKE, load_camera_models, photos_of_other_lenses, read_photo_cameras
from shoal.logs.export.message_batches import ExportBatch, LogSource, MessageBatch, nanoseconds
from shoal.logs.export.photo_files import Photo, find_photos
from shoal.logs.export.ros_standard_conversion import MapOrigin, first_origin, quaternion_columns
from support.wgs84_arrays import displacement

TRIAD = ("timestamp", "src", "src_ent", "x", "y", "z")
STATE = ("timestamp", "src", "src_ent", "lat", "lon", "height", "x", "y", "z", "phi", "theta", "psi", "u", "v", "w")
FIELDS: dict[str, tuple[str, ...]] = {
    "AngularVelocity": TRIAD,
    "Acceleration": TRIAD,
    "SimulatedState": (*STATE, "svx", "svy", "svz"),
    "EstimatedState": STATE,
}
ENU_OF_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


class ImuSamples(NamedTuple):
    """Samples of an inertial measurement unit: times (ns since 1970), rates (rad/s) and forces (m/s²), a row each."""

    label: str
    times: Array
    rates: Array
    forces: Array


class PoseTrack(NamedTuple):
    """The motion of the vehicle: times (ns since 1970), places and velocities (m, m/s; east, north, up), attitudes.

    An attitude is a quaternion w, x, y, z that turns vectors of the body (forward, right, down) to east, north, up.
    The origin is that of the first track of the log.
    """

    times: Array
    places: Array
    attitudes: Array
    velocities: Array


@dataclass
class VioRecording:
    """The samples, tracks and pictures of a log's vehicle; pictures by camera."""

    imus: list[ImuSamples] = field(default_factory=list[ImuSamples])
    truth: PoseTrack | None = None
    estimate: PoseTrack | None = None
    photos: dict[str, list[Photo]] = field(default_factory=dict[str, list[Photo]])


def read_recording(source: LogSource, progress: ReportProgress = lambda _: None) -> VioRecording:
    """Read a log. What cannot be used counts as skipped in `source`. Raises OSError."""
    found: dict[str, list[Array]] = {name: [] for name in FIELDS}
    for batch in source.batches(progress):
        for group in source.groups(batch):
            if group.message.abbrev in FIELDS:
                rows = _rows(source, batch, group)
                found[group.message.abbrev].append(rows[rows["src"] == source.summary.owner])
    tables = {name: _cleaned(source, name, rows) for name, rows in found.items() if rows}
    recording = VioRecording(list(_units(source, tables)))
    states = [tables[name] for name in ("SimulatedState", "EstimatedState") if name in tables and len(tables[name])]
    origin = first_origin(states[0]) if states else None
    if origin is not None:
        recording.truth, recording.estimate = (
            _track(tables[name], origin) if name in tables else None for name in ("SimulatedState", "EstimatedState")
        )
    lacks = {
        "inertial samples: no entity of the vehicle has AngularVelocity and Acceleration": not recording.imus,
        "true motion: no SimulatedState of the vehicle": recording.truth is None,
        "estimated motion: no EstimatedState of the vehicle": recording.estimate is None,
    }
    source.notes += [f"without {what}" for what, is_missing in lacks.items() if is_missing]
    folder = source.log.path.parent / "Photos"
    unlike = photos_of_other_lenses(source, load_camera_models(folder, read_photo_cameras(folder, source.notes.append)))
    for photo in find_photos(folder, source.summary.start):
        if not source.selection.start <= photo.time < source.selection.end:
            continue
        if photo.path.name in unlike:
            source.skipped[UNLIKE.format(photo.camera)] += 1
        else:
            recording.photos.setdefault(photo.camera, []).append(photo)
    return recording


def quaternions(phi: Array, theta: Array, psi: Array) -> Array:
    """Rows w, x, y, z, w >= 0, that turn body vectors to east, north, up, from Euler angles against north (rad)."""
    w, x, y, z = quaternion_columns(phi, theta, psi)
    half = math.sqrt(0.5)  # east-north-up from north-east-down: half a turn about north-east
    found = np.stack((-half * (x + y), half * (w + z), half * (w - z), half * (y - x)), axis=-1)
    return np.where(found[:, :1] < 0.0, -found, found)


def _rows(source: LogSource, batch: ExportBatch, group: MessageBatch) -> Array:
    names = FIELDS[group.message.abbrev]
    rows = np.empty(len(group.rows), [(name, "f8") for name in names])
    if group.array is not None:
        for name in names:
            rows[name] = group.array[name]
        return rows
    kept: list[tuple[float, ...]] = []
    for _, message in source.decode(batch, group.rows):
        kept.append(tuple(float(getattr(message, name)) for name in names))
    return np.array(kept, rows.dtype)


def _cleaned(source: LogSource, name: str, rows: list[Array]) -> Array:
    """All rows that are finite, by time; the last one of those of the same time and entity."""
    table = np.concatenate(rows)
    finite = np.ones(len(table), bool)
    for column in table.dtype.names or ():
        finite &= np.isfinite(table[column])
    if not finite.all():
        source.skipped[f"{name} is not finite"] += int((~finite).sum())
    table = table[finite]
    order = np.lexsort((np.arange(len(table)), table["timestamp"], table["src_ent"]))
    table = table[order]
    last = np.ones(len(table), bool)
    last[:-1] = (np.diff(table["timestamp"]) != 0.0) | (np.diff(table["src_ent"]) != 0.0)
    return table[last]


def _units(source: LogSource, tables: dict[str, Array]) -> Iterator[ImuSamples]:
    rates, forces = tables.get("AngularVelocity"), tables.get("Acceleration")
    if rates is None or forces is None:
        return
    for entity in np.intersect1d(rates["src_ent"], forces["src_ent"]).tolist():
        turning, pushing = rates[rates["src_ent"] == entity], forces[forces["src_ent"] == entity]
        times, first, second = np.intersect1d(turning["timestamp"], pushing["timestamp"], return_indices=True)
        label = source.names.entity_label(source.summary.owner, int(entity))
        alone = len(turning) + len(pushing) - 2 * len(times)
        if alone:
            source.skipped[f"{label} has no rates and force at the same time"] += alone
        if len(times):
            yield ImuSamples(
                label, nanoseconds(times), _vectors(turning[first], "xyz"), _vectors(pushing[second], "xyz")
            )


def _track(states: Array, origin: MapOrigin) -> PoseTrack:
    """The states of the entity that has most of them."""
    entities, counts = np.unique(states["src_ent"], return_counts=True)
    states = states[states["src_ent"] == entities[int(np.argmax(counts))]]
    places = positions(states)
    north, east, down = displacement(origin, places["lat"], places["lon"], places["height"])
    attitudes = quaternions(states["phi"], states["theta"], states["psi"])
    velocities = _turned(attitudes, _vectors(states, "uvw"))
    if "svx" in (states.dtype.names or ()):
        velocities += np.stack((states["svx"], states["svy"], states["svz"]), axis=-1) @ ENU_OF_NED.T
    return PoseTrack(nanoseconds(states["timestamp"]), np.stack((east, north, -down), axis=-1), attitudes, velocities)


def _vectors(table: Array, names: str) -> Array:
    return np.stack([table[name] for name in names], axis=-1)


def _turned(quaternion: Array, vectors: Array) -> Array:
    """Vectors turned by quaternions, row by row."""
    w, axis = quaternion[:, :1], quaternion[:, 1:]
    across = 2.0 * np.cross(axis, vectors)
    return vectors + w * across + np.cross(axis, across)
