"""Measures the detector: pictures of 1280 x 960 px with noise, per second of processor time of one thread.

Marks are found, placed on the ground and followed, as the task does; rendering and noise are not counted.
"""

import sys
import time

import numpy as np

from support.pose import DOWN
from world.detection import (
    BlobDetector,
    DetectionAccuracy,
    MarkerDetector,
    PoseOverPlane,
    Tracker,
    TrackerSettings,
    project_to_plane,
)
from world.optics import PinholeModel
from world.rendering import Glider, SceneCamera, ScenePose, optical_to_body_transform

LEAST = 30.0  # per second
OPTICS = PinholeModel(1280, 960, 1000.0, 1000.0, 640.0, 480.0)
PLACES = ((1.0, 0.3), (-2.0, 3.0), (2.5, -4.0))


def main() -> int:
    pictures = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    camera, random = SceneCamera(OPTICS, 640, 6, visibility=30.0), np.random.default_rng(1)
    tracker, mount = (
        Tracker(DetectionAccuracy(), TrackerSettings(least_separation=0.8)),
        optical_to_body_transform(DOWN),
    )
    spent = {"color": 0.0, "tracks": 0.0, "markers": 0.0}
    found = 0
    for k in range(pictures):
        pose = ScenePose(0.1 * k - 1.0, 0.0, 10.0, depth=5.0, time=0.2 * k)
        image = camera.take_picture(pose, [Glider(*place) for place in PLACES])
        grain = random.normal(0.0, 4.0, (960, 1280, 3))
        image[..., :3] = np.clip(np.rint(image[..., :3] + grain), 0, 255)
        begun = time.process_time()
        marks = BlobDetector().detect(image)
        spent["color"] += (now := time.process_time()) - begun
        standing = PoseOverPlane(pose.north, pose.east, pose.height, (0.0, 0.0, 0.0))
        pixels = np.array([(mark.u, mark.v) for mark in marks]).reshape(-1, 2)
        seen = [at for at in project_to_plane(OPTICS, mount, standing, pixels, tracker.accuracy) if at]
        found += len(tracker.update(0.2 * k, standing, seen))
        spent["tracks"] += (begun := time.process_time()) - now
        MarkerDetector().detect(image)
        spent["markers"] += time.process_time() - begun
    for name, seconds in spent.items():
        print(f"{name:8s} {1e3 * seconds / pictures:6.2f} ms {pictures / seconds:8.0f} pictures/s")
    rate = pictures / (spent["color"] + spent["tracks"])
    print(f"color and tracks: {rate:.0f} pictures/s (at least {LEAST:g}), {found} detections in {pictures} pictures")
    return 0 if rate >= LEAST else 1


if __name__ == "__main__":
    sys.exit(main())
