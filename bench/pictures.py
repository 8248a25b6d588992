"""Draws the picture of a run in the README: `python bench/pictures.py docs/images`."""

import io
import os
import re
import sys
import tempfile
from pathlib import Path

from rich.console import Console

from runtime.kernel import ScaledClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.cli.status import Status

COMMAND = "shoal run lauv-noptilus-1 -p Simulation --clock 20x"
SECONDS = 300.0  # of the vehicle


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


if __name__ == "__main__":
    draw_run(Path(sys.argv[1]).resolve() / "run.svg")
