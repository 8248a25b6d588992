"""Values that DUNE's tasks accept: ours are never stricter."""

import math

import pytest

import imc
from runtime import ParameterError
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from tasks.simulators.gaussian import Gaussian
from tasks.simulators.stream_velocity import StreamVelocity

# Defaults of DUNE's sources, and values that their descriptions allow.
ACCEPTED = [
    "Control.Path.VectorField:Control Frequency=-1",
    "Control.Path.VectorField:State Report Frequency=0.05",
    "Control.Path.VectorField:Cross-track -- Nav. Unc. Factor=-1",
    "Control.Path.VectorField:Along-track -- Check Period=0.5",
    "Control.AUV.Attitude:Pitch Integral Limit=-5",
    "Control.AUV.Attitude:Pitch Angle At Surface=60",
    "Control.AUV.Speed:MPS Integral Limit=-2",
    "Control.AUV.Speed:Negative Thrust Limit=-1.0",
    "Maneuver.Elevator:VMonitor -- Minimum Speed=-1.0",
    "Maneuver.PopUp:VMonitor -- Minimum Speed=-1.0",
    "Simulators.Gaussian/SoundSpeed:Name of message to produce=RhodamineDye",
    "Simulators.Gaussian/SoundSpeed:Name of message to produce=DissolvedOxygen",
    "Simulators.StreamVelocity:Stream Velocity Source=Sinusoidal",
    "Simulators.StreamVelocity:Default Speed North=15",
    "Monitors.Emergency:Expiration Time - Abort SMS=86400",
    "Monitors.Emergency:Expiration Time - Lost Communications=86400",
    "Monitors.Emergency:Execution Frequency=0.01",
    "Monitors.Entities:Report Timeout=2",
    "Monitors.FuelLevel:Execution Frequency=20",
    "Monitors.HostResources:Execution Frequency=0.005",
    "Monitors.Medium:Altitude Threshold=-1",
    "Monitors.Medium:Initialization Time=5",
    "Monitors.Medium:Execution Frequency=0.05",
    "Monitors.OperationalLimits:Hysteresis Threshold - Maximum Depth=-0.1",
    "Monitors.OperationalLimits:Hysteresis Threshold - Minimum Altitude=-0.1",
    "Monitors.OperationalLimits:Execution Frequency=0.05",
    "Supervisors.AUV.LostComms:Lost Comms Timeout=0",
    "Supervisors.AUV.LostComms:Lost Comms Timeout=-1",
    "Supervisors.AUV.LostComms:Execution Frequency=0.05",
    "Supervisors.Vehicle:Maneuver Handling Timeout=0.05",
    "Supervisors.Vehicle:Maneuver Handling Timeout=0",
    "Supervisors.Vehicle:Execution Frequency=0.05",
    "Transports.FTP:Control Port=21",
    "Transports.TCP.Server:Port=0",
    "Transports.UDP:Communication Range=-1",
    "Transports.UDP:Contact Timeout=0.5",
    "Transports.UDP:Contact Timeout=0",
    "Transports.Announce:Announcement Periodicity=120",
    "Transports.Announce:Announcement Periodicity=0.5",
]


@pytest.mark.parametrize("option", ACCEPTED)
def test_a_shipped_vehicle_takes_what_dune_takes(option, tmp_path):
    profile = load_profile("lauv-noptilus-1", overrides=[option])
    build(profile, {"Simulation"}, clock=VirtualClock(profile.start_time_ns), log_root=tmp_path).vehicle.close()


def states(seconds):
    start = 1_767_225_600.0
    return [imc.SimulatedState(timestamp=start + k, lat=math.radians(41.185373), z=2.0) for k in range(seconds)]


def test_a_gaussian_field_is_any_message_with_a_value():
    run = simulate(Gaussian, feed=states(5), message_name="rhodaminedye", standard_deviation=0.0)
    assert run.of(imc.RhodamineDye)[-1].value == pytest.approx(14.0, abs=0.1)
    for name in ("Sms", "EntityState", "Temprature"):
        with pytest.raises(ParameterError, match="is no message with a value"):
            simulate(Gaussian, feed=states(2), message_name=name)


def test_a_sinusoidal_current_begins_with_its_phase_and_flows_along_its_slope():
    """DUNE: SinusoidalStreamGenerator.cpp of LSTS/dune."""
    wanted = {"amplitude": 0.5, "period": 40.0, "phase": 90.0, "slope": 30.0, "default_speed_north": 3.0}
    run = simulate(StreamVelocity, seconds=40.0, stream_velocity_source="Sinusoidal", **wanted)
    found = run.of(imc.EstimatedStreamVelocity)
    began = run.vehicle.start_time
    assert len(found) >= 39
    for current in found:
        speed = 0.5 * math.cos(math.tau * (current.timestamp - began) / 40.0)
        assert current.x == pytest.approx(speed * math.cos(math.radians(30.0)), abs=1e-5)
        assert current.y == pytest.approx(speed * math.sin(math.radians(30.0)), abs=1e-5)
        assert current.z == 0.0
