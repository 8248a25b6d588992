"""Kinematic motion: velocities are derivatives, limits hold, patterns are followed."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.rotations import rotation, to_ned
from world.bodies import (
    CirclePattern,
    LegsPattern,
    LinePattern,
    MinimumJerkRamp,
    PatternMotion,
    lawn_mower_corners,
    parse_points,
)

NAMES = ["north", "east", "depth", "phi", "theta", "psi", "u", "v", "w", "vn", "ve", "vd", "p", "q", "r"]


def travel(motion, seconds, step=0.02):
    states = []
    for _ in range(round(seconds / step)):
        motion.advance(step)
        states.append({name: getattr(motion, name) for name in NAMES})
    return states


def make(pattern, current=(0.0, 0.0), heading=0.0, speed=1.5, depth=3.0, turn_rate=0.26, pitch=0.26, dive_time=8.0):
    motion = PatternMotion(pattern, heading, current, dive_time)
    motion.speed, motion.depth_target, motion.turn_rate, motion.maximum_pitch = speed, depth, turn_rate, pitch
    return motion


@st.composite
def motions(draw):
    speed = draw(st.floats(0.5, 4.0))
    heading = draw(st.floats(-3.2, 3.2))
    turn_rate = draw(st.floats(0.1, 0.5))
    current = draw(st.sampled_from([(0.0, 0.0), (0.15, -0.2), (-0.3, 0.0)]))
    radius = speed / turn_rate * draw(st.floats(1.0, 3.0))
    pattern = draw(
        st.sampled_from(
            [
                None,
                LinePattern(0.0, 0.0, heading + draw(st.floats(-1.0, 1.0)), 5 * speed),
                CirclePattern(0.0, radius, radius, 5 * speed),
                LegsPattern([*lawn_mower_corners(15.0, 6.0, 3, heading)], speed / turn_rate, 5 * speed),
                LegsPattern([(0.0, 0.0, None), (10.0, 5.0, 4.0), (-8.0, 9.0, 1.0)], speed / turn_rate, 5 * speed),
            ]
        )
    )
    pitch = draw(st.floats(0.1, 0.5))
    return make(pattern, current, heading, speed, draw(st.floats(0.0, 6.0)), turn_rate, pitch, 2.0)


@pytest.mark.heavy
@pytest.mark.computing
@settings(max_examples=25)
@given(motions())
def test_velocities_are_derivatives_and_agree_with_attitude(motion):
    turn_rate, pitch, current = motion.turn_rate, motion.maximum_pitch, (*motion.current, 0.0)
    step = 0.002
    states = travel(motion, 25.0, step)
    at = {name: np.array([state[name] for state in states]) for name in NAMES}

    def derivative(name, wrapped=False):
        change = at[name][2:] - at[name][:-2]
        return ((change + np.pi) % (2 * np.pi) - np.pi if wrapped else change) / (2 * step)

    for position, velocity in (("north", "vn"), ("east", "ve"), ("depth", "vd")):
        assert np.max(np.abs(derivative(position) - at[velocity][1:-1])) < 1e-4
    phi, theta = at["phi"][1:-1], at["theta"][1:-1]
    dphi, dtheta, dpsi = (derivative(name, wrapped=True) for name in ("phi", "theta", "psi"))
    p = dphi - dpsi * np.sin(theta)
    q = dtheta * np.cos(phi) + dpsi * np.cos(theta) * np.sin(phi)
    r = dpsi * np.cos(theta) * np.cos(phi) - dtheta * np.sin(phi)
    for name, rate in (("p", p), ("q", q), ("r", r)):
        assert np.max(np.abs(rate - at[name][1:-1])) < 5e-3
    for s in states[::50]:
        through_water = to_ned(rotation(s["phi"], s["theta"], s["psi"]), (s["u"], s["v"], s["w"]))
        over_ground = [a + b for a, b in zip(through_water, current, strict=True)]
        assert over_ground == pytest.approx((s["vn"], s["ve"], s["vd"]), abs=1e-9)
    assert at["depth"].min() >= 0.0
    assert at["depth"].max() <= 6.0
    assert np.max(np.abs(at["theta"])) <= pitch + 1e-9
    assert np.max(np.abs(dpsi)) <= 1.02 * turn_rate


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(0.1, 5), st.floats(0.01, 5))
def test_ramp_stays_within_its_limits(start, end, rate, acceleration):
    ramp = MinimumJerkRamp(start)
    ramp.set_target(end, rate, acceleration)
    low, high = min(start, end), max(start, end)
    for _ in range(100_000):
        if not ramp.moving:
            break
        ramp.advance(0.05)
        assert low - 1e-9 <= ramp.value <= high + 1e-9
        assert abs(ramp.rate) <= rate * (1 + 1e-9)
        assert abs(ramp.acceleration) <= acceleration * (1 + 1e-9)
    assert ramp.value == end


def test_it_starts_at_rest_on_the_surface():
    motion = make(CirclePattern(0.0, 20.0, 20.0, 7.5))
    assert (motion.depth, motion.u, motion.vn, motion.ve) == (0.0, 0.0, 0.0, 0.0)
    assert all(state["depth"] == 0.0 for state in travel(motion, 7.9))
    assert travel(motion, 40.0)[-1]["depth"] == 3.0


@pytest.mark.heavy
@pytest.mark.computing
def test_circle_is_round_also_in_a_current():
    for current, tolerance in (((0.0, 0.0), 0.02), ((0.3, 0.2), 0.05)):
        states = travel(make(CirclePattern(0.0, 20.0, 20.0, 7.5), current), 200.0, 0.01)[4000:]
        assert max(abs(math.hypot(s["north"], s["east"] - 20.0) - 20.0) for s in states) < tolerance


@pytest.mark.heavy
@pytest.mark.computing
def test_legs_are_followed_in_order_and_again():
    corners = lawn_mower_corners(50.0, 10.0, 4, 0.5)
    c, s = math.cos(0.5), math.sin(0.5)
    assert [(round(n * c + e * s), round(e * c - n * s)) for n, e, _ in corners[:5]] == [
        (0, 0),
        (50, 0),
        (50, 10),
        (0, 10),
        (0, 20),
    ]
    states = travel(make(LegsPattern(corners, 5.7, 7.5), heading=0.5), 600.0)
    passed = []
    for state in states:
        for index, (n, e, _) in enumerate(corners):
            if math.hypot(state["north"] - n, state["east"] - e) < 3.5 and passed[-1:] != [index]:
                passed.append(index)
    assert passed[:14] == [0, 1, 2, 3, 4, 5, 6, 7, 4, 3, 0, 1, 2, 3]  # the way back passes 4 and 3


def test_waypoints_bring_their_depths():
    legs = LegsPattern([(0.0, 0.0, None), (40.0, 0.0, 5.0), (40.0, 40.0, None)], 5.7, 7.5)
    states = travel(make(legs, depth=2.0), 150.0)
    reached = {round(s["depth"], 6) for s in states}
    assert {5.0, 2.0} <= reached


def test_hover_holds_its_place_in_a_current():
    states = travel(make(None, (0.2, -0.1), heading=1.0), 60.0)
    assert all(s["north"] == 0.0 and s["east"] == 0.0 for s in states)
    assert states[-1]["depth"] == 3.0
    assert (states[-1]["u"], states[-1]["v"]) == pytest.approx(
        (-0.2 * math.cos(1.0) + 0.1 * math.sin(1.0), 0.2 * math.sin(1.0) + 0.1 * math.cos(1.0))
    )


def test_speed_and_depth_follow_new_targets():
    motion = make(LinePattern(0.0, 0.0, 0.0, 7.5))
    travel(motion, 60.0)
    motion.speed, motion.depth_target = 0.8, 1.0
    last = travel(motion, 60.0)[-1]
    assert (last["u"], last["depth"]) == (0.8, 1.0)


def test_steps_of_any_length_lead_to_the_same_place():
    places = []
    for step in (0.01, 0.05, 0.5):
        last = travel(make(CirclePattern(0.0, 20.0, 20.0, 7.5)), 60.0, step)[-1]
        places.append((last["north"], last["east"], last["depth"]))
    assert places[1] == pytest.approx(places[2], abs=1e-3)
    assert places[0] == pytest.approx(places[2], abs=2e-2)


@pytest.mark.parametrize("row", ["", "1", "1 x", "nan 2", "1 2 3 4", "inf 1"])
def test_bad_points_are_named(row):
    with pytest.raises(ValueError, match="is not 2 or 3 numbers"):
        parse_points(["1 2", row], (2, 3))
