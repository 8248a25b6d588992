"""Whichever task of the AUV falls silent in a dive, the vehicle comes up, or goes on unharmed: see docs/mission.md."""

import math
import re
import tempfile
from pathlib import Path

import pytest
from flying import BROADCAST, CCU, control, plan_of

import imc
from runtime.kernel import SECOND, VirtualClock
from runtime.snapshot import InputJournals, load, restore, take_snapshot
from shoal.missions import prepare
from support import wgs84

Mode = imc.VehicleState.OpMode
PLACE = 41.05, -9.1  # °, where the simulated sea is 120 m deep
DIVE, FAULT = 10, 55  # s; at the fault the vehicle goes ahead at a depth of 10 m
LOOK = 25.0  # s after the fault
PATIENCE = 60  # s without the DVL, with the speed of the motor
DEEPER = 3.5  # m, at most, until it rises; fins that have stopped as they were, and what speed is left, lead down
PAGE = Path(__file__).parents[3] / "docs" / "mission.md"
SETUP = (
    f"Simulators.GPS:Initial Position={PLACE[0]}, {PLACE[1]}",
    "Transports.Logging:Transports=VehicleState",
)
# task -> s until it is on its way up, and who says so in VehicleState.last_error
RISES = {
    "Control.AUV.Allocator": (15, "Failsafe: no AllocatedControlTorques for 3 s"),
    "Control.AUV.Attitude": (15, "Failsafe: no DesiredControl for 3 s, no AllocatedControlTorques for 3 s"),
    "Control.AUV.Speed": (5, "Failsafe: no SetThrusterActuation for 3 s"),
    "Control.Path.VectorField": (10, "Failsafe: no PathControlState for 3 s"),
    "Daemon": (10, "no report for 5 s"),
    "Maneuver.Goto": (10, "Goto maneuver error: no report for 3 s"),
    "Monitors.Entities": (10, "Failsafe: no EntityMonitoringState for 3 s"),
    "Navigation.AUV.Navigation": (10, "EstimatedState is missing"),
    "Plan.Engine": (5, "Failsafe: no PlanControlState for 3 s"),
    "Simulators.DepthSensor": (10, "Navigation: depth is missing"),
    "Simulators.IMU/AHRS": (15, "Navigation: attitude is missing"),
    "Simulators.Motor": (10, "Speed Control: no Rpm for 2 s"),
    "Simulators.Servos": (15, "Allocator: no position from servo 0, 1, 2, 3"),
    "Supervisors.Failsafe": (10, "Failsafe: no Heartbeat for 5 s"),
    "Supervisors.Vehicle": (10, ""),  # nobody publishes VehicleState
}
PHYSICS = "Simulators.VSIM"  # if it is silent, nothing moves
# task -> why the plan goes on without it
GOES_ON = {
    "Control.AUV.Brakes": "only needed before an obstacle; `Environment` sees none",
    "Control.AUV.RemoteOperation": "only needed in Teleoperation",
    "Monitors.FuelLevel": "the level is unknown then; with an empty battery the vehicle rises",
    "Monitors.Medium": "only needed before a plan",
    "Supervisors.AUV.LostComms": "only needed after a failed plan",
    "Monitors.OperationalLimits": "`Attitude` and `Failsafe` receive the limit of depth",
    "Plan.DB": "only needed for a START that names a stored plan",
    "Plan.Generator": "only needed for its requests",
    "Simulators.Battery": "`Fuel Monitor` is in FAULT",
    "Simulators.DVL": "for 60 s: the speed follows from the motor",
    "Simulators.Environment": "a depth is kept as planned, an altitude for 60 s",
    "Simulators.GPS": "normal under water",
    "Simulators.Gaussian/SoundSpeed": "not used for control",
    "Simulators.Gaussian/Temperature": "not used for control",
    "Simulators.MUGDetectionCamera": "not needed for control",
    "Simulators.Leaks": "publishes only when there is a leak",
    "Simulators.StreamVelocity": "the current stays as it is",
    "Monitors.HostResources": "not needed for control",
    "Supervisors.Equipment": "only answers requests",
    "Transports.Cache": "only needed at the start",
    "Transports.FTP": "not needed for control",
    "Transports.Fragments": "only needed for messages in pieces",
    "Transports.LogBook": "only answers requests",
    "Transports.Logging": "not needed for control",
    "Transports.MAVLink": "not needed for control",
    "Transports.TCP.Server": "not needed for control",
}
# These do not run on a virtual clock.
NEEDS_A_NETWORK = {"Monitors.HostResources", "Transports.FTP", "Transports.MAVLink", "Transports.TCP.Server"}
OTHER_MANEUVERS = "only needed if the plan has it"


def vehicle(folder, **options):
    made = prepare("lauv-noptilus-1", overrides=SETUP, log_root=folder / "log", state_folder=folder / "db", **options)
    made.vehicle.keep_going = True
    return made.vehicle


def say(vehicle, message):
    packet = imc.encode_with_header(message, vehicle.kernel.now_ns / SECOND, CCU, 3, message.dst, message.dst_ent)
    vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)


@pytest.fixture(scope="module")
def diving():
    """The state of the vehicle in its dive."""
    lat, lon, _ = wgs84.displace(*map(math.radians, PLACE), 0.0, 5000.0, 0.0)
    plan = plan_of(imc.Goto(lat=lat, lon=lon, z=10.0, z_units=imc.ZUnits.DEPTH, speed=1.5))
    with tempfile.TemporaryDirectory() as folder:
        diver = vehicle(Path(folder))
        InputJournals(diver)
        diver.start()
        diver.run(DIVE)
        say(diver, control(imc.PlanControl.Op.START, -1.0, plan.plan_id, 1, arg=plan))
        diver.run(FAULT - DIVE)
        yield load(take_snapshot(diver))
        diver.close()


class Dive:
    """What happens after some tasks fall silent: true depths once a second, modes, last errors, replies."""

    def __init__(self, diving, folder, silent=(), *, abort=None, seconds=LOOK):
        self.depths, self.modes, self.errors, self.replies = [], [], [], []
        self.vehicle = diver = vehicle(folder, clock=VirtualClock(diving.time))
        diver.observe(imc.VehicleState, self._note)
        diver.observe(imc.PlanControl, self._note_reply)
        restore(diver, diving)
        for name in silent:
            task = diver.task(name)
            task.publish = lambda message, **_: message
        if abort is not None:
            diver.run(1.0)
            say(diver, abort)
        truth, self.thrusts = diver.task(PHYSICS).craft, []
        for _ in range(round(seconds)):
            self.depths.append(truth.z)
            self.thrusts.append(truth.actuations[0])
            diver.run(1.0)
        self.thrust = truth.actuations[0]
        diver.close()

    def _note(self, state):
        self.modes.append(Mode(state.op_mode))
        self.errors.append(state.last_error)

    def _note_reply(self, reply):
        if reply.dst == CCU:
            self.replies.append(reply.info)

    @property
    def rises_after(self):
        """From when on (s) the vehicle rises without thrust or pause."""
        pairs = zip(self.depths, self.depths[1:], self.thrusts, strict=False)
        return max((s + 1 for s, (now, then, thrust) in enumerate(pairs) if thrust or then >= now), default=0)


@pytest.mark.parametrize("task", RISES)
def test_the_vehicle_comes_up_when_a_task_falls_silent(task, diving, tmp_path):
    seconds, error = RISES[task]
    dive = Dive(diving, tmp_path, [task])
    assert dive.rises_after <= seconds, dive.depths
    assert max(dive.depths) < dive.depths[0] + DEEPER
    assert dive.thrust == 0.0
    assert Mode.MANEUVER not in dive.modes[-10:]
    assert any(error in text for text in dive.errors) or not error


def test_without_supervisor_and_failsafe_the_plan_engine_stops_the_vehicle(diving, tmp_path):
    dive = Dive(diving, tmp_path, ["Supervisors.Vehicle", "Supervisors.Failsafe"])
    assert dive.rises_after <= 10, dive.depths
    assert dive.replies[-1] == "VehicleState is missing"
    assert dive.thrust == 0.0


def test_the_vehicle_is_in_error_when_physics_stop(diving, tmp_path):
    assert Dive(diving, tmp_path, [PHYSICS]).modes[-1] is Mode.ERROR


@pytest.mark.heavy
def test_the_plan_goes_on_without_all_others(diving, tmp_path):
    tasks = {task.name for task in vehicle(tmp_path).tasks}
    others = sorted(tasks - set(RISES) - {PHYSICS})
    maneuvers = {name for name in others if name.startswith("Maneuver.")}
    assert set(others) - maneuvers == set(GOES_ON) - NEEDS_A_NETWORK
    dive = Dive(diving, tmp_path, others)
    assert set(dive.modes) == {Mode.MANEUVER}
    assert not dive.replies
    assert all(abs(depth - 10.0) < 0.5 for depth in dive.depths)


@pytest.mark.heavy
def test_a_dvl_that_stays_silent_ends_the_plan_after_a_minute(diving, tmp_path):
    dive = Dive(diving, tmp_path, ["Simulators.DVL"], seconds=PATIENCE + 15)
    assert PATIENCE <= dive.rises_after <= PATIENCE + 10, dive.depths
    assert all(abs(depth - 10.0) < 0.5 for depth in dive.depths[:PATIENCE])
    assert dive.thrust == 0.0
    assert "Navigation: DVL is silent" in dive.errors[-1]


@pytest.mark.parametrize("silent", ["Supervisors.Vehicle", "Supervisors.Failsafe", "Maneuver.Goto"])
@pytest.mark.parametrize("dst", [imc.reserved_ids.UNKNOWN_SYSTEM, BROADCAST])
def test_an_abort_to_everybody_is_obeyed_whoever_is_silent(silent, dst, diving, tmp_path):
    dive = Dive(diving, tmp_path, [silent], abort=imc.Abort(dst=dst), seconds=1.0)
    assert dive.thrust == 0.0


@pytest.mark.heavy
def test_the_vehicle_comes_up_after_an_error_even_if_no_maneuver_idles(diving, tmp_path):
    dive = Dive(diving, tmp_path, ["Maneuver.Idle", "Simulators.DepthSensor"])
    assert dive.thrust == 0.0
    assert dive.depths[-1] < dive.depths[-20]


def test_all_tasks_are_in_the_docs():
    page = PAGE.read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `([\w./]+)` \| .* \| (\d+) s \|$", page, re.MULTILINE))
    assert {task: str(seconds) for task, (seconds, _) in RISES.items()} == rows
    for task, reason in GOES_ON.items():
        assert f"| `{task}` | {reason} |" in page
    assert f"| other maneuvers | {OTHER_MANEUVERS} |" in page
