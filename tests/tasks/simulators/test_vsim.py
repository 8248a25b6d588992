"""Simulators.VSIM on a bus: start position, commands, current, and bad values of them."""

import math
from pathlib import Path

import pytest

import imc
from runtime import ParameterError, Task
from runtime.profile import read_sections
from runtime.testing import simulate
from tasks.simulators.gps import GPS
from tasks.simulators.vsim import VSIM

MODELS = read_sections(Path(__file__).parents[3] / "etc/common/vsim-models.ini")
MANUAL = imc.GpsFix.Type.MANUAL_INPUT
HERE = imc.GpsFix(timestamp=0.0, type=MANUAL, lat=0.7188, lon=-0.152, height=3.0)


class StreamVelocity(Task):
    """Reserves the entity."""


def vsim(*feed: imc.Message, settings=MODELS, **options):
    return simulate(VSIM, [HERE, *feed], settings=settings, **options)


def last(run) -> imc.SimulatedState:
    return run.of(imc.SimulatedState)[-1]


def test_it_waits_for_a_manual_fix():
    run = simulate(VSIM, [HERE.replace(type=0), HERE.replace(timestamp=2.005)], seconds=3.0, settings=MODELS)
    states = run.of(imc.SimulatedState)
    assert len(states) == 99
    assert states[0].timestamp == pytest.approx(run.vehicle.start_time + 2.01)
    assert (states[0].lat, states[0].lon, states[0].height) == (0.7188, -0.152, 3.0)
    assert list(dict.fromkeys(m.state for m in run.of(imc.EntityState))) == [0, 1]


def test_the_gps_simulator_starts_it():
    run = simulate([VSIM, (GPS, {"initial_position": [41.185, -8.7062]})], seconds=2.0, settings=MODELS)
    assert last(run).lat == pytest.approx(math.radians(41.185), abs=1e-12)
    assert len(run.of(imc.SimulatedState)) == 199


def test_thruster_and_rudder():
    push = imc.SetThrusterActuation(timestamp=1.0, value=0.5)
    rudder = imc.ServoPosition(timestamp=11.0, id=0, value=-0.1)
    run = vsim(push, rudder, seconds=20.0, initial_heading=90.0)
    states = run.of(imc.SimulatedState)
    before = states[1099]
    assert (before.psi, before.v, before.r) == pytest.approx((0.5 * math.pi, 0.0, 0.0), abs=1e-6)
    assert before.u > 1.0
    assert before.y > 5.0
    assert states[-1].r > 0.01
    assert states[-1].v < 0.0


def test_the_same_run_again():
    feed = [imc.SetThrusterActuation(timestamp=1.0, value=0.5), imc.ServoPosition(timestamp=3.0, id=1, value=0.2)]
    assert vsim(*feed, seconds=10.0).packets == vsim(*feed, seconds=10.0).packets


def test_only_the_named_entity_moves_the_water():
    stream = imc.EstimatedStreamVelocity(timestamp=1.0, x=0.5, y=-0.25)
    tasks = [VSIM, (StreamVelocity, {"entity_label": "Stream Velocity Simulator"})]
    for right in (True, False):
        run = simulate(tasks, [HERE], seconds=0.1, settings=MODELS)
        label = run.tasks[1].entity.id if right else run.tasks[0].entity.id
        run = simulate(tasks, [HERE, stream.replace(src_ent=label)], seconds=11.0, settings=MODELS)
        state = last(run)
        assert (state.svx, state.svy) == ((0.5, -0.25) if right else (0.0, 0.0))
        assert state.y == pytest.approx(-2.5 if right else 0.0, abs=0.01)
        assert state.v == pytest.approx(0.0, abs=1e-6)


def test_a_later_fix_moves_it_as_it_is():
    push = imc.SetThrusterActuation(timestamp=1.0, value=0.5)
    later = HERE.replace(timestamp=10.005, lat=0.72, src=0x4001, dst=0x1A)
    nobody = HERE.replace(timestamp=15.0, lat=0.1, src=0x4001)
    states = vsim(push, later, nobody, seconds=20.0).of(imc.SimulatedState)
    before, after = states[999], states[1000]
    assert before.x > 5.0
    assert (after.lat, after.y) == (0.72, 0.0)
    assert after.x == pytest.approx(0.01 * after.u, rel=0.1)
    assert (after.u, after.z, after.psi) == pytest.approx((before.u, before.z, before.psi), abs=1e-2)
    assert states[-1].lat == 0.72


def test_commands_that_nothing_can_follow_are_said_once():
    feed = [
        *(imc.ServoPosition(timestamp=1.0 + k, id=9, value=0.1) for k in range(3)),
        imc.SetThrusterActuation(timestamp=2.0, id=0, value=math.nan),
        imc.ServoPosition(timestamp=2.0, id=0, value=math.inf),
        imc.EstimatedStreamVelocity(timestamp=2.0, x=math.nan),
        HERE.replace(timestamp=3.0, lat=7.0),
        HERE.replace(timestamp=3.0, lat=math.nan),
    ]
    run = vsim(*feed, seconds=5.0)
    state = last(run)
    assert math.isfinite(state.x + state.z + state.u)
    assert state.lat == 0.7188
    assert sum("fin 9 has no effect: the model has 4" in text for text in run.log) == 1
    assert sum("has no effect" in text for text in run.log) == 3
    assert sum("not a position on Earth" in text for text in run.log) == 2


def test_a_vehicle_type_without_model():
    with pytest.raises(ParameterError, match=r"no section \[VSIM/Model/xauv\] describes this vehicle$"):
        vsim(settings=MODELS | {"General": {"Vehicle Type": "xauv"}})


def test_the_bottom_stays_where_it_is_when_a_fix_moves_the_vehicle_and_is_that_of_the_altimeter():
    sea = MODELS | {
        "Bathymetry": {"Latitude (degrees)": "41.185", "Longitude (degrees)": "-8.7062", "Data": "0 0 4"},
        "Simulators.Environment": {"Tide Level": "-3.5", "Out Of Bounds Depth": "50"},
    }
    here = HERE.replace(lat=math.radians(41.185), lon=math.radians(-8.7062))
    there = here.replace(timestamp=3.0, lat=math.radians(41.186))
    back = here.replace(timestamp=9.0)
    sinking = imc.EstimatedStreamVelocity(timestamp=1.0, z=1.0)
    tasks = [VSIM, (StreamVelocity, {"entity_label": "Stream Velocity Simulator"})]
    label = simulate(tasks, [here], seconds=0.1, settings=sea).tasks[1].entity.id
    run = simulate(tasks, [here, sinking.replace(src_ent=label), there, back], seconds=10.0, settings=sea)
    depths = [state.z for state in run.of(imc.SimulatedState)]
    assert max(depths[:295]) == pytest.approx(0.445), "half a meter of water, less half the height of the hull"
    assert max(depths[300:895]) > 3.0
    assert depths[-1] == pytest.approx(0.445)
    assert run.log.count("grounded in 0.5 m of water") == 2


def test_a_start_below_the_bottom_is_reported():
    sea = MODELS | {"Bathymetry": {"Latitude (degrees)": "41.185", "Longitude (degrees)": "-8.7062", "Data": "0 0 4"}}
    here = HERE.replace(lat=math.radians(41.185), lon=math.radians(-8.7062))

    def log(depth: float) -> list[str]:
        return simulate(VSIM, [here], seconds=0.1, settings=sea, initial_depth=depth).log

    assert log(5.0)[0] == "the water is 4.0 m deep here: it begins at 3.9 m, not at 5 m"
    assert log(3.9) == []


@pytest.mark.parametrize("option", ["Tide Level", "Sounding Radius", "Out Of Bounds Depth"])
def test_a_bottom_that_is_not_a_number_is_refused(option):
    with pytest.raises(ParameterError, match=rf"\[Simulators.Environment\] {option} = deep is not a number"):
        vsim(settings=MODELS | {"Simulators.Environment": {"Enabled": "Always", option: "deep"}})
