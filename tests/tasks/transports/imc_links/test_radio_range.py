"""The simulated radio of limited range."""

import math

import imc
from tasks.transports.imc_links.radio_range import RadioRange

LAT, LON = math.radians(41.185), math.radians(-8.706)
FAR = LAT + 500.0 / 6_371_000.0  # 500 m to the north
CONSOLE, OTHER, NOWHERE = 0x4001, 0x001B, 0x4002


def reach(*, depth: float = 0.0, under_water: bool = False) -> RadioRange:
    made = RadioRange(300.0, under_water, [imc.Abort.ID])
    made.on_announce(imc.Announce(src=CONSOLE, lat=LAT, lon=LON))
    made.on_announce(imc.Announce(src=OTHER, lat=FAR, lon=LON))
    made.on_announce(imc.Announce(src=NOWHERE))
    made.on_own_state(imc.EstimatedState(lat=LAT, lon=LON, depth=depth))
    return made


def reached(radio: RadioRange, message: type[imc.Message] = imc.EstimatedState) -> set[int]:
    return {system for system in (CONSOLE, OTHER, NOWHERE, 0x4003) if radio.reaches(system, message.ID)}


def test_who_is_near_is_reached_and_who_is_nowhere_is_not() -> None:
    assert reached(reach()) == {CONSOLE}
    assert reach().reaches(0xFFFF, imc.EstimatedState.ID), "a static destination has no position"
    assert reached(reach(), imc.Abort) == {CONSOLE, OTHER, NOWHERE, 0x4003}
    assert reached(RadioRange(300.0, True, [])) == set(), "the own position is not known yet"


def test_the_vehicle_takes_its_reach_along() -> None:
    radio = reach()
    assert reached(radio) == {CONSOLE}
    radio.on_own_state(imc.EstimatedState(lat=FAR, lon=LON))
    assert reached(radio) == {OTHER}
    radio.on_announce(imc.Announce(src=CONSOLE, lat=FAR, lon=LON))
    assert reached(radio) == {CONSOLE, OTHER}


def test_under_water_nobody_is_reached_unless_the_profile_says_so() -> None:
    assert reached(reach(depth=1.0)) == set()
    assert reached(reach(depth=1.0, under_water=True)) == {CONSOLE}


def test_many_systems_need_bounded_memory() -> None:
    radio = reach()
    for system in range(1000):
        radio.on_announce(imc.Announce(src=system, lat=LAT, lon=LON))
    assert not radio.reaches(0, imc.EstimatedState.ID)
    assert radio.reaches(999, imc.EstimatedState.ID)
