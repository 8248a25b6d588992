"""Labels against a ray caster that works another way, and against the pictures."""

import math
from dataclasses import replace

import numpy as np
import pytest

from support.pose import DOWN, Pose
from tests.world.rendering import ray_caster
from world.optics import DoubleSphereModel, FisheyeModel, PinholeModel, kannala_brandt_lens, preset_lens
from world.rendering import Glider, Labeler, PixelClass, SceneCamera, ScenePose
from world.sea import SeaState

FISHEYE = FisheyeModel(96, 96, 96 / math.pi, 96 / math.pi, 48.0, 48.0, preset_lens("equidistant", math.pi))
WIDE = preset_lens("woodscape", math.radians(230.0))
CAMERAS = {
    "fisheye": FISHEYE,
    "wider than half of all": FisheyeModel(110, 83, 29.0, 29.5, 57.3, 38.9, WIDE),
    "kannala brandt": FisheyeModel(
        90, 90, 33.0, 33.0, 44.2, 47.0, kannala_brandt_lens((0.003, 7e-4, -0.002, 2e-4), 3.4)
    ),
    "brown": PinholeModel(120, 77, 73.4, 73.2, 66.1, 31.7, -0.28340811, 0.07395907, 1.9e-4, 1.8e-3),
    "narrow": PinholeModel(100, 60, 400.0, 410.0, 20.5, 90.0),
    "double sphere": DoubleSphereModel(96, 90, 30.0, 31.0, 49.0, 41.0, -0.2, 0.59),
}
FORWARD = Pose(1.1, -0.2, 0.3, 0.1, -0.25, 0.4)
STARBOARD = Pose(0.0, 0.3, -0.2, 0.0, math.radians(-35), math.radians(80))
GLIDERS = (
    Glider(3.2, -1.5, 0.0, 0.4, id=7),
    Glider(3.9, -2.2, 0.3, 2.0, id=3),
    Glider(5.0, -2.0, 1.2, -1.0, 1.6, 0.4, id=300),
    Glider(2.4, 0.4, 0.6, 1.5, 0.5, 0.5, id=12),
    Glider(4.6, -0.4, 2.5, 0.2, 1.0, 0.2, id=5),
)
DIVING = ScenePose(3.0, -2.0, 3.0, 6.0, 0.2, -0.1, 1.0)
VIEWS = {
    "down": (DIVING, DOWN),
    "forward": (replace(DIVING, north=0.5, east=-2.4, yaw=0.1), FORWARD),
    "starboard, rolled": (replace(DIVING, north=2.0, east=-4.0, height=2.0, roll=-0.6, yaw=0.4), STARBOARD),
    "in the air": (replace(DIVING, height=4.0, depth=-4.0, pitch=0.9), DOWN),
}


def moved(standpoint):
    """The next picture, of gliders of which one is gone and others go on."""
    after = replace(standpoint, north=standpoint.north + 0.11, east=standpoint.east - 0.07, yaw=standpoint.yaw + 0.04)
    after = replace(after, height=after.height - 0.06, depth=after.depth + 0.05, roll=after.roll - 0.03)
    _gone, turned, ahead, *rest = GLIDERS
    return after, (ahead._replace(north=5.1, height=1.25), turned._replace(heading=2.1, east=-2.15), *rest)


class Trial:
    """The labels of a view, and what the ray caster finds."""

    def __init__(self, name, view):
        self.optics = CAMERAS[name]
        self.standpoint, self.mount = VIEWS[view]
        scene = "Sea Surface" if view == "in the air" else "Seabed"
        self.then = moved(self.standpoint)
        self.found = Labeler(self.optics, self.mount, scene).labels(self.standpoint, GLIDERS, self.then)
        self.shape = self.optics.height, self.optics.width
        j, i = np.mgrid[: self.optics.height, : self.optics.width]
        self.centers = np.stack((i + 0.5, j + 0.5), axis=-1)
        rays, valid = self.optics.unproject(self.centers)
        assert np.nanmax(np.abs(self.optics.project(rays)[0] - self.centers)[valid]) < 1e-6
        self.rays = rays.reshape(-1, 3)
        turn = ray_caster.camera_frame(self.standpoint, self.mount)
        self.cast = ray_caster.cast(turn, self.rays, self.standpoint, GLIDERS, scene)

    def image(self, values):
        return values.reshape(*self.shape, *values.shape[1:])

    @property
    def inside(self):
        """The pixels that are farther than 1 px from all edges of classes and objects."""
        what = np.pad(self.image(self.cast.kinds * 1000 + self.cast.instances), 1, mode="edge")
        height, width = self.shape
        near = [what[j : j + height, i : i + width] for j in range(3) for i in range(3)]
        return np.all([each == near[4] for each in near], axis=0)


@pytest.fixture(scope="module", params=[(name, view) for name in CAMERAS for view in VIEWS], ids=" ".join)
def trial(request):
    return Trial(*request.param)


def test_distance_and_depth_are_those_of_the_ray_caster(trial):
    expected = trial.image(trial.cast.distance)
    np.testing.assert_allclose(trial.found.distance[trial.inside], expected[trial.inside], rtol=1e-5)
    along = trial.image(trial.rays)[..., 2]
    depth = np.where(np.isinf(expected), expected, expected * along)
    np.testing.assert_allclose(trial.found.depth[trial.inside], depth[trial.inside], rtol=1e-5, atol=1e-5)


def test_classes_and_instances_are_those_of_the_ray_caster(trial):
    kinds, instances = trial.image(trial.cast.kinds), trial.image(trial.cast.instances)
    np.testing.assert_array_equal(trial.found.kinds[trial.inside], kinds[trial.inside])
    np.testing.assert_array_equal(trial.found.instances[trial.inside], instances[trial.inside])
    assert np.mean(trial.found.instances != instances) < 1e-3


def test_boxes_are_those_of_the_ray_caster(trial):
    boxes = {box.instance: box for box in trial.found.boxes}
    for number, alone in trial.cast.alone.items():
        if alone.sum() < 4:  # so small that rounding decides whether it is seen at all
            continue
        box = boxes[number]
        visible = trial.cast.instances == number
        for pixels, corners, area in ((alone, box.whole_box, box.whole_area), (visible, box.box, box.area)):
            rows, columns = np.nonzero(trial.image(pixels))
            assert area == pytest.approx(pixels.sum(), abs=2)
            if rows.size > 3:
                edges = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
                assert np.abs(np.subtract(corners, edges)).max() <= 1
        assert box.occluded_share == pytest.approx(1 - visible.sum() / alone.sum(), abs=2 / alone.sum())
    assert not any(trial.cast.alone[number].sum() == 0 and box.whole_area > 2 for number, box in boxes.items())


def test_what_the_border_cuts_off_is_that_of_rays_all_around(trial):
    """Of directions drawn at random, all over the sphere, those that meet a glider but not the picture."""
    random = np.random.default_rng(1)
    rays = random.standard_normal((8000, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    turn = ray_caster.camera_frame(trial.standpoint, trial.mount)
    for box in trial.found.boxes:
        (glider,) = (each for each in GLIDERS if each.id == box.instance)
        toward = turn[:3, :3].T @ (np.array((glider.north, glider.east, -glider.height)) - turn[:3, 3])
        spread = min(2.0, glider.length / np.linalg.norm(toward))
        near = rays * spread + toward / np.linalg.norm(toward)
        lengths = np.linalg.norm(near, axis=1, keepdims=True)
        # Drawn in a ball around the direction, rays are densest toward its middle: weigh them back.
        cosine = (near / lengths) @ toward / np.linalg.norm(toward)
        hits = np.isfinite(ray_caster.march(turn[:3, 3], near / lengths @ turn[:3, :3].T, glider))
        bins = np.minimum((np.arccos(np.clip(cosine, -1, 1)) / 0.02).astype(int), 157)
        rings = np.cos(np.arange(158) * 0.02) - np.cos(np.arange(1, 159) * 0.02)
        weight = (rings / np.maximum(np.bincount(bins, minlength=158), 1))[bins] * hits
        outside = ~trial.optics.project(near)[1]
        assert box.cut_share == pytest.approx(np.sum(weight * outside) / np.sum(weight), abs=0.05)


def test_flow_leads_to_where_the_point_is_seen_next(trial):
    after, gliders = trial.then
    turn = ray_caster.camera_frame(after, trial.mount)
    points = ray_caster.seen_again(trial.cast, GLIDERS, trial.standpoint, after, turn, gliders)
    expected = trial.optics.project(trial.image(points))[0] - trial.centers
    void = trial.image(trial.cast.kinds) == PixelClass.VOID
    inside = trial.inside & ~void
    np.testing.assert_allclose(trial.found.flow[inside], expected[inside], atol=0.005)
    assert np.isnan(trial.found.flow[void | (trial.found.instances == GLIDERS[0].id)]).all()
    assert np.isfinite(trial.found.flow[inside]).mean() > 0.6


@pytest.mark.parametrize("waves", [0.0, 0.5, 2.5])
def test_labels_are_those_of_the_picture(waves):
    """Yellow is where a glider is, and the rest is brighter or darker than the horizon, also above high waves."""
    lens = FisheyeModel.from_lens(preset_lens("equidistant", math.radians(200.0)), 300)
    camera = SceneCamera(lens, scene="Sea Surface", waves=SeaState(waves))
    standpoint, gliders = ScenePose(0.0, 0.0, 1.5, 0.0, 0.2, 0.1, 0.7), (Glider(1.0, 0.4), Glider(-0.5, 1.4, 0.2, 1.0))
    picture, found = camera.take_picture(standpoint, gliders), camera.labels(standpoint, gliders)
    red, _, blue = np.moveaxis(picture[..., :3].astype(int), -1, 0)
    yellow = (red > 90) & (blue < red // 2)
    shown = found.kinds == PixelClass.GLIDER
    assert shown.sum() > 400
    assert np.sum(yellow != shown) < 0.06 * shown.sum()  # a rim of half a pixel
    np.testing.assert_array_equal(picture[..., 3] == 0, found.kinds == PixelClass.VOID)
    low, high = (red[found.kinds == kind] for kind in (PixelClass.SURFACE, PixelClass.SKY))
    assert np.percentile(low, 99) < np.percentile(high, 1)


def test_gliders_without_numbers_get_theirs_in_their_order():
    found = Labeler(FISHEYE).labels(ScenePose(0.0, 0.0, 3.0, 5.0), (Glider(1.0, 0.0), Glider(-1.0, 0.0)))
    assert [box.instance for box in found.boxes] == [1, 2]
    assert found.boxes[0].box[1] < found.boxes[1].box[1]  # the first one is ahead, so above
    assert set(np.unique(found.instances)) == {0, 1, 2}


def test_a_glider_behind_another_is_reported_with_nothing_visible():
    found = Labeler(FISHEYE).labels(ScenePose(0.0, 0.0, 3.0, 5.0), (Glider(0.0, 0.0, 1.5), Glider(0.0, 0.0)))
    above, below = found.boxes
    assert (below.area, below.occluded_share, below.box) == (0, 1.0, (0, 0, 0, 0))
    assert below.whole_area > 10
    assert (above.occluded_share, above.cut_share) == (0.0, 0.0)


def test_a_camera_close_to_a_glider_sees_it_as_large_as_it_is():
    """A ball fills a circle of known angle, however close the camera is."""
    ball = Glider(0.0, 0.0, length=0.2, diameter=0.2)
    for near in (0.6, 0.11, 0.1001):
        (box,) = Labeler(FISHEYE).labels(ScenePose(0.0, 0.0, near, 5.0), (ball,)).boxes
        radius = math.asin(0.1 / near) / (math.pi / 2) * 48
        assert box.area == pytest.approx(math.pi * radius**2, rel=0.03)


STILL = ScenePose(0.0, 0.0, 3.0, 5.0)


@pytest.mark.parametrize(
    ("standpoint", "gliders", "mount", "told"),
    [
        (replace(STILL, north=math.nan), (), DOWN, "not finite"),
        (replace(STILL, yaw=math.inf), (), DOWN, "not finite"),
        (replace(STILL, east=1e30), (), DOWN, "more than 1e.07 m away"),
        (replace(STILL, height=0.0), (), DOWN, "above the ground is under it"),
        (STILL, (), DOWN._replace(z=3.5), "-0.5 m above the ground is under it"),
        (STILL, (), DOWN._replace(x=math.nan), "not finite"),
        (STILL, (Glider(0.0, 0.0, 3.0, id=4),), DOWN, "within object 4"),
        (STILL, (Glider(0.3, 0.0, 3.07, id=4),), DOWN, "within object 4"),
        (STILL, (Glider(0.0, math.nan, id=4),), DOWN, "object 4 is not finite"),
        (STILL, (Glider(0.0, 1.0, length=0.0, id=4),), DOWN, "object 4: 0 m by 0.16 m"),
        (STILL, (Glider(0.0, 1.0, diameter=0.0, id=4),), DOWN, "object 4: 0.8 m by 0 m"),
        (STILL, (Glider(0.0, 1.0, id=4), Glider(0.0, 2.0, id=4)), DOWN, "the number 4 "),
        (STILL, (Glider(0.0, 1.0, id=4), Glider(0.0, 2.0)), DOWN, "the number 0 "),
        (STILL, (Glider(0.0, 1.0, id=65536),), DOWN, "the number 65536 "),
    ],
)
def test_what_cannot_be_labelled_is_refused(standpoint, gliders, mount, told):
    with pytest.raises(ValueError, match=told):
        Labeler(FISHEYE, mount).labels(standpoint, gliders)


def test_an_unknown_scene_is_refused():
    with pytest.raises(ValueError, match="'Moon' is not one of the scenes"):
        Labeler(FISHEYE, scene="Moon")


@pytest.mark.parametrize("depth", [0.002, 0.01, 0.04, 0.2])
def test_the_surface_is_as_near_as_it_is(depth):
    """Looking straight up, it is as far as the camera is deep, however little that is."""
    up = Pose(theta=math.pi / 2)
    here = ScenePose(0.0, 0.0, 5.0, depth)
    found = Labeler(PinholeModel(33, 33, 30.0, 30.0, 16.5, 16.5), up).labels(here)
    assert found.kinds[16, 16] == PixelClass.SURFACE
    assert found.distance[16, 16] == pytest.approx(depth, rel=1e-6)
    picture = SceneCamera(PinholeModel(33, 33, 30.0, 30.0, 16.5, 16.5), 64, 6, mount=up).take_picture(here)
    assert (picture[..., 3] == 255).all()
