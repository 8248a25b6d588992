"""Follows what is seen on the plane: one track for each thing, with an id that stays."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from world.detection.ground_projection import ERRORS, PLACE, DetectionAccuracy, PlaneDetection, PoseOverPlane

Floats = NDArray[np.floating[Any]]

LEAST = 1e-8  # m², variance of any sighting: two that are exact cannot be weighed against each other
GATE = 13.8  # chi² of two dimensions, exceeded once in a thousand


@dataclass(frozen=True)
class TrackerSettings:
    """Motion of objects, and certainty that a track needs.

    `position_walk` (m/√s) is the random walk of a thing's place, `speed_sigma` (m/s) the standard deviation of its
    speed, 0 for things that lie still, `speed_walk` (m/s per √s) that speed's random walk. A track counts when
    `confirmations` of `window` pictures of one camera have shown it; until then it is dropped when none can show it
    often enough any more, afterward when it has not been seen for `memory` s. Of tracks closer than `least_separation`
    (m), which may be parts of one thing, the oldest stays; those of markers all stay.
    """

    position_walk: float = 0.002
    speed_sigma: float = 0.0
    speed_walk: float = 0.0
    confirmations: int = 3
    window: int = 5
    memory: float = 900.0
    least_separation: float = 0.0


@dataclass(eq=False)
class ObjectTrack:
    """The estimated place of something, as a Schmidt-Kalman filter: errors of the pose are considered, not estimated.

    `state` is north and east (m, on the map of the vehicle), and if things move, their velocities; `covariance` is (n,
    n), `pose_correlation` (n, 6) that of its error with the errors of the pose (see DetectionAccuracy). `id` is None
    until the track counts. `hits` are by camera: whether its last pictures have shown it.
    """

    state: Floats
    covariance: Floats
    pose_correlation: Floats
    time: float
    last_seen: float
    marker: int | None = None
    id: int | None = None
    hits: dict[str, list[bool]] = field(default_factory=dict[str, list[bool]])

    def advance(self, time: float, accuracy: DetectionAccuracy, habits: TrackerSettings) -> None:
        """Let time pass, in s; nothing happens for a time before that of the track."""
        seconds = time - self.time
        if not seconds > 0.0:
            return
        self.time = time
        if len(self.state) == 4:
            step = np.eye(4)
            step[0, 2] = step[1, 3] = seconds
            self.state = step @ self.state
            self.covariance = step @ self.covariance @ step.T
            self.pose_correlation = step @ self.pose_correlation
        walks = [habits.position_walk**2] * 2 + [habits.speed_walk**2] * (len(self.state) - 2)
        self.covariance = self.covariance + seconds * np.diag(walks)
        self.pose_correlation = self.pose_correlation * accuracy.error_decay(seconds)

    def innovation(self, view: "TrackMeasurement") -> tuple[Floats, Floats]:
        """Difference of a sighting from the track (2,), and its covariance (2, 2)."""
        cross = self.pose_correlation[:2] @ view.error_jacobian.T
        spread = self.covariance[:2, :2] - cross - cross.T + view.covariance
        return view.position - self.state[:2], spread

    def update(self, view: "TrackMeasurement") -> None:
        """Schmidt (1966); the covariances as in Joseph's form, which stays symmetric and positive."""
        beyond, spread = self.innovation(view)
        gain = (self.covariance[:, :2] - self.pose_correlation @ view.error_jacobian.T) @ np.linalg.inv(spread)
        keep = np.eye(len(self.state))
        keep[:, :2] -= gain
        mixed = keep @ self.pose_correlation @ view.error_jacobian.T @ gain.T
        self.state = self.state + gain @ beyond
        self.covariance = keep @ self.covariance @ keep.T + mixed + mixed.T + gain @ view.covariance @ gain.T
        self.pose_correlation = keep @ self.pose_correlation + gain @ (view.error_jacobian * view.errors)

    def predicted(self, time: float, accuracy: DetectionAccuracy, habits: TrackerSettings) -> "ObjectTrack":
        """A copy of the track at a later time (s)."""
        later = replace(self)
        later.advance(time, accuracy, habits)
        return later

    def offset(self, standing: PoseOverPlane, accuracy: DetectionAccuracy) -> tuple[float, float, Floats]:
        """North and east (m) of a vehicle at the time of the track, and the covariance (2, 2)."""
        cross = self.pose_correlation[:2, PLACE]
        spread = self.covariance[:2, :2] - cross - cross.T + accuracy.place**2 * np.eye(2)
        return float(self.state[0]) - standing.north, float(self.state[1]) - standing.east, spread


class TrackMeasurement(NamedTuple):
    """A sighting on the map of the vehicle: its place (2,), and its covariance, by the errors of the pose."""

    position: Floats
    covariance: Floats
    error_jacobian: Floats
    errors: Floats

    @classmethod
    def from_detection(
        cls, sighting: PlaneDetection, standing: PoseOverPlane, accuracy: DetectionAccuracy
    ) -> "TrackMeasurement":
        errors = accuracy.pose_error_variances(abs(standing.height))
        h = sighting.error_jacobian
        place = np.array([standing.north + sighting.north, standing.east + sighting.east])
        return cls(place, h * errors @ h.T + sighting.noise + LEAST * np.eye(2), h, errors)


class Tracker:
    """Assigns sightings to tracks. Ids count from 1, and are never used again; those of markers are the markers'.

    Ids that count skip the numbers of markers seen before.
    """

    def __init__(self, accuracy: DetectionAccuracy, habits: TrackerSettings | None = None):
        self.accuracy = accuracy
        self.settings: TrackerSettings = habits or TrackerSettings()
        self.tracks: list[ObjectTrack] = []
        self._last_id = 0
        self._markers: set[int | None] = set()

    def update(
        self,
        time: float,
        standing: PoseOverPlane,
        sightings: Sequence[PlaneDetection],
        markers: Sequence[int | None] = (),
        camera: str = "",
    ) -> list[ObjectTrack]:
        """The tracks that count and are seen in a picture that a `camera` has taken at `time` (s), by ascending id.

        `markers` are numbers read from the things, None where there is none. A picture from before the last one is
        taken for one of its time.
        """
        views = [TrackMeasurement.from_detection(sighting, standing, self.accuracy) for sighting in sightings]
        numbers = list(markers) or [None] * len(views)
        self._markers.update(numbers)
        for track in self.tracks:
            track.advance(time, self.accuracy, self.settings)
        pairs = self._pairs(views, numbers)
        for number, track in enumerate(self.tracks):
            track.hits[camera] = [*track.hits.get(camera, ()), number in pairs][-self.settings.window :]
            if number in pairs:
                track.update(views[pairs[number]])
                track.last_seen = time
                self._confirm(track)
        found = [self.tracks[number] for number in pairs if self.tracks[number].id is not None]
        taken = set(pairs.values())
        begun = [self._begin(time, view, numbers[k], camera) for k, view in enumerate(views) if k not in taken]
        self.tracks = [track for track in self.tracks if self._lasts(track, time)] + begun
        self.tracks = self._separate(self.tracks)
        return sorted((track for track in found if track in self.tracks), key=lambda track: track.id or 0)

    def drop_all_tracks(self) -> None:
        """Forget all tracks, but not which ids were used."""
        self.tracks = []

    def _pairs(self, views: list[TrackMeasurement], markers: list[int | None]) -> dict[int, int]:
        """Numbers of tracks, with those of their sightings: the likeliest pairs first, among those within the gate."""
        chances: list[tuple[bool, float, int, int]] = []
        for t, track in enumerate(self.tracks):
            for v, view in enumerate(views):
                if track.marker != markers[v]:
                    continue
                beyond, spread = track.innovation(view)
                distance = float(beyond @ np.linalg.solve(spread, beyond))
                if distance < GATE:
                    unlikely = distance + math.log(float(np.linalg.det(spread)))
                    chances.append((track.id is None, unlikely, t, v))
        pairs: dict[int, int] = {}
        for _, _, t, v in sorted(chances):
            if t not in pairs and v not in pairs.values():
                pairs[t] = v
        return pairs

    def _begin(self, time: float, view: TrackMeasurement, marker: int | None, camera: str) -> ObjectTrack:
        moving = self.settings.speed_sigma > 0.0
        size = 4 if moving else 2
        state, covariance, shared = np.zeros(size), np.zeros((size, size)), np.zeros((size, ERRORS))
        state[:2], covariance[:2, :2] = view.position, view.covariance
        if moving:
            covariance[2:, 2:] = self.settings.speed_sigma**2 * np.eye(2)
        shared[:2] = view.error_jacobian * view.errors
        track = ObjectTrack(state, covariance, shared, time, time, marker, hits={camera: [True]})
        self._confirm(track)
        return track

    def _separate(self, tracks: list[ObjectTrack]) -> list[ObjectTrack]:
        """Tracks without those that are too close to an older one."""
        kept: list[ObjectTrack] = []
        for track in sorted(tracks, key=lambda track: track.id is None):
            nearest = min((math.dist(track.state[:2], other.state[:2]) for other in kept), default=math.inf)
            if track.marker is not None or nearest >= self.settings.least_separation:
                kept.append(track)
        return kept

    def _confirm(self, track: ObjectTrack) -> None:
        most = max(hits.count(True) for hits in track.hits.values())
        if track.id is not None or most < self.settings.confirmations:
            return
        if track.marker is None:
            self._last_id = next(n for n in count(self._last_id + 1) if n not in self._markers)
        track.id = self._last_id if track.marker is None else track.marker

    def _lasts(self, track: ObjectTrack, time: float) -> bool:
        spared = self.settings.window - self.settings.confirmations + 1
        hopeful = track.id is not None or any(any(hits[-spared:]) for hits in track.hits.values())
        return hopeful and time - track.last_seen <= self.settings.memory
