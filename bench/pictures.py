"""Draws the pictures of README and docs, of a run and of cameras: `python bench/pictures.py docs/images`."""

import io
import math
import os
import re
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from rich.console import Console

from runtime.kernel import ScaledClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.cli.status_display import StatusDisplay
from support.pose import Pose
from world import Sun
from world.optics import DoubleSphereModel, FisheyeModel, PinholeModel, kannala_brandt_lens, preset_lens
from world.rendering import Board, Glider, Lamp, SceneCamera, ScenePose, chessboard_cells

COMMAND = "shoal run lauv-noptilus-1 -p Simulation --clock 20x"
SECONDS = 300.0  # of the vehicle
SIZE, GAP = 396, 28  # px
MUGS = ((2.5, 1.0), (0.5, -0.5), (-1.5, 2.0))
WATERS, TILE = ("I", "II", "1C", "3C", "5C"), 150  # Jerlov types; px
FISHEYES = (
    ("Seabed", ScenePose(0.0, 0.0, 3.0, depth=8.0, roll=math.radians(38), yaw=math.radians(20))),
    ("Sea Surface", ScenePose(0.0, 0.0, 7.0, roll=math.radians(-28), pitch=math.radians(8))),
)

VIEW, CAPTION = 196, 20  # px
PINHOLE = PinholeModel(VIEW, VIEW, fx=150.0, fy=150.0, cx=VIEW / 2, cy=VIEW / 2)
MODELS = {
    "pinhole": PINHOLE,
    "Brown-Conrady": PinholeModel(VIEW, VIEW, fx=150.0, fy=150.0, cx=VIEW / 2, cy=VIEW / 2, k1=-0.18, k2=0.03),
    "Kannala-Brandt": FisheyeModel.from_lens(kannala_brandt_lens((0.03, -0.02, 0.0, 0.0), math.pi), VIEW),
    "quartic": FisheyeModel.from_lens(preset_lens("tumvi_195", math.pi), VIEW),
    "double sphere": DoubleSphereModel(VIEW, VIEW, fx=75.0, fy=75.0, cx=VIEW / 2, cy=VIEW / 2, xi=-0.2, alpha=0.6),
}
DOWN = Pose(theta=math.radians(-90))
SIGNS = {
    "looks down, bow up": (DOWN, {}),
    "roll 15°": (DOWN, {"roll": math.radians(15)}),
    "pitch 15°": (DOWN, {"pitch": math.radians(15)}),
    "yaw 15°": (DOWN, {"yaw": math.radians(15)}),
    "looks forward": (Pose(), {"height": 0.8, "north": -2.0}),
}


def draw_run(path: Path) -> None:
    """The panel of a run, in a terminal of 100 columns."""
    os.environ["COLUMNS"] = "104"
    profile = load_profile("lauv-noptilus-1")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        vehicle = build(profile, profile.parse_modes("Simulation"), clock=ScaledClock(20.0)).vehicle
        with StatusDisplay(vehicle, "lauv-noptilus-1 (Simulation)", None) as status:
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
    """Draw the views of the camera of a tilted vehicle under water and above it, beside each other."""
    optics = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 2 * SIZE)
    sheet = Image.new("RGBA", (2 * SIZE + GAP, SIZE))
    for place, (scene, pose) in enumerate(FISHEYES):
        camera = SceneCamera(optics, 1024, interpolation="bilinear", scene=scene, glider_positions=MUGS)
        picture = Image.fromarray(np.ascontiguousarray(camera.take_picture(pose)))
        sheet.paste(picture.resize((SIZE, SIZE), Image.Resampling.LANCZOS), (place * (SIZE + GAP), 0))
    sheet.save(path, optimize=True)


def draw_cameras(path: Path) -> None:
    """One place by each model; then what the signs of angles and mounts mean."""
    views = [(caption, optics, DOWN, {}) for caption, optics in MODELS.items()]
    views += [(caption, PINHOLE, mount, turned) for caption, (mount, turned) in SIGNS.items()]
    gliders = [Glider(1.0, 0.3, heading=0.3), Glider(-0.8, -0.7, heading=2.4)]
    board = Board(chessboard_cells(6, 9), cell_size=0.07, north=0.0, east=0.0)
    step, font = VIEW + 8, ImageFont.load_default(size=13)
    sheet = Image.new("RGB", (len(MODELS) * step - 8, 2 * (VIEW + CAPTION)), "white")
    pen = ImageDraw.Draw(sheet)
    for place, (caption, optics, mount, turned) in enumerate(views):
        camera = SceneCamera(optics, 1024, faces=6, mount=mount, interpolation="bilinear")
        here = ScenePose(**{"north": 0.0, "east": 0.0, "height": 2.0, "depth": 5.0, **turned})
        picture = Image.fromarray(camera.take_picture(here, gliders, [board]))
        row, column = divmod(place, len(MODELS))
        corner = column * step, row * (VIEW + CAPTION)
        sheet.paste(picture, corner, mask=picture)
        pen.text((corner[0] + VIEW / 2, corner[1] + VIEW + 2), caption, "#333", font, anchor="ma")
    sheet.save(path, quality=90)


def draw_water(path: Path) -> None:
    """A seabed in waters of Jerlov, by day and at night in the light of two lamps."""
    optics = FisheyeModel.from_lens(preset_lens("equidistant", math.radians(150)), 2 * TILE)
    lamps = tuple(Lamp(Pose(0.5, side, 0.0, 0.0, math.radians(-60)), 3000.0, math.radians(70)) for side in (-0.4, 0.4))
    lights = ((Sun(), ()), (Sun(elevation=math.radians(-30)), lamps))
    sheet = Image.new("RGBA", (len(WATERS) * TILE, len(lights) * TILE))
    for column, water in enumerate(WATERS):
        for row, (sun, lit) in enumerate(lights):
            camera = SceneCamera(
                optics, 512, glider_positions=MUGS, water=water, sun=sun, lamps=lit, interpolation="bilinear"
            )
            picture = Image.fromarray(camera.take_picture(ScenePose(0.0, 0.0, 1.8, depth=6.0, pitch=0.2)))
            sheet.paste(picture.resize((TILE, TILE), Image.Resampling.LANCZOS), (column * TILE, row * TILE))
    paper = Image.new("RGB", sheet.size, "white")
    paper.paste(sheet, mask=sheet)
    paper.save(path, quality=85)


if __name__ == "__main__":
    folder = Path(sys.argv[1]).resolve()
    draw_fisheye(folder / "fisheye.png")
    draw_cameras(folder / "cameras.jpg")
    draw_water(folder / "water.jpg")
    draw_run(folder / "run.svg")
