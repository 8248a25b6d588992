"""The relief of the seabed, and walls, in labels and pictures."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from runtime.profile import load_profile
from support.pose import DOWN, Pose
from tests.world.rendering import ray_caster
from world import read_world
from world.optics import FisheyeModel, PinholeModel, preset_lens
from world.rendering import Glider, PixelClass, SceneCamera, ScenePose, april_grid_cells
from world.rendering.objects.calibration_targets import Board
from world.rendering.renderer import optical_to_ned_rotation
from world.sea import Bathymetry

REACH = 120.0  # m, of the ray caster
WALLS = (((4.0, 3.0), (9.0, -3.0)), ((-6.0, -4.0), (-6.0, 5.0)))
AHEAD = Pose(0.3, 0.1, 0.2, 0.05, -0.2, 0.3)
FISHEYE = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 72)
PINHOLE = PinholeModel(75, 60, 68.0, 68.0, 37.5, 30.0)


def hills():
    """Soundings 6 m apart over hills of half a meter, with a ridge in the north."""
    places = [(n, e) for n in range(-60, 61, 6) for e in range(-60, 61, 6)]
    rows = [(n, e, 7 + 0.5 * math.sin(n / 9) + 0.4 * math.cos(e / 7) - 2.5 * (n == 12)) for n, e in places]
    return Bathymetry(rows, 20.0, 25.0)


def harbor():
    """The soundings of the shipped AUV."""
    sea = read_world(load_profile("lauv-noptilus-1").value).seabed
    assert sea is not None
    return sea


SEAS = {"hills": (hills(), (0.0, 0.0, 3.5)), "harbor": (harbor(), (24.0, 30.0, 2.0))}


def standpoint(sea, north, east, depth, **angles):
    return ScenePose(north, east, sea.depth(north, east) - depth, depth, **angles)


def on_ground(sea, pose, north, east, **fields):
    """A glider that lies on the bottom, seen from a pose."""
    return Glider(north, east, pose.height + pose.depth - sea.depth(north, east), **fields)


class Trial:
    """Labels of a view over a relief with walls, and what a ray caster finds in the true bottom."""

    def __init__(self, name, optics, mount):
        self.sea, (north, east, depth) = SEAS[name]
        self.camera = SceneCamera(optics, 64, 6, mount=mount, seabed=self.sea, walls=self.walls(north, east))
        self.pose = standpoint(self.sea, north, east, depth, roll=0.25, pitch=-0.1, yaw=0.4)
        lying = [(2.0, 1.0), (4.5, -1.5), (17.0, 2.0), (9.0, 1.0)]
        self.gliders = [
            on_ground(self.sea, self.pose, north + n, east + e, heading=e, id=k)
            for k, (n, e) in enumerate(lying, start=1)
        ]
        self.then = replace(self.pose, north=north + 0.1, east=east - 0.07, yaw=0.43, depth=depth + 0.05)
        self.then = replace(self.then, height=self.sea.depth(self.then.north, self.then.east) - self.then.depth)
        moved = [glider._replace(height=self.rise(glider, self.then)) for glider in self.gliders]
        self.found = self.camera.labels(self.pose, self.gliders, (self.then, moved))
        self.turn = ray_caster.camera_frame(replace(self.pose, height=-depth), mount)
        self.shape = optics.height, optics.width
        j, i = np.mgrid[: optics.height, : optics.width]
        self.centers = np.stack((i + 0.5, j + 0.5), axis=-1)
        rays, self.covered = optics.unproject(self.centers)
        self.rays = np.nan_to_num(rays.reshape(-1, 3)) @ self.turn[:3, :3].T
        self._cast()

    def walls(self, north, east):
        return tuple(tuple((n + north, e + east) for n, e in wall) for wall in WALLS)

    def rise(self, glider, pose):
        return pose.height + pose.depth - self.sea.depth(glider.north, glider.east)

    def _cast(self):
        origin, rays = self.turn[:3, 3], self.rays
        self.ground = ray_caster.march_down(self.sea, origin, rays)
        with np.errstate(divide="ignore"):
            top = np.where(rays[:, 2] < 0, -origin[2] / rays[:, 2], np.inf)
        wall = np.min([ray_caster.wall_distance(each, origin, rays) for each in self.camera.walls], axis=0)
        self.distance = np.minimum(np.minimum(np.minimum(self.ground, top), wall), 1e9)
        self.kinds = np.select(
            [wall <= self.distance, top <= self.distance], [PixelClass.WALL, PixelClass.SURFACE], PixelClass.SEABED
        )
        self.instances = np.zeros(len(rays), dtype=int)
        self.alone = {}
        for glider in self.gliders:
            # The caster's gliders are above its ground at zero depth.
            far = ray_caster.march(origin, rays, glider._replace(height=-self.sea.depth(glider.north, glider.east)))
            self.alone[glider.id] = np.isfinite(far) & self.covered.ravel()
            own = np.flatnonzero(np.isfinite(far))
            straight = (glider.length - glider.diameter) / 2 * np.array([-1, 0, 1])
            ends = glider.north + straight * math.cos(glider.heading), glider.east + straight * math.sin(glider.heading)
            bed = self.sea.depth(glider.north, glider.east) + glider.diameter / 2 - self.sea.depths(*ends).min()
            lowered = ray_caster.march_down(self.sea, origin, rays[own], bed)
            own = own[(far[own] < lowered) & (far[own] < wall[own]) & (far[own] < top[own])]
            free = self.instances[own] == 0
            own = own[free | (far[own] < self.distance[own])]
            self.distance[own], self.kinds[own], self.instances[own] = far[own], PixelClass.GLIDER, glider.id

    def image(self, values):
        return values.reshape(*self.shape, *values.shape[1:])

    @property
    def inside(self):
        """The pixels that are farther than 1 px from edges of classes, objects, and of ground before other ground."""
        what = np.pad(self.image(self.kinds * 100 + self.instances), 1, mode="edge")
        far = np.pad(self.image(np.log(self.distance)), 1, mode="edge")
        height, width = self.shape
        parts = [(slice(j, j + height), slice(i, i + width)) for j in range(3) for i in range(3)]
        same = np.all([what[part] == what[parts[4]] for part in parts], axis=0)
        steps = [np.abs(far[a] - far[b]) for a, b in pairwise(parts)]
        smooth = np.max(steps, axis=0) < 0.25
        return same & smooth & self.covered & (self.image(self.distance) < REACH)


VIEWS = [
    pytest.param(("hills", FISHEYE, DOWN), id="hills", marks=pytest.mark.heavy),
    pytest.param(("hills", PINHOLE, AHEAD), id="hills ahead"),
    pytest.param(("harbor", FISHEYE, DOWN), id="harbor", marks=pytest.mark.heavy),
    pytest.param(("harbor", PINHOLE, AHEAD), id="harbor ahead"),
]


@pytest.fixture(scope="module", params=VIEWS)
def trial(request):
    return Trial(*request.param)


@pytest.mark.heavy
def test_distances_to_a_relief_are_those_of_the_true_bottom(trial):
    inside, expected = trial.inside, trial.image(trial.distance)
    assert inside.sum() > 0.6 * trial.covered.sum()
    np.testing.assert_allclose(trial.found.distance[inside], expected[inside], rtol=1e-3)
    errors = np.abs(trial.found.distance[inside] / expected[inside] - 1)
    assert np.percentile(errors, 90) < 1e-5  # most of the bottom is smooth
    along = trial.image(trial.rays @ trial.turn[:3, 2])
    np.testing.assert_allclose(trial.found.depth[inside], (expected * along)[inside], rtol=1e-3, atol=1e-3)


def test_classes_over_a_relief_are_those_of_the_ray_caster(trial):
    inside = trial.inside
    np.testing.assert_array_equal(trial.found.kinds[inside], trial.image(trial.kinds)[inside])
    np.testing.assert_array_equal(trial.found.instances[inside], trial.image(trial.instances)[inside])
    assert {PixelClass.SEABED, PixelClass.WALL} <= set(np.unique(trial.found.kinds))


def test_what_ground_and_walls_hide_of_a_glider_is_reported(trial):
    boxes = {box.instance: box for box in trial.found.boxes}
    for number, alone in trial.alone.items():
        if alone.sum() < 6:
            continue
        visible = np.sum((trial.instances == number) & trial.covered.ravel())
        assert boxes[number].whole_area == pytest.approx(alone.sum(), abs=2)
        assert boxes[number].area == pytest.approx(visible, abs=3)


def test_flow_over_a_relief_leads_to_where_the_point_is_seen_next(trial):
    turn = ray_caster.camera_frame(replace(trial.then, height=-trial.then.depth), trial.camera.mount)
    points = trial.turn[:3, 3] + trial.distance[:, None] * trial.rays - turn[:3, 3]
    expected = trial.camera.optics.project(trial.image(points @ turn[:3, :3]))[0] - trial.centers
    inside = trial.inside
    np.testing.assert_allclose(trial.found.flow[inside], expected[inside], atol=0.02)
    assert np.isfinite(trial.found.flow[inside]).mean() > 0.9


@pytest.mark.parametrize("name", SEAS)
@pytest.mark.parametrize(
    "optics",
    [
        pytest.param(FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 512), marks=pytest.mark.heavy),
        PINHOLE,
    ],
)
def test_a_point_of_the_ground_is_shown_where_it_projects_to(name, optics):
    """The place that each pixel of a view shows, put onto the true bottom, is seen in that pixel."""
    sea, (north, east, depth) = SEAS[name]
    shown = SceneCamera(optics, 0, seabed=sea)
    errors = []
    for step in range(4):
        pose = standpoint(sea, north + 0.7 * step, east + 0.3 * step, depth, roll=0.2 - 0.1 * step, yaw=0.4 * step)
        _, renderer = shown._tables
        near = renderer._surroundings(
            np.zeros(renderer.caster.width**2 * 5 + 1, np.uint32), optical_to_ned_rotation(pose), pose, ()
        )
        for turn, close, ((first, last), (left, right)) in zip(
            optical_to_ned_rotation(pose) @ renderer.faces, near, renderer.windows, strict=True
        ):
            if first == last:
                continue
            axis = renderer.caster.axis.astype(float)
            x, y = np.meshgrid(axis[left:right], axis[first:last])
            rays = np.stack((x, y, np.ones_like(x)), axis=-1).reshape(-1, 3)
            near_by = close[first:last, left:right].ravel()
            place = (rays / np.maximum(near_by, 1e-9)[:, None]) @ turn.T + (pose.north, pose.east, pose.depth)
            seen = (near_by > 1 / 18.0) & (place[:, 2] > 0.2)  # nearer than the visibility
            place[:, 2] = sea.depths(place[:, 0].copy(), place[:, 1].copy())
            back = (place - (pose.north, pose.east, pose.depth)) @ turn
            error = (back[:, :2] / back[:, 2:] - rays[:, :2]) * renderer.width / 2
            errors.append(np.linalg.norm(error[seen], axis=1))
    apart = np.concatenate(errors)
    assert len(apart) > 20000 or optics is PINHOLE
    assert math.sqrt(np.mean(apart**2)) <= 0.5
    assert np.percentile(apart, 99.9) <= 1.5  # the rest are edges of ground before other ground


@pytest.mark.heavy
def test_pictures_do_not_depend_on_where_the_camera_was_before():
    sea, (north, east, depth) = SEAS["hills"]
    traveled, fresh = (SceneCamera(FISHEYE, 64, seabed=sea, walls=WALLS) for _ in range(2))
    for k in range(6):
        traveled.take_picture(standpoint(sea, north + 9.0 * k, east - 5.0 * k, depth))
    pose = standpoint(sea, north, east, depth, roll=0.3)
    np.testing.assert_array_equal(traveled.take_picture(pose), fresh.take_picture(pose))
    for ours, theirs in zip(traveled.split_into_bands(3), fresh.split_into_bands(3), strict=True):
        np.testing.assert_array_equal(ours.take_picture(pose), theirs.take_picture(pose))
    mine, other = traveled.labels(pose), fresh.labels(pose)
    np.testing.assert_array_equal(mine.distance, other.distance)


def test_a_level_relief_looks_like_a_plane():
    level = Bathymetry([(n, e, 6.0) for n in range(-60, 61, 20) for e in range(-60, 61, 20)], 30.0, 6.0)
    pose = ScenePose(1.0, 2.0, 3.0, 3.0, roll=0.3, yaw=1.0)
    gliders = [Glider(2.0, 2.5, id=1), Glider(-1.0, 4.0, id=2)]
    optics = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 256)
    plane, relief = (SceneCamera(optics, 256, 6, seabed=seabed) for seabed in (None, level))
    pictures = [each.take_picture(pose, gliders).astype(int) for each in (plane, relief)]
    assert np.mean(np.abs(pictures[0] - pictures[1]).max(axis=-1) > 3) < 0.01
    flat, found = (each.labels(pose, gliders) for each in (plane, relief))
    near = flat.distance < 50.0
    np.testing.assert_allclose(found.distance[near], flat.distance[near], rtol=1e-5)
    assert found.boxes == flat.boxes


def test_a_bottom_without_soundings_is_the_plane_itself():
    flat = Bathymetry((), 10.0, 8.0)
    pose = ScenePose(1.0, 2.0, 3.0, 5.0, roll=0.3)
    pictures = [
        SceneCamera(FISHEYE, 64, seabed=seabed, glider_positions=((2.0, 2.0),)).take_picture(pose)
        for seabed in (None, flat)
    ]
    np.testing.assert_array_equal(*pictures)


def test_a_ridge_hides_a_glider_and_a_board_in_the_picture_too():
    sea, _ = SEAS["hills"]
    pose = standpoint(sea, 4.0, 0.0, 6.0)
    shown = SceneCamera(PINHOLE, 0, mount=Pose(), seabed=sea)
    hidden, open_ = on_ground(sea, pose, 18.0, 0.0, id=1), on_ground(sea, pose, 8.5, 0.5, id=2)
    board = Board(april_grid_cells(2, 2), 0.05, 18.0, 1.0, pose.height + pose.depth - sea.depth(18.0, 1.0), id=3)
    boxes = {box.instance: box for box in shown.labels(pose, [hidden, open_], boards=[board]).boxes}
    assert boxes[1].occluded_share == 1.0
    assert boxes[2].occluded_share == 0.0
    assert boxes[3].occluded_share == 1.0
    empty = shown.take_picture(pose, [])
    np.testing.assert_array_equal(shown.take_picture(pose, [hidden], [board]), empty)
    assert (shown.take_picture(pose, [open_]) != empty).any(axis=-1).sum() >= boxes[2].area > 5


def test_a_wall_is_seen_from_the_bottom_to_the_surface_and_hides_what_is_behind():
    pose, wall = ScenePose(0.0, 0.0, 4.0, 3.0), (((6.0, -2.0), (6.0, 3.0)),)
    optics = PinholeModel(160, 160, 60.0, 60.0, 80.0, 80.0)
    behind, before = Glider(8.0, 0.0, 1.0, id=1), Glider(4.0, 0.0, 1.0, id=2)
    for seabed in (None, Bathymetry([(n, e, 7.0) for n in (-20, 0, 20) for e in (-20, 0, 20)], 40.0, 7.0)):
        shown = SceneCamera(optics, 0, mount=Pose(), seabed=seabed, walls=wall)
        found = shown.labels(pose, [behind, before])
        rows, columns = np.nonzero(found.kinds == PixelClass.WALL)
        edges = 80 - 60 * 2 / 6, 80 + 60 * 3 / 6, 80 - 60 * 3 / 6, 80 + 60 * 4 / 6
        assert np.abs(np.subtract((columns.min(), columns.max() + 1, rows.min(), rows.max() + 1), edges)).max() <= 1
        assert {box.instance: box.occluded_share for box in found.boxes} == {1: 1.0, 2: 0.0}
        picture = shown.take_picture(pose, [behind, before])
        np.testing.assert_array_equal(picture, shown.take_picture(pose, [before]))
        open_ = SceneCamera(optics, 0, mount=Pose(), seabed=seabed).take_picture(pose, [before])
        changed = np.any(picture != open_, axis=-1)
        assert changed[found.kinds == PixelClass.WALL].mean() > 0.97
        assert changed[found.kinds == PixelClass.SEABED].mean() < 0.01


@pytest.mark.parametrize(
    ("place", "told"),
    [
        ((12.0, 0.0, 5.5), "is under it"),
        ((0.0, 0.0, 30.0), "is under it"),
        ((6.5, 0.0, 3.0), "within a wall|in a wall"),
    ],
)
def test_a_camera_in_ground_or_wall_is_refused(place, told):
    sea, _ = SEAS["hills"]
    north, east, depth = place
    blind = SceneCamera(FISHEYE, 64, seabed=sea, walls=WALLS)
    pose = ScenePose(north, east, 2.0, depth)
    assert blind.obstruction(pose)
    with pytest.raises(ValueError, match=told):
        blind.labels(pose)
    assert blind.obstruction(replace(pose, north=0.0, east=0.0, depth=2.0)) == ""


def test_a_height_that_contradicts_depth_and_seabed_is_refused():
    sea, _ = SEAS["hills"]
    camera, right = SceneCamera(FISHEYE, 64, seabed=sea), standpoint(sea, 0.0, 0.0, 2.0)
    camera.take_picture(right)
    wrong = replace(right, height=right.height + 1.0)
    for look in (camera.take_picture, camera.labels):
        with pytest.raises(ValueError, match="contradicts depth = 2 m"):
            look(wrong)
