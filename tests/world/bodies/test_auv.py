"""The equations of motion: balances with closed solutions, symmetries, conserved energy, signs of fins."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from runtime.profile import read_sections
from world.bodies import DivergedError, Fin, ModelError, Thruster, UnderwaterVehicle, read_underwater_model
from world.bodies.auv import GRAVITY

MODELS = read_sections(Path(__file__).parents[3] / "etc/common/vsim-models.ini")


def lauv(**changes: str):
    section = MODELS["VSIM/Model/lauv"] | {name.replace("_", " "): text for name, text in changes.items()}
    return read_underwater_model(
        lambda name, option: section.get(option, "") if name == "VSIM/Model/lauv" else "", "lauv"
    )


LAUV = lauv()
AFLOAT = LAUV.mass / (1000.0 * LAUV.volume[0] * LAUV.volume[1]) - 0.5 * LAUV.volume[2]
NEUTRAL = replace(LAUV, volume=(2.0, 0.11, 24.0 / (1000.0 * 2.0 * 0.11)))


def swim(craft: UnderwaterVehicle, seconds: float, h: float = 0.01) -> UnderwaterVehicle:
    for _ in range(round(seconds / h)):
        craft.step(h)
    return craft


def under_way(model=NEUTRAL, depth: float = 20.0, actuation: float = 0.5) -> UnderwaterVehicle:
    craft = UnderwaterVehicle(model)
    craft.z = depth
    craft.set_actuation(0, actuation)
    return swim(craft, 30.0)


def test_it_floats_where_it_displaces_its_mass():
    craft = swim(UnderwaterVehicle(LAUV), 60.0)
    assert abs(AFLOAT - 0.0541) < 1e-4
    assert craft.z == pytest.approx(AFLOAT, abs=1e-6)
    assert (craft.y, craft.v, craft.p, craft.r) == (0.0, 0.0, 0.0, 0.0)
    assert abs(craft.u) + abs(craft.w) + abs(craft.q) < 1e-3


def test_it_rises_with_the_speed_that_drag_allows():
    level = replace(LAUV, linear=(*LAUV.linear[:6], 0.0, 0.0, 0.0, 0.0), quadratic=(*LAUV.quadratic[:6], *(0.0,) * 4))
    craft = UnderwaterVehicle(level)
    craft.z = 1000.0
    swim(craft, 200.0)
    surplus = GRAVITY * (1000.0 * math.prod(LAUV.volume) - LAUV.mass)
    linear, quadratic = -LAUV.linear[2], -LAUV.quadratic[2]
    speed = (math.sqrt(linear**2 + 4.0 * quadratic * surplus) - linear) / (2.0 * quadratic)
    assert craft.w == pytest.approx(-speed, rel=1e-6)


@pytest.mark.parametrize("actuation", [0.2, 0.5, 0.68, 1.0])
def test_steady_speed_is_where_thrust_equals_drag(actuation):
    craft = under_way(actuation=actuation)
    swim(craft, 60.0)
    n, (engine,) = actuation * LAUV.engines[0].full_speed, LAUV.engines
    linear, quadratic = -LAUV.linear[0], -LAUV.quadratic[0]
    b = linear + engine.loss * n
    thrust_limited = (math.sqrt(b**2 + 4.0 * quadratic * engine.gain * n * n) - b) / (2.0 * quadratic)
    force_limited = (math.sqrt(linear**2 + 4.0 * quadratic * LAUV.maximum_force) - linear) / (2.0 * quadratic)
    assert craft.u == pytest.approx(min(thrust_limited, force_limited), rel=1e-9)
    assert (craft.v, craft.r, craft.p) == (0.0, 0.0, 0.0)


def test_the_current_carries_it_and_changes_nothing_else():
    still, carried = under_way(), under_way()
    carried.stream = (0.3, -0.2, 0.1)
    x, y, z = still.x - carried.x, still.y - carried.y, still.z - carried.z
    for craft in (still, carried):
        craft.set_deflection(0, 0.1)
        swim(craft, 20.0)
    assert (carried.u, carried.v, carried.r) == (still.u, still.v, still.r)
    assert carried.x - still.x + x == pytest.approx(6.0, abs=1e-6)
    assert carried.y - still.y + y == pytest.approx(-4.0, abs=1e-6)
    assert carried.z - still.z + z == pytest.approx(2.0, abs=1e-6)


@pytest.mark.parametrize("fin", [0, 3])
def test_a_rudder_turns_it_the_way_that_the_allocator_expects(fin):
    """DUNE's allocator sets the rudders to minus the desired yaw moment."""
    craft = under_way()
    craft.set_deflection(fin, -0.1)
    swim(craft, 5.0)
    assert craft.r > 0.01
    assert craft.euler_angles()[2] > 0.05


@pytest.mark.parametrize("fin", [1, 2])
def test_an_elevator_pitches_it_the_way_that_the_allocator_expects(fin):
    craft = under_way()
    craft.set_deflection(fin, -0.1)
    before = craft.z
    swim(craft, 5.0)
    assert craft.euler_angles()[1] > 0.05
    assert craft.z < before


def test_crossed_fins_roll_it_only_if_the_model_says_so():
    for model, rolls in ((LAUV, False), (lauv(Fins_Roll="true"), True)):
        craft = under_way(model)
        for fin, sign in enumerate((-1.0, 1.0, -1.0, 1.0)):
            craft.set_deflection(fin, 0.05 * sign)
        swim(craft, 1.0)
        assert (craft.euler_angles()[0] > 0.05) is rolls


def test_port_and_starboard_are_mirror_images():
    crafts: list[UnderwaterVehicle] = []
    for sign in (1.0, -1.0):
        craft = under_way(LAUV)
        craft.set_deflection(0, 0.2 * sign)
        craft.set_deflection(1, 0.1)
        craft.set_deflection(2, 0.1)
        crafts.append(swim(craft, 20.0))
    left, right = crafts
    assert right.y == pytest.approx(-left.y, abs=1e-9)
    assert (right.x, right.z, right.u) == pytest.approx((left.x, left.z, left.u), abs=1e-9)
    assert (right.v, right.p, right.r) == pytest.approx((-left.v, -left.p, -left.r), abs=1e-9)


def test_without_drag_and_weight_energy_stays():
    free = replace(
        NEUTRAL,
        linear=(0.0,) * 10,
        quadratic=(0.0,) * 10,
        lift=(0.0,) * 8,
        rotational_inertia=NEUTRAL.inertia[3:],
        mass=24.2,
    )
    free = replace(free, volume=(2.0, 0.11, 24.2 / 220.0))
    craft = UnderwaterVehicle(free)
    craft.z = 500.0
    craft.u, craft.v, craft.w, craft.p, craft.q, craft.r = 1.0, 0.1, -0.1, 0.3, 0.1, -0.2

    def energy() -> float:
        velocities = craft.u, craft.v, craft.w, craft.p, craft.q, craft.r
        kinetic = sum(0.5 * m * v * v for m, v in zip(free.inertia, velocities, strict=True))
        phi, theta, _ = craft.euler_angles()
        return kinetic + free.buoyancy[2] * free.mass * GRAVITY * math.cos(theta) * math.cos(phi)

    before, scale = energy(), 0.5 * free.inertia[0]
    swim(craft, 5.0)
    coarse = abs(energy() - before) / scale
    craft.u, craft.v, craft.w, craft.p, craft.q, craft.r = 1.0, 0.1, -0.1, 0.3, 0.1, -0.2
    craft.set_attitude(0.0, 0.0, 0.0)
    swim(craft, 5.0, 0.001)
    fine = abs(energy() - before) / scale
    assert coarse < 2e-3
    assert fine < 2e-5


def test_the_error_of_a_step_falls_with_its_square():
    def end(h: float) -> tuple[float, ...]:
        craft = under_way(LAUV)
        craft.set_deflection(0, -0.3)
        craft.set_deflection(1, 0.2)
        craft.set_deflection(2, 0.2)
        swim(craft, 4.0, h)
        return craft.x, craft.y, craft.z, *craft.euler_angles(), craft.v, craft.r

    truth = end(0.000625)
    errors = [math.dist(end(h), truth) for h in (0.02, 0.01, 0.005)]
    assert errors[1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.3)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.3)


def test_no_pitch_is_special():
    craft = UnderwaterVehicle(NEUTRAL)
    craft.z = 300.0
    craft.set_attitude(0.2, 0.5 * math.pi, 0.3)
    craft.u, craft.q = 1.0, 0.5
    swim(craft, 2.0)
    assert all(map(math.isfinite, (*craft.euler_angles(), craft.x, craft.y, craft.z)))
    assert craft.z < 299.5


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (0.3, -0.4, 2.5), (-3.0, 1.4, -3.1), (0.1, 0.2, 3.14)])
def test_euler_angles_come_back(angles):
    craft = UnderwaterVehicle(LAUV)
    craft.set_attitude(*angles)
    assert craft.euler_angles() == pytest.approx(angles)


def test_it_never_leaves_the_water_and_its_fins_do_not_lift_it_out():
    craft = UnderwaterVehicle(LAUV)
    craft.set_actuation(0, 1.0)
    highest = 1.0
    for _ in range(6000):
        for fin in (1, 2):
            craft.set_deflection(fin, -0.4)
        craft.step(0.01)
        highest = min(highest, craft.z)
    assert highest >= 0.0
    assert math.isfinite(craft.x)


def test_fins_stop_and_thrust_is_limited():
    craft = under_way()
    craft.set_deflection(0, 5.0)
    assert craft.deflections[0] == pytest.approx(0.4363)
    craft.set_actuation(0, -7.0)
    assert craft.actuations[0] == -1.0
    craft.step(0.01)
    assert craft.u < 2.0


def test_engines_aside_of_the_centre_turn_it():
    side = Thruster(0.96, 12.6, 41.7, (-0.5, 0.3, 0.0), (1.0, 0.0, 0.0))
    lifter = Thruster(0.96, 12.6, 41.7, (0.4, 0.0, 0.0), (0.0, 0.0, 1.0))
    craft = UnderwaterVehicle(replace(NEUTRAL, engines=(side, lifter), maximum_force=2.0))
    craft.z = 50.0
    craft.set_actuation(0, 0.3)
    swim(craft, 1.0)
    assert craft.u > 0.05
    assert craft.r < -0.02
    craft = UnderwaterVehicle(craft.model)
    craft.z = 50.0
    craft.set_actuation(1, 0.3)
    swim(craft, 0.05)
    assert craft.w > 0.001
    assert craft.q < -0.01


def test_a_model_that_cannot_be_diverges_with_a_word():
    craft = UnderwaterVehicle(replace(LAUV, linear=(5000.0,) * 10))
    craft.z, craft.u = 10.0, 1.0
    with pytest.raises(DivergedError, match="m/s"):
        swim(craft, 10.0)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"Mass": ""}, "has no Mass"),
        ({"Mass": "heavy"}, "Mass is not a number"),
        ({"Mass": "-1"}, "Mass must be more than 0"),
        ({"Mass": "nan"}, "Mass is not a number"),
        ({"Inertial_Matrix": "19, 34, 34"}, "Inertial Matrix is not 6 numbers"),
        ({"Inertial_Matrix": "19, 34, 34, 0, 2, 2"}, "more than 0"),
        ({"Fin_Count": "2.5"}, "whole number"),
        ({"Fin_Count": "5"}, "has no Fin Force 4"),
        ({"Engine_Parameters_0": "0.96"}, "Engine Parameters 0 is not 3 numbers"),
        ({"Integration_Method": "false", "Type": "ASV"}, "type ASV, not of an underwater vehicle"),
    ],
)
def test_what_is_wrong_with_a_model(changes, words):
    with pytest.raises(ModelError, match=words):
        lauv(**changes)


def test_options_that_models_of_dune_do_not_have():
    assert LAUV.rotational_inertia == (0.04, 2.1, 2.1)
    assert lauv(Rotational_Inertia="19, 34, 34").rotational_inertia == (19.0, 34.0, 34.0)
    assert LAUV.fins_roll is False
    assert LAUV.fins[1] == Fin((0.0, 0.0, -9.64), (-0.455, -0.08, 0.0))
    assert LAUV.engines[0].direction == (1.0, 0.0, 0.0)
