"""Takes the pictures of the page in docs/images: a vehicle is run, and Chromium draws its page.

`python -m docs.screenshots [FOLDER]` in the clone needs the extra `dev` and Chromium. It draws a survey by mouse, tries
it, starts it, and takes pictures while it is carried out.
"""

import io
import sys
import tempfile
from pathlib import Path

from PIL import Image

from tests.outside import until
from tests.shoal.console.browser import Browser, browser
from tests.shoal.console.operator_page import vehicle_page

IMAGES = Path(__file__).parent / "images"
PATIENCE = 120.0  # s
COLORS = 128
LARGEST = 150_000  # bytes
MODES = ("-p", "Simulation,Camera,Detector", "--set", "Vision.FisheyeCamera:Save Images=false")
CORNERS = ((400, 440), (550, 400), (530, 320))  # pixels, of the survey
UNDER_WAY = 30.0  # % of the plan


def main(folder: Path = IMAGES) -> None:
    """Write the pictures into a folder. Raises AssertionError if the page does something else, or one is large."""
    with tempfile.TemporaryDirectory(prefix="shoal-pictures-") as name:
        work = Path(name)
        (work / "vehicle").mkdir()
        with vehicle_page(work / "vehicle", *MODES) as vehicle, browser(work / "browser") as page:
            page.set_size(1280, 800)
            page.open(vehicle.link)
            until(lambda: page.text("#summary").startswith("service"), PATIENCE, told=lambda: page.text("#summary"))
            view(page, "cameras")
            until(
                lambda: "MUG Detector" in page.text("#cameras svg"), PATIENCE, told=lambda: page.text("#cameras-view")
            )
            save(page, folder / "console-cameras.png")
            draw_survey(page)
            try_plan(page)
            save(page, folder / "console-plans.png")
            carry_out(page)
            page.open(vehicle.link.partition("#")[0])  # without what was drawn
            until(lambda: page.text("#summary").startswith("maneuver"), PATIENCE)
            view(page, "plans")
            until(lambda: "harbor" in page.text("#plans"), PATIENCE)
            page.press("#plans li button")  # the map shows the whole plan
            view(page, "map")
            save(page, folder / "console.png")
            page.set_size(360, 740)
            page.set_dark("dark")
            view(page, "health")
            save(page, folder / "console-health.png")


def view(page: Browser, name: str) -> None:
    page.press(f"[data-view={name}]")


def set_value(page: Browser, name: str, value: str) -> None:
    page.run(f"document.getElementById('{name}').value = '{value}'")
    page.run(f"document.getElementById('{name}').dispatchEvent(new Event('change'))")


def draw_survey(page: Browser) -> None:
    """Draw a survey area in the bathymetry, by mouse."""
    view(page, "plans")
    set_value(page, "draw-name", "harbor")
    set_value(page, "draw-depth", "1.5")
    set_value(page, "draw-spacing", "6")
    set_value(page, "draw-kind", "rows")
    page.press("#draw-toggle")
    for x, y in CORNERS:
        page.press_at(x, y)
    page.press("#draw-toggle")
    until(lambda: page.run("document.getElementById('plan-text').value"), PATIENCE)


def try_plan(page: Browser) -> None:
    page.press("#plan-fly")
    until(lambda: "plan completed" in page.text("#fly-result"), PATIENCE, told=lambda: page.text("#fly-result"))
    page.run("document.getElementById('drawn-list').scrollIntoView()")


def carry_out(page: Browser) -> None:
    """Store the plan and start it, and wait until it is under way."""
    page.press("#draw-put")
    until(lambda: "harbor" in page.text("#plans"), PATIENCE, told=lambda: page.text("#result"))
    page.press("#plans li button:nth-of-type(2)")
    progress = "parseFloat(document.getElementById('summary').textContent.match(/([0-9]+) %/)?.[1] ?? 0)"
    until(
        lambda: page.text("#summary").startswith("maneuver") and page.run(progress) >= UNDER_WAY,
        2 * PATIENCE,
        told=lambda: page.text("#summary"),
    )


def save(page: Browser, path: Path) -> None:
    """Save the page without alarms as a PNG file of few colors."""
    page.run("document.getElementById('alarms-acknowledge').click()")  # of a computer that is busy
    page.run("new Promise((done) => setTimeout(done, 1000))")  # the map moves, and plots are drawn
    data = page.picture()
    image = Image.open(io.BytesIO(data)).convert("RGB").quantize(COLORS, dither=Image.Dither.NONE)
    image.save(path, optimize=True)
    assert path.stat().st_size < LARGEST, f"{path}: {path.stat().st_size} bytes"


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
