"""All tasks of a vehicle live in one world: bottom, gliders and water are the same for each of them."""

import math

import numpy as np
import pytest
from lean import UNLOGGED

import imc
from runtime import Frame, ParameterError
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from tasks.simulated_world import WorldFrame, world_of
from tasks.simulators.dvl import DVL
from tasks.simulators.environment import Environment
from tasks.simulators.estimated_state import EstimatedState
from tasks.simulators.mug_detection_camera import MUGDetectionCamera
from tasks.vision.fisheye_camera import FisheyeCamera
from world.rendering.renderer import optical_to_ned_rotation
from world.rendering.scenes import ScenePose

LAT, LON = math.radians(41.185), math.radians(-8.7062)
SLOPE = {
    "Bathymetry": {"Latitude (degrees)": "41.185", "Longitude (degrees)": "-8.7062", "Data": "-20 0 8, 20 0 12"},
    "World": {"Sounding Radius": "200"},
}
MUG_CAMERA = "Simulators.MUGDetectionCamera"


def sailed(folder, seconds, *overrides, modes="Simulation", kinds=(imc.EstimatedMugState, imc.SimulatedState)):
    """The shipped AUV, which circles under water by itself; returns the vehicle, and what it published of `kinds`."""
    profile = load_profile("lauv-noptilus-1", overrides=(UNLOGGED, *overrides))
    vehicle = build(
        profile, profile.parse_modes(modes), clock=VirtualClock(profile.start_time_ns), log_root=folder
    ).vehicle
    heard = {kind: [] for kind in kinds}
    for kind, messages in heard.items():
        vehicle.observe(kind, messages.append)
    vehicle.start()
    vehicle.run(seconds)
    vehicle.close()
    return vehicle, list(heard.values())


def truth(time, **fields):
    return imc.SimulatedState(timestamp=time, lat=LAT, lon=LON, **fields)


def estimate(time, **fields):
    return imc.EstimatedState(timestamp=time, lat=LAT, lon=LON, **fields)


def test_all_tasks_of_a_shipped_vehicle_share_one_world(tmp_path):
    vehicle, _ = sailed(tmp_path, 0.1, modes="Simulation,Camera,Detector")
    users = [task for task in vehicle.tasks if type(task).reads]
    assert len({id(world_of(task)) for task in users}) == 1
    assert {type(task).__name__ for task in users} == {
        *("DVL", "Environment", "FisheyeCamera", "MUGDetectionCamera", "MUGDetector", "VSIM")
    }


@pytest.mark.heavy
@pytest.mark.parametrize("plane", ["Seabed", "Surface"])
def test_the_shipped_vehicle_detects_gliders_below_and_above_it(plane, tmp_path):
    override = f"{MUG_CAMERA}:Target Plane={plane}"
    vehicle, (seen, truths) = sailed(tmp_path, 110.0, override, f"{MUG_CAMERA}:Error Model=None")
    times = np.array([t.timestamp for t in truths])
    deep = [m for m in seen if m.timestamp - vehicle.start_time > 30.0]
    assert len(deep) > 9
    for detection in deep:
        state = truths[int(np.searchsorted(times, detection.timestamp + 1e-4)) - 1]
        off = math.hypot(state.x + detection.x - 1.0, state.y + detection.y - 0.3)
        assert off < 2.5, "the error of navigation"


@pytest.mark.parametrize(("plane", "depth"), [("Seabed", None), ("Surface", 0.0), ("Depth", 9.0)])
def test_pictures_and_detections_put_a_glider_at_one_height(plane, depth):
    """A tilted vehicle: the glider is where its true depth projects to, in the picture and on the map."""
    pose = {"z": 3.0, "phi": 0.15, "theta": -0.1, "psi": 0.6}
    settings = SLOPE | {"World": SLOPE["World"] | {"Gliders": "4 1", "Gliders Lie On": plane, "Gliders Depth": "9"}}
    if plane == "Surface":
        pose["z"] = -3.0
    below = imc.EstimatedState(lat=LAT, lon=LON, alt=1.0, **pose)
    feed = [m for k in range(8) for m in (truth(0.1 * k, **pose), below.replace(timestamp=0.1 * k))]
    tasks = [
        (
            MUGDetectionCamera,
            {"error_model": "None", "horizontal_field_of_view": 150.0, "vertical_field_of_view": 150.0},
        ),
        (FisheyeCamera, {"size": 512, "face_size": 512, "visibility": 500.0, "frame_rate": 5.0}),
    ]
    if plane == "Surface":
        tasks[1][1]["scene"] = "Sea Surface"
    run = simulate(tasks, feed, seconds=0.75, settings=settings)
    world = world_of(run.tasks[0])
    (glider,) = world.objects
    down = world.object_position(glider, 0.0).down
    assert down == (world.seabed_depth(4.0, 1.0) if depth is None else depth)
    ray = np.array([4.0, 1.0, down - pose["z"]])
    place = run.tasks[1].camera.optics.project(
        ray @ optical_to_ned_rotation(ScenePose(0.0, 0.0, 1.0, 0.0, 0.15, -0.1, 0.6))
    )[0]
    red, green, blue = np.moveaxis(run.frames[-1].image[..., :3].astype(int), -1, 0)
    rows, columns = np.nonzero((red > 1.3 * blue) & (green > 1.3 * blue))
    assert len(rows) > 5
    assert np.hypot(columns.mean() + 0.5 - place[0], rows.mean() + 0.5 - place[1]) < 1.5
    seen = run.of(imc.EstimatedMugState)[-1]
    # On an uneven seabed the vehicle believes that the glider is its altitude below it.
    scale = 1.0 / (down - pose["z"]) if depth is None else 1.0
    assert (seen.x, seen.y) == pytest.approx((4.0 * scale, 1.0 * scale), abs=0.1)


def test_gliders_stay_where_the_world_has_them_if_the_vehicle_starts_elsewhere(tmp_path):
    elsewhere = "Simulators.GPS:Initial Position=41.1851, -8.7062"  # 11 m to the north
    glider = "World:Gliders=12.1 0.3"
    assert sailed(tmp_path / "a", 10.0, elsewhere)[1][0] == []
    seen = sailed(tmp_path / "b", 10.0, elsewhere, glider, f"{MUG_CAMERA}:Error Model=None")[1][0]
    assert len(seen) > 50
    assert seen[0].x == pytest.approx(1.0, abs=0.2)


def test_a_moving_glider_is_detected_where_it_is():
    settings = {
        "World": {"Origin": "41.185, -8.7062", "Gliders": "none", "Objects": "Drifter"},
        "World/Drifter": {"Track": "0 -2 0, 4 2 0", "Id": "7"},
    }
    feed = [m for k in range(41) for m in (truth(0.1 * k), estimate(0.1 * k, alt=10.0))]
    run = simulate(MUGDetectionCamera, feed, settings=settings, detection_rate=0.0, error_model="None")
    seen = run.of(imc.EstimatedMugState)
    assert [m.id for m in seen] == [7] * 41
    assert [m.x for m in seen] == pytest.approx([-2.0 + 0.1 * k for k in range(41)], abs=0.02)


def test_the_kinematic_vehicle_swims_above_the_same_bottom(tmp_path):
    vehicle, (states,) = sailed(tmp_path, 60.0, modes="Kinematic", kinds=[imc.EstimatedState])
    world = world_of(vehicle.task("Simulators.EstimatedState"))
    assert world.seabed_depth(0.0, 20.0) == pytest.approx(4.4, abs=0.3)
    for state in states[::20]:
        assert state.alt == pytest.approx(world.seabed_depth(state.x, state.y) - state.z, abs=1e-4)
    assert max(state.z for state in states) == 3.0


@pytest.mark.heavy
@pytest.mark.parametrize(
    "options", [["Depth=20"], ["Vertical Mode=Altitude", "Altitude=1.5"], ["Pattern=Lawn-mower", "Depth=4"]]
)
def test_the_kinematic_vehicle_stays_above_the_bottom(options, tmp_path):
    overrides = [f"Simulators.EstimatedState:{option}" for option in options]
    _, (states,) = sailed(
        tmp_path,
        120.0,
        *overrides,
        "Bathymetry:Data=0 0 6, 40 0 5, 0 40 4, 40 40 3",
        modes="Kinematic",
        kinds=[imc.EstimatedState],
    )
    assert min(state.alt for state in states) > 0.2
    assert max(state.z for state in states) > 2.0


def test_the_kinematic_vehicle_has_no_bottom_of_its_own_beside_soundings():
    with pytest.raises(ParameterError, match=r"Bottom Depth: the bottom is that of \[World\] and \[Bathymetry\]"):
        simulate(EstimatedState, settings=SLOPE, bottom_depth=13.0)
    flat = simulate(EstimatedState, seconds=1.0, settings={"World": {"Out Of Bounds Depth": "30"}})
    assert flat.of(imc.EstimatedState)[0].alt == 30.0


def test_a_dvl_hears_the_bottom_of_the_world_within_its_range():
    settings = SLOPE | {"World": SLOPE["World"] | {"Out Of Bounds Depth": "100"}}
    feed = [truth(0.2 * k, x=-20.0 + 0.4 * k, z=2.0, u=2.0) for k in range(101)]
    options = {"settings": settings, "bottom_range": 8.0, "invalid_reading_probability": 0.0}
    run = simulate(DVL, feed, **options)
    ground, water = run.of(imc.GroundVelocity), run.of(imc.WaterVelocity)
    seabed = world_of(run.task).seabed
    expected = [seabed.depth(-20.0 + 2.0 * (m.timestamp - run.vehicle.start_time), 0.0) - 2.0 <= 8.0 for m in ground]
    heard = [bool(m.validity) for m in ground]
    assert 20 < sum(heard) < len(heard) - 20
    assert sum(a != b for a, b in zip(heard, expected, strict=True)) <= 2
    assert all(m.validity for m in water)
    assert (
        simulate(DVL, [truth(0.1, theta=1.5, z=2.0)], seconds=0.5, **options).of(imc.GroundVelocity)[-1].validity == 0
    )


def test_a_camera_of_its_own_section_cannot_have_its_own_gliders():
    with pytest.raises(ParameterError, match=r"one world for all tasks: set its Gliders in \[World\]"):
        simulate(MUGDetectionCamera, section=f"{MUG_CAMERA}/Front", mugs=["4 4"])


def test_an_altimeter_and_the_vehicle_have_the_bottom_of_the_world():
    run = simulate(Environment, [truth(0.0, z=2.0)], seconds=0.5, settings=SLOPE, bottom_noise=0.0)
    assert run.of(imc.Distance)[0].value == pytest.approx(world_of(run.task).seabed_depth(0.0, 0.0) - 2.0, abs=1e-3)


def test_places_of_states_with_another_reference():
    chart = WorldFrame((LAT, LON))
    assert chart.position(truth(0.0, x=3.0, y=4.0)) == pytest.approx((3.0, 4.0), abs=1e-6)
    north = imc.SimulatedState(lat=LAT + 1e-5, lon=LON, x=3.0)
    assert chart.position(north)[0] == pytest.approx(3.0 + 63.7, abs=0.2)
    first = WorldFrame(None)
    assert first.position(truth(0.0, x=3.0, y=4.0)) == (0.0, 0.0)
    assert first.position(truth(0.1, x=5.0, y=4.0)) == (2.0, 0.0)


def test_frames_show_the_water_of_the_world():
    feed = [estimate(0.0, z=5.0, depth=5.0, alt=8.0)]
    clear, murky = (
        simulate(
            FisheyeCamera,
            feed,
            seconds=0.3,
            size=96,
            face_size=48,
            settings={"World": {"Water Visibility": visibility, "Gliders": "none"}},
        ).frames[0]
        for visibility in ("100", "2")
    )
    assert isinstance(clear, Frame)
    assert clear.image[30:66, 30:66, 1].std() > 5 * murky.image[30:66, 30:66, 1].std()


@pytest.mark.parametrize("own", ["", "MUGs = 1.0, 0.3\n"])
def test_gliders_that_are_moved_on_one_camera_are_moved_for_all(tmp_path, own):
    aft = f"[Simulators.MUGDetectionCamera/Aft]\nEnabled = Simulation\nEntity Label = Aft\n{own}"
    (tmp_path / "two.ini").write_text(f"[Require lauv-noptilus-1.ini]\n[General]\nVehicle = lauv-noptilus-1\n{aft}")
    profile = load_profile(tmp_path / "two.ini")
    selected = profile.parse_modes("Simulation,Camera")
    vehicle = build(profile, selected, clock=VirtualClock(profile.start_time_ns), log_root=tmp_path).vehicle
    vehicle.start()
    vehicle.run(1.0)
    said = []
    vehicle.observe(imc.LogBookEntry, lambda entry: said.append(entry.text))

    def move(label, text):
        parameters = (imc.EntityParameter(name="MUGs", value=text),)
        order = imc.SetEntityParameters(name=label, params=parameters)
        packet = imc.encode_with_header(order, vehicle.kernel.now_ns * 1e-9, 0x4001, 1, vehicle.system, 0xFF)
        vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)
        vehicle.run(0.5)

    def places():
        tasks = vehicle.task(MUG_CAMERA), vehicle.task("Vision.FisheyeCamera")
        return [[thing.track[0][1:] for thing in world_of(task).objects] for task in tasks]

    def texts():
        cameras = [task for task in vehicle.tasks if "MUGs" in task.parameters()]
        assert len(cameras) == 3
        return {task.parameter_set.text(task.parameters()["MUGs"]) for task in cameras}

    assert places() == [[(1.0, 0.3)]] * 2
    move("MUG Camera", "2 2")
    move("MUG Camera", "4 5, 6 7")
    assert places() == [[(4.0, 5.0), (6.0, 7.0)]] * 2
    assert texts() == {"4 5, 6 7"}
    move("Fisheye Camera", "1 2")
    assert any("there is one world" in text for text in said)
    assert places() == [[(4.0, 5.0), (6.0, 7.0)]] * 2
    assert texts() == {"4 5, 6 7"}
    (tmp_path / "again.ini").write_text(vehicle.profile.dump())
    vehicle.close()
    build(load_profile(tmp_path / "again.ini"), selected, clock=VirtualClock(profile.start_time_ns)).vehicle.close()


def test_a_camera_that_knows_only_an_estimate_sees_the_seabed_of_the_soundings():
    """What the vehicle believes of its altitude does not contradict them."""
    feed = [estimate(0.1 * k, alt=3.0, z=2.0, depth=2.0) for k in range(11)]
    run = simulate(FisheyeCamera, feed, settings=SLOPE, size=32, face_size=16)
    assert len(run.frames) > 3
    assert run.frames[-1].info["height"] == pytest.approx(8.0, abs=0.3)
