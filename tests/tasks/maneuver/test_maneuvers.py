"""Every maneuver, flown as a plan by the ideal vehicle."""

import math

import pytest
from flying import BOARD, CCU, DEPTH, OWN, START, fly, place, plan_of, replies, start, track
from ideal_vehicle import IdealVehicle

import imc
from imc.coordinates import row_pattern
from runtime import periodic
from runtime.testing import simulate
from tasks.maneuver.maneuver_task import missed_depths_text

DONE = ("SUCCESS", "plan completed")
Medium = imc.VehicleMedium.Medium


def flown(*maneuvers, seconds=200.0, feed=(), **options):
    """The run of a plan with these maneuvers."""
    return fly(start(plan_of(*maneuvers)), *feed, seconds=seconds, **options)


def duration(run):
    """Time (s) between the last START and the end of the plan."""
    ended = [m.timestamp for m in run.of(imc.PlanControl) if m.info == "plan completed"]
    return ended[0] - run.vehicle.start_time - START


def at(north, east, depth=0.0, speed=1.5, **fields):
    return {**place(north, east), "z": depth, "z_units": DEPTH, "speed": speed, **fields}


def test_depths_that_are_missed_are_counted():
    assert missed_depths_text([]) == ""
    assert missed_depths_text(["depth 1 m"]) == "depth 1 m"
    assert missed_depths_text(["depth 1 m", "depth 2 m"]) == "depth 1 m (and once more)"
    assert missed_depths_text(["depth 1 m", "depth 2 m", "depth 3 m"]) == "depth 1 m (and 2 more times)"


def test_idle_takes_its_duration():
    run = flown(imc.IdleManeuver(duration=5), seconds=20)
    assert replies(run)[-1] == DONE
    assert duration(run) == pytest.approx(5.0)
    assert [m.eta for m in run.of(imc.ManeuverControlState)][1:6] == [5, 4, 3, 2, 1]


def test_goto_is_done_when_it_is_near():
    run = flown(imc.Goto(**at(60, 0, 2)), seconds=60)
    assert replies(run)[-1] == DONE
    assert duration(run) == pytest.approx(60 / 1.5 - 5.0, abs=0.2)


def test_loiter_counts_from_the_circle():
    run = flown(imc.Loiter(**at(60, 0, 2), radius=15, duration=60), seconds=150)
    assert replies(run)[-1] == DONE
    assert duration(run) == pytest.approx((60 - 15) / 1.5 + 60, abs=1.5)
    path = run.of(imc.DesiredPath)[0]
    assert (path.lradius, path.flags) == (15.0, 0)


def test_loiter_is_never_too_small_and_turns_as_it_is_reported():
    run = flown(imc.Loiter(**at(20, 0), radius=2, duration=5, direction=imc.Loiter.Direction.CCLOCKW), seconds=40)
    path = run.of(imc.DesiredPath)[0]
    assert (path.lradius, path.flags) == (10.0, imc.DesiredPath.Flags.CCLOCKW)


def test_an_eight_changes_its_side_and_direction():
    eight = imc.Loiter(**at(0, 80), type=imc.Loiter.Type.EIGHT, radius=15, length=60, duration=300)
    run = flown(eight, seconds=450)
    assert replies(run)[-1] == DONE
    paths = run.of(imc.DesiredPath)
    assert len(paths) >= 4
    assert [p.flags for p in paths[:4]] == [0, 16, 0, 16]
    lats = [math.degrees(p.end_lat - place(0, 80)["lat"]) * 111_000 for p in paths[:2]]
    assert lats == [pytest.approx(30, abs=0.5), pytest.approx(-30, abs=0.5)]


def test_station_keeping_goes_back_when_it_has_drifted():
    station = imc.StationKeeping(**at(0, 40), radius=12, duration=200)
    run = flown(station, seconds=300, vehicle={"current_east": 0.3})
    assert replies(run)[-1] == DONE
    outside = [text for text in run.log if text.startswith("outside safe region")]
    assert len(outside) >= 3
    assert max(e for _, e, _, t in track(run) if 60 < t < 220) < 40 + 12.5


def test_station_keeping_reaches_a_circle_that_is_smaller_than_the_way_of_its_last_seconds():
    station = imc.StationKeeping(**at(0, 40), radius=2, duration=200, custom="Minimum Radius=2")
    run = flown(station, seconds=300, vehicle={"current_east": 0.3})
    assert replies(run)[-1] == DONE
    assert max(abs(e - 40.0) for _, e, _, t in track(run) if 60 < t < 220) < 4.0


@pytest.mark.parametrize(
    ("custom", "radius"),
    [("Minimum Radius=3", 3.0), ("a=b; Minimum Radius = 4", 4.0), ("", 10.0), ("Minimum Radius=nan", 10.0),
     ("Minimum Radius=0", 10.0), ("Minimum Radius", 10.0), ("Minimum Radius=-3", 10.0)],
)  # fmt: skip
def test_a_station_has_the_minimum_radius_unless_it_brings_its_own(custom, radius):
    custom = f"{custom};Under Water=circle"
    run = flown(imc.StationKeeping(**at(0, 10, 2), radius=1, duration=5, custom=custom), seconds=20)
    assert run.of(imc.DesiredPath)[0].lradius == radius


def test_station_keeping_under_water_circles_at_its_depth_if_it_says_so():
    run = flown(imc.StationKeeping(**at(0, 40, 2), radius=12, duration=100, custom="Under Water=Circle"), seconds=200)
    assert replies(run)[-1] == DONE
    (path,) = run.of(imc.DesiredPath)
    assert (path.end_z, path.lradius) == (2.0, 12.0)
    assert all(abs(z - 2.0) < 0.3 for _, _, z, t in track(run) if 60 < t < 120)


def test_station_keeping_under_water_ends_with_the_motor_off_and_goes_back_at_the_surface():
    """As in DUNE: the way there is at the station's depth, what it has drifted by is covered at the surface."""
    station = imc.StationKeeping(**at(0, 40, 2), radius=12, duration=200)
    run = flown(station, seconds=300, vehicle={"current_east": 0.3})
    assert replies(run)[-1] == DONE
    there, *back = run.of(imc.DesiredPath)
    assert (there.end_z, there.lradius) == (2.0, 0.0)
    assert len(back) >= 2
    assert {(path.end_z, path.end_z_units) for path in back} == {(0.0, imc.ZUnits.DEPTH)}


def test_station_keeping_ends_with_maneuver_done():
    station = imc.StationKeeping(**at(0, 0), radius=12)
    run = flown(station, imc.IdleManeuver(duration=1), feed=[imc.ManeuverDone(timestamp=30.0, src=CCU)], seconds=40)
    assert replies(run)[-1] == DONE
    assert duration(run) == pytest.approx(29.0, abs=0.2)


def test_follow_path_goes_through_its_points():
    points = [imc.PathPoint(x=30, y=0, z=1), imc.PathPoint(x=30, y=30, z=2), imc.PathPoint(x=0, y=30)]
    run = flown(imc.FollowPath(**at(0, 0, 1), points=points), seconds=120)
    assert replies(run)[-1] == DONE
    assert [p.end_z for p in run.of(imc.DesiredPath)] == [2.0, 3.0, 1.0]
    assert {m.info for m in run.of(imc.ManeuverControlState)} >= {"waypoint=0", "waypoint=1", "waypoint=2"}


def test_rows_cover_their_width():
    rows = imc.Rows(**at(20, 0, 2), width=40, length=60, hstep=20, alternation=100, flags=2, bearing=math.pi / 2)
    run = flown(rows, seconds=400)
    assert replies(run)[-1] == DONE
    north, east = zip(*[(n, e) for n, e, _, t in track(run) if t > 20], strict=True)
    assert min(north) == pytest.approx(20 - 40, abs=8)
    assert max(east) == pytest.approx(60, abs=8)


def test_rows_coverage_follows_from_the_swath():
    sonar = {"angaperture": math.radians(120), "range": 30, "overlap": 20}
    run = flown(imc.RowsCoverage(**at(0, 0, 2), width=100, length=50, flags=2, **sonar), seconds=500)
    assert replies(run)[-1] == DONE
    wide = row_pattern.sonar_row_spacing(math.radians(120), 30, 20)
    assert len(run.of(imc.DesiredPath)) == 2 + 2 * int(100 / wide) + 1


def test_rows_coverage_is_denser_where_the_water_is_shallow():
    sonar = {"angaperture": math.radians(120), "range": 30, "overlap": 20}
    area = imc.RowsCoverage(**at(0, 0, 2), width=60, length=50, flags=2, **sonar)
    run = flown(area, seconds=600, vehicle={"bottom": 10.0})
    assert replies(run)[-1] == DONE
    wide = row_pattern.altitude_row_spacing(math.radians(120), 8.0, 20)  # 8 m above the bottom
    assert len(run.of(imc.DesiredPath)) == 2 + 2 * int(60 / wide) + 1
    assert wide < row_pattern.sonar_row_spacing(math.radians(120), 30, 20)


def test_yoyo_swings_between_two_depths():
    yoyo = imc.YoYo(**at(300, 0, 5), amplitude=3, pitch=math.radians(15))
    run = flown(yoyo, seconds=250)
    assert replies(run)[-1] == DONE
    depths = [d for _, _, d, t in track(run) if 40 < t < 180]
    assert min(depths) == pytest.approx(2.2, abs=0.6)
    assert max(depths) == pytest.approx(7.8, abs=0.6)
    pitches = [m.value for m in run.of(imc.DesiredPitch)]
    steps = [abs(b - a) for a, b in zip([0.0, *pitches], pitches, strict=False)]
    assert max(steps) <= math.radians(10) + 1e-6
    assert pitches[-1] == 0.0


def test_elevator_spirals_down():
    run = flown(
        imc.Elevator(**place(40, 0), start_z=1, end_z=6, start_z_units=1, end_z_units=1, speed=1.5), seconds=120
    )
    assert replies(run)[-1] == DONE
    paths = run.of(imc.DesiredPath)
    assert [(p.end_z, p.lradius) for p in paths] == [(1.0, 0.0), (6.0, 10.0)]
    assert max(d for *_, d, _ in track(run)) == pytest.approx(5.7, abs=0.4)


def test_elevator_without_progress_fails():
    elevator = imc.Elevator(start_z=0, end_z=6, end_z_units=1, speed=0.2, flags=imc.Elevator.Flags.CURR_POS)
    run = flown(elevator, seconds=90)
    assert ("FAILURE", "Elevator maneuver error: vertical speed is below 0.1 m/s") in replies(run)


@pytest.mark.heavy
def test_popup_surfaces_and_dives_again():
    flags = imc.PopUp.Flags.WAIT_AT_SURFACE
    run = flown(imc.Goto(**at(30, 0, 6)), imc.PopUp(**at(80, 0, 6), duration=20, radius=15, flags=flags), seconds=300)
    assert replies(run)[-1] == DONE
    depths = [(d, t) for *_, d, t in track(run) if t < START + duration(run)]
    up = [t for d, t in depths if d < 0.35 and t > 40]
    assert up[-1] - up[0] >= 19
    assert max(d for d, t in depths if t > up[-1]) == pytest.approx(5.7, abs=0.4)


def test_popup_above_a_shallow_bottom_fails():
    class Bottom(IdealVehicle):
        """Cannot go deeper than 3 m."""

        @periodic(20.0)
        def move(self):
            self.depth = min(self.depth, 3.0)
            super().move()

    popup = imc.PopUp(**at(40, 0, 8), duration=5, radius=15, flags=imc.PopUp.Flags.WAIT_AT_SURFACE)
    feed = [start(plan_of(popup)), *(imc.VehicleMedium(timestamp=float(t), medium=Medium.WATER) for t in range(150))]
    run = simulate([*BOARD, Bottom], feed, seconds=150)
    assert replies(run)[-1] == ("FAILURE", "PopUp maneuver error: vertical speed is below 0.1 m/s")


def test_popup_waits_for_a_good_fix():
    good = imc.GpsFix(timestamp=200.0, validity=imc.GpsFix.Validity.VALID_POS, satellites=9, **place(80, 0))
    popup = imc.PopUp(**at(80, 0, 3), radius=15)
    run = flown(popup, seconds=100)
    assert replies(run)[-1] != DONE
    popup = imc.PopUp(**at(0, 0, 3), radius=15, flags=imc.PopUp.Flags.CURR_POS)
    fixes = [good.replace(timestamp=60.0, satellites=4, **place(0, 0)), good.replace(timestamp=80.0, **place(0, 0))]
    run = flown(popup, seconds=140, feed=fixes)
    assert replies(run)[-1] == DONE


def test_launch_waits_for_the_water():
    dry = [imc.SoundSpeed(timestamp=float(t), value=340.0) for t in range(30)]
    run = flown(imc.Launch(**at(40, 0)), seconds=80, feed=dry)
    assert replies(run)[-1] == DONE
    assert run.of(imc.DesiredPath)[0].timestamp - run.vehicle.start_time >= 30


@pytest.mark.parametrize(
    ("seconds", "policy", "expected", "note"),
    [
        (80, 0, 80, ""),
        (40, 0, 58, "; m0: arrived 23 s after its time"),
        (40, 1, 0, "; m0: skipped 100 m before the point: it is too late"),
    ],
)
def test_scheduled_goto_arrives_in_time_or_says_how_late(seconds, policy, expected, note):
    arrival = 1_767_225_600.0 + START + seconds
    goto = imc.ScheduledGoto(
        **place(0, 100), arrival_time=arrival, z=2, z_units=1, travel_z=4, travel_z_units=1, delayed=policy
    )
    run = flown(goto, seconds=120)
    assert replies(run)[-1] == ("SUCCESS", f"plan completed{note}")
    assert note or duration(run) == pytest.approx(expected, abs=7)


def test_scheduled_goto_may_fail():
    goto = imc.ScheduledGoto(**place(0, 100), arrival_time=1.0, delayed=imc.ScheduledGoto.Delayed.FAIL)
    assert ("FAILURE", "ScheduledGoto maneuver error: cannot arrive in time: 100 m are left") in replies(
        flown(goto, seconds=20)
    )


def test_dislodge_is_done_at_the_surface_or_fails():
    run = flown(imc.Dislodge(rpm=1500), seconds=20)
    assert replies(run)[-1] == DONE
    stuck = [imc.EstimatedState(timestamp=2.0 + 0.5 * i, depth=5.0) for i in range(200)]
    run = flown(imc.Dislodge(rpm=1500, timeout=60), seconds=80, feed=stuck)
    assert run.of(imc.DesiredSpeed)[0].value == 1500.0


def test_teleoperation_ends_when_the_operator_says_so():
    for over in (imc.TeleoperationDone(), imc.RemoteActions(actions="Thrust=10;Exit=1")):
        run = flown(imc.Teleoperation(), feed=[over.replace(timestamp=20.0, src=CCU, dst=OWN)], seconds=30)
        assert replies(run)[-1] == DONE
        assert duration(run) == pytest.approx(18.0)
        assert [m.mask for m in run.of(imc.ControlLoops) if m.enable] == [imc.CLoopsMask.TELEOPERATION]


def reference(at_time, north, east, *, flags=0, depth=2.0, speed=1.5, **fields):
    has = imc.Reference.Flags
    return imc.Reference(
        timestamp=at_time,
        src=CCU,
        dst=OWN,
        flags=has.LOCATION | has.SPEED | has.Z | flags,
        speed=imc.DesiredSpeed(value=speed),
        z=imc.DesiredZ(value=depth, z_units=1),
        **place(north, east),
        **fields,
    )


def test_references_are_followed_until_the_last():
    done = imc.Reference.Flags.MANDONE
    feed = [reference(5.0, 60, 0, depth=20.0), reference(80.0, 60, 60), reference(140.0, 0, 0, flags=done)]
    run = flown(imc.FollowReference(control_src=CCU, control_ent=0xFF, timeout=0), feed=feed, seconds=160)
    assert replies(run)[-1] == DONE
    states = [imc.FollowRefState.State(m.state).name for m in run.of(imc.FollowRefState)]
    assert [s for s in dict.fromkeys(states)] == ["WAIT", "GOTO", "ELEVATOR", "HOVER"]
    assert max(e for _, e, *_ in track(run)) > 40


def test_references_of_others_count_as_silence():
    order = imc.FollowReference(control_src=CCU + 1, control_ent=0xFF, timeout=10)
    run = flown(order, feed=[reference(5.0, 60, 0)], seconds=30)
    assert ("FAILURE", "FollowReference maneuver error: reference timeout") in replies(run)
    assert run.of(imc.FollowRefState)[-1].state == imc.FollowRefState.State.TIMEOUT
