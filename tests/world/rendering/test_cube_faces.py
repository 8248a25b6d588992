"""Directions and order of the faces."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from support.rotations import matrix_from_quaternion
from world.rendering.cube_faces import (
    FACE_NAMES,
    QUATERNIONS,
    face_rotations,
    stack_faces,
)

VECTORS = json.loads((Path(__file__).parents[2] / "data/sensors/fisheye.json").read_text())
AXES = dict(zip(FACE_NAMES, ((0, 0, 1), (0, -1, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, 0, -1)), strict=True))


@pytest.mark.parametrize(("number", "name"), list(enumerate(VECTORS["fisheye_face_rotations"])))
def test_rotations_match_the_vectors(number, name):
    case = VECTORS["fisheye_face_rotations"][name]
    assert FACE_NAMES[number] == name
    np.testing.assert_array_equal(face_rotations(5)[number], case["R_face_to_d"])
    np.testing.assert_allclose(matrix_from_quaternion(case["q_optical"]), case["R_face_to_d"], atol=1e-9)
    np.testing.assert_allclose(QUATERNIONS[number], case["q_optical"], atol=1e-9)


@pytest.mark.parametrize(("number", "name"), list(enumerate(FACE_NAMES)))
def test_each_face_looks_where_its_name_says(number, name):
    turn = face_rotations(6)[number]
    np.testing.assert_array_equal(turn[:, 2], AXES[name])
    assert np.linalg.det(turn) == pytest.approx(1)
    if name not in ("down", "up"):
        np.testing.assert_array_equal(turn[:, 1], AXES["down"])  # the lower edges of the sides meet the face below


def test_the_table_of_the_thesis_means_the_same_with_the_sign_of_front_put_back():
    """Its image coordinates are (row, column, depth): left-handed."""
    h = math.sqrt(0.5)
    table = ((1, 0, 0, 0), (h, 0, -h, 0), (0.5, -0.5, -0.5, -0.5), (0, h, 0, h), (0.5, 0.5, -0.5, 0.5))
    swap = np.array([[0, 1, 0], [1, 0, 0], [0, 0, 1]])
    for original, turn in zip(table, face_rotations(5), strict=True):
        np.testing.assert_allclose(swap @ matrix_from_quaternion(original) @ swap, turn, atol=1e-12)


def test_stacking_takes_three_or_four_colours():
    four = [np.full((2, 2, 4), 10 * n, dtype=np.uint8) for n in range(5)]
    atlas = stack_faces(four)
    assert atlas.shape == (21,)
    assert atlas[-1] == 0
    pixels = atlas[:-1].view(np.uint8).reshape(5, 2, 2, 4)
    np.testing.assert_array_equal(pixels, four)
    opaque = stack_faces([face[..., :3] for face in four])[:-1].view(np.uint8).reshape(5, 2, 2, 4)
    np.testing.assert_array_equal(opaque[..., :3], pixels[..., :3])
    np.testing.assert_array_equal(opaque[..., 3], 255)


@pytest.mark.parametrize(
    ("shapes", "why"),
    [
        ([(4, 4, 4)] * 4, "5 or 6 faces"),
        ([(4, 4, 4)] * 7, "5 or 6 faces"),
        ([(4, 4, 4)] * 4 + [(5, 5, 4)], "left"),
        ([(4, 3, 4)] * 5, "down"),
        ([(4, 4, 2)] * 5, "down"),
        ([(4, 4)] * 5, "down"),
        ([(0, 0, 4)] * 5, "no pixels"),
    ],
)
def test_faces_that_do_not_fit_are_refused(shapes, why):
    with pytest.raises(ValueError, match=why):
        stack_faces([np.zeros(shape, dtype=np.uint8) for shape in shapes])
