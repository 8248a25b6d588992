"""The position error of the whole vehicle matches its covariance, if sensors have the noise they claim."""

import pytest

import imc
from imc.coordinates import absolute_position
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from support.wgs84 import displacement

NOISE = (
    "Simulators.GPS:Standard Deviation - Position=1.414",  # each way, of the 2 m that a fix claims
    "Simulators.IMU/AHRS:Standard Deviation - Heading Offset=0.57",
    "Simulators.DVL:Standard Deviation - Ground Velocity=0.01",
    "Simulators.MUGDetectionCamera:Enabled=Never",
)
SEEDS, LENGTH = range(12), 28.0  # s, of which most are under water


def normalised_error(folder, seed: int) -> float:
    """The squared error of the position over its covariance, in a circle under water."""
    profile = load_profile("lauv-noptilus-1", overrides=NOISE)
    clock = VirtualClock(profile.start_time_ns)
    vehicle = build(profile, {"Simulation"}, clock=clock, seed=seed, log_root=folder).vehicle
    latest = {}
    for kind in (imc.SimulatedState, imc.EstimatedState, imc.NavigationUncertainty):
        vehicle.observe(kind, lambda message: latest.update({type(message): message}))
    vehicle.start()
    vehicle.run(LENGTH)
    vehicle.close()
    truth, estimate, sure = (latest[k] for k in (imc.SimulatedState, imc.EstimatedState, imc.NavigationUncertainty))
    assert estimate.depth > 1.0
    north, east, _ = displacement(truth.lat, truth.lon, 0.0, *absolute_position(estimate)[:2], 0.0)
    return (north - truth.x) ** 2 / sure.x + (east - truth.y) ** 2 / sure.y


@pytest.mark.heavy
@pytest.mark.computing
def test_errors_are_those_that_the_uncertainty_promises(tmp_path):
    """The mean of twelve distances, each of two degrees of freedom, is from 1.03 to 3.28 in 95 of 100 cases."""
    distances = [normalised_error(tmp_path, seed) for seed in SEEDS]
    assert 1.03 < sum(distances) / len(distances) < 3.28, distances
