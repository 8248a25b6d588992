"""Cameras on the page in a real browser: those of a shipped vehicle, of a log, and one that sends damaged pictures."""

import json
import subprocess
import sys

import pytest

import imc
from support.picture_headers import read_picture_header
from tests.outside import until
from tests.shoal.console.browser import browser
from tests.shoal.console.cameras.sent_pictures import CameraRadio, first_messages, from_vehicle, jpeg, picture, state
from tests.shoal.console.operator_page import operator_page, vehicle_page
from tests.shoal.console.page_of_nobody import served_page

pytestmark = pytest.mark.browser
NAME = "lauv-noptilus-1"
IMAGE = "document.querySelector('#cameras img')"
PIXELS = f"""(() => {{
  const image = {IMAGE};
  if (!image?.naturalWidth) return null;
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [16, 16];
  const context = canvas.getContext("2d");
  context.drawImage(image, 0, 0, 16, 16);
  return Array.from(context.getImageData(0, 0, 16, 16).data).join();
}})()"""
CIRCLE = "['cx', 'cy'].map((name) => document.querySelector('#cameras circle')[name].baseVal.value)"


def told(page):
    return page.text("#cameras figcaption span")


def test_pictures_of_a_shipped_vehicle_change_and_are_saved(tmp_path):
    (tmp_path / "vehicle").mkdir()
    words = ("-p", "Simulation,Camera,Detector", "--set", "Vision.FisheyeCamera:Save Images=false")
    with vehicle_page(tmp_path / "vehicle", *words) as vehicle, browser(tmp_path / "browser") as page:
        page.set_size(1280, 800)
        page.open(vehicle.link)
        until(lambda: page.run("document.querySelector('#vehicle').value") == NAME, 60.0)
        page.press("[data-view=cameras]")
        until(lambda: page.run(PIXELS), 60.0, told=lambda: page.text("#cameras-view"))
        first = page.run(PIXELS)
        assert page.run(f"[{IMAGE}.naturalWidth, {IMAGE}.naturalHeight]") == [512, 512]
        assert page.text("#cameras strong") == "Fisheye Camera"
        until(lambda: page.run(PIXELS) != first, 60.0)
        until(lambda: "MUG Detector" in page.text("#cameras svg"), 60.0)
        assert all(150 < place < 360 for place in page.run(CIRCLE))
        page.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path / "saved"))
        page.press("#cameras figcaption a")
        until(lambda: list((tmp_path / "saved").glob("*.jpg")))
        (saved,) = (tmp_path / "saved").iterdir()
        assert saved.name.startswith(f"{NAME}_Fisheye_Camera_20")
        until(lambda: read_picture_header(saved.read_bytes())[1:3] == (512, 512))
        page.set_size(360, 740)
        assert page.run("document.documentElement.scrollWidth") <= 360
        page.run("document.querySelector('#cameras-marks').click()")
        until(lambda: page.text("#cameras svg") == "")
        assert page.errors == []


def test_photos_of_a_log_are_shown_at_its_time(tmp_path):
    command = [sys.executable, "-m", "shoal.cli", "run", NAME, "-p", "Simulation,Camera,Detector", "--clock", "virtual"]
    subprocess.run([*command, "--for", "12", "--log-dir", str(tmp_path / "log")], check=True, capture_output=True)
    (_, dive) = sorted((tmp_path / "log").glob("*/*/*"))
    photos = sorted((dive / "Photos").glob("*.png"))
    photos[-1].write_bytes(photos[-1].read_bytes()[:3000])
    with operator_page(str(dive)) as console, browser(tmp_path / "browser") as page:
        page.set_size(1280, 800)
        page.open(console.link)
        until(lambda: page.text("#replay-clock").startswith("00:00:00"), 30.0)
        page.press("[data-view=cameras]")
        until(
            lambda: "no picture yet" in told(page) or "512 × 512" in told(page), told=lambda: page.text("#cameras-view")
        )
        move(page, 3.5)
        until(lambda: "512 × 512" in told(page), told=lambda: told(page))
        first = page.run(PIXELS)
        until(lambda: "MUG Detector" in page.text("#cameras svg"))
        move(page, 4.5)
        until(lambda: page.run(PIXELS) != first)
        assert "NOT LIVE" not in told(page)
        move(page, 60.0)
        until(lambda: f"{photos[-1].name}: a PNG without its end" in told(page), told=lambda: told(page))
        assert page.errors == []


def move(page, seconds):
    body = json.dumps({"position": seconds, "playing": False})
    page.run(f"fetch('/api/replay', {{ method: 'POST', body: {json.dumps(body)} }}).then((answer) => answer.status)")


def test_what_the_browser_cannot_decode_is_named_and_old_pictures_are_not_live(tmp_path):
    radio = CameraRadio()
    with served_page(radio) as console, browser(tmp_path / "browser") as page:
        page.open(console.server.login_link())
        chosen = "document.querySelector('#vehicle').value"
        until(lambda: radio.bring_soon(*first_messages()) or page.run(chosen) == NAME)
        page.press("[data-view=cameras]")
        hostile = "<img src=x onerror=window.bad=1>"
        labels = from_vehicle(imc.EntityList, 0.5, 0, op=imc.EntityList.Op.REPORT, list=f"{hostile}=7;Detector=8")
        radio.bring_soon(labels, picture(1.0), state(1.0))
        until(lambda: page.run(PIXELS))
        assert (page.text("#cameras strong"), page.run("window.bad ?? null")) == (hostile, None)
        good = page.run(PIXELS)
        data = jpeg(2.0)
        sampling = data.index(b"\xff\xc0") + 11
        broken = data[:sampling] + b"\xff" + data[sampling + 1 :]  # 15 x 15 blocks at once: nothing can be decoded
        radio.bring_soon(picture(2.0, broken))
        until(lambda: "a damaged picture" in told(page), told=lambda: told(page))
        assert page.run(PIXELS) == good
        radio.bring_soon(state(50.0))
        until(lambda: "NOT LIVE" in told(page), told=lambda: told(page))
        radio.bring_soon(picture(51.0, color=(200, 10, 10)), state(51.0))
        until(lambda: page.run(PIXELS) != good and "damaged" not in told(page), told=lambda: told(page))
        assert page.errors == []
