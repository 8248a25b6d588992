"""Measures the fisheye camera: assembling pictures, compared with OpenCV, rendering scenes, and the first picture.

Figures are the best processor time of one thread; the methods run alternately, so that the ratios are fair.
"""

import importlib.util
import math
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from world.optics import FisheyeModel, preset_lens
from world.rendering import Glider, SceneCamera, ScenePose
from world.rendering.cube_faces import stack_faces
from world.rendering.remap_interpolation import BilinearResampler, NearestResampler, OpencvResampler
from world.rendering.remap_table import RemapTable
from world.rendering.renderer import Renderer
from world.rendering.scenes import make_scene

LONGEST_START = 0.3  # s
FIRST = "first"  # argument of a process of its own, before the width of its faces
LEAST_RATIOS = {"nearest": 1.2, "bilinear": 0.2}
CASES = ((512, 1024, 180.0), (1024, 1024, 180.0), (512, 2048, 180.0), (1024, 2048, 180.0), (512, 1024, 220.0))
POSES = (
    ("Seabed", ScenePose(0.0, 0.0, 5.0, 10.0)),
    ("Seabed", ScenePose(0.0, 0.0, 5.0, 8.0, roll=math.radians(20))),
    ("Sea Surface", ScenePose(0.0, 0.0, 10.0)),
    ("Sea Surface", ScenePose(0.0, 0.0, 10.0, roll=math.radians(20))),
)


def best(methods: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Least processor time of each in s."""
    times = dict.fromkeys(methods, math.inf)
    for _ in range(rounds):
        for name, method in methods.items():
            start = time.process_time_ns()
            method()
            times[name] = min(times[name], (time.process_time_ns() - start) / 1e9)
    return times


def remap_nearest(lookup: RemapTable) -> Callable[[np.ndarray], np.ndarray]:
    """OpenCV's nearest neighbor, with fixed-point maps, its fastest way."""
    import cv2

    floats = OpencvResampler(lookup)
    maps = cv2.convertMaps(floats.x, floats.y, cv2.CV_16SC2, nninterpolation=True)
    width = lookup.face_width
    return lambda atlas: cv2.remap(atlas[:-1].view(np.uint8).reshape(-1, width, 4), *maps, cv2.INTER_NEAREST)


def assembling(rounds: int) -> bool:
    """Prints the table; False if a ratio to OpenCV is below its limit."""
    with_opencv = importlib.util.find_spec("cv2") is not None
    if with_opencv:
        import cv2

        cv2.setNumThreads(1)
    good = True
    random = np.random.default_rng(1)
    print("faces -> picture, field of view   method            ms    fps   of OpenCV's speed")
    for width, size, fov in CASES:
        lookup = RemapTable(FisheyeModel.from_lens(preset_lens("equidistant", math.radians(fov)), size), width)
        atlas = stack_faces(list(random.integers(0, 256, (5, width, width, 4), dtype=np.uint8)))
        samplers = {"nearest": NearestResampler(lookup), "bilinear": BilinearResampler(lookup)}
        if with_opencv:
            samplers |= {"OpenCV nearest": remap_nearest(lookup), "OpenCV bilinear": OpencvResampler(lookup)}
        times = best({name: partial(s, atlas) for name, s in samplers.items()}, rounds)
        for name, seconds in times.items():
            ratio = times.get(f"OpenCV {name}", math.nan) / seconds
            good &= not ratio < LEAST_RATIOS.get(name, 0.0)
            shown = f"{ratio:8.2f} (at least {LEAST_RATIOS[name]})" if ratio == ratio else ""
            print(f"{width:5d} -> {size:4d}, {fov:3.0f}°    {name:20s} {seconds * 1e3:8.2f} {1 / seconds:6.0f} {shown}")
    return good


def rendering(rounds: int) -> None:
    lookup = RemapTable(FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 1024), 512)
    print("\nfive faces of 512 px, two gliders                 all rows       rows of 180°")
    gliders = Glider(1.0, 0.3), Glider(3.0, -2.0)
    for scene, pose in POSES:
        around = make_scene(scene, 0.0, 1)
        views = {name: Renderer(around, 512, 5, rows) for name, rows in (("all", ()), ("some", lookup.rows))}
        times = best({name: partial(v.render, pose, gliders) for name, v in views.items()}, rounds)
        columns = "   ".join(f"{t * 1e3:5.1f} ms {1 / t:4.0f} fps" for t in times.values())
        print(f"{scene:12s} {pose.height:3.0f} m, roll {math.degrees(pose.roll):3.0f}°                {columns}")


def in_the_water(rounds: int) -> None:
    """Prints what caustics and marine snow cost a whole picture of 512 px, five faces of 256 px."""
    optics, pose = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 512), ScenePose(0.0, 0.0, 3.0, 6.0)
    cameras = {"clear": SceneCamera(optics, 256), "with 300 flakes per m³": SceneCamera(optics, 256, marine_snow=300.0)}
    cameras["with caustics"] = SceneCamera(optics, 256, caustics=1.0)
    times = best({name: partial(camera.take_picture, pose) for name, camera in cameras.items()}, rounds)
    print("\n" + ", ".join(f"{name} {seconds * 1e3:.1f} ms" for name, seconds in times.items()))


def first(face: int) -> float:
    """Processor time from making a camera to its first picture in s; later ones in this process find its textures."""
    start = time.process_time_ns()
    camera = SceneCamera(FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 1024), face)
    camera.take_picture(ScenePose(0.0, 0.0, 5.0, 8.0, roll=math.radians(20)))
    return (time.process_time_ns() - start) / 1e9


def beginning(rounds: int) -> bool:
    """Prints the time of the first picture of a process; False if it is too long."""
    times = {512: math.inf, 1024: math.inf}
    for _ in range(rounds):
        for width, least in times.items():
            alone = [sys.executable, __file__, FIRST, str(width)]
            times[width] = min(least, float(subprocess.run(alone, check=True, capture_output=True).stdout))
    for width, seconds in times.items():
        print(f"first picture of 1024 px, five faces of {width:4d} px: {seconds:6.3f} s (at most {LONGEST_START})")
    return max(times.values()) <= LONGEST_START


def main() -> int:
    if sys.argv[1:2] == [FIRST]:
        print(first(int(sys.argv[2])))
        return 0
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    good = assembling(rounds)
    rendering(rounds)
    in_the_water(rounds)
    good &= beginning(min(rounds, 10))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
