"""A simulated vehicle with its own navigation and control follows paths."""

import math
from dataclasses import dataclass

import pytest

import imc
from imc.coordinates import absolute_position
from runtime.kernel import VirtualClock, nanoseconds
from runtime.profile import load_profile, own_etc
from runtime.vehicle import build
from support.wgs84 import displace, displacement

SECTIONS = {
    "Simulators.VSIM",
    "Simulators.Servos",
    "Simulators.Motor",
    "Simulators.GPS",
    "Simulators.IMU/AHRS",
    "Simulators.DepthSensor",
    "Simulators.DVL",
    "Simulators.Environment",
    "Simulators.StreamVelocity",
    "Navigation.AUV.Navigation",
    "Control.AUV.Attitude",
    "Control.AUV.Allocator",
    "Control.AUV.Speed",
    "Control.Path.VectorField",
}
LAT, LON = math.radians(41.185), math.radians(-8.7062)
BEGIN = 15.0  # s
DEEP = ("Bathymetry:Data=",)  # 120 m of water


@dataclass
class Sample:
    """True and estimated position at one time (s): m north and east of the start, and variances (m²)."""

    time: float
    north: float
    east: float
    depth: float
    error_north: float
    error_east: float
    variance_north: float
    variance_east: float

    @property
    def distance(self) -> float:
        """Squared error over variance, of both coordinates."""
        return self.error_north**2 / self.variance_north + self.error_east**2 / self.variance_east


def path(ref, north, east, z, **fields):
    lat, lon, _ = displace(LAT, LON, 0.0, north, east)
    depth = imc.ZUnits.DEPTH
    fields = {"speed": 1.4, "end_z_units": depth} | fields
    return imc.DesiredPath(path_ref=ref, end_lat=lat, end_lon=lon, end_z=z, **fields)


def fly(tmp_path, paths, seconds, *, seed=0, settings=DEEP):
    """Follow each path after the one before has ended. Returns the samples of each second, and all messages."""
    profile = load_profile("lauv-noptilus-1", [own_etc()])
    for setting in settings:
        profile.override(setting)
    clock = VirtualClock(profile.start_time_ns)
    made = build(profile, ["Simulation"], clock=clock, seed=seed, log_root=tmp_path, only=SECTIONS)
    vehicle, messages = made.vehicle, []
    assert {task.name for task in vehicle.tasks} >= SECTIONS
    vehicle.observe(imc.Message, messages.append)
    vehicle.start()
    waiting = list(paths)

    def publish(message):
        packet = imc.encode_with_header(message, vehicle.kernel.now_ns * 1e-9, vehicle.system, 0xFE, 0xFFFF, 0xFF)
        vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)

    def follow(state):
        if state.flags & imc.PathControlState.Flags.NEAR and waiting and state.path_ref < waiting[0].path_ref:
            publish(waiting.pop(0))

    vehicle.observe(imc.PathControlState, follow)
    begin = nanoseconds(vehicle.start_time + BEGIN)
    vehicle.kernel.at(begin, publish, imc.ControlLoops(enable=1, mask=1, scope_ref=1))
    vehicle.kernel.at(begin, lambda: publish(waiting.pop(0)))
    vehicle.run(seconds)
    vehicle.close()
    return list(sampled(messages, vehicle.start_time)), messages


def sampled(messages, start):
    truth = state = None
    due = BEGIN
    for message in messages:
        if isinstance(message, imc.SimulatedState):
            truth = message
        elif isinstance(message, imc.EstimatedState):
            state = message
        elif isinstance(message, imc.NavigationUncertainty) and message.timestamp - start >= due:
            due += 1.0
            lat, lon, height = displace(truth.lat, truth.lon, truth.height, truth.x, truth.y, truth.z)
            north, east, _ = displacement(LAT, LON, 0.0, lat, lon, height)
            own = absolute_position(state)
            off = displacement(lat, lon, height, *own)
            yield Sample(message.timestamp - start, north, east, truth.z, off[0], off[1], message.x, message.y)


def rms(values):
    values = list(values)
    return math.sqrt(sum(value**2 for value in values) / len(values))


def between(samples, begin, end):
    return [sample for sample in samples if begin <= sample.time < end]


@pytest.fixture(scope="module")
def mission(tmp_path_factory):
    """150 m north at 3 m depth, 90 m east at 5 m, back to the surface."""
    paths = [path(1, 150.0, 0.0, 3.0), path(2, 150.0, 90.0, 5.0), path(3, 0.0, 90.0, 0.0)]
    return fly(tmp_path_factory.mktemp("log"), paths, 230.0)


@pytest.mark.heavy
@pytest.mark.computing
def test_it_keeps_to_its_track(mission):
    samples, _ = mission
    assert rms(s.east for s in between(samples, 30.0, 110.0)) < 1.0
    assert rms(s.north - 150.0 for s in between(samples, 125.0, 168.0)) < 1.0
    assert all(abs(s.east) < 3.0 for s in between(samples, BEGIN, 110.0))


@pytest.mark.heavy
def test_it_keeps_its_depth_once_settled(mission):
    samples, _ = mission
    assert all(abs(s.depth - 3.0) < 0.3 for s in between(samples, 40.0, 110.0))
    assert all(abs(s.depth - 5.0) < 0.3 for s in between(samples, 135.0, 168.0))
    assert all(s.depth < 0.3 for s in between(samples, 190.0, 230.0))


def test_it_comes_near_the_end_of_each_path_five_seconds_before(mission):
    samples, messages = mission
    start = next(m for m in messages if isinstance(m, imc.SimulatedState)).timestamp
    near = [m for m in messages if isinstance(m, imc.PathControlState) and m.flags & imc.PathControlState.Flags.NEAR]
    first = min(m.timestamp for m in near if m.path_ref == 1) - start
    assert 150.0 - between(samples, first, first + 1.0)[0].north == pytest.approx(7.5, abs=1.5)


def test_the_position_is_lost_slowly_under_water_and_found_again(mission):
    """A compass error of up to half a degree makes the variance across the track grow, and a fix reduces it again."""
    samples, _ = mission
    dived, surfaced = between(samples, 167.0, 168.0)[0], between(samples, 229.0, 230.0)[0]
    assert dived.variance_north + dived.variance_east > 1.0
    assert surfaced.variance_north + surfaced.variance_east < 0.5
    assert all(math.hypot(s.error_north, s.error_east) < 1.0 for s in samples)
    assert all(s.distance < 9.0 for s in samples)
    assert sum(s.distance for s in samples) / len(samples) < 2.5


def test_fins_and_thruster_stay_within_their_limits(mission):
    _, messages = mission
    assert all(abs(m.value) <= math.radians(25.0) + 1e-6 for m in messages if isinstance(m, imc.SetServoPosition))
    assert all(0.0 <= m.value <= 1700.0 / 2500.0 + 1e-6 for m in messages if isinstance(m, imc.SetThrusterActuation))


@pytest.mark.heavy
def test_a_current_from_the_side_is_held_against(tmp_path):
    current = [*DEEP, "Simulators.StreamVelocity:Default Speed East=0.3"]
    samples, messages = fly(tmp_path, [path(1, 200.0, 0.0, 3.0)], 90.0, seed=3, settings=current)
    settled = between(samples, 60.0, 90.0)
    assert rms(s.east - samples[0].east for s in settled) < 3.0
    assert rms(s.depth - 3.0 for s in settled) < 0.5
    assert all(s.distance < 16.0 for s in samples)
    stream = [m for m in messages if isinstance(m, imc.EstimatedStreamVelocity)][-1]
    assert stream.y == pytest.approx(0.3, abs=0.02)


@pytest.mark.heavy
@pytest.mark.computing
def test_without_velocities_over_ground_the_error_is_still_what_it_says(tmp_path):
    """The speed comes from the motor, which is less accurate."""
    lost = [*DEEP, "Simulators.DVL:Invalid Reading Probability=100"]
    samples, _ = fly(tmp_path, [path(1, 200.0, 0.0, 3.0)], 90.0, seed=4, settings=lost)
    assert all(s.distance < 12.0 for s in samples)
    assert samples[-1].variance_north > 1.0


@pytest.mark.heavy
@pytest.mark.computing
def test_a_circle_is_kept(tmp_path):
    circle = path(1, 60.0, 0.0, 2.0, lradius=20.0)
    samples, messages = fly(tmp_path, [circle], 150.0, seed=5)
    loitering = [m for m in messages if isinstance(m, imc.PathControlState) and m.flags & 2]
    assert loitering
    settled = between(samples, 90.0, 150.0)
    assert rms(math.dist((s.north, s.east), (60.0, 0.0)) - 20.0 for s in settled) < 1.5


@pytest.mark.heavy
def test_the_bottom_is_kept_away_from(tmp_path):
    """The desired depth is 5 m where the water is shallower."""
    samples, messages = fly(tmp_path, [path(1, 60.0, 15.0, 5.0)], 60.0, seed=6, settings=())
    altitudes = [m.alt for m in messages if isinstance(m, imc.EstimatedState) and m.alt >= 0.0]
    assert min(altitudes) > 1.2
    assert all(abs(alt - 2.5) < 0.6 for alt in altitudes[-200:])
    assert samples[-1].depth > 1.0
