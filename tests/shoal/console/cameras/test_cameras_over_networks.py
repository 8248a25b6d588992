"""Pictures of a shipped vehicle's camera over its networks."""

import pytest

from support.picture_headers import read_picture_header
from tests.outside import until
from tests.shoal.console.operator_page import operator_page
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
pytestmark = pytest.mark.heavy


@pytest.mark.parametrize("network", ["zenoh", "udp", "tcp"])
def test_pictures_come_over_each_network(tmp_path, network):
    camera = ("-p", "Simulation,Camera", "--set", "Vision.FisheyeCamera:Save Images=false")
    with running(tmp_path, *camera, network=network), operator_page() as page:
        page.log_in()

        def number():
            found = page.get(f"/api/cameras?vehicle={NAME}").get("cameras", [])
            return next((each["number"] or 0 for each in found), 0)

        until(lambda: number() > 2, told=lambda: page.get(f"/api/cameras?vehicle={NAME}"))
        (camera,) = page.get(f"/api/cameras?vehicle={NAME}")["cameras"]
        assert camera["label"] == "Fisheye Camera"
        address = f"/api/picture?vehicle={NAME}&camera={camera['camera']}"
        answer = page.request("GET", f"{address}&number={camera['number']}")
        assert answer[0] in (200, 204)
        if answer[0] == 200:
            assert read_picture_header(answer[1])[:3] == ("jpeg", 512, 512)
