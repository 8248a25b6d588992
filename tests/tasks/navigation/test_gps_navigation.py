"""Navigation of a boat: circles in a current, sensors that are lost and return, its uncertainty."""

import math

import numpy as np
import pytest

import imc
from imc.coordinates import absolute_position
from runtime import State, Task
from runtime.testing import simulate
from support.wgs84 import displace, displacement
from tasks.navigation.general.gps_navigation import GPSNavigation

LAT, LON = math.radians(41.185), math.radians(-8.7062)
ANY = {"gps": "", "imu": "", "yaw": "", "altimeter": ""}
VALID = 0x1FF
RADIUS, SPEED = 15.0, 1.5


class GPS(Task):
    """Reserves the entity."""


def truth(time, stream=(0.2, -0.3)):
    """Position (m), heading, heading rate and velocity over ground of a boat that circles in a current."""
    rate = SPEED / RADIUS
    psi = rate * time
    x, y = RADIUS * math.sin(psi) + stream[0] * time, RADIUS * (1.0 - math.cos(psi)) + stream[1] * time
    return x, y, psi, rate, SPEED * math.cos(psi) + stream[0], SPEED * math.sin(psi) + stream[1]


def sensors(seconds, noise=0.0, seed=0, gone=(math.inf, math.inf), **options):
    """GPS at 1 Hz with white noise (m), lost between two times; attitude at 50 Hz."""
    random = np.random.default_rng(seed)
    feed = []
    for k in range(round(seconds * 50)):
        time = 0.02 * k + 0.001
        x, y, psi, rate, vx, vy = truth(time, **options)
        feed.append(imc.EulerAngles(timestamp=time, psi=math.remainder(psi, 2.0 * math.pi)))
        feed.append(imc.AngularVelocity(timestamp=time, z=rate))
        if k % 50 == 0 and not gone[0] <= time < gone[1]:
            dn, de = noise * random.standard_normal(2)
            lat, lon, _ = displace(LAT, LON, 0.0, x + dn, y + de)
            dx, dy = 0.05 * random.standard_normal(2)
            sog, cog = math.hypot(vx + dx, vy + dy), math.atan2(vy + dy, vx + dx)
            feed.append(
                imc.GpsFix(timestamp=time, validity=VALID, lat=lat, lon=lon, hacc=2.0, hdop=0.9, sog=sog, cog=cog)
            )
    return feed


def navigate(feed, **parameters):
    return simulate(GPSNavigation, feed=feed, **(ANY | parameters))


def errors(run, begin=0.0, **options):
    """Distances (m) of the estimates from the truth, from `begin` (s) on."""
    found = []
    for state in run.of(imc.EstimatedState):
        time = state.timestamp - run.vehicle.start_time
        if time >= begin:
            lat, lon, _ = absolute_position(state)
            north, east, _ = displacement(LAT, LON, 0.0, lat, lon, 0.0)
            x, y, *_ = truth(time, **options)
            found.append(math.hypot(north - x, east - y))
    return found


def test_a_compass_without_roll_and_pitch_gives_the_heading():
    """The heading of a GNSS compass has NaN for roll and pitch, which come from an IMU without a heading."""
    feed = []
    for message in sensors(60.0):
        if isinstance(message, imc.EulerAngles):
            feed.append(message.replace(phi=math.nan, theta=math.nan))
            feed.append(message.replace(psi=math.nan))
        else:
            feed.append(message)
    run = navigate(feed)
    assert run.task.entity.state is State.NORMAL
    state = run.of(imc.EstimatedState)[-1]
    psi = truth(state.timestamp - run.vehicle.start_time)[2]
    assert math.remainder(state.psi - psi, math.tau) == pytest.approx(0.0, abs=0.05)


def test_position_velocity_and_current_are_found_in_circles():
    run = navigate(sensors(150.0, noise=0.5))
    assert max(errors(run, 30.0)) < 1.5
    state = run.of(imc.EstimatedState)[-1]
    _, _, psi, rate, vx, vy = truth(state.timestamp - run.vehicle.start_time)
    assert (state.vx, state.vy) == pytest.approx((vx, vy), abs=0.15)
    assert (state.r, state.depth, state.z) == (pytest.approx(rate), 0.0, 0.0)
    assert abs(math.remainder(state.psi - psi, 2.0 * math.pi)) < 0.01
    assert (state.u, state.v) == pytest.approx(
        (math.cos(psi) * vx + math.sin(psi) * vy, math.cos(psi) * vy - math.sin(psi) * vx), abs=0.15
    )
    water = run.of(imc.EstimatedStreamVelocity)[-1]
    assert (water.x, water.y) == pytest.approx((0.2, -0.3), abs=0.1)


@pytest.mark.heavy
def test_it_is_not_surer_than_it_may_be():
    """Normalized squared errors of the position, over seeds and seconds; fixes claim 2 m and have it."""
    ratios = []
    for seed in range(5):
        run = navigate(sensors(50.0, noise=math.sqrt(2.0), seed=seed))
        sure = [m.x + m.y for m in run.of(imc.NavigationUncertainty)][-600::20]
        ratios += [error**2 / size for error, size in zip(errors(run)[-600::20], sure, strict=True)]
    assert 0.2 < sum(ratios) / len(ratios) < 1.2


def test_without_fixes_the_last_velocities_go_on_and_it_is_an_error():
    run = navigate(sensors(100.0, gone=(60.0, 85.0)))
    states = [(m.timestamp - run.vehicle.start_time, m.state, m.description) for m in run.of(imc.EntityState)]
    lost = [time for time, state, text in states if (state, text) == (State.ERROR, "GPS is missing")]
    assert lost[0] == pytest.approx(69.1, abs=0.2)
    assert run.task.entity.state is State.NORMAL
    assert max(errors(run, 30.0)) < 4.0
    sizes = {round(m.timestamp - run.vehicle.start_time, 2): m.x for m in run.of(imc.NavigationUncertainty)}
    assert sizes[84.0] > 4.0 * sizes[59.0]


def test_without_attitude_it_is_an_error():
    feed = [m for m in sensors(10.0) if m.timestamp < 5.0 or not isinstance(m, imc.EulerAngles)]
    run = navigate(feed)
    assert (run.task.entity.state, run.task.entity.description) == (State.ERROR, "attitude is missing")


def test_a_fix_without_height_is_at_the_height_of_the_one_before():
    feed = sensors(6.0)
    heights = iter((50.0, *[math.nan] * 9))
    feed = [m.replace(height=next(heights)) if isinstance(m, imc.GpsFix) else m for m in feed]
    run = navigate(feed)
    assert run.of(imc.GpsFixRejection) == []
    assert {state.height for state in run.of(imc.EstimatedState)} == {50.0}


def test_before_the_first_fix_nothing_is_published():
    run = navigate([m for m in sensors(2.0) if not isinstance(m, imc.GpsFix)])
    assert (run.task.entity.state, run.task.entity.description) == (State.BOOT, "waiting for GPS fix")
    assert run.of(imc.EstimatedState) == run.of(imc.NavigationUncertainty) == []


def test_bad_fixes_are_refused_and_a_position_that_stays_elsewhere_is_taken():
    good = sensors(60.0)
    bad = imc.GpsFix(timestamp=30.0, validity=VALID, lat=LAT, lon=LON + 0.01, hacc=50.0)
    invalid = imc.GpsFix(timestamp=31.5, validity=0)
    nowhere = imc.GpsFix(timestamp=32.5, validity=VALID, lat=math.nan, hacc=2.0)
    run = navigate(sorted([*good, bad, invalid, nowhere], key=lambda m: m.timestamp))
    assert len(run.of(imc.GpsFixRejection)) == 3
    assert max(errors(run, 20.0)) < 1.0
    moved = [m.replace(lat=m.lat + 2e-5) if isinstance(m, imc.GpsFix) and m.timestamp > 40.0 else m for m in good]
    run = navigate(moved)
    assert any("is reset to theirs" in text for text in run.log)
    assert errors(run)[-1] == pytest.approx(127.0, abs=2.0)


def test_the_reference_follows_far_away():
    run = navigate(sensors(60.0, stream=(10.0, 0.0)), farthest=100.0)
    assert len({m.lat for m in run.of(imc.EstimatedState)}) > 3
    assert max(errors(run, 30.0, stream=(10.0, 0.0))) < 1.5


def test_only_the_named_entity_is_received():
    fixes = [m for m in sensors(5.0)]
    run = navigate(fixes, gps="GPS")
    assert run.of(imc.NavigationUncertainty) == []
    run = simulate([(GPSNavigation, ANY | {"gps": "GPS"}), GPS], seconds=0.1)
    own = run.tasks[1].entity.id
    feed = [m.replace(src_ent=own) if isinstance(m, imc.GpsFix) else m for m in fixes]
    run = simulate([(GPSNavigation, ANY | {"gps": "GPS"}), GPS], feed=feed)
    assert run.of(imc.NavigationUncertainty)


def test_the_depth_of_the_water_is_the_altitude_until_it_is_old():
    sounded = imc.Distance(timestamp=1.0, validity=imc.Distance.Validity.VALID, value=4.5)
    deaf = sounded.replace(timestamp=2.0, value=math.nan)
    run = navigate(sorted([*sensors(10.0), sounded, deaf], key=lambda m: m.timestamp))
    found = {round(m.timestamp - run.vehicle.start_time): m.alt for m in run.of(imc.EstimatedState)}
    assert (found[0], found[4], found[9]) == (-1.0, 4.5, -1.0)


@pytest.mark.heavy
@pytest.mark.computing
def test_fixes_that_drift_are_found_by_their_own_speed_and_noise_and_a_current_are_not():
    sound = navigate(sensors(300.0, noise=2.0, stream=(0.6, -0.4)))
    assert {m.description for m in sound.of(imc.EntityState) if m.state == State.ERROR} == set()
    drifting = [
        m.replace(lon=m.lon + 0.4 * m.timestamp / 4.8e6) if isinstance(m, imc.GpsFix) else m for m in sensors(120.0)
    ]
    run = navigate(drifting)
    found = [m for m in run.of(imc.EntityState) if m.state == State.ERROR]
    assert found[0].description == "GPS drifts away from its own speed"
    assert found[0].timestamp - run.vehicle.start_time < 90.0
