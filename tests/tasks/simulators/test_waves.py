"""Shipped boats in waves: they carry out their plan, ride as the sea does, and do the same in each run."""

from pathlib import Path

import numpy as np
import pytest

import imc
from runtime.profile import load_profile, read_sections
from runtime.snapshot import load, take_snapshot
from runtime.testing import simulate
from shoal.missions import load_plan, prepare
from shoal.rerun import resume_snapshot
from support.rotations import body_rates, rotation, to_ned
from tasks.simulators.vsim import VSIM
from tests.repeats import all_but
from tests.tasks.mission.boats import BOATS, LAT, LON, goto, plan_of, sail

HARBOR = Path(__file__).parents[2] / "data/plans/harbor.yaml"
MODELS = read_sections(Path(__file__).parents[3] / "etc/common/vsim-models.ini")
HEIGHT = 0.5  # m
WAVES = (f"World:Wave Height={HEIGHT}",)


def ran(boat, seconds, folder):
    vehicle, packets = prepare(boat, overrides=WAVES, log_root=folder / "log").vehicle, list[bytes]()
    vehicle.observe(imc.Message, lambda _, packet: packets.append(packet), packets=True)
    vehicle.start()
    vehicle.run(seconds)
    vehicle.close()
    return packets


@pytest.mark.heavy
@pytest.mark.parametrize(("boat", "corner"), all_but([("caravel", 5.0)], [("otter", 4.0), ("caravel", 5.0)]))
def test_a_plan_is_carried_out_in_waves(boat, corner):
    voyage = sail(boat, load_plan(HARBOR), *WAVES)
    assert voyage.report.completed, voyage.report.reason
    states = voyage.of(imc.SimulatedState)
    straight = [abs(m.y) for m in states if 20.0 < m.x < 48.0 and m.y < 20.0 and abs(m.psi) < 1.0]
    assert max(straight) < 2.0
    assert max(m.x for m in states) < 60.0 + corner
    assert max(m.y for m in states) < 60.0 + corner


@pytest.mark.heavy
def test_a_small_boat_at_rest_rises_by_a_quarter_of_the_significant_height():
    """Its two meters average waves of ten a little."""
    here = imc.GpsFix(timestamp=0.1, type=imc.GpsFix.Type.MANUAL_INPUT, lat=LAT, lon=LON)
    settings = {
        "General": {"Vehicle Type": "otter"},
        "World": {"Wave Height": f"{HEIGHT}"},
        "VSIM/Model/otter": MODELS["VSIM/Model/otter"],
    }
    run = simulate(VSIM, [here], seconds=600.0, settings=settings, execution_frequency=20.0)
    states = run.of(imc.SimulatedState)
    assert np.std([m.z for m in states]) == pytest.approx(HEIGHT / 4, rel=0.12)
    assert 1.0 < np.degrees(np.std([m.phi for m in states])) < 6.0
    assert 1.0 < np.degrees(np.std([m.theta for m in states])) < 6.0


@pytest.mark.heavy
@pytest.mark.parametrize("boat", all_but(["otter"], BOATS))
def test_velocities_and_rates_of_the_truth_are_its_derivatives(boat):
    states = sail(boat, plan_of(goto(5, 20), goto(30, 20)), *WAVES, until=35.0).of(imc.SimulatedState)
    assert np.ptp([m.psi for m in states]) > 0.8, "it turns"
    for before, now, after in zip(states[-700:-2], states[-699:-1], states[-698:], strict=True):
        step = after.timestamp - before.timestamp
        moved = [(getattr(after, name) - getattr(before, name)) / step for name in ("x", "y", "z")]
        through = to_ned(rotation(now.phi, now.theta, now.psi), (now.u, now.v, now.w))
        assert through == pytest.approx(moved, abs=5e-3)
        phi, theta, psi = (
            ((getattr(after, name) - getattr(before, name) + np.pi) % (2 * np.pi) - np.pi) / step
            for name in ("phi", "theta", "psi")
        )
        assert (now.p, now.q, now.r) == pytest.approx(body_rates(now.phi, now.theta, phi, theta, psi), abs=5e-3)


@pytest.mark.heavy
def test_a_run_in_waves_is_the_same_again_and_after_a_snapshot(tmp_path):
    assert ran("otter", 8.0, tmp_path) == ran("otter", 8.0, tmp_path)
    vehicle = prepare("otter", overrides=WAVES, log_root=tmp_path / "log").vehicle
    vehicle.start()
    vehicle.run(8.0)
    snapshot, states = load(take_snapshot(vehicle)), list[imc.SimulatedState]()
    vehicle.observe(imc.SimulatedState, states.append)
    vehicle.run(3.0)
    vehicle.close()
    again, later = resume_snapshot(snapshot, tmp_path / "again"), list[imc.SimulatedState]()
    again.observe(imc.SimulatedState, later.append)
    again.run(3.0)
    again.close()
    assert later == states
    assert any(m.z for m in states)


@pytest.mark.parametrize("boat", BOATS)
def test_without_a_wave_height_boats_stay_level(boat):
    assert load_profile(boat).value("World", "Wave Height") == ""
