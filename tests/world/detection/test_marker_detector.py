"""Markers are found where they are, and tell their numbers."""

import numpy as np
import pytest

from world.detection import MARKER_FAMILIES, MarkerDetector

cv2 = pytest.importorskip("cv2")
CORNERS = np.array([[210.0, 120.0], [300.0, 130.0], [290.0, 215.0], [205.0, 200.0]])


@pytest.mark.parametrize("family", MARKER_FAMILIES)
def test_a_marker_that_is_seen_askew(family):
    kind = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{family}"))
    marker = cv2.aruco.generateImageMarker(kind, 7, 200)
    flat = np.array([[0.0, 0.0], [200.0, 0.0], [200.0, 200.0], [0.0, 200.0]])
    # OpenCV's pixels begin half a pixel earlier than ours
    turn = cv2.getPerspectiveTransform((flat - 0.5).astype(np.float32), (CORNERS - 0.5).astype(np.float32))
    gray = cv2.warpPerspective(marker, turn, (480, 360), borderValue=210)
    image = np.dstack([gray, gray, gray, np.full_like(gray, 255)])
    (mark,) = MarkerDetector(family).detect(image)
    middle = turn @ [99.5, 99.5, 1.0]
    assert mark.marker == 7
    assert (mark.u, mark.v) == pytest.approx(middle[:2] / middle[2] + 0.5, abs=0.5)


def test_pictures_without_markers():
    assert MarkerDetector().detect(np.full((60, 60, 4), 128, np.uint8)) == []
