"""What the shipped vehicles say about their position before the first fix, and while they have none."""

import math

import numpy as np
import pytest
from PIL import Image

import imc
from imc.coordinates import absolute_position
from runtime import State
from runtime.logs import summarize
from shoal.logs.inspect.report_data import read_report_data
from shoal.missions import prepare
from support.wgs84 import displacement

START = math.radians(41.185), math.radians(-8.7062)
VEHICLES = [
    ("lauv-noptilus-1", "Simulation"),
    ("lauv-noptilus-1", "Kinematic"),
    ("otter", "Simulation"),
    ("caravel", "Simulation"),
    ("hexa-00", "Simulation"),
]


def start(folder, profile="lauv-noptilus-1", mode="Simulation", seconds=15.0, kinds=(imc.EstimatedState,), **settings):
    """Run a vehicle; returns it and what it published of `kinds`."""
    modes = mode.split(",")
    made = prepare(profile, modes, log_root=folder / "log", state_folder=folder / "db", **settings)
    heard = {kind: [] for kind in kinds}
    for kind, messages in heard.items():
        made.vehicle.observe(kind, messages.append)
    made.vehicle.start()
    made.vehicle.run(seconds)
    made.vehicle.close()
    return made.vehicle, heard


def away(state):
    """Distance of a state from the start (m)."""
    return math.hypot(*displacement(*START, 0.0, *absolute_position(state)[:2], 0.0)[:2])


@pytest.mark.parametrize(("profile", "mode"), VEHICLES)
def test_every_state_is_where_the_vehicle_starts_and_the_report_is_not_4000_km_long(profile, mode, tmp_path):
    _, heard = start(tmp_path, profile, mode)
    states = heard[imc.EstimatedState]
    assert len(states) > 200
    assert max(map(away, states)) < 60.0
    (data,) = tmp_path.glob("log/*/*/*/Data.lsf.gz")
    log = imc.Log(data.parent)
    story = read_report_data(log, summarize(log))
    assert story.distance < 60.0
    assert story.origin == pytest.approx(START, abs=1e-4)


@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter", "caravel", "hexa-00"])
def test_a_vehicle_without_a_fix_says_no_position_and_why(profile, tmp_path):
    lost = ["Simulators.GPS:Enabled=Never", "Monitors.Entities:Default Monitoring=Daemon, Navigation"]
    kinds = imc.EstimatedState, imc.VehicleState, imc.NavigationUncertainty
    vehicle, heard = start(tmp_path, profile, overrides=lost, kinds=kinds)
    assert heard[imc.EstimatedState] == heard[imc.NavigationUncertainty] == []
    navigation = vehicle.entities.find("Navigation")
    assert (navigation.state, navigation.description[:11]) != (State.NORMAL, "active")
    assert {state.op_mode for state in heard[imc.VehicleState]} <= {
        imc.VehicleState.OpMode.BOOT,
        imc.VehicleState.OpMode.ERROR,
    }


def test_a_lost_fix_does_not_put_the_simulated_vehicle_back_to_its_start(tmp_path):
    current = ["Simulators.StreamVelocity:Default Speed North=1.0", "Plan.Autostart:Enabled=Never"]
    kinds = imc.SimulatedState, imc.GpsFix
    _, heard = start(tmp_path, overrides=current, kinds=kinds, seconds=6.0)
    fixes = heard[imc.GpsFix]
    assert any(not fix.validity for fix in fixes), "the vehicle starts with its antenna under water"
    assert [fix.validity for fix in fixes if fix.type == imc.GpsFix.Type.MANUAL_INPUT] == [0x1FF]
    norths = [state.x for state in heard[imc.SimulatedState]]
    assert norths == sorted(norths)
    assert norths[-1] > 4.5


@pytest.mark.heavy
def test_the_first_pictures_show_the_glider_and_the_camera_detects_it(tmp_path):
    _, heard = start(tmp_path, mode="Simulation,Camera", seconds=8.0, kinds=[imc.EstimatedMugState])
    assert len(heard[imc.EstimatedMugState]) > 40
    photos = sorted(tmp_path.glob("log/**/*.png"), key=lambda path: path.name.rpartition("_")[2])
    assert len(photos) >= 6
    for photo in photos:
        red, green, blue = np.moveaxis(np.asarray(Image.open(photo).convert("RGB")), 2, 0)
        assert np.count_nonzero((red > 200) & (green > 200) & (blue < 100)) > 20, photo.name
