"""CompassCalibration and FollowSystem, flown as plans by the ideal vehicle."""

import math

import pytest
from flying import DEPTH, LAT, LON, OWN, fly, place, plan_of, replies, start, track

import imc
from runtime import Task, consume, periodic
from runtime.kernel import SECOND
from runtime.testing import START
from support.rotations import rotation
from support.wgs84 import displace
from tasks.maneuver.compass_calibration import CompassCalibration
from tasks.maneuver.follow_system import FollowSystem
from tests.tasks.mission.stalling_clock import StallingClock

DONE = ("SUCCESS", "plan completed")
EARTH = (0.26, 0.0, 0.37)  # G
OWN_FIELD = (0.05, -0.08, 0.0)  # G
LEADER = 0x0801


class Compass(Task):
    """A compass in a vehicle with a field of its own."""

    def start(self):
        self.entity.label = "AHRS"
        self._heading = 0.0

    @consume
    def on_state(self, state: imc.EstimatedState) -> None:
        self._heading = state.psi

    @periodic(10.0)
    def measure(self) -> None:
        self.publish(imc.EulerAngles(psi=self._heading))
        r = rotation(0.0, 0.0, self._heading)
        x, y, z = (sum(r[k][i] * EARTH[k] for k in range(3)) + OWN_FIELD[i] for i in range(3))
        self.publish(imc.MagneticField(x=x, y=y, z=z))


def calibration(**fields):
    usual = {"z": 3.0, "z_units": DEPTH, "speed": 1.5, "radius": 15.0, "amplitude": 1.0, "pitch": 0.26}
    return imc.CompassCalibration(**{**place(40, 0), **usual, **fields})


def calibrated(*more, seconds=200.0, **fields):
    return fly(start(plan_of(calibration(**fields))), seconds=seconds, more=more)


COMPASS = (Compass, {"entity_label": "AHRS"})


def test_the_compass_is_calibrated_in_one_turn_up_and_down():
    run = calibrated(COMPASS)
    assert replies(run)[-1] == DONE
    found = [m for m in run.of(imc.MagneticField) if m.dst == run.vehicle.system]
    assert len(found) == 1
    assert (found[0].x, found[0].y, found[0].z) == (pytest.approx(0.05, abs=1e-3), pytest.approx(-0.08, abs=1e-3), 0.0)
    assert run.vehicle.entities.label(found[0].dst, found[0].dst_ent) == "AHRS"
    assert any(text.startswith("own field of AHRS after 1.0 turns: 0.0500 G ahead") for text in run.log)
    depths = [depth for _, _, depth, time in track(run) if time > 60]
    assert min(depths) < 2.7
    assert max(depths) > 3.3


def test_without_samples_nothing_is_published_and_the_plan_fails():
    run = calibrated()
    kind, words = replies(run)[-1]
    assert kind == "FAILURE"
    assert words.endswith("AHRS is not calibrated: 0 samples of the magnetic field are too few")
    assert not run.of(imc.MagneticField)


def test_a_duration_ends_it_and_no_calibration_needs_no_samples():
    more = (CompassCalibration, {"calibrate_compass": False, "number_of_turns": 50.0})
    run = fly(
        start(plan_of(calibration(duration=30, amplitude=0.0))),
        seconds=100,
        without=(CompassCalibration,),
        more=(more,),
    )
    assert replies(run)[-1] == DONE
    assert max(abs(depth - 3.0) for _, _, depth, time in track(run) if 30 < time < 45) < 0.3


@pytest.mark.parametrize(
    ("fields", "reason"),
    [({"z_units": 0}, "z is neither a depth nor an altitude"), ({"z": 48.0}, "maneuver depth beyond limits")],
)
def test_a_calibration_that_cannot_be_carried_out_is_refused(fields, reason):
    settings = {"General": {"Absolute Maximum Depth": "50"}}
    run = fly(start(plan_of(calibration(**fields, amplitude=3.0))), seconds=20, settings=settings)
    assert reason in replies(run)[-1][1]


def leader(kind, times, speed=0.5, course=math.pi / 2, **fields):
    """Reports of a system that goes from 60 m north in a direction."""
    for time in times:
        lat, lon, _ = displace(LAT, LON, 0.0, 60 + speed * time * math.cos(course), speed * time * math.sin(course))
        yield kind(timestamp=time, src=LEADER, lat=lat, lon=lon, **fields)


def followed(*feed, seconds=150.0, **parameters):
    order = imc.FollowSystem(system=LEADER, duration=100, speed=1.5, x=-20.0, y=0.0, z=2.0, z_units=DEPTH)
    task = (FollowSystem, {"using_announce": True, "using_remote_state": True, **parameters})
    feed = sorted([start(plan_of(order)), *feed], key=lambda m: m.timestamp)
    return fly(*feed, seconds=seconds, without=(FollowSystem,), more=(task,))


@pytest.mark.parametrize(
    "reports",
    [
        list(leader(imc.Announce, range(3, 120, 10))),
        list(leader(imc.RemoteState, range(3, 120, 2), psi=math.pi / 2, depth=1)),
    ],
    ids=["Announce", "RemoteState"],
)
def test_it_stays_behind_the_system(reports):
    run = followed(*reports)
    assert replies(run)[-1] == DONE
    north, east, depth, time = next(at for at in track(run) if at[3] >= 95)
    assert (north, east) == (pytest.approx(60, abs=8), pytest.approx(0.5 * time - 20, abs=14))
    assert depth <= 3.2
    paths = run.of(imc.DesiredPath)
    assert {path.end_z for path in paths} == ({3.0} if isinstance(reports[0], imc.RemoteState) else {2.0})


def test_the_offset_to_port_is_that_of_dune():
    run = followed(*leader(imc.RemoteState, [5.0], psi=math.pi / 2))
    path = run.of(imc.DesiredPath)[0]
    lat, lon, _ = displace(LAT, LON, 0.0, 60.0, 2.5 - 20.0)
    assert (path.end_lat, path.end_lon) == (pytest.approx(lat, abs=2e-7), pytest.approx(lon, abs=2e-7))


def test_silence_of_the_system_ends_it():
    run = followed(*leader(imc.Announce, [3.0, 13.0]), timeout=30.0)
    assert replies(run)[-1][1].endswith("for 30 s")
    assert "no position of" in replies(run)[-1][1]


def test_near_the_system_it_rests():
    reports = list(leader(imc.Announce, range(3, 100, 5), speed=0.0))
    run = followed(*reports, minimum_safe_distance=100.0)
    assert not [path for path in run.of(imc.DesiredPath) if path.path_ref]
    assert replies(run)[-1] == DONE


@pytest.mark.parametrize("fields", [{"lat": 0.0, "lon": 0.0}, {"lat": 0.1, "lon": 0.1}, {"lat": math.nan, "lon": 0.0}])
def test_positions_that_are_unknown_or_absurd_are_not_followed(fields):
    reports = [imc.Announce(timestamp=float(time), src=LEADER, **fields) for time in range(3, 40, 5)]
    run = followed(*reports, timeout=20.0)
    assert not run.of(imc.DesiredPath)
    assert replies(run)[-1][0] == "FAILURE"


def test_a_leader_that_teleports_is_not_followed_there():
    reports = list(leader(imc.RemoteState, range(3, 110, 2), psi=math.pi / 2))
    far, away, _ = displace(LAT, LON, 0.0, 60.0, 1500.0)
    reports += [imc.RemoteState(timestamp=t + 0.5, src=LEADER, lat=far, lon=away) for t in range(11, 110, 2)]
    run = followed(*sorted(reports, key=lambda m: m.timestamp))
    assert replies(run)[-1] == DONE
    assert max(east for _, east, _, _ in track(run)) < 60.0
    told = [text for text in run.log if "it would have moved faster than 20 m/s" in text]
    assert len(told) == 1  # of fifty


def test_a_leader_moves_also_while_the_process_stands_still():
    order = imc.FollowSystem(system=LEADER, duration=70, speed=1.5, x=-20.0, y=0.0, z=2.0, z_units=DEPTH)
    reports = leader(imc.Announce, range(3, 80, 10), speed=15.0)
    feed = sorted([start(plan_of(order)), *reports], key=lambda m: m.timestamp)
    task, clock = (FollowSystem, {"using_announce": True}), StallingClock(round(START * SECOND), [(24.0, 8.5)])
    run = fly(*feed, seconds=85.0, without=(FollowSystem,), more=(task,), clock=clock)
    assert not clock.stalls
    assert not [text for text in run.log if "rejecting" in text]
    assert replies(run)[-1] == DONE


def test_a_vehicle_does_not_follow_itself():
    order = imc.FollowSystem(system=OWN, duration=0, speed=1.5, z=2.0, z_units=DEPTH)
    task = (FollowSystem, {"using_announce": True})
    run = fly(start(plan_of(order)), seconds=10, without=(FollowSystem,), more=(task,))
    assert replies(run)[-1][1].endswith("a vehicle cannot follow itself")


def test_a_stranger_is_not_followed():
    reports = [report.replace(src=0x0802) for report in leader(imc.Announce, range(3, 40, 5))]
    assert not followed(*reports, timeout=20.0).of(imc.DesiredPath)


def test_without_any_source_it_says_so():
    run = followed(using_announce=False, using_remote_state=False)
    assert replies(run)[-1][1].endswith("neither Using Announce nor Using RemoteState is set")
