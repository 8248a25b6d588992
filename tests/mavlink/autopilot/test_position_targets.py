"""Targets are sent once, and again only if they were lost; speeds after them, and compared with measured ones."""

import math

import pytest

import imc
from mavlink.autopilot.heartbeat import HeartbeatWatch
from mavlink.autopilot.leg import Leg, ReportedPosition
from mavlink.autopilot.leg_speed import TRIES, LegSpeed
from mavlink.autopilot.position_targets import PositionTargets
from mavlink.autopilot.vehicle_modes import ARDUPILOT, steered_vehicle
from support.wgs84 import displace

ORIGIN = 0.7188, -0.1519
COPTER, ROVER, SUB = (steered_vehicle(ARDUPILOT, kind) for kind in (2, 10, 12))


def place(north, speed=0.0):
    return ReportedPosition(*displace(*ORIGIN, 0.0, north, 0.0)[:2], 0.0, 0.0, vx=speed)


def leg(length=100.0, speed=2.0):
    lat, lon, _ = displace(*ORIGIN, 0.0, length, 0.0)
    path = imc.DesiredPath(end_lat=lat, end_lon=lon, speed=speed, speed_units=imc.SpeedUnits.METERS_PS)
    return Leg(path, place(0.0), 0.0)


def sent(vehicle, moves, shows=False, seconds=40.0):
    """The times at which targets are sent; `moves` is how far it has come at a time."""
    targets, to, times = PositionTargets(), leg(), []
    for tick in range(round(5 * seconds)):
        now = 0.2 * tick
        if shows and now >= 0.4:
            targets.receive_shown(to.lat, to.lon, now)
        if targets.due(vehicle, to, place(moves(now)), now) is not None:
            times.append(now)
    return times


@pytest.mark.parametrize("vehicle", [COPTER, ROVER, SUB])
def test_a_target_is_sent_once_while_the_vehicle_comes_closer(vehicle):
    assert sent(vehicle, lambda now: max(0.0, now - 1.0) * 0.8) == [0.0]


def test_a_target_that_the_autopilot_shows_is_not_sent_again():
    assert sent(ROVER, lambda _: 0.0, shows=True) == [0.0]


def test_a_submarine_that_does_not_move_gets_its_target_again_less_and_less_often():
    times = sent(SUB, lambda _: 0.0)
    assert times == pytest.approx([0.0, 6.0, 18.0], abs=0.3)


def test_others_get_it_every_two_seconds_until_they_move():
    times = sent(ROVER, lambda now: max(0.0, now - 3.0))
    assert times == pytest.approx([0.0, 2.0], abs=0.3)


def keep(measured, results=(), seconds=40.0):
    """A speed of 2 m/s, for an autopilot that answers so and moves so; the times of the commands."""
    speed, to, times, results = LegSpeed(), leg(), [], [*results]
    speed.restart(to.speed)
    for tick in range(round(5 * seconds)):
        now = 0.2 * tick
        if speed.command(ROVER, to, place(0.0, measured(now)), now) is not None:
            times.append(now)
            speed.settle(results.pop(0) if results else "", now)
        if speed.error:
            break
    return speed, times


def test_a_speed_that_is_kept_is_commanded_once():
    speed, times = keep(lambda now: 4.5 if now < 4.0 else 2.1)
    assert (speed.error, speed.warning, times) == ("", "", [0.0])


def test_a_speed_that_is_not_kept_is_commanded_again_and_then_given_up():
    speed, times = keep(lambda _: 4.5)
    assert len(times) == 2
    assert speed.error == "it moves at 4.5 m/s, not the plan's 2 m/s"


def test_a_speed_that_is_refused_is_commanded_again_and_then_given_up():
    speed, times = keep(lambda _: 0.0, ["the speed was denied"] * TRIES)
    assert (speed.error, len(times)) == ("the speed was denied", TRIES)
    assert keep(lambda _: 2.0, ["the speed was denied"])[0].error == ""


def test_what_holds_a_vehicle_back_is_reported_and_ends_no_plan():
    speed, _ = keep(lambda _: 0.4)
    assert (speed.error, speed.warning) == ("", "it moves at 0.4 m/s only, not the plan's 2 m/s")


def test_a_speed_that_is_unknown_is_neither_kept_nor_missed():
    assert keep(lambda _: math.nan)[0].error == ""


def test_a_heartbeat_is_late_once_and_lost_once():
    watch = HeartbeatWatch()
    assert not watch.becomes_lost(5.0, 3.0), "none was there"
    assert watch.receive(10.0)
    assert not watch.receive(11.0)
    assert not watch.is_late(12.5, 2.0)
    assert watch.becomes_late(13.5, 2.0)
    assert not watch.becomes_late(13.6, 2.0)
    assert not watch.becomes_lost(13.9, 3.0)
    assert watch.becomes_lost(14.5, 3.0)
    assert not watch.becomes_lost(14.6, 3.0)
    assert not watch.is_alive
    assert watch.receive(20.0)
