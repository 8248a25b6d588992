"""A vehicle on UDP that falls silent while views are open: no view shows an old value as new."""

import json
import signal

import pytest

from tests.outside import until
from tests.shoal.console.operator_page import OperatorPage, operator_page
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
pytestmark = pytest.mark.heavy


def posted(page: OperatorPage, path: str, **words: object) -> dict:
    status, content, _ = page.request("POST", path, {"vehicle": NAME, **words})
    assert status == 200, content
    return json.loads(content)


def age_of_picture(page: OperatorPage) -> float | None:
    return next((each["age"] for each in page.get(f"/api/cameras?vehicle={NAME}").get("cameras", [])), None)


def test_each_view_shows_the_age_of_what_it_has(tmp_path):
    camera = ("-p", "Simulation,Camera", "--set", "Vision.FisheyeCamera:Save Images=false")
    with running(tmp_path, *camera, network="udp") as vehicle, operator_page() as page:
        page.log_in()
        until(lambda: age_of_picture(page) is not None, told=lambda: page.get(f"/api/cameras?vehicle={NAME}"))
        until(lambda: "green" in {each["color"] for each in posted(page, "/api/checks")["checks"]}, every=0.5)
        assert posted(page, "/api/forecast", horizon=20)["ok"]
        vehicle.popen.send_signal(signal.SIGSTOP)
        try:
            until(lambda: (age_of_picture(page) or 0.0) > 6.0, every=0.2)
            answer = posted(page, "/api/checks")
            assert "green" not in {each["color"] for each in answer["checks"]}, answer
            assert answer["text"].startswith("NOT READY")
            assert page.get(f"/api/forecast?vehicle={NAME}")["text"].startswith("no message of the vehicle for ")
            assert page.get(f"/api/limits?vehicle={NAME}")["ok"] is False
            assert page.get("/api/logs")["ok"]  # those of this computer
        finally:
            vehicle.popen.send_signal(signal.SIGCONT)
        until(lambda: (age_of_picture(page) or 99.0) < 3.0, every=0.2)
        until(lambda: "green" in {each["color"] for each in posted(page, "/api/checks")["checks"]}, every=0.5)
