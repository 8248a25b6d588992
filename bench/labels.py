"""Measures labels of fisheye pictures beside the pictures themselves.

Figures are the best processor time of one thread; picture and labels alternate, so that their ratio is fair.
"""

import math
import sys
from functools import partial

from fisheye import best

from runtime.profile import load_profile
from world import read_world
from world.optics import FisheyeModel, preset_lens
from world.rendering import Glider, SceneCamera, ScenePose

LEAST_FPS = 40.0  # five faces of 256 px, a fisheye picture of 512 px, depth and instances
LEAST_PICTURES = 60.0  # the same without labels, over a bathymetry
CASES = ((256, 512), (512, 1024))
GLIDERS = Glider(1.0, 0.3, id=1), Glider(3.0, -2.0, id=2), Glider(-1.5, 2.0, 0.4, 1.0, id=3)
VIEWS = (
    ("Seabed", ScenePose(0.0, 0.0, 5.0, 8.0, roll=math.radians(20))),
    ("Sea Surface", ScenePose(0.0, 0.0, 10.0, roll=math.radians(20))),
)


def main() -> int:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    good = True
    print("180°, three gliders         picture    labels   with flow    both, fps   labels / picture")
    for face, size in CASES:
        optics = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), size)
        for scene, pose in VIEWS:
            camera = SceneCamera(optics, face, scene=scene)
            times = best(
                {
                    "picture": partial(camera.take_picture, pose, GLIDERS),
                    "labels": partial(camera.labels, pose, GLIDERS),
                    "flow": partial(camera.labels, pose, GLIDERS, (pose, GLIDERS)),
                },
                rounds,
            )
            picture, labels, flow = (times[name] for name in ("picture", "labels", "flow"))
            fps = 1.0 / (picture + labels)
            good &= size > 512 or fps >= LEAST_FPS
            least = f" (at least {LEAST_FPS:.0f})" if size <= 512 else ""
            columns = f"{picture * 1e3:6.1f} ms {labels * 1e3:6.1f} ms {flow * 1e3:8.1f} ms {fps:10.0f}{least:14s}"
            print(f"{face:4d} -> {size:4d}  {scene:12s} {columns} {labels / picture:5.2f}")
    good &= harbor(rounds)
    return 0 if good else 1


def harbor(rounds: int) -> bool:
    """Prints figures over the bathymetry of a shipped profile; False if pictures, or with labels, are too slow."""
    sea = read_world(load_profile("lauv-noptilus-1").value).seabed
    assert sea is not None
    optics = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 512)
    pose = ScenePose(20.0, 30.0, sea.depth(20.0, 30.0) - 2.0, 2.0, roll=math.radians(20))
    lying = [
        glider._replace(north=20.0 + glider.north, east=30.0 + glider.east, height=glider.height) for glider in GLIDERS
    ]
    plane, relief = SceneCamera(optics, 256), SceneCamera(optics, 256, seabed=sea)
    times = best(
        {
            "plane": partial(plane.take_picture, pose, lying),
            "picture": partial(relief.take_picture, pose, lying),
            "labels": partial(relief.labels, pose, lying),
        },
        rounds,
    )
    flat, picture, labels = (times[name] for name in ("plane", "picture", "labels"))
    fps = 1.0 / (picture + labels)
    columns = f"{picture * 1e3:6.1f} ms {labels * 1e3:6.1f} ms {'':11s} {fps:10.0f} (at least {LEAST_FPS:.0f})"
    print(f" 256 ->  512  bathymetry   {columns}")
    print(f"pictures: {1.0 / picture:.0f} fps (at least {LEAST_PICTURES:.0f}), {1.0 / flat:.0f} over a plane")
    return 1.0 / picture >= LEAST_PICTURES and fps >= LEAST_FPS


if __name__ == "__main__":
    sys.exit(main())
