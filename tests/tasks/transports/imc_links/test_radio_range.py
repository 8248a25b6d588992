"""The simulated radio of limited range."""

import math

import imc
from tasks.transports.imc_links.radio_range import Reach

LAT, LON = math.radians(41.185), math.radians(-8.706)
FAR = LAT + 500.0 / 6_371_000.0  # 500 m to the north
CONSOLE, OTHER, NOWHERE = 0x4001, 0x001B, 0x4002


def reach(*, depth: float = 0.0, under_water: bool = False) -> Reach:
    made = Reach(300.0, under_water, [imc.Abort.ID])
    made.sight(imc.Announce(src=CONSOLE, lat=LAT, lon=LON))
    made.sight(imc.Announce(src=OTHER, lat=FAR, lon=LON))
    made.sight(imc.Announce(src=NOWHERE))
    made.locate(imc.EstimatedState(lat=LAT, lon=LON, depth=depth))
    return made


def reached(radio: Reach, message: type[imc.Message] = imc.EstimatedState) -> set[int]:
    return {system for system in (CONSOLE, OTHER, NOWHERE, 0x4003) if radio.has(system, message.ID)}


def test_who_is_near_is_reached_and_who_is_nowhere_is_not() -> None:
    assert reached(reach()) == {CONSOLE}
    assert reach().has(0xFFFF, imc.EstimatedState.ID), "a static destination has no position"
    assert reached(reach(), imc.Abort) == {CONSOLE, OTHER, NOWHERE, 0x4003}
    assert reached(Reach(300.0, True, [])) == set(), "the own position is not known yet"


def test_the_vehicle_takes_its_reach_along() -> None:
    radio = reach()
    assert reached(radio) == {CONSOLE}
    radio.locate(imc.EstimatedState(lat=FAR, lon=LON))
    assert reached(radio) == {OTHER}
    radio.sight(imc.Announce(src=CONSOLE, lat=FAR, lon=LON))
    assert reached(radio) == {CONSOLE, OTHER}


def test_under_water_nobody_is_reached_unless_the_profile_says_so() -> None:
    assert reached(reach(depth=1.0)) == set()
    assert reached(reach(depth=1.0, under_water=True)) == {CONSOLE}


def test_many_systems_need_bounded_memory() -> None:
    radio = reach()
    for system in range(1000):
        radio.sight(imc.Announce(src=system, lat=LAT, lon=LON))
    assert not radio.has(0, imc.EstimatedState.ID)
    assert radio.has(999, imc.EstimatedState.ID)
