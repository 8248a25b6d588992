"""CompassCalibration, FollowSystem, LostComms and Emergency in the shipped profiles."""

import math

import pytest

import imc
from runtime.bus import Subscription
from runtime.kernel import SECOND
from shoal.missions import Mission, parse_plan, prepare
from support.wgs84 import displace

CCU, LEADER = 0x4000, 0x0801
HERE = (math.radians(41.185), math.radians(-8.7062))
CALIBRATION = """plan: p
origin: 41.185°, -8.7062°
speed: 1.4 m/s
maneuvers:
  - compass_calibration: {north: 60, radius: 15, DEPTH, pitch: 15°, duration: 60s}
"""
IDLE = "plan: NAME\nmaneuvers:\n  - idle: {duration: 60s}\n"
QUIET = "Plan.Autostart:Enabled=Never"


def prepared(profile, folder, *overrides):
    """A shipped vehicle that waits for a plan."""
    folders = {"log_root": folder / "log", "state_folder": folder / "db"}
    return prepare(profile, overrides=[QUIET, *overrides], **folders).vehicle


def say(vehicle, message, src=CCU):
    now = vehicle.kernel.now_ns / SECOND
    packet = imc.encode_with_header(message, now, src, 3, vehicle.system, 0xFF)
    vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)


class Witness:
    """Keeps messages of some types that a vehicle publishes."""

    def __init__(self, vehicle, *kinds):
        self.kept = []
        for kind in kinds:
            vehicle.bus.subscribe(Subscription(kind, self.kept.append, vehicle.daemon))

    def of(self, kind):
        return [message for message in self.kept if isinstance(message, kind)]


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("profile", "depth"), [("lauv-noptilus-1", "depth: 3, amplitude: 1"), ("otter", "depth: 0, amplitude: 0")]
)
def test_shipped_vehicles_circle_to_calibrate(tmp_path, profile, depth):
    vehicle = prepared(profile, tmp_path)
    seen = Witness(vehicle, imc.MagneticField)
    report = Mission(vehicle, parse_plan(CALIBRATION.replace("DEPTH", depth))).fly(400)
    assert (report.outcome, report.reason) == ("SUCCESS", "plan completed")
    compass = vehicle.entities.find("AHRS").id
    (found,) = [field for field in seen.of(imc.MagneticField) if field.dst_ent == compass]
    own = [float(part) for part in vehicle.profile.value("Simulators.IMU/AHRS", "Hard Iron").split(",")]
    assert (found.x, found.y) == (pytest.approx(own[0], abs=2e-3), pytest.approx(own[1], abs=2e-3))
    assert len([field for field in seen.of(imc.MagneticField) if field.src_ent == compass]) > 600


@pytest.mark.heavy
def test_a_boat_follows_a_system_that_announces_itself(tmp_path):
    vehicle = prepared("otter", tmp_path)
    seen = Witness(vehicle, imc.EstimatedState, imc.PlanControlState)
    vehicle.start()
    vehicle.run(20.0)
    order = imc.FollowSystem(system=LEADER, duration=200, speed=1.5, x=-20.0)
    start = imc.PlanControl(op=imc.PlanControl.Op.START, plan_id="follow", arg=order)
    say(vehicle, start)
    for k in range(16):
        lat, lon, _ = displace(*HERE, 0.0, 60.0 + 5.0 * k, 0.0)
        say(vehicle, imc.Announce(sys_name="leader", lat=lat, lon=lon), src=LEADER)
        vehicle.run(10.0)
    state = seen.of(imc.EstimatedState)[-1]
    assert seen.of(imc.PlanControlState)[-1].state == imc.PlanControlState.State.EXECUTING
    vehicle.close()
    own = displace(state.lat, state.lon, 0.0, state.x, state.y)
    behind = displace(*HERE, 0.0, 60.0 + 75.0 - 20.0, 0.0)
    away = math.hypot(own[0] - behind[0], (own[1] - behind[1]) * math.cos(own[0])) * 6.371e6
    assert away < 20.0


@pytest.mark.heavy
def test_after_a_failed_plan_the_auv_starts_lostcomms(tmp_path):
    emergency = ["Monitors.Emergency:Enabled=Always", "Monitors.Emergency:SMS Recipient Number=+351000000000"]
    timeouts = ["Supervisors.AUV.LostComms:Lost Comms Timeout=30", "Monitors.Emergency:Lost Communications Timeout=60"]
    vehicle = prepared("lauv-noptilus-1", tmp_path, *emergency, *timeouts)
    seen = Witness(vehicle, imc.PlanControlState, imc.Sms)
    vehicle.start()
    vehicle.run(15.0)
    stored = parse_plan(IDLE.replace("NAME", "lostcomms"))
    say(vehicle, imc.PlanDB(op=imc.PlanDB.Op.SET, plan_id="lostcomms", arg=stored))
    first = parse_plan(IDLE.replace("NAME", "first"))
    say(vehicle, imc.PlanControl(op=imc.PlanControl.Op.START, plan_id="first", arg=first))
    vehicle.run(5.0)
    say(vehicle, imc.PlanControl(op=imc.PlanControl.Op.STOP, plan_id="first"))
    vehicle.run(25.0)
    assert "lostcomms" not in {state.plan_id for state in seen.of(imc.PlanControlState)}
    vehicle.run(15.0)
    state = seen.of(imc.PlanControlState)[-1]
    assert (state.plan_id, state.state) == ("lostcomms", imc.PlanControlState.State.EXECUTING)
    vehicle.run(200.0)
    vehicle.close()
    assert seen.of(imc.Sms)[0].contents.startswith("(T) (lauv-noptilus-1) ")
