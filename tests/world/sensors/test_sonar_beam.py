"""The bottom that a beam hits, however it is found."""

import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from world.sea import Bathymetry
from world.sensors import SonarBeam

HILLS = random.Random(7)
SOUNDINGS = [
    (5.0 * i, 5.0 * j, 12.0 + 4.0 * math.sin(i) * math.cos(0.7 * j) + HILLS.uniform(-3.0, 3.0))
    for i in range(-12, 13)
    for j in range(-12, 13)
]
HILLY = Bathymetry(SOUNDINGS, 10.0, 25.0)
PLACE = st.tuples(st.floats(-80.0, 80.0), st.floats(-80.0, 80.0), st.floats(0.0, 20.0))


@pytest.mark.heavy
@settings(max_examples=400)
@given(PLACE, st.floats(-math.pi, math.pi), st.floats(-0.5 * math.pi, 0.5), st.floats(1.0, 120.0))
def test_a_quicker_look_at_the_bottom_finds_the_same_to_the_last_bit(place, pan, tilt, reach) -> None:
    beam = SonarBeam.from_vehicle(place, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), pan, tilt)
    looked: list[int] = []

    def depth(north: float, east: float) -> float:
        looked[-1] += 1
        return HILLY.depth(north, east)

    found: list[float] = []
    for more in ((), (HILLY.shallowest_near,)):
        looked.append(0)
        found.append(beam.distance_to_bottom(depth, reach, HILLY.shallowest, HILLY.deepest, HILLY.sampling_step, *more))
    assert found[0] == found[1]
    assert looked[1] <= looked[0] + 1
