"""Draws the pictures of the README, of a run and of the fisheye camera: `python bench/pictures.py docs/images`."""

import io
import math
import os
import re
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image
from rich.console import Console

from runtime.kernel import ScaledClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.cli.status import Status
from world.optics import FisheyeCamera, preset_lens
from world.pictures import Camera, Standpoint

COMMAND = "shoal run lauv-noptilus-1 -p Simulation --clock 20x"
SECONDS = 300.0  # of the vehicle
SIZE, GAP = 396, 28  # px
MUGS = ((2.5, 1.0), (0.5, -0.5), (-1.5, 2.0))
FISHEYES = (
    ("Seabed", Standpoint(0.0, 0.0, 3.0, depth=8.0, roll=math.radians(38), yaw=math.radians(20))),
    ("Sea Surface", Standpoint(0.0, 0.0, 7.0, roll=math.radians(-28), pitch=math.radians(8))),
)


def draw_run(path: Path) -> None:
    """The panel of a run, in a terminal of 100 columns."""
    os.environ["COLUMNS"] = "104"
    profile = load_profile("lauv-noptilus-1")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        vehicle = build(profile, profile.select("Simulation"), clock=ScaledClock(20.0)).vehicle
        with Status(vehicle, "lauv-noptilus-1 (Simulation)", None) as status:
            vehicle.start()
            vehicle.run(SECONDS)
            status._refresh()
            console = Console(record=True, width=100, file=io.StringIO())
            console.print(status._panel())
        vehicle.close()
    picture = console.export_svg(title=COMMAND)
    # Without the fonts and the comment that Rich adds, so that the picture loads nothing from elsewhere.
    picture = re.sub(r"\s*<!-- Generated.*?-->|\s*@font-face {.*?}", "", picture, flags=re.DOTALL)
    path.write_text(picture.replace("Fira Code", "DejaVu Sans Mono"))


def draw_fisheye(path: Path) -> None:
    """What the camera of a tilted vehicle sees under water and above it, beside each other."""
    optics = FisheyeCamera.square(preset_lens("equidistant", math.pi), 2 * SIZE)
    sheet = Image.new("RGBA", (2 * SIZE + GAP, SIZE))
    for place, (scene, pose) in enumerate(FISHEYES):
        camera = Camera(optics, 1024, interpolation="bilinear", scene=scene, mugs=MUGS)
        picture = Image.fromarray(np.ascontiguousarray(camera.picture(pose)))
        sheet.paste(picture.resize((SIZE, SIZE), Image.Resampling.LANCZOS), (place * (SIZE + GAP), 0))
    sheet.save(path, optimize=True)


if __name__ == "__main__":
    folder = Path(sys.argv[1]).resolve()
    draw_fisheye(folder / "fisheye.png")
    draw_run(folder / "run.svg")
