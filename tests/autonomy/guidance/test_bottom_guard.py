"""A depth that is given up for an altitude."""

from autonomy.guidance import BottomGuard


def test_a_bottom_that_rises_is_avoided_until_it_falls():
    guard = BottomGuard(2.5)
    assert not guard.update(3.0, 3.0, 4.0)
    assert guard.update(3.0, 3.0, 2.4)
    assert guard.active
    assert not guard.update(3.0, 2.0, 2.5)
    assert not guard.update(3.0, 2.0, -1.0)
    assert not guard.update(3.0, 2.9, 2.7)
    assert guard.update(3.0, 2.9, 3.2)
    assert not guard.active


def test_the_surface_is_never_too_deep():
    assert not BottomGuard(2.5).update(0.0, 0.1, 1.0)
