"""Poses of sensors and vehicles."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.pose import DOWN, Pose

angles = st.tuples(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
places = st.tuples(*[st.floats(-1e3, 1e3)] * 3)
poses = st.builds(lambda place, turn: Pose(*place, *turn), places, angles)


@given(poses, poses)
def test_a_carried_pose_is_the_product_of_both_transforms(outer: Pose, inner: Pose) -> None:
    assert outer.compose(inner).transform == pytest.approx(outer.transform @ inner.transform, abs=1e-6)


def test_what_looks_down_has_its_top_at_the_bow() -> None:
    ahead, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, -1.0])
    turn = np.array(DOWN.rotation)
    assert turn @ ahead == pytest.approx([0.0, 0.0, 1.0])
    assert turn @ up == pytest.approx([1.0, 0.0, 0.0])
    assert Pose(psi=0.5).compose(DOWN).transform[:3, :3] == pytest.approx(
        Pose(psi=0.5).transform[:3, :3] @ DOWN.transform[:3, :3]
    )
    assert math.isclose(Pose(psi=0.5).compose(DOWN).theta, -math.pi / 2)


@given(poses)
def test_a_pose_comes_back_from_its_transform(pose: Pose) -> None:
    assert Pose.from_transform(pose.transform).transform == pytest.approx(pose.transform, abs=1e-9)
