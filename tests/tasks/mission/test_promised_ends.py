"""Maneuvers of the shipped AUV that cannot end as planned say so, and those with a time keep it."""

import math

import pytest
from flying import DEPTH, place, plan_of
from lean import BLIND

import imc
from tests.repeats import repeat
from tests.tasks.mission.underway import START, underway

pytestmark = [pytest.mark.heavy, pytest.mark.computing]
BASIN = ("Bathymetry:Data=", "World:Out Of Bounds Depth=4")
DEEP = ("Bathymetry:Data=", "World:Out Of Bounds Depth=60")


def last_state(plan, seconds, *overrides, texts=None):
    """The first PlanControlState that is not EXECUTING after the start, and its time (s) after that; else the last.

    `texts` gets those of the log book.
    """
    kinds = [imc.PlanControlState, imc.LogBookEntry]
    flight = underway("lauv-noptilus-1", plan, START + seconds, BLIND, *overrides, kinds=kinds)
    if texts is not None:
        texts.extend(entry.text for _, entry in flight.heard[imc.LogBookEntry])
    states = [(at - START, state) for at, state in flight.heard[imc.PlanControlState]]
    executing = imc.PlanControlState.State.EXECUTING
    began = next(i for i, (_, state) in enumerate(states) if state.state == executing)
    return next(((at, state) for at, state in states[began:] if state.state != executing), states[-1])


def test_an_elevator_that_does_not_reach_its_depth_fails():
    elevator = imc.Elevator(
        **place(30, 0), start_z=0.0, start_z_units=DEPTH, end_z=8.0, end_z_units=DEPTH, speed=1.2, radius=15.0
    )
    at, state = last_state(plan_of(elevator), 200.0, *BASIN)
    assert state.last_outcome == imc.PlanControlState.LastOutcome.FAILURE, at
    at, state = last_state(plan_of(elevator), 120.0, *DEEP)
    assert state.last_outcome == imc.PlanControlState.LastOutcome.SUCCESS, at


def scheduled(seconds, far, depth):
    return imc.ScheduledGoto(
        **place(far, 0),
        arrival_time=1_767_225_600.0 + START + seconds,
        z=depth,
        z_units=DEPTH,
        travel_z=depth,
        travel_z_units=DEPTH,
    )


@pytest.mark.parametrize(
    ("profile", "seconds", "far", "north", "east"),
    [
        ("lauv-noptilus-1", 60.0, 60.0, 0.0, 0.0),
        repeat(("lauv-noptilus-1", 180.0, 60.0, 0.0, 0.0)),
        repeat(("otter", 100.0, 100.0, 0.4, 0.0)),
        ("otter", 100.0, 100.0, -0.4, 0.2),
        ("caravel", 150.0, 150.0, 0.3, 0.2),
    ],
)
def test_a_scheduled_goto_passes_its_point_in_time_and_ends_as_forecast_also_in_a_current(
    profile, seconds, far, north, east
):
    """A current (m/s) to the north carries the vehicle on."""
    current = [f"Simulators.StreamVelocity:Default Speed {way}" for way in (f"North={north}", f"East={east}")]
    diving = [BLIND, *DEEP] if profile.startswith("lauv") else []
    kinds = [imc.PlanControlState, imc.EstimatedState]
    plan = plan_of(scheduled(seconds, far, 2.0 if diving else 0.0))
    flight = underway(profile, plan, START + seconds + 40.0, *diving, *current, kinds=kinds)
    states = [(at - START, state) for at, state in flight.heard[imc.PlanControlState]]
    executing = imc.PlanControlState.State.EXECUTING
    began = next(i for i, (_, state) in enumerate(states) if state.state == executing)
    at, end = next((at, state) for at, state in states[began:] if state.state != executing)
    assert end.last_outcome == imc.PlanControlState.LastOutcome.SUCCESS
    assert at == pytest.approx(states[began][1].plan_eta, abs=3.0)
    here = next(state for when, state in flight.heard[imc.EstimatedState] if when - START >= at)
    left = math.hypot(far - here.x, here.y)
    assert at + left / math.hypot(here.vx, here.vy) == pytest.approx(seconds, abs=3.0)


def test_a_scheduled_goto_that_a_current_carries_to_its_point_too_early_says_so():
    texts = []
    _, end = last_state(
        plan_of(scheduled(60.0, 60.0, 2.0)),
        60.0,
        *DEEP,
        "Simulators.StreamVelocity:Default Speed North=0.9",
        texts=texts,
    )
    assert end.last_outcome == imc.PlanControlState.LastOutcome.SUCCESS
    assert any(" s before its time" in text for text in texts), texts


@pytest.mark.parametrize(
    ("maneuver", "seconds"),
    [
        pytest.param(
            imc.CompassCalibration(
                **place(30, 0), z=20.0, z_units=DEPTH, pitch=0.26, amplitude=1.0, radius=15.0, speed=1.2, duration=600
            ),
            400.0,
            id="compass calibration below the bottom",
        ),
        pytest.param(
            imc.FollowSystem(system=0x4321, duration=30, speed=1.0, x=5.0, z_units=DEPTH), 90.0, id="nobody to follow"
        ),
    ],
)
def test_a_maneuver_that_cannot_do_what_it_is_for_fails(maneuver, seconds):
    at, state = last_state(plan_of(maneuver), seconds, *BASIN)
    assert state.last_outcome == imc.PlanControlState.LastOutcome.FAILURE, at
    assert at < seconds - 5.0


@pytest.mark.parametrize(
    ("maneuver", "override", "seconds", "reason"),
    [
        pytest.param(
            imc.PopUp(**place(10, 0), z=2.0, z_units=DEPTH, radius=15.0, speed=1.2, duration=20),
            "Monitors.Medium:Enabled=Never",
            250.0,
            "has not surfaced",
            id="pop-up that nobody sees surface",
        ),
        pytest.param(
            imc.PopUp(**place(10, 0), z=2.0, z_units=DEPTH, radius=15.0, speed=1.2, duration=20),
            "Simulators.GPS:Number of Satellites=5",
            250.0,
            "no good fix has confirmed the position within 20 s",
            id="pop-up without a good fix",
        ),
        pytest.param(
            imc.StationKeeping(**place(0, 0), z=0.0, z_units=DEPTH, radius=15.0, speed=1.2, duration=150),
            "Simulators.StreamVelocity:Default Speed East=1.9",
            250.0,
            "along-track divergence error",
            id="station in a current that carries the vehicle off",
        ),
        pytest.param(
            imc.StationKeeping(**place(0, 0), z=0.0, z_units=DEPTH, radius=15.0, speed=1.2, duration=30),
            "Simulators.StreamVelocity:Default Speed East=1.9",
            100.0,
            "m from the station at the end, with a radius of 15 m",
            id="station that is over before path control gives up",
        ),
    ],
)
def test_a_maneuver_fails_that_what_surrounds_the_vehicle_prevents(maneuver, override, seconds, reason):
    texts = []
    at, state = last_state(plan_of(maneuver), seconds, *DEEP, override, texts=texts)
    assert state.last_outcome == imc.PlanControlState.LastOutcome.FAILURE, (at, state)
    assert any(reason in text for text in texts), "\n".join(texts[6:])
