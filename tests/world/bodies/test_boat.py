"""The motion of boats: balances with closed solutions, symmetries, conserved energy, signs of rudders and wind."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

import imc
from runtime.profile import read_sections
from runtime.testing import simulate
from tasks.simulators.battery import Battery
from tasks.simulators.motor import Motor
from tasks.simulators.vsim import VSIM
from tasks.simulators.wind import Wind
from world.bodies import Boat, DivergedError, ModelError, is_boat_model, read_boat_model
from world.bodies.boat import AIR

MODELS = read_sections(Path(__file__).parents[3] / "etc/common/vsim-models.ini")


def model(name, **changes):
    section = MODELS[f"VSIM/Model/{name}"] | {option.replace("_", " "): text for option, text in changes.items()}
    return read_boat_model(lambda _, option: section.get(option, ""), name)


OTTER, DISPLACEMENT = model("otter"), model("displacement-boat")
AIRLESS = replace(DISPLACEMENT, wind=(0.0,) * 6)


def sail(boat, seconds, h=0.02):
    for _ in range(round(seconds / h)):
        boat.step(h)
    return boat


def under_way(of=DISPLACEMENT, actuation=0.6, seconds=150.0):
    boat = Boat(of)
    for engine in range(len(of.engines)):
        boat.set_actuation(engine, actuation)
    return sail(boat, seconds)


def test_an_otter_is_as_fast_as_the_real_one():
    """Fossen's model gives it six knots at full thrust."""
    assert under_way(OTTER, 1.0, 60.0).u == pytest.approx(6 * 0.5144, rel=0.02)


@pytest.mark.parametrize("actuation", [0.3, 0.6, 1.0])
def test_steady_speed_is_where_thrust_equals_drag(actuation):
    boat = under_way(AIRLESS, actuation, 300.0)
    (engine,) = DISPLACEMENT.engines
    n = actuation * engine.full_speed
    thrust = (engine.gain * n - engine.loss * boat.u) * n
    assert thrust == pytest.approx(-(DISPLACEMENT.linear[0] + DISPLACEMENT.quadratic[0] * boat.u) * boat.u, rel=1e-6)
    assert (boat.v, boat.r, boat.z, boat.euler_angles()) == (0.0, 0.0, 0.0, (0.0, 0.0, 0.0))


def test_the_current_carries_it_and_changes_nothing_else():
    still, carried = under_way(AIRLESS), under_way(AIRLESS)
    carried.stream = (0.3, -0.2, 0.0)
    x, y = still.x - carried.x, still.y - carried.y
    for boat in (still, carried):
        boat.set_deflection(0, 0.2)
        sail(boat, 20.0)
    assert (carried.u, carried.v, carried.r) == (still.u, still.v, still.r)
    assert (carried.x - still.x + x, carried.y - still.y + y) == pytest.approx((6.0, -4.0), abs=1e-6)


def test_port_and_starboard_are_mirror_images():
    left, right = under_way(), under_way()
    left.set_deflection(0, 0.3)
    right.set_deflection(0, -0.3)
    sail(left, 30.0)
    sail(right, 30.0)
    assert left.r < -0.05
    assert (right.x, right.u) == pytest.approx((left.x, left.u), abs=1e-9)
    assert (right.y, right.v, right.r) == pytest.approx((-left.y, -left.v, -left.r), abs=1e-9)


def test_a_rudder_turns_it_in_a_circle_of_some_lengths_and_straight_it_stays_straight():
    boat = under_way()
    boat.r = 0.05
    assert abs(sail(boat, 30.0).r) < 1e-3
    boat.set_deflection(0, -math.radians(20.0))
    sail(boat, 60.0)
    assert 1.0 < boat.u / boat.r / 4.0 < 3.0
    assert boat.v < 0.0


def test_a_rudder_in_the_stream_of_its_propeller_turns_a_boat_that_lies_still():
    turned = []
    for share in ("0.8, 0.3", "0, 1"):
        boat = Boat(model("displacement-boat", Rudder_Slipstream_0=share))
        boat.set_deflection(0, -0.4)
        boat.set_actuation(0, 0.8)
        turned.append(sail(boat, 3.0).r)
    assert turned[0] > 3.0 * turned[1] > 0.0


def test_two_motors_against_each_other_turn_it_on_the_spot():
    boat = Boat(OTTER)
    boat.set_actuation(0, 0.4)
    boat.set_actuation(1, -0.4 / math.sqrt(0.58))
    sail(boat, 20.0)
    assert boat.r > 0.1
    assert abs(boat.u) < 0.05


def test_motors_need_time():
    boat = Boat(OTTER)
    boat.set_actuation(0, 1.0)
    boat.set_actuation(1, 1.0)
    sail(boat, 0.02)
    assert boat.u < 1e-3
    sail(boat, 1.0)
    assert 0.2 < boat.u < 1.5


def test_without_drag_energy_stays():
    free = replace(
        AIRLESS, linear=(0.0,) * 5, quadratic=(0.0,) * 5, lift=(0.0,) * 4, cross_flow=(0.0,) * 3, munk=True,
        rudders=(), center=0.2, added_mass=(-45.0, -780.0, -500.0, 60.0),
    )  # fmt: skip
    boat = Boat(free)
    boat.u, boat.v, boat.r = 1.0, 0.3, 0.2

    def energy():
        m, (xud, yvd, nrd, yrd) = free.mass, free.added_mass
        own = (m - xud) * boat.u**2 + (m - yvd) * boat.v**2 + (free.inertia - nrd) * boat.r**2
        return 0.5 * own + (m * free.center - yrd) * boat.v * boat.r

    before = energy()
    sail(boat, 20.0, 0.002)
    assert energy() == pytest.approx(before, rel=1e-5)


def test_the_error_of_a_step_falls_with_its_square():
    def end(h):
        boat = Boat(DISPLACEMENT)
        boat.u = 1.5
        boat.set_deflection(0, -0.3)
        sail(boat, 4.0, h)
        return boat.x, boat.y, boat.euler_angles()[2], boat.v, boat.r

    truth = end(0.00125)
    errors = [math.dist(end(h), truth) for h in (0.04, 0.02, 0.01)]
    assert errors[1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.4)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.4)


def test_wind_from_ahead_is_balanced_by_drag_and_wind_from_abeam_pushes_aside():
    boat = Boat(OTTER)
    boat.wind = (-8.0, 0.0)
    sail(boat, 60.0)
    frontal, _, _, cx, _, _ = OTTER.wind
    push = 0.5 * AIR * cx * frontal * (8.0 + boat.u) ** 2
    assert boat.u == pytest.approx(push / OTTER.linear[0], rel=1e-3)
    boat = Boat(OTTER)
    boat.wind = (0.0, 8.0)
    assert sail(boat, 20.0).y > 1.0


def test_a_model_that_cannot_be_diverges_with_a_word():
    boat = Boat(replace(OTTER, linear=(5000.0, 0.0, 0.0, 0.0, 0.0)))
    boat.u = 1.0
    with pytest.raises(DivergedError, match="m/s"):
        sail(boat, 10.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"Mass": ""}, "has no Mass"),
        ({"Mass": "nan"}, "Mass is not a number"),
        ({"Yaw_Inertia": "-1"}, "Yaw Inertia must be more than 0"),
        ({"Linear_Drag_Coefficients": "1, 0, 0, 0, 0"}, "cannot be more than 0"),
        ({"Added_Mass_Coefficients": "2000, 0, 0, 0"}, "make the inertia matrix not positive definite"),
        ({"Engine_Parameters_0": "1, -1, 100"}, "engine 0: gain and speed must be more than 0, the others at least 0"),
        ({"Rudder_Slipstream_0": "2, 0.3"}, "must be a share from 0 to 1"),
        ({"Engine_Count": "0"}, "there is no engine 0"),
        ({"Rudder_Count": "0.5"}, "whole number"),
    ],
)
def test_what_is_wrong_with_a_model(changes, words):
    with pytest.raises(ModelError, match=words):
        model("displacement-boat", **changes)


def test_vsim_moves_a_boat_with_its_rudder_current_and_wind():
    settings = MODELS | {"General": {"Vehicle Type": "displacement-boat"}}
    assert is_boat_model(lambda section, option: settings[section].get(option, ""), "displacement-boat")
    here = imc.GpsFix(timestamp=0.0, type=imc.GpsFix.Type.MANUAL_INPUT, lat=0.7188, lon=-0.152)
    feed = [
        here,
        imc.SetThrusterActuation(timestamp=1.0, value=0.6),
        imc.ServoPosition(timestamp=20.0, id=0, value=-0.3),
        imc.ServoPosition(timestamp=20.0, id=1, value=-0.3),
    ]
    run = simulate(VSIM, feed, seconds=40.0, settings=settings, execution_frequency=50.0)
    state = run.of(imc.SimulatedState)[-1]
    assert state.r > 0.05
    assert (state.z, state.phi, state.theta) == (0.0, 0.0, 0.0)
    assert sum("fin 1 has no effect: the model has 1" in text for text in run.log) == 1
    windy = (Wind, {"speed": 8.0, "direction": 90.0})
    run = simulate([VSIM, windy], [here], seconds=60.0, settings=settings)
    assert run.of(imc.SimulatedState)[-1].y < -2.0


def test_a_motor_with_a_time_constant_takes_its_time():
    push = [imc.SetThrusterActuation(timestamp=0.1 * k, value=0.5) for k in range(1, 50)]
    run = simulate(Motor, push, thruster_act_to_rpm_factor=[0.0, 1000.0], time_constant=1.0)
    speeds = {round(m.timestamp - run.vehicle.start_time, 2): m.value for m in run.of(imc.Rpm)}
    assert speeds[1.2] == pytest.approx(500.0 * (1.0 - math.exp(-1.0)), abs=15.0)
    assert speeds[4.8] == pytest.approx(495.0, abs=5.0)


def test_two_motors_draw_together_what_the_model_of_the_profile_has():
    power = {"Power Model -- Conversion - RPM": "0, 1000", "Power Model -- Conversion - Watt": "0, 600"}
    feed = [imc.SetThrusterActuation(timestamp=1.5, id=motor, value=0.5) for motor in (0, 1)]
    options = {"full_speed": 1000.0, "number_of_thrusters": 2, "hotel_load": 40.0}
    run = simulate(Battery, feed, seconds=4.0, settings={"General": power}, **options)
    drawn = run.of(imc.Voltage)[-1].value * run.of(imc.Current)[-1].value
    assert drawn == pytest.approx(340.0, rel=1e-4)


def test_wind_has_gusts_around_its_mean():
    run = simulate(Wind, seconds=2000.0, speed=6.0, direction=-90.0, gusts=1.0, seed=3)
    speeds = [m.speed for m in run.of(imc.AbsoluteWind)]
    assert sum(speeds) / len(speeds) == pytest.approx(6.0, abs=0.3)
    assert max(speeds) > 7.5
    assert run.of(imc.AbsoluteWind)[0].direction == pytest.approx(-0.5 * math.pi)
