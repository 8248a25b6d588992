"""A vehicle stops on the bottom, and before a wall."""

from dataclasses import dataclass, replace

import pytest

from world.sea import Bathymetry, SeabedContact

FLAT = Bathymetry((), 10.0, 20.0)
WALL = Bathymetry([(0.0, 0.0, 4.0)], 10.0, 30.0)  # 4 m of water within 10 m, 30 m of it elsewhere
H = 0.01  # s


@dataclass
class Hull:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    p: float = 0.0
    q: float = 0.0
    r: float = 0.0
    draft: float = 0.1
    ground_velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def move(self):
        n, e, d = self.ground_velocity
        self.x, self.y, self.z = self.x + H * n, self.y + H * e, max(0.0, self.z + H * d)


def move(hull, sea, steps, north=0.0):
    """Move and hold; returns the depths of the water at the touches, and the deepest keel."""
    grounding, touches, deepest = SeabedContact(), list[float](), 0.0
    grounding.reset(hull, north, 0.0, sea)
    for _ in range(steps):
        hull.move()
        water = grounding.apply(hull, sea, H)
        touches += [] if water is None else [water]
        deepest = max(deepest, hull.z + hull.draft)
    return touches, deepest


def test_it_sinks_to_the_bottom_and_slides_to_a_stop():
    hull = Hull(z=10.0, q=0.5, ground_velocity=(2.0, 0.0, 0.5))
    touches, deepest = move(hull, FLAT, 2100)
    assert touches[0] == 20.0
    assert deepest <= 20.0 + 1e-9
    assert hull.z == pytest.approx(19.9)
    assert hull.ground_velocity[2] == 0.0
    assert hull.x < 2.0 * 19.9 + 0.5


def test_a_vehicle_that_buoyancy_lifts_off_the_bottom_is_not_held():
    hull = Hull(z=19.9 - 0.003, q=0.5, ground_velocity=(1.0, 0.0, -0.01))
    touches, _ = move(hull, FLAT, 5)
    assert touches == [20.0] * 5
    assert (hull.ground_velocity, hull.q) == ((1.0, 0.0, -0.01), 0.5)
    pressed = Hull(z=19.9, q=0.5, ground_velocity=(1.0, 0.0, 0.01))
    move(pressed, FLAT, 6)
    assert pressed.ground_velocity == (pytest.approx(0.75, abs=0.051), 0.0, 0.0)
    assert pressed.q < 0.5


def test_far_from_the_bottom_nothing_is_changed():
    hull = Hull(z=5.0, q=0.5, ground_velocity=(2.0, 1.0, 0.1))
    before = replace(hull)
    assert move(hull, FLAT, 1) == ([], pytest.approx(5.101))
    assert (hull.ground_velocity, hull.q) == (before.ground_velocity, before.q)


def test_it_rises_along_a_wall_against_which_a_current_presses_it():
    hull, grounding = Hull(z=9.0), SeabedContact()
    grounding.reset(hull, 12.0, 0.0, WALL)
    rise = 0.0
    for _ in range(6000):
        rise = min(0.1, rise + 0.1 * H)
        hull.ground_velocity = -0.3, 0.0, -rise if hull.ground_velocity[2] or rise < 0.01 else 0.0
        hull.move()
        grounding.apply(hull, WALL, H)
    assert hull.z < 4.0


def test_a_wall_stops_it_where_it_was_free():
    hull = Hull(z=9.0, ground_velocity=(-2.0, 0.0, 0.0))
    touches, _ = move(hull, WALL, 1000, north=20.0)
    assert touches[0] == 4.0
    assert hull.x == pytest.approx(-10.0, abs=0.03)
    assert hull.z == 9.0
    assert hull.ground_velocity == (0.0, 0.0, 0.0)


def test_one_that_is_placed_where_the_water_is_too_shallow_lies_on_the_bottom():
    hull = Hull(z=9.0)
    SeabedContact().reset(hull, 0.0, 0.0, WALL)
    assert hull.z == pytest.approx(3.9)
    ashore = Bathymetry((), 10.0, -2.0)
    hull = Hull(z=1.0, ground_velocity=(1.0, 0.0, 0.0))
    assert move(hull, ashore, 3)[0] == [-2.0] * 3
    assert (hull.x, hull.z) == (0.0, 0.0)


def test_the_level_of_the_water_counts_everywhere():
    tide = Bathymetry([(0.0, 0.0, 4.0)], 10.0, 30.0, level=1.5)
    assert [tide.depth(*at) for at in ((0.0, 0.0), (1.0, 1.0), (50.0, 0.0))] == pytest.approx([5.5, 5.5, 31.5])
    assert tide.shallowest == 5.5
    assert tide.is_clear(0.0, 0.0, 5.4)
    assert not tide.is_clear(5.0, 5.0, 5.6)
    assert tide.is_clear(50.0, 0.0, 31.4)
