"""Every shipped vehicle has a camera in the mode Camera."""

import gzip

import pytest
from PIL import Image

from runtime import Frame
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.vision.cameras.rendered_camera import RenderedCameraTask


@pytest.mark.parametrize("name", ["lauv-noptilus-1", "otter", "caravel", "hexa-00"])
def test_the_mode_camera_takes_pictures_of_what_is_below(name, tmp_path):
    profile = load_profile(name, overrides=["Vision.FisheyeCamera:Size=64", "Vision.FisheyeCamera:Face Size=32"])
    selected = profile.parse_modes("Simulation, Camera")
    vehicle = build(profile, selected, clock=VirtualClock(profile.start_time_ns), log_root=tmp_path).vehicle
    vehicle.start()
    vehicle.run(8.0)
    vehicle.close()
    pictures = sorted(tmp_path.rglob("Photos/*.png"))
    assert len(pictures) >= 3
    with Image.open(pictures[-1]) as picture:
        assert picture.size == (64, 64)
        assert len(picture.getcolors(64 * 64) or []) > 100  # neither black nor one color


def test_a_second_run_of_the_same_moment_has_its_pictures_beside_its_own_log(tmp_path):
    for _ in range(2):
        profile = load_profile("otter", overrides=["Vision.FisheyeCamera:Size=32", "Vision.FisheyeCamera:Face Size=16"])
        made = build(
            profile,
            profile.parse_modes("Simulation, Camera"),
            clock=VirtualClock(profile.start_time_ns),
            log_root=tmp_path,
        )
        made.vehicle.start()
        made.vehicle.run(3.0)
        made.vehicle.close()
    logs = sorted(path.parent for path in tmp_path.rglob("Data.lsf.gz") if not path.parent.name.endswith("_2"))
    assert logs
    for log in logs:
        again = log.with_name(f"{log.name}_2")
        assert names(log) == names(again)
        assert gzip.decompress((log / "Data.lsf.gz").read_bytes()) == gzip.decompress(
            (again / "Data.lsf.gz").read_bytes()
        )
    assert sum(len(names(log)) for log in logs) >= 2


def names(log):
    return sorted(path.name for path in log.glob("Photos/*.png"))


@pytest.mark.parametrize(("name", "scene"), [("lauv-noptilus-1", "Seabed"), ("hexa-00", "Sea Surface")])
def test_all_cameras_of_a_vehicle_see_what_is_below_it(name, scene, tmp_path):
    profile = load_profile(name)
    selected = profile.parse_modes("Simulation, Camera, Stereo")
    clock = VirtualClock(profile.start_time_ns)
    vehicle = build(profile, selected, clock=clock, log_root=tmp_path).vehicle
    assert [task.scene for task in vehicle.tasks if isinstance(task, RenderedCameraTask)] == [scene] * 3
    vehicle.close()


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("water", ["Water Type=9C", "Water Visibility=3"])
def test_the_water_of_the_world_is_that_of_shipped_cameras(water, tmp_path):
    def means(*overrides):
        loaded = load_profile("lauv-noptilus-1", overrides=["Vision.FisheyeCamera:Size=32", *overrides])
        modes = loaded.parse_modes("Simulation, Camera, Stereo")
        vehicle = build(loaded, modes, clock=VirtualClock(loaded.start_time_ns), log_root=tmp_path).vehicle
        found = {}
        vehicle.observe(Frame, lambda frame: found.update({frame.camera: frame.image[..., 0].mean()}))
        vehicle.start()
        vehicle.run(8.0)
        vehicle.close()
        return found

    clear, murky = means(), means(f"World:{water}")
    assert len(clear) == 3
    assert all(murky[camera] < 0.7 * red for camera, red in clear.items())
