"""Vision.MUGDetector on a bus: what it publishes of shipped vehicles and of bad frames."""

import math
import threading
from dataclasses import replace

import numpy as np
import pytest

import imc
from runtime import ParameterError, Task
from runtime.kernel import VirtualClock, WallClock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from tasks.vision.camera import Camera
from tasks.vision.mug_detector import MUGDetector
from world import read_world

NORMAL, FAULT = imc.EntityState.State.NORMAL, imc.EntityState.State.FAULT
GLIDERS = "World:Gliders=1 0.3, 8 -4, -5 6, 15 10, 20 0, 0 20"
CAMERA = (Camera, {"frame_rate": 5.0, "width": 320, "height": 240, "visibility": 60.0})
START = 1_767_225_600_000_000_000  # ns


def state(time, **fields):
    return imc.EstimatedState(timestamp=time, **{"z": 5.0, "depth": 5.0, "alt": 4.0, **fields})


def states(seconds=2.0, **fields):
    return [state(n / 20, **fields) for n in range(int(seconds * 20))]


def watched(feed, seconds=None, camera=CAMERA, settings=None, clock=None, **parameters):
    settings = settings or {"World": {"Gliders": "0.5 0.3"}}
    return simulate([(MUGDetector, parameters), camera], feed, seconds=seconds, settings=settings, clock=clock)


def last_state(run):
    return run.task.entity.state, run.task.entity.description


def test_a_glider_is_published_where_it_is_with_a_number_that_stays():
    run = watched(states(3.0, psi=0.7))
    seen = run.of(imc.EstimatedMugState)
    assert len(seen) >= 11
    assert {mug.id for mug in seen} == {1}
    assert {mug.src_ent for mug in seen} == {run.task.entity.id}
    for mug in seen:
        assert (mug.x, mug.y) == pytest.approx((0.5, 0.3), abs=0.03)
    assert last_state(run) == (NORMAL, "14 frames, 0 dropped, 1 glider")


def test_offsets_are_from_where_the_vehicle_is_when_they_are_published():
    """2 m/s and half a second from exposure to detection: the vehicle is 1 m on."""
    feed = [state(n / 20, x=n / 10, vx=2.0) for n in range(60)]
    seen = watched(feed, settings={"World": {"Gliders": "3 0.3"}}, latency=0.45).of(imc.EstimatedMugState)
    assert len(seen) >= 3
    for mug in seen:
        assert (mug.x + 2.0 * (mug.timestamp - START / 1e9), mug.y) == pytest.approx((3.0, 0.3), abs=0.05)


def test_a_rolling_shutter_shows_each_row_from_where_the_vehicle_was_then():
    """2 m/s, and 0.3 s from the first to the last row."""
    feed = [state(n / 20, x=n / 10, vx=2.0) for n in range(60)]
    camera = (Camera, {**CAMERA[1], "readout_time": 0.3, "latency": 0.2})
    seen = watched(feed, camera=camera, settings={"World": {"Gliders": "3 0.3"}}).of(imc.EstimatedMugState)
    assert len(seen) >= 3
    for mug in seen:
        assert (mug.x + 2.0 * (mug.timestamp - START / 1e9), mug.y) == pytest.approx((3.0, 0.3), abs=0.05)


def sailed(profile, seconds, folder, *overrides):
    """What the detector of a shipped vehicle publishes, with its errors, and what is true meanwhile."""
    loaded = load_profile(profile, overrides=[GLIDERS, "Vision.FisheyeCamera:Save Images=false", *overrides])
    selected = loaded.parse_modes("Simulation,Camera,Detector")
    vehicle = build(loaded, selected, clock=VirtualClock(loaded.start_time_ns), log_root=folder).vehicle
    (detector,) = (task for task in vehicle.tasks if isinstance(task, MUGDetector))
    seen, truths = [], []
    vehicle.observe(imc.EstimatedMugState, seen.append)
    vehicle.observe(imc.SimulatedState, truths.append)
    vehicle.start()
    vehicle.run(seconds)
    vehicle.close()
    times = np.array([truth.timestamp for truth in truths])
    places = np.array([(truth.x, truth.y) for truth in truths])
    world = read_world(loaded.value)
    gliders = np.array([(thing.track[0].north, thing.track[0].east) for thing in world.objects])
    found = []
    for mug in (mug for mug in seen if mug.src_ent == detector.entity.id):
        here = [np.interp(mug.timestamp, times, places[:, axis]) for axis in (0, 1)]
        apart = np.array([mug.x, mug.y]) + here - gliders
        nearest = int(np.linalg.norm(apart, axis=1).argmin())
        found.append((mug.timestamp - vehicle.start_time, mug.id, nearest + 1, float(np.linalg.norm(apart[nearest]))))
    return detector, found


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(("profile", "error"), [("lauv-noptilus-1", 0.5), ("hexa-00", 1.0)])
def test_a_shipped_vehicle_finds_its_gliders(profile, error, tmp_path):
    detector, found = sailed(profile, 40.0, tmp_path)
    assert detector.entity.state == NORMAL
    later = [row for row in found if row[0] > 15.0]
    assert len(later) > 40
    assert math.sqrt(np.mean([off**2 for *_, off in later])) < error
    numbers = {(number, glider) for _, number, glider, _ in later}
    assert len(numbers) == len({number for number, _ in numbers}) == len({glider for _, glider in numbers}) >= 3


@pytest.fixture(scope="module")
def good():
    """A frame that shows a glider at 0.5, 0.3."""
    return simulate([CAMERA], states(0.5), settings={"World": {"Gliders": "0.5 0.3"}}).frames[-1]


def shown(frames, feed=None, clock=None, seconds=3.0, **parameters):
    """A run in which these frames are shared, at the seconds from the start beside them."""

    def start(task):
        for time, frame in frames:
            task.at(START / 1e9 + time, task.publish_frame, frame)

    projector = type("Projector", (Task,), {"start": start})
    feed = states(seconds) if feed is None else feed
    return simulate([(MUGDetector, parameters), (projector, {})], feed, seconds=seconds, clock=clock)


def timed(frame, *times):
    """A frame shared a moment after each time of exposure (s from the start)."""
    return [(time + 0.01, replace(frame, time=START / 1e9 + time)) for time in times]


EVEN = [0.2 * k for k in range(1, 11)]


def test_frames_that_cannot_be_located_are_a_fault_and_the_next_good_one_ends_it(good):
    other = replace(good.optics, width=100)
    for change, fault in (
        ({"optics": None}, "frames without the camera model"),
        ({"mount": None}, "frames without the mount of the camera"),
        ({"optics": other}, "frames of 320 x 240 px, model of 100 x 240 px"),
        ({"mount": np.full((4, 4), math.nan)}, "frames without time or mount"),
        ({"mount": np.eye(3)}, "frames without time or mount"),
    ):
        bad = replace(good, **change)
        run = shown(timed(bad, *EVEN))
        assert last_state(run) == (FAULT, f"Camera: {fault} (10 skipped)")
        assert run.log == [f"Camera: {fault}"]
        run = shown([*timed(bad, *EVEN[:3]), *timed(good, *EVEN[3:])])
        assert last_state(run) == (NORMAL, "7 frames, 0 dropped, 1 glider, 3 skipped")
        assert len(run.of(imc.EstimatedMugState)) == 5


def test_only_frames_of_its_camera_are_looked_at(good):
    frames = timed(replace(good, camera="Other", optics=None), *EVEN) + timed(good, *EVEN)
    run = shown(sorted(frames, key=lambda row: row[0]), camera="Camera")
    assert last_state(run) == (NORMAL, "10 frames, 0 dropped, 1 glider")
    assert shown(timed(good, *EVEN), camera="Other").of(imc.EstimatedMugState) == []


def test_one_camera_without_a_model_does_not_keep_it_from_another(good):
    frames = timed(replace(good, camera="Other", optics=None), *EVEN) + timed(good, *EVEN)
    run = shown(sorted(frames, key=lambda row: row[0]))
    assert last_state(run) == (FAULT, "Other: frames without the camera model (10 skipped)")
    assert len(run.of(imc.EstimatedMugState)) == 8


def test_states_that_are_not_numbers_are_passed_over(good):
    feed = [state(n / 20, psi=math.nan if n % 3 else 0.0) for n in range(60)]
    run = shown(timed(good, *EVEN), feed)
    assert len(run.of(imc.EstimatedMugState)) == 8
    assert run.task.skipped == {"no position or attitude": 40}
    blind = shown(timed(good, *EVEN), [state(n / 20, x=math.inf) for n in range(60)])
    assert last_state(blind)[0] == FAULT
    assert blind.task.skipped["no EstimatedState"] == 10


def test_a_frame_needs_a_state_of_its_time(good):
    late = [(time + 5.5, frame) for time, frame in timed(good, *EVEN)]
    run = shown(late, states(8.0), seconds=8.0)
    assert last_state(run) == (FAULT, "Camera: older than the states (10 skipped)")
    gone = shown(timed(good, *EVEN), states(0.3))
    assert gone.task.skipped["no recent EstimatedState"] > 3
    assert len(gone.of(imc.EstimatedMugState)) == 3  # the last state is carried on for a second
    deep = shown(timed(good, *EVEN), [state(n / 20, alt=-1.0) for n in range(60)])
    assert last_state(deep) == (FAULT, "Camera: no altitude (10 skipped)")


def test_a_clock_that_jumps_back_begins_again_with_new_numbers(good):
    times = [*EVEN, *EVEN[:5]]
    frames = [(0.2 * k, replace(good, time=START / 1e9 + time)) for k, time in enumerate(times, start=1)]
    run = shown(frames, states(4.0), seconds=4.0)
    assert run.task.skipped == {"time goes backwards": 1}
    assert [mug.id for mug in run.of(imc.EstimatedMugState)] == [1] * 8 + [2] * 3
    assert last_state(run)[0] == NORMAL


def faulty(image):
    raise RuntimeError("no weights")


def wrong(image):
    return [(1.0,)]


def nowhere(image):
    return [(math.nan, 3.0)]


def middle(image):
    return [(image.shape[1] / 2, image.shape[0] / 2), (10.5, 10.5, 77)]


@pytest.mark.parametrize(
    ("name", "fault"), [("faulty", "RuntimeError: no weights"), ("wrong", "TypeError"), ("nowhere", "ValueError")]
)
def test_a_function_that_fails_is_a_fault_and_counted(name, fault, good):
    run = shown(timed(good, *EVEN), detector="Function", function=f"{__name__}:{name}")
    state, text = last_state(run)
    assert state == FAULT
    assert text.startswith(f"Camera: the detector failed: {fault}")
    assert text.endswith("(10 skipped)")


def test_a_function_of_the_user_finds_places_and_numbers(good):
    run = shown(timed(good, *EVEN), detector="Function", function=f"{__name__}:middle")
    seen = run.of(imc.EstimatedMugState)
    assert {mug.id for mug in seen} == {1, 77}
    assert [(mug.x, mug.y) for mug in seen if mug.id == 1] == [pytest.approx((0.0, 0.0), abs=1e-6)] * 8


WAITING = threading.Event()


def hanging(image):
    WAITING.wait(20.0)
    return []


@pytest.mark.heavy
def test_a_function_that_hangs_is_a_fault_and_frames_are_dropped(good):
    """On a wall clock; the kernel goes on: states are heard meanwhile."""
    WAITING.clear()
    run = shown(
        timed(good, *(0.1 * k for k in range(1, 12))),
        clock=WallClock(start=START),
        seconds=1.4,
        detector="Function",
        function=f"{__name__}:hanging",
        patience=0.3,
    )
    WAITING.set()
    state, text = last_state(run)
    assert state == FAULT
    assert text.startswith("Camera: the detector has not answered for 0.3 s")
    assert run.task.dropped >= 5


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ({"detector": "Function"}, "Function"),
        ({"detector": "Function", "function": "no.such.module:find"}, "Function"),
        ({"detector": "Function", "function": "math:nothing"}, "Function"),
        ({"detector": "Function", "function": "math:pi"}, "Function"),
        ({"detector": "Function", "function": "os:abort"}, "Function"),
        ({"detector": "Function", "function": "PIL.Image:os.abort"}, "Function"),
        ({"color": [1.0, 2.0]}, "Color"),
        ({"color": [100.0, 100.0, 100.0]}, "Color"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(values, name):
    with pytest.raises(ParameterError) as refusal:
        simulate(MUGDetector, **values)
    assert refusal.value.name == name


@pytest.mark.parametrize(
    ("plane", "depth", "settings"),
    [
        ("Depth", 9.0, {}),
        ("Surface", 0.0, {}),
        ("Map", 9.0, {"World": {"Out Of Bounds Depth": "9"}}),
    ],
)
def test_planes(plane, depth, settings, good):
    feed = [state(n / 20, z=depth - 4.0, alt=-1.0) for n in range(60)]

    def start(task):
        for time, frame in timed(good, *EVEN):
            task.at(START / 1e9 + time, task.publish_frame, frame)

    projector = type("Projector", (Task,), {"start": start})
    given = {"target_plane": plane, "target_depth": depth}
    run = simulate([(MUGDetector, given), (projector, {})], feed, settings=settings)
    seen = run.of(imc.EstimatedMugState)
    assert len(seen) == 8
    for mug in seen:
        assert (mug.x, mug.y) == pytest.approx((0.5, 0.3), abs=0.03)
