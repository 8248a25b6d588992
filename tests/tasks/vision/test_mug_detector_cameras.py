"""Vision.MUGDetector with several cameras, numbers that clash, and long latencies."""

import math
from dataclasses import replace

import pytest

import imc
from runtime import Task
from runtime.testing import simulate
from tasks.vision.mug_detector import MUGDetector
from tests.tasks.vision.test_mug_detector import CAMERA, EVEN, FAULT, NORMAL, START, last_state, shown, states, timed


@pytest.fixture(scope="module")
def seen():
    """A frame that shows a glider at 0.5, 0.3."""
    return simulate([CAMERA], states(0.5), settings={"World": {"Gliders": "0.5 0.3"}}).frames[-1]


@pytest.fixture(scope="module")
def empty():
    return simulate([CAMERA], states(0.5), settings={"World": {"Gliders": "none"}}).frames[-1]


@pytest.mark.parametrize("cameras", [2, 3, 4])
def test_what_one_of_several_cameras_sees_is_detected(cameras, seen, empty):
    frames = []
    for time in EVEN:
        for number in range(cameras):
            frames += timed(replace(seen if number == 0 else empty, camera=f"C{number}"), time + 0.001 * number)
    run = shown(frames)
    assert len(run.of(imc.EstimatedMugState)) == len(EVEN) - 2
    assert last_state(run) == (NORMAL, f"{cameras * len(EVEN)} frames, 0 dropped, 1 glider")


def test_two_cameras_that_are_exact_see_the_same_at_one_instant(seen):
    frames = [row for time in EVEN for row in timed(seen, time) + timed(replace(seen, camera="B"), time)]
    run = shown(frames, pixel_error=0.0, shape_error=0.0, height_error=0.0, position_error=0.0, attitude_error=0.0)
    found = run.of(imc.EstimatedMugState)
    assert {mug.id for mug in found} == {1}
    assert len(found) >= 2 * len(EVEN) - 4
    for mug in found:
        assert (mug.x, mug.y) == pytest.approx((0.5, 0.3), abs=0.05)


def twice(image):
    return [(100.5, 100.5, 7), (250.5, 200.5, 7)]


def clashing(image):
    return [(100.5, 100.5), (250.5, 200.5, 1)]


def found_by(name, frame):
    run = shown(timed(frame, *EVEN), detector="Function", function=f"{__name__}:{name}")
    return {(mug.id, (round(mug.x, 1), round(mug.y, 1))) for mug in run.of(imc.EstimatedMugState)}


def test_each_place_is_that_of_its_thing_even_if_two_have_a_number(seen):
    both, other = found_by("twice", seen), found_by("clashing", seen)
    assert [number for number, _ in both] == [7, 7]
    ahead, behind = sorted((place for _, place in both), reverse=True)
    assert ahead[0] > behind[0] + 1.0
    assert other == {(2, ahead), (1, behind)}, "the marker is lower in the picture, which looks ahead at the top"


def negative(image):
    return [(100.5, 100.5, -1)]


def large(image):
    return [(100.5, 100.5, 2**40)]


@pytest.mark.parametrize(("name", "number"), [("negative", -1), ("large", 2**40)])
def test_a_number_that_no_message_can_carry_is_a_fault_and_the_vehicle_goes_on(name, number, seen):
    run = shown(timed(seen, *EVEN), detector="Function", function=f"{__name__}:{name}")
    fault = f"Camera: the detector failed: ValueError: {number} is no number of a marker (10 skipped)"
    assert last_state(run) == (FAULT, fault)
    assert run.of(imc.EstimatedMugState) == []


def test_a_fault_of_a_camera_that_is_not_heard_any_more_ends(seen):
    broken = timed(replace(seen, camera="Other", optics=None), 0.1, 0.3)
    soon = shown(broken + timed(seen, *EVEN))
    assert last_state(soon)[0] == FAULT
    late = shown(broken + timed(seen, *[0.5 * k for k in range(1, 25)]), seconds=13.0)
    assert last_state(late) == (NORMAL, "24 frames, 0 dropped, 1 glider, 2 skipped")


def test_a_fault_of_a_camera_that_is_not_to_be_heard_any_more_ends(seen):
    def start(task):
        for time, frame in timed(replace(seen, camera="Other", optics=None), 0.1, 0.3) + timed(seen, *EVEN):
            task.at(START / 1e9 + time, task.publish_frame, frame)
        task.at(START / 1e9 + 0.5, task.publish, choice)

    params = (imc.EntityParameter(name="Camera", value=seen.camera),)
    choice = imc.SetEntityParameters(name="MUG Detector", params=params)
    projector = type("Projector", (Task,), {"start": start})
    detector = (MUGDetector, {"entity_label": "MUG Detector"})
    run = simulate([detector, (projector, {})], states(3.0), seconds=3.0)
    assert last_state(run) == (NORMAL, "10 frames, 0 dropped, 1 glider, 2 skipped")


def test_a_map_without_a_bottom_is_named(seen):
    run = shown(timed(seen, *EVEN), target_plane="Map")
    assert last_state(run) == (FAULT, "Camera: [World] has no bottom here (10 skipped)")


def test_a_detector_may_take_longer_than_states_are_usually_kept(seen):
    times = [0.5 * k for k in range(1, 30)]
    run = shown(timed(seen, *times), seconds=22.0, latency=6.0)
    assert last_state(run) == (NORMAL, "29 frames, 0 dropped, 1 glider")
    assert len(run.of(imc.EstimatedMugState)) == 27
    assert all(math.hypot(mug.x - 0.5, mug.y - 0.3) < 0.05 for mug in run.of(imc.EstimatedMugState))
