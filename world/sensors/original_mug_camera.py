"""The geometry of the first MUGDetectionCamera (TTK22 project, NTNU), as its author wrote it.

Kept for comparison, with its flaws: the camera frame is rotated by twice the heading, the footprint is compared with
north and east instead of the image's sides, attitude is ignored, pixels are truncated toward the center.
"""

import math

from world.optics import FieldOfViewCamera

ALTITUDE = 10.0  # m, at any altitude of the vehicle
FROZEN = (-0.736924425, -0.082699736)  # share of the bound: the original seeded its generator again for every detection


def is_visible(camera: FieldOfViewCamera, altitude: float, north: float, east: float) -> bool:
    """Whether a target (m, from the vehicle) counts as seen."""
    return abs(north) < abs(altitude * math.tan(0.5 * camera.horizontal)) and abs(east) < abs(
        altitude * math.tan(0.5 * camera.vertical)
    )


def to_pixel(camera: FieldOfViewCamera, altitude: float, psi: float, north: float, east: float) -> tuple[int, int]:
    """Pixel of a target at `north`, `east` (m) of a vehicle with heading `psi` (rad)."""
    x = north * math.sin(psi) + east * math.cos(psi)
    y = -north * math.cos(psi) + east * math.sin(psi)
    wide, high = _footprint(camera, altitude)
    return (
        math.trunc(x / wide * camera.width) + camera.width // 2,
        math.trunc(y / high * camera.height) + camera.height // 2,
    )


def to_offset(camera: FieldOfViewCamera, altitude: float, psi: float, u: int, v: int) -> tuple[float, float]:
    """North and east (m, from the vehicle) of a pixel."""
    wide, high = _footprint(camera, altitude)
    x = wide / camera.width * (u - camera.width // 2)
    y = high / camera.height * (v - camera.height // 2)
    return -y * math.cos(psi) + x * math.sin(psi), y * math.sin(psi) + x * math.cos(psi)


def error_bound(camera: FieldOfViewCamera, altitude: float) -> tuple[float, float]:
    """Largest error (m) north and east: half a meter at 10 m and 1000 px."""
    return altitude * camera.width / 2e4, altitude * camera.height / 2e4


def _footprint(camera: FieldOfViewCamera, altitude: float) -> tuple[float, float]:
    return (
        2.0 * abs(altitude) * math.tan(0.5 * camera.horizontal),
        2.0 * abs(altitude) * math.tan(0.5 * camera.vertical),
    )
