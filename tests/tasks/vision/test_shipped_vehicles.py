"""Every shipped vehicle has a camera in the mode Camera."""

import pytest
from PIL import Image

from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build


@pytest.mark.parametrize("name", ["lauv-noptilus-1", "otter", "caravel", "hexa-00"])
def test_the_mode_camera_takes_pictures_of_what_is_below(name, tmp_path):
    profile = load_profile(name, overrides=["Vision.FisheyeCamera:Size=64", "Vision.FisheyeCamera:Face Size=32"])
    selected = profile.select("Simulation, Camera")
    vehicle = build(profile, selected, clock=VirtualClock(profile.start_time_ns), log_root=tmp_path).vehicle
    vehicle.start()
    vehicle.run(8.0)
    vehicle.close()
    pictures = sorted(tmp_path.rglob("Photos/*.png"))
    assert len(pictures) >= 3
    with Image.open(pictures[-1]) as picture:
        assert picture.size == (64, 64)
        assert len(picture.getcolors(64 * 64) or []) > 100  # neither black nor one color
