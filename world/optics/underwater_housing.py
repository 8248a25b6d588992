"""Cameras behind glass in water: flat ports and domes, by Snell's law."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from world.optics.camera_model import Bools, CalibrationError, CameraModel, Floats

WATER, GLASS = 1.34, 1.49  # refractive indices of sea water and of acrylic
TABLE = 4096
STEPS = 4  # of Newton, from the table
NUDGE = 1e-6  # rad
AXIS = 1e-9  # rad, closer to which a ray lies on the axis


@dataclass(frozen=True)
class HousingPort(ABC):
    """A window around the axis of a camera, its glass `thickness` m thick, between air and water.

    Rays are followed backwards, from the camera into the water, in the plane of the axis: (across, along) in m.
    """

    thickness: float = 0.01
    glass: float = GLASS
    water: float = WATER

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (math.isfinite(value) and (value >= 0.0 or name == "offset")):
                raise CalibrationError(f"{name} = {value:g} of a port is not a length or an index")
        if not (1.0 <= self.glass <= 3.0 and 1.0 <= self.water <= 2.0):
            raise CalibrationError(f"glass = {self.glass:g} and water = {self.water:g} are no refractive indices")

    @property
    @abstractmethod
    def max_angle(self) -> float:
        """Angle (rad) off the axis, in air, from which on no ray gets through."""

    @property
    @abstractmethod
    def outer_distance(self) -> float:
        """Distance (m) from the camera within which there is only air and glass."""

    @abstractmethod
    def trace(self, angle: Floats) -> tuple[Floats, Floats]:
        """Points where rays at these angles (...) leave the glass, and their directions in water, (..., 2) each."""

    def refracted_angle(self, angle: Floats, subject: float | Floats) -> Floats:
        """Angle off the axis (rad), seen from the camera, of what a ray at `angle` in air shows `subject` m away."""
        place, way = self.trace(angle)
        if isinstance(subject, float) and math.isinf(subject):
            return np.arctan2(way[..., 0], way[..., 1])
        across = _dot(place, way)
        with np.errstate(invalid="ignore"):
            place = place + (np.sqrt(across**2 + subject**2 - _dot(place, place)) - across)[..., None] * way
        return np.arctan2(place[..., 0], place[..., 1])


@dataclass(frozen=True)
class FlatPort(HousingPort):
    """A pane, square to the axis, `distance` m before the camera's center."""

    distance: float = 0.03

    @property
    def max_angle(self) -> float:
        return math.radians(89.0)

    @property
    def outer_distance(self) -> float:
        return self.distance + self.thickness

    def trace(self, angle: Floats) -> tuple[Floats, Floats]:
        sine = np.sin(angle)
        across = self.distance * np.tan(angle) + self.thickness * _tangent(sine / self.glass)
        way = np.stack((sine / self.water, np.sqrt(1 - (sine / self.water) ** 2)), axis=-1)
        return np.stack((across, np.full_like(across, self.outer_distance)), axis=-1), way


@dataclass(frozen=True)
class DomePort(HousingPort):
    """A part of a sphere of inner `radius` m; the camera's center is `offset` m before the sphere's, along the axis."""

    radius: float = 0.08
    offset: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not abs(self.offset) < self.radius:
            raise CalibrationError(f"offset = {self.offset:g} m is outside of a dome of radius {self.radius:g} m")

    @property
    def max_angle(self) -> float:
        return math.pi

    @property
    def outer_distance(self) -> float:
        return self.radius + self.thickness + abs(self.offset)

    def trace(self, angle: Floats) -> tuple[Floats, Floats]:
        way = np.stack((np.sin(angle), np.cos(angle)), axis=-1)
        place = np.broadcast_to(np.array([0.0, self.offset]), way.shape)
        for radius, before, behind in (
            (self.radius, 1.0, self.glass),
            (self.radius + self.thickness, self.glass, self.water),
        ):
            along = _dot(place, way)
            onward = np.sqrt(along**2 + radius**2 - _dot(place, place)) - along
            place = place + onward[..., None] * way
            normal = place / radius
            ratio, cosine = before / behind, _dot(way, normal)
            onto = np.sqrt(1 - ratio**2 * (1 - cosine**2)) - ratio * cosine
            way = ratio * way + onto[..., None] * normal
        return place - np.array([0.0, self.offset]), way


def _dot(one: Floats, other: Floats) -> Floats:
    return one[..., 0] * other[..., 0] + one[..., 1] * other[..., 1]


def _tangent(sine: Floats) -> Floats:
    return sine / np.sqrt(1 - sine**2)


@dataclass(frozen=True)
class HousedModel(CameraModel):
    """A camera `inner` behind a port.

    Behind a flat port, and off the center of a dome, rays do not meet in one point but along the axis (Agrawal and
    others, CVPR 2012). `project`, `rays` and `jacobian` are those of one point, the camera's center, and right for all
    that is `subject_distance` m away from it; `project_refracted` is right everywhere, and `axis_crossings` are where
    rays cross the axis. Make one by `put_behind_port`. Raises CalibrationError.
    """

    inner: CameraModel
    port: HousingPort
    subject_distance: float = math.inf
    _angles: Floats = field(init=False, repr=False, compare=False)
    _bent: Floats = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not self.subject_distance > self.port.outer_distance:
            raise CalibrationError(f"a subject {self.subject_distance:g} m away is within the port")
        angles = np.linspace(0.0, self.port.max_angle - 10 * NUDGE, TABLE)
        bent = self.port.refracted_angle(angles, self.subject_distance)
        rising = np.flatnonzero(~(np.diff(bent) > 0.0))
        last = int(rising[0]) + 1 if rising.size else TABLE
        object.__setattr__(self, "_angles", angles[:last])
        object.__setattr__(self, "_bent", bent[:last])

    def project_to_unit_plane(self, points: Floats) -> tuple[Floats, Bools]:
        seen, away, outward = _polar(points)
        angle = self._unbend(seen)
        places, valid = self.inner.project_to_unit_plane(_directed(np.nan_to_num(angle), outward))
        return places, valid & np.isfinite(angle) & (away > 0.0)

    def unproject_from_unit_plane(self, places: Floats) -> tuple[Floats, Bools]:
        rays, valid = self.inner.unproject_from_unit_plane(places)
        angle, _, outward = _polar(np.nan_to_num(rays))
        valid = valid & (angle <= self._angles[-1])
        bent = self.port.refracted_angle(np.where(valid, angle, 0.0), self.subject_distance)
        return _directed(bent, outward), valid & np.isfinite(bent)

    def unit_plane_jacobian(self, points: Floats) -> Floats:
        """Derivatives of the inner camera at the ray in air, times those of that ray by the point."""
        seen, away, outward = _polar(points)
        angle = np.nan_to_num(self._unbend(seen))
        across = away * np.sin(seen)
        near = seen < AXIS
        slope = (2 * NUDGE) / (self._bend(angle + NUDGE) - self._bend(angle - NUDGE))
        ratio = np.where(near, slope / away, np.sin(angle) / np.where(near, 1.0, across))
        # The ray (sin a e, cos a) with the unit vector e across the axis; a and e change with the point.
        along = np.concatenate((outward * np.cos(angle)[..., None], -np.sin(angle)[..., None]), axis=-1)
        turned = np.concatenate((outward * np.cos(seen)[..., None], -np.sin(seen)[..., None]), axis=-1)
        found = along[..., :, None] * turned[..., None, :] * (slope / away)[..., None, None]
        aside = np.stack((-outward[..., 1], outward[..., 0], np.zeros_like(angle)), axis=-1)
        found += aside[..., :, None] * aside[..., None, :] * ratio[..., None, None]
        return self.inner.unit_plane_jacobian(_directed(angle, outward)) @ found

    def project_refracted(self, points: ArrayLike) -> tuple[Floats, Bools]:
        """Pixels (..., 2) of points (..., 3; m), wherever they are in the water, and which of them are seen."""
        points = np.asarray(points, np.float64)
        seen, away, outward = _polar(points)
        low, high = np.zeros_like(seen), np.full_like(seen, self._angles[-1])
        for _ in range(60):
            middle = (low + high) / 2
            above = ~(self.port.refracted_angle(middle, away) < seen)
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        pixels, valid = self.inner.project(_directed(low, outward))
        return pixels, valid & (away > self.port.outer_distance) & (
            np.abs(self.port.refracted_angle(low, away) - seen) < 1e-9
        )

    def axis_crossings(self, pixels: ArrayLike) -> Floats:
        """(...) m ahead of the camera's center at which the rays in water cross the axis; NaN without a ray."""
        rays, valid = self.inner.unproject(pixels)
        angle, _, _ = _polar(np.nan_to_num(rays))
        place, way = self.port.trace(np.maximum(np.where(valid, angle, 0.0), 10 * NUDGE))
        return np.where(valid, place[..., 1] - place[..., 0] * way[..., 1] / way[..., 0], np.nan)

    def to_opencv(self) -> dict[str, Any]:
        raise CalibrationError("OpenCV has no port between air and water")

    def to_kalibr(self) -> dict[str, Any]:
        raise CalibrationError("Kalibr has no port between air and water")

    def _bend(self, angle: Floats) -> Floats:
        """Refracted angles, also of those a little below 0."""
        return np.copysign(self.port.refracted_angle(np.abs(angle), self.subject_distance), angle)

    def _unbend(self, seen: Floats) -> Floats:
        """Angle in air of a ray that is seen at an angle; NaN if there is none."""
        angle = np.interp(seen, self._bent, self._angles)
        for _ in range(STEPS):
            slope = (self._bend(angle + NUDGE) - self._bend(angle - NUDGE)) / (2 * NUDGE)
            angle = np.clip(angle - (self._bend(angle) - seen) / slope, 0.0, self._angles[-1])
        return np.where(seen <= self._bent[-1], angle, np.nan)


def put_behind_port(camera: CameraModel, port: HousingPort | None, subject_distance: float = math.inf) -> CameraModel:
    """A camera behind a port, right for what is `subject_distance` m away (see HousedModel); itself without one."""
    if port is None:
        return camera
    size = camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy
    return HousedModel(*size, camera, port, subject_distance)


def _polar(points: Floats) -> tuple[Floats, Floats, Floats]:
    """Angles (...) off the axis, distances (...), and unit vectors (..., 2) across the axis."""
    across = np.hypot(points[..., 0], points[..., 1])
    safe = np.where(across > 0.0, across, 1.0)[..., None]
    outward = np.where(across[..., None] > 0.0, points[..., :2] / safe, (1.0, 0.0))
    return np.arctan2(across, points[..., 2]), np.hypot(across, points[..., 2]), outward


def _directed(angle: Floats, outward: Floats) -> Floats:
    """Unit vectors (..., 3)."""
    return np.concatenate((outward * np.sin(angle)[..., None], np.cos(angle)[..., None]), axis=-1)
