"""The equations of motion compared with a mission that DUNE simulated.

`before`, `steady` and `after` are states and commands (four fins in rad, thruster) of 500 steps of 10 ms in which the
log shows clearly which commands acted; `commands` acted in each step of its first 116 s, of which `states` are those
at `times`. A state is x, y, z, phi, theta, psi, u, v, w, p, q, r.
"""

import math
from pathlib import Path

import numpy as np
import pytest

from runtime.profile import read_sections
from world.bodies import UnderwaterVehicle, read_underwater_model

ROOT = Path(__file__).parents[3]
LAUV = read_sections(ROOT / "etc/common/vsim-models.ini")["VSIM/Model/lauv"]
SURFACED = 110  # s; then a few cm of depth decide whether the fins still have effect


@pytest.fixture(scope="module")
def mission():
    return dict(np.load(ROOT / "tests/data/simulators/dune_mission.npz"))


def craft_at(state, model) -> UnderwaterVehicle:
    craft = UnderwaterVehicle(model)
    craft.x, craft.y, craft.z = map(float, state[:3])
    craft.set_attitude(*map(float, state[3:6]))
    craft.u, craft.v, craft.w, craft.p, craft.q, craft.r = map(float, state[6:])
    return craft


def command(craft: UnderwaterVehicle, commands) -> None:
    for fin in range(4):
        craft.set_deflection(fin, float(commands[fin]))
    craft.set_actuation(0, float(commands[4]))


def as_dune():
    return read_underwater_model(
        lambda _, option: (LAUV | {"Rotational Inertia": "19, 34, 34"}).get(option, ""), "lauv"
    )


def as_it_should_be():
    return read_underwater_model(lambda _, option: LAUV.get(option, ""), "lauv")


def swim(mission, model):
    """Differences from DUNE's states at `times`, with DUNE's commands and without corrections."""
    craft = craft_at(mission["states"][0], model)
    found: list[tuple[float, ...]] = []
    for step, commands in enumerate(mission["commands"]):
        if step:
            command(craft, commands)
            craft.step(0.01)
        if step % 100 == 0:
            found.append((craft.x, craft.y, craft.z, *craft.euler_angles(), craft.u, craft.v, craft.w))
    difference = (np.array(found) - mission["states"][:, :9])[:SURFACED]
    difference[:, 3:6] = (difference[:, 3:6] + math.pi) % (2.0 * math.pi) - math.pi
    return difference


def accelerations(mission, model):
    """The accelerations of this model minus DUNE's, per step."""
    found: list[tuple[float, ...]] = []
    for state, commands in zip(mission["before"], mission["steady"], strict=True):
        craft = craft_at(state, model)
        command(craft, commands)
        found.append(craft.accelerations())
    return np.array(found) - (mission["after"][:, 6:].astype(float) - mission["before"][:, 6:]) / 0.01


def test_with_the_inertia_that_dune_takes_by_mistake_the_forces_are_the_same(mission):
    worst = np.abs(accelerations(mission, as_dune())).max(axis=0)
    assert worst[:3] == pytest.approx([0.0] * 3, abs=2e-4)
    assert worst[3:] == pytest.approx([0.0] * 3, abs=2e-4)


def test_with_the_right_inertia_only_pitch_and_yaw_differ(mission):
    difference = accelerations(mission, as_it_should_be())
    roll, pitch, yaw = mission["before"][:, 9:].T.astype(float)
    assert np.abs(difference[:, :4]).max() < 2e-4
    assert difference[:, 4] == pytest.approx((2.06 - 15.0) * roll * yaw / 2.1, abs=5e-4)
    assert difference[:, 5] == pytest.approx((15.0 - 2.06) * roll * pitch / 2.1, abs=5e-4)


def test_a_dive_of_almost_two_minutes_without_any_correction(mission):
    x, y, z, phi, theta, psi, u, v, w = np.abs(swim(mission, as_dune())).max(axis=0)
    assert (x, y, z) == pytest.approx((0.0, 0.0, 0.0), abs=0.15)
    assert (phi, theta, psi) == pytest.approx((0.0, 0.0, 0.0), abs=0.01)
    assert max(u, v) < 0.01
    assert w < 0.05


def test_the_right_inertia_changes_the_dive_by_less_than_a_controller_corrects(mission):
    x, y, z, phi, theta, psi, u, v, w = np.abs(swim(mission, as_it_should_be())).max(axis=0)
    assert max(x, y) < 1.5
    assert z < 0.5
    assert max(phi, theta, psi) < 0.05
    assert max(u, v, w) < 0.05
