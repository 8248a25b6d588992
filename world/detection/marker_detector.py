"""Finds ArUco and AprilTag markers in a picture, with OpenCV."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from world.detection.blob_detector import ImageDetection

MARKER_FAMILIES = ("4X4_50", "5X5_100", "6X6_250", "APRILTAG_16h5", "APRILTAG_25h9", "APRILTAG_36h11")


@dataclass(frozen=True)
class MarkerDetector:
    """Finds the markers of a family, one of FAMILIES. Raises ImportError without OpenCV."""

    family: str = MARKER_FAMILIES[0]

    def detect(self, image: NDArray[np.uint8]) -> list[ImageDetection]:
        """The markers in an RGBA picture (height, width, 4), by number; their middle is where their diagonals meet."""
        cv2, detector = self._opencv
        corners, numbers, _ = detector.detectMarkers(cv2.cvtColor(image, cv2.COLOR_RGBA2GRAY))
        if numbers is None:
            return []
        found = [
            (int(number), np.asarray(square, np.float64).reshape(4, 2))
            for number, square in zip(np.asarray(numbers).reshape(-1), corners, strict=True)
        ]
        marks: list[ImageDetection] = []
        for number, square in sorted(found, key=lambda item: item[0]):
            u, v = (_crossing(square) + 0.5).tolist()  # OpenCV's first pixel has its middle at 0, not at 0.5
            marks.append(ImageDetection(u, v, _area(square), marker=number))
        return marks

    @cached_property
    def _opencv(self) -> tuple[Any, Any]:
        import cv2

        vision: Any = cv2
        kind = vision.aruco.getPredefinedDictionary(getattr(vision.aruco, f"DICT_{self.family}"))
        wanted = vision.aruco.DetectorParameters()
        wanted.cornerRefinementMethod = vision.aruco.CORNER_REFINE_SUBPIX
        return vision, vision.aruco.ArucoDetector(kind, wanted)


def _crossing(square: NDArray[np.float64]) -> NDArray[np.float64]:
    """Intersection of the diagonals of a square (4, 2), seen at any angle."""
    first, second = square[2] - square[0], square[3] - square[1]
    across = first[0] * second[1] - first[1] * second[0]
    to = square[1] - square[0]
    return square[0] + first * (to[0] * second[1] - to[1] * second[0]) / across


def _area(square: NDArray[np.float64]) -> float:
    """Area (px²) of a polygon (n, 2)."""
    x, y = square.T
    return 0.5 * abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))))
