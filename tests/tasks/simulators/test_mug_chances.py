"""What the MUG camera misses, makes up, and is late with; its mount; and that a detector of pictures agrees."""

import math
from functools import partial

import numpy as np
import pytest

import imc
from runtime import State, Task
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from support.pose import euler_angles
from tasks.simulators.mug_detection_camera import MUGDetectionCamera
from tasks.vision.camera import Camera
from tasks.vision.mug_detector import MUGDetector
from world.detection import DetectionProbability
from world.sensors import ACCURACY

START = 1_767_225_600
EXACT = {"error_model": "None", "detection_rate": 0.0}


def still(count, rate=20, alt=10.0, **fields):
    """A vehicle that stays where it is."""
    fields = {"z": 3.0, "depth": 3.0, "alt": alt, **fields}
    return [imc.EstimatedState(timestamp=k / rate, **fields) for k in range(count)]


def detections(feed, **parameters):
    return simulate(MUGDetectionCamera, feed=feed, **parameters).of(imc.EstimatedMugState)


def within(count, total, probability):
    """Whether a number of `total` is what a probability gives, within four standard deviations."""
    return abs(count - total * probability) <= 4.0 * math.sqrt(total * probability * (1.0 - probability))


def test_half_of_the_near_ones_are_missed_on_demand():
    seen = detections(still(1000), detection_probability=0.5, **EXACT)
    assert within(len(seen), 1000, 0.5)


@pytest.mark.parametrize("alt", [5.0, 10.0, 15.0])
def test_detections_become_rare_at_the_visibility(alt):
    seen = detections(still(1000, alt=alt), visibility=10.0, mugs=["0 0"], **EXACT)
    expected = DetectionProbability(visibility=10.0).probability(alt, 1e3)
    assert within(len(seen), 1000, expected)
    assert {5.0: expected > 0.99, 10.0: abs(expected - 0.5) < 1e-9, 15.0: expected < 0.01}[alt]


def test_half_of_those_are_found_that_have_the_least_pixels():
    focal = 640 / math.tan(math.radians(46.4)), 480 / math.tan(math.radians(25.0))
    pixels = 0.8 * 0.16 * focal[0] * focal[1] / 10.0**2
    seen = detections(still(1000), least_pixels=pixels, mugs=["0 0"], **EXACT)
    assert within(len(seen), 1000, 0.5)
    assert len(detections(still(100), least_pixels=pixels / 20, mugs=["0 0"], **EXACT)) == 100


def test_false_alarms_come_at_their_rate_anywhere_in_the_image_with_new_numbers():
    seen = detections(still(2000), false_alarm_rate=2.0, error_model="None", mugs=["0 0", "500 0"])
    false = [mug for mug in seen if mug.id > 2]
    assert len(false) == pytest.approx(200, abs=4 * math.sqrt(200))
    assert [mug.id for mug in false] == list(range(3, 3 + len(false)))
    half = 10.0 * math.tan(math.radians(25.0)), 10.0 * math.tan(math.radians(46.4))
    for axis, side in zip(([mug.x for mug in false], [mug.y for mug in false]), half, strict=True):
        assert max(map(abs, axis)) <= side
        assert np.std(axis) == pytest.approx(side / math.sqrt(3.0), rel=0.2)


def test_errors_are_the_same_with_and_without_misses_and_false_alarms():
    feed = still(100)
    all_seen = {mug.timestamp: (mug.x, mug.y) for mug in detections(feed, seed=3)}
    some = detections(feed, seed=3, detection_probability=0.6, false_alarm_rate=1.0)
    true = [mug for mug in some if mug.id == 1]
    assert 10 < len(true) < len(all_seen)
    assert all((mug.x, mug.y) == all_seen[mug.timestamp] for mug in true)
    assert some != detections(feed, seed=4, detection_probability=0.6, false_alarm_rate=1.0)


def test_late_detections_are_from_where_the_vehicle_is_by_then():
    feed = [imc.EstimatedState(timestamp=k / 20, x=k / 10, vx=2.0, alt=10.0) for k in range(60)]
    run = simulate(MUGDetectionCamera, feed, mugs=["3 0"], latency=0.33, **EXACT)
    seen = run.of(imc.EstimatedMugState)
    assert seen[0].timestamp - run.vehicle.start_time == pytest.approx(0.33, abs=1e-3)
    for mug in seen:
        assert mug.x == pytest.approx(3.0 - 2.0 * (mug.timestamp - run.vehicle.start_time), abs=0.02)
    silent = simulate(MUGDetectionCamera, feed[:3], seconds=5.0, mugs=["0 0"], latency=3.0, **EXACT)
    assert silent.of(imc.EstimatedMugState) == []
    assert silent.task.skipped == {"no recent EstimatedState": 3}


def test_a_camera_apart_from_the_middle_sees_what_is_below_it():
    narrow = {"horizontal_field_of_view": 20.0, "vertical_field_of_view": 20.0, **EXACT}
    feed = still(1, psi=math.pi / 2)
    assert detections(feed, mugs=["-3 4"], **narrow) == []
    (seen,) = detections(feed, mugs=["-3 4"], mount_position=[4.0, 3.0, 0.0], **narrow)
    assert (seen.x, seen.y) == pytest.approx((-3.0, 4.0), abs=0.01)
    (seen,) = detections(feed, mugs=["-3 4"], mount_position=[4.0, 3.0, 1.0], **narrow)
    assert (seen.x, seen.y) == pytest.approx((-3.0, 4.0), abs=0.01)


@pytest.mark.heavy
def test_errors_by_covariance_are_longer_where_the_plane_is_seen_aslant():
    seen = detections(still(3000, phi=0.6), error_model="Covariance", detection_rate=0.0, mugs=["0 -6"], seed=1)
    exact = detections(still(1, phi=0.6), mugs=["0 -6"], **EXACT)[0]
    spread = np.std([(mug.x - exact.x, mug.y - exact.y) for mug in seen], axis=0)
    distance, tangent = math.hypot(10.0, 6.0), 0.6
    turn = math.degrees(ACCURACY.attitude) / 0.2
    east = math.hypot(math.radians(0.2) * 10.0 * (1 + tangent**2) * turn, 0.1 * tangent)
    assert spread[1] == pytest.approx(east, rel=0.1)
    assert spread[0] < 0.8 * spread[1]
    assert distance > 10.0


@pytest.mark.heavy
@pytest.mark.computing
def test_a_detector_of_pictures_agrees_with_the_camera_without_pixels(tmp_path):
    """The shipped AUV with a camera that both look through: offsets of one instant differ by the detector's error."""
    wide = f"{math.degrees(2 * math.atan(0.75 * math.tan(math.radians(40.0)))):.9f}"
    mug_camera = {
        **{"Horizontal Field of View": "80", "Vertical Field of View": wide, "Error Model": "None"},
        **{"Horizontal Resolution": "640", "Vertical Resolution": "480", "Mount Position": "0.5, 0, 0.1"},
        "Mount Orientation": "10, -5, 20",
    }
    overrides = [f"Simulators.MUGDetectionCamera:{name}={value}" for name, value in mug_camera.items()]
    loaded = load_profile("lauv-noptilus-1", overrides=["World:Gliders=1 0.3, 3 1.5, 12 7", *overrides])
    selected = loaded.parse_modes("Simulation")
    vehicle = build(loaded, selected, clock=VirtualClock(loaded.start_time_ns), log_root=tmp_path).vehicle
    (simulated,) = (task for task in vehicle.tasks if isinstance(task, MUGDetectionCamera))
    mount = simulated.mounts[0]
    camera = vehicle.add(
        Camera,
        "Vision.Camera/Trial",
        entity_label="Trial",
        frame_rate=2.5,
        field_of_view=80.0,
        visibility=60.0,
        mount_position=[0.5, 0.0, 0.1],
        mount_orientation=[math.degrees(angle) for angle in euler_of(mount)],
    )
    detector = vehicle.add(MUGDetector, "Vision.MUGDetector/Trial", entity_label="Detector", camera="Trial")
    by_geometry, by_pixels = [], []

    def note(mug):
        if mug.src_ent == simulated.entity.id:
            by_geometry.append(mug)
        else:
            by_pixels.append((mug, detector.glider_offset(mug.id)[2]))

    vehicle.observe(imc.EstimatedMugState, note)
    vehicle.start()
    vehicle.run(110.0)
    vehicle.close()
    assert (camera.entity.state, detector.entity.state) == (State.NORMAL, State.NORMAL)
    assert len(by_pixels) > 25
    times = np.array([mug.timestamp for mug in by_geometry])
    off, nees = [], []
    for mug, spread in by_pixels:
        near = [by_geometry[k] for k in np.flatnonzero(np.abs(times - mug.timestamp) < 0.11)]
        for number in {other.id for other in near}:
            track = [other for other in near if other.id == number]
            if track[0].timestamp <= mug.timestamp <= track[-1].timestamp:
                then = [other.timestamp for other in track]
                places = ([other.x for other in track], [other.y for other in track])
                apart = np.array([mug.x, mug.y]) - [np.interp(mug.timestamp, then, place) for place in places]
                if np.linalg.norm(apart) < 1.0:
                    off.append(np.linalg.norm(apart))
                    nees.append(apart @ np.linalg.solve(spread, apart))
    assert len(off) > 0.8 * len(by_pixels)
    assert math.sqrt(np.mean(np.square(off))) < 0.1
    assert np.mean(nees) < 2.0


def euler_of(mount):
    """Roll, pitch and yaw (rad) of a camera that looks ahead, from the matrix of its optical frame."""
    ahead = mount[:3, [2, 0, 1]]
    return euler_angles(tuple(map(tuple, ahead.tolist())))


def test_late_detections_are_right_of_a_state_that_is_late_itself():
    """At 2 m/s, with an estimate that comes 0.2 s after its time."""

    def start(task):
        for k in range(60):
            estimate = imc.EstimatedState(timestamp=START + k / 20, x=k / 10, vx=2.0, u=2.0, z=5.0, depth=5.0, alt=4.0)
            task.at(START + k / 20 + 0.2, partial(task.publish, estimate, keep_time=True))

    truths = [imc.SimulatedState(timestamp=k / 20, x=k / 10, u=2.0, z=5.0) for k in range(60)]
    filtering = type("Filtering", (Task,), {"start": start})
    for latency in (0.0, 0.5):
        camera = (MUGDetectionCamera, {"latency": latency, "error_model": "None"})
        world = {"World": {"Gliders": "2 0.3"}}
        seen = simulate([camera, (filtering, {})], truths, seconds=2.5, settings=world).of(imc.EstimatedMugState)
        assert len(seen) >= 5
        for mug in seen:
            assert mug.x + 2.0 * (mug.timestamp - START) == pytest.approx(2.0, abs=0.02)


def test_the_first_image_has_no_false_alarms_of_the_time_before():
    seen = detections(still(60), false_alarm_rate=20.0, detection_rate=0.0, settings={"World": {"Gliders": "none"}})
    assert within(len(seen) / 2.95, 1000, 0.02)
    assert all(mug.timestamp - START > 0.04 for mug in seen)


def test_a_camera_without_a_recent_state_is_not_active():
    run = simulate(MUGDetectionCamera, still(20), seconds=19.0, mugs=["0 0"], **EXACT)
    assert (run.task.entity.state, run.task.entity.description) == (State.FAULT, "no recent EstimatedState")
    feed = [*still(20), *(state.replace(timestamp=state.timestamp + 10.0) for state in still(20))]
    again = simulate(MUGDetectionCamera, feed, seconds=11.0, mugs=["0 0"], **EXACT)
    assert again.task.entity.state is State.NORMAL


def test_a_camera_in_the_plane_of_a_glider_does_not_see_it():
    """Looking ahead, with an estimate that is a meter off in depth."""
    truths = [imc.SimulatedState(timestamp=k / 20, z=0.0) for k in range(20)]
    feed = sorted([*truths, *still(20, z=-1.0, depth=-1.0)], key=lambda message: message.timestamp)
    world = {"World": {"Gliders": "20 0", "Gliders Lie On": "Surface"}}
    run = simulate(
        MUGDetectionCamera, feed, settings=world, error_model="GSD", mount_orientation=[0.0, 90.0, 0.0], seconds=0.9
    )
    assert run.of(imc.EstimatedMugState) == []
    assert run.task.entity.state is State.NORMAL
