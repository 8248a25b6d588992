"""Tracks are as exact as they say, keep their ids, and are not begun by noise."""

import math

import numpy as np
import pytest

from support.pose import DOWN, euler_angles
from support.rotations import rotation
from world.detection import DetectionAccuracy, PoseOverPlane, Tracker, TrackerSettings, project_to_plane
from world.optics import FisheyeModel, preset_lens
from world.rendering import optical_to_body_transform

CAMERA = FisheyeModel(1280, 960, 800.0, 800.0, 640.0, 480.0, preset_lens("equidistant", 2.0))
RATE = 5.0  # Hz
WRONG = DetectionAccuracy(attitude_time=5.0, height_time=10.0, place=0.3, place_time=20.0)
RUNS = 100
BAND = (1.627, 2.411)  # 95 % of the mean of 100 values of chi² with two degrees of freedom, over 2 * 100


MOUNT = optical_to_body_transform(DOWN._replace(x=0.5, z=0.1))
UPRIGHT = PoseOverPlane(0.0, 0.0, 10.0, (0.0, 0.0, 0.0))


class Errors:
    """Gauss-Markov errors of a pose, at the height of 10 m."""

    def __init__(self, accuracy, random):
        self.left = accuracy.error_decay(1.0 / RATE)
        self.sigmas = np.sqrt(accuracy.pose_error_variances(10.0))
        self.random = random
        self.now = random.normal(size=6) * self.sigmas

    def step(self):
        drive = self.random.normal(size=6) * self.sigmas
        self.now = self.left * self.now + np.sqrt(1.0 - self.left**2) * drive

    def believed(self, true):
        """Where a vehicle believes to stand that stands so."""
        x, y, z = self.now[:3]
        turn = np.eye(3) - np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        angles = euler_angles(tuple(map(tuple, np.array(rotation(*true.angles)) @ turn)))
        return PoseOverPlane(true.north + self.now[4], true.east + self.now[5], true.height - self.now[3], angles)


def passed(seed, accuracy, told=None, seconds=12.0, glider=(8.0, 1.0), **habits):
    """Errors and covariances of the offsets of a glider that a vehicle passes, one for each picture that shows it."""
    random = np.random.default_rng(seed)
    errors, tracker = Errors(accuracy, random), Tracker(told or accuracy, TrackerSettings(position_walk=0.0, **habits))
    found = []
    for k in range(int(seconds * RATE)):
        time = k / RATE
        angles = 0.1 * math.sin(time), 0.05 * math.cos(0.7 * time), 0.3 * math.sin(0.4 * time)
        true = PoseOverPlane(1.0 * time, 0.5 * math.sin(0.5 * time), 10.0, angles)
        errors.step()
        turn = np.array(rotation(*angles))
        shift = random.normal(size=2) * accuracy.shape
        to = np.array([glider[0] + shift[0] - true.north, glider[1] + shift[1] - true.east, true.height])
        pixel, inside = CAMERA.project((turn @ MOUNT[:3, :3]).T @ (to - turn @ MOUNT[:3, 3]))
        believed = errors.believed(true)
        pixels = [pixel + random.normal(size=2) * accuracy.pixel] if inside else []
        seen = [
            s for s in project_to_plane(CAMERA, MOUNT, believed, np.reshape(pixels, (-1, 2)), tracker.accuracy) if s
        ]
        for track in tracker.update(time, believed, seen):
            north, east, spread = track.offset(believed, tracker.accuracy)
            error = np.array([north - glider[0] + true.north, east - glider[1] + true.east])
            found.append((track.id, error, spread))
    return found


def nees(rows):
    return [float(error @ np.linalg.solve(spread, error)) for _, error, spread in rows]


@pytest.fixture(scope="module")
def passes():
    return [passed(seed, WRONG) for seed in range(RUNS)]


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("at", [0, 20, -1])
def test_errors_are_as_large_as_the_covariance_says(passes, at):
    """One value of each of 100 passes: they do not depend on each other. First, later and last picture of a pass."""
    values = nees([rows[at] for rows in passes])
    assert BAND[0] < np.mean(values) < BAND[1]
    errors = np.array([rows[at][1] for rows in passes])
    told = np.mean([np.trace(rows[at][2]) for rows in passes])
    assert np.mean(np.sum(errors**2, axis=1)) == pytest.approx(told, rel=0.3)


@pytest.mark.heavy
def test_a_filter_that_took_errors_of_the_pose_for_noise_would_be_too_sure():
    """What is told as new in each picture, but lasts: the band is no formality."""
    lasting, short = (DetectionAccuracy(place=0.0, attitude_time=time, height_time=time) for time in (1e6, 0.0))
    values = nees([passed(seed, lasting, short)[-1] for seed in range(30)])
    assert np.mean(values) > BAND[1]


def test_with_the_true_pose_a_glider_is_within_five_centimeters():
    exact = DetectionAccuracy(attitude=0.0, heading=0.0, height=0.0, slope=0.0, place=0.0)
    errors = [error for seed in range(10) for _, error, _ in passed(seed, exact)]
    assert math.sqrt(np.mean(np.sum(np.square(errors), axis=1))) < 0.05


@pytest.mark.heavy
def test_each_glider_keeps_its_id(passes):
    """A pass may lose a picture to the gate, but never its glider."""
    assert {id for rows in passes for id, _, _ in rows} == {1}


def spotted(north, east):
    (found,) = project_to_plane(CAMERA, MOUNT, UPRIGHT, (640.0, 480.0), DetectionAccuracy())
    return found._replace(north=north, east=east)


def seen(tracker, pictures, period=0.2, standing=UPRIGHT):
    """The ids that are seen in each of a number of pictures, of which each is a list of places."""
    return [
        [track.id for track in tracker.update(k * period, standing, [spotted(*place) for place in places])]
        for k, places in enumerate(pictures)
    ]


def test_a_glider_counts_when_three_of_five_pictures_have_shown_it():
    assert seen(Tracker(DetectionAccuracy()), [[(1, 1)]] * 4) == [[], [], [1], [1]]
    assert seen(Tracker(DetectionAccuracy()), [[(1, 1)], [], [(1, 1)], [], [(1, 1)]]) == [[], [], [], [], [1]]
    assert seen(Tracker(DetectionAccuracy()), [[(1, 1)], [], [], [], [(1, 1)], [(1, 1)]]) == [[]] * 6


def test_an_id_is_kept_while_the_glider_is_out_of_sight_and_never_used_again():
    tracker = Tracker(DetectionAccuracy(), TrackerSettings(memory=60.0))
    pictures = [[(1, 1)]] * 4 + [[]] * 200 + [[(1.05, 1)]] * 2 + [[]] * 400 + [[(1, 1)]] * 4
    found = seen(tracker, pictures)
    assert found[204:206] == [[1], [1]]
    assert found[-4:] == [[], [], [2], [2]]
    tracker.drop_all_tracks()
    assert seen(tracker, [[(1, 1)]] * 3)[-1] == [3]


def test_gliders_beside_each_other_are_distinguished_also_in_another_order():
    pictures = [[(0, 0), (0, 1.5)], [(0, 1.5), (0, 0)]] * 3
    tracker = Tracker(DetectionAccuracy(place=0.0), TrackerSettings(least_separation=0.8))
    assert seen(tracker, pictures)[2:] == [[1, 2]] * 4
    assert sorted(round(float(track.state[1]), 2) for track in tracker.tracks) == [0.0, 1.5]


def test_parts_of_one_glider_are_one():
    tracker = Tracker(DetectionAccuracy(), TrackerSettings(least_separation=0.8))
    assert seen(tracker, [[(0, 0), (0, 0.5)]] * 6)[2:] == [[1]] * 4


def test_markers_tell_the_id():
    tracker = Tracker(DetectionAccuracy(), TrackerSettings(least_separation=0.8))
    for k in range(4):
        found = tracker.update(k * 0.2, UPRIGHT, [spotted(0, 0), spotted(0, 0.3)], [17, 0])
    assert [track.id for track in found] == [0, 17]


def test_a_glider_that_moves():
    """0.2 m/s: a filter that expects it follows, with errors as large as it says."""
    random, values = np.random.default_rng(2), []
    accuracy = DetectionAccuracy(attitude=0.0, heading=0.0, height=0.0, slope=0.0, place=0.0)
    for _ in range(30):
        tracker = Tracker(accuracy, TrackerSettings(speed_sigma=0.2, speed_walk=0.01))
        speed = random.normal(size=2) * 0.2
        for k in range(40):
            view = spotted(*(speed * k * 0.2))
            noise = np.linalg.cholesky(view.noise) @ random.normal(size=2)
            found = tracker.update(
                k * 0.2, UPRIGHT, [view._replace(north=view.north + noise[0], east=view.east + noise[1])]
            )
        (track,) = found
        north, east, spread = track.offset(UPRIGHT, accuracy)
        error = np.array([north, east]) - speed * 39 * 0.2
        values.append(error @ np.linalg.solve(spread, error))
        assert track.state[2:] == pytest.approx(speed, abs=0.1)
    assert np.mean(values) < 2.6


def test_ten_minutes_of_false_alarms_make_no_track():
    """One in ten pictures, anywhere within 10 m."""
    random = np.random.default_rng(4)
    pictures = [random.uniform(-10.0, 10.0, (int(random.random() < 0.1), 2)).tolist() for _ in range(3000)]
    tracker = Tracker(DetectionAccuracy())
    assert not any(seen(tracker, pictures))
    assert len(tracker.tracks) < 5


def test_a_picture_from_before_the_last_one_is_harmless():
    tracker = Tracker(DetectionAccuracy())
    for time in (10.0, 10.2, 10.4, 3.0):
        found = tracker.update(time, UPRIGHT, [spotted(1, 1)])
    assert [track.id for track in found] == [1]
    assert tracker.tracks[0].time == 10.4
    assert np.isfinite(tracker.tracks[0].covariance).all()
