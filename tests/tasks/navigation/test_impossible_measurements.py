"""The navigation of each shipped vehicle rejects what no sound sensor measures, and reports how much it was."""

import math
from pathlib import Path

import pytest

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build

ETC = Path(__file__).parents[3] / "etc"
WRONG = math.radians(302.0)
VEHICLES = ["lauv-noptilus-1", "otter", "caravel", "hexa-00"]
NAN = math.nan


def navigate(name, folder, *wrong, rate=1.0, seconds=20.0):
    """The estimates of a shipped vehicle, and its log book; beside each sensor's values come wrong ones, at a rate."""
    vehicle = build(
        load_profile(name, [ETC]), ["Simulation"], clock=VirtualClock(), log_root=folder, state_folder=folder
    ).vehicle
    states, log, faults = [], [], set()
    vehicle.observe(imc.EstimatedState, states.append)
    vehicle.observe(imc.LogBookEntry, lambda entry: log.append(entry.text))
    navigation = next(task for task in vehicle.tasks if task.name.startswith("Navigation."))

    def spoil():
        for section, message in wrong:
            vehicle.task(section).publish(message)
        faults.add(navigation.entity.description)
        vehicle.kernel.after(1.0 / rate, spoil)

    vehicle.start()
    vehicle.kernel.after(15.0, spoil)
    vehicle.run(15.0 + seconds)
    vehicle.close()
    return states, [line for line in log if line.startswith("impossible")], faults


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("angles", [{"theta": WRONG}, {"phi": WRONG}, {"psi": 302.0}, {"theta": NAN}])
def test_an_impossible_attitude_is_rejected_and_counted(name, angles, tmp_path):
    states, reports, _ = navigate(name, tmp_path, ("Simulators.IMU/AHRS", imc.EulerAngles(**angles)), seconds=8.0)
    assert len(states) > 100
    assert max(abs(state.theta) + abs(state.phi) for state in states) < 0.5
    assert reports == ["impossible values are rejected: 1 of attitude"]


@pytest.mark.parametrize("name", VEHICLES)
def test_attitudes_in_degrees_are_named(name, tmp_path):
    wrong = ("Simulators.IMU/AHRS", imc.EulerAngles(theta=WRONG))
    states, _, faults = navigate(name, tmp_path, wrong, rate=20.0)
    assert "attitude is impossible in radians" in faults
    assert max(abs(state.theta) for state in states) < 0.5


@pytest.mark.parametrize("name", ["lauv-noptilus-1", "hexa-00"])
def test_an_impossible_attitude_now_and_then_does_not_disable_the_others(name, tmp_path):
    wrong = ("Simulators.IMU/AHRS", imc.EulerAngles(theta=WRONG))
    states, _, faults = navigate(name, tmp_path, wrong, rate=1.0 / 0.9, seconds=5.0)
    assert "attitude is impossible in radians" not in faults
    assert max(abs(state.theta) for state in states) < 0.5


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("wrong", [NAN, math.inf])
def test_attitudes_that_are_no_number_do_not_spoil_those_between_them(name, wrong, tmp_path):
    _, reports, faults = navigate(name, tmp_path, ("Simulators.IMU/AHRS", imc.EulerAngles(theta=wrong)), rate=5.0)
    assert faults == {"active"}
    assert len(reports) == 1


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("value", [NAN, math.inf, -1e30])
def test_impossible_values_of_all_sensors_are_rejected_and_counted(name, value, tmp_path):
    wrong = [
        ("Simulators.IMU/AHRS", imc.EulerAngles(phi=value, theta=value, psi=0.0 if value == value else 1e3)),
        ("Simulators.IMU/AHRS", imc.AngularVelocity(x=value)),
        ("Simulators.IMU/AHRS", imc.Acceleration(z=value)),
        ("Simulators.GPS", imc.GpsFix(validity=0x1FF, lat=value, lon=value, height=value, sog=value, cog=value)),
    ]
    kinds = {"attitude", "turn rates"}
    if name == "lauv-noptilus-1":
        velocity = imc.GroundVelocity(validity=7, x=value)
        wrong += [("Simulators.DepthSensor", imc.Depth(value=value)), ("Simulators.DVL", velocity)]
        kinds |= {"depth"}
    if name == "hexa-00":
        wrong.append(("Simulators.Barometer", imc.Pressure(value=value)))
        kinds |= {"acceleration", "pressure"}
    states, reports, _ = navigate(name, tmp_path, *wrong, seconds=8.0)
    numbers = [getattr(state, field) for state in states for field in ("x", "y", "z", "u", "v", "w", "p", "psi", "alt")]
    assert all(abs(number) < 100.0 for number in numbers)
    assert len(reports) == 1
    assert all(f"1 of {kind}" in reports[0] for kind in kinds)
