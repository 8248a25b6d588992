"""Remote operation of the shipped multirotor in its full simulation: it follows the stick, and stays when released."""

import math

import pytest

import imc
from runtime.testing import simulate
from shoal.missions import parse_plan, prepare
from tasks.control.uav.remote_operation import RemoteOperation
from tests.tasks.ideal.aloft import CCU, OWN, publish

PLAN = parse_plan("plan: up\norigin: 41.185°, -8.7062°\nspeed: 2 m/s\nmaneuvers:\n  - takeoff: {altitude: 12}\n")
STEER = imc.PlanSpecification(
    plan_id="console-steer",
    start_man_id="steer",
    maneuvers=[imc.PlanManeuver(maneuver_id="steer", data=imc.Teleoperation(custom=f"src={CCU}"))],
)


def references(actions, seconds=20.0, *, arming=0, sinks=0.0):
    """Velocities and headings that a stick which is held makes, of a vehicle whose heading stays 3 rad."""
    enabled = imc.ControlLoops(timestamp=0.5, enable=1, mask=imc.CLoopsMask.TELEOPERATION)
    feed = [
        *(imc.EstimatedState(timestamp=0.1 * k, psi=3.0, z=0.1 * k * sinks) for k in range(round(10.0 * seconds))),
        *(imc.ArmingState(timestamp=float(k), state=arming) for k in range(round(seconds))),
        *(imc.RemoteActions(timestamp=0.6 + 0.2 * k, src=CCU, actions=actions) for k in range(round(5 * seconds))),
    ]
    run = simulate(RemoteOperation, sorted([enabled, *feed], key=lambda m: m.timestamp), seconds=seconds)
    return run.of(imc.DesiredVelocity), run.of(imc.DesiredHeading)


def test_on_the_ground_no_height_is_kept_that_would_lift_it():
    """The estimate of a vehicle that stands sinks and rises with the pressure of the air."""
    disarmed, armed = imc.ArmingState.State.DISARMED, imc.ArmingState.State.ARMED
    assert min(each.w for each in references("", arming=armed, sinks=0.02)[0]) < -0.2
    assert {each.w for each in references("", arming=disarmed, sinks=0.02)[0]} == {0.0}
    assert references("Thrust=127", arming=disarmed)[0][-1].w == -2.0


@pytest.mark.parametrize("actions", ["Heading=127", "Heading=-127"])
def test_a_heading_that_does_not_follow_is_not_asked_for_from_the_other_side(actions):
    headings = references(actions)[1]
    leads = [math.remainder(each.value - 3.0, math.tau) for each in headings]
    assert math.copysign(leads[-1], float(actions[8:])) == pytest.approx(leads[-1])
    assert max(map(abs, leads)) == pytest.approx(math.radians(90.0))


class Steered:
    """A multirotor in the air, and a console that steers it."""

    def __init__(self, vehicle):
        self.vehicle, self.truths, self.replies, self.modes = vehicle, [], [], []
        vehicle.observe(imc.SimulatedState, self.truths.append)
        vehicle.observe(imc.PlanControl, lambda m: self.replies.append(m.info) if m.dst == CCU else None)
        vehicle.observe(imc.VehicleState, lambda m: self.modes.append(m.op_mode))

    def order(self, plan):
        publish(self.vehicle, imc.PlanControl(plan_id=plan.plan_id, arg=plan, src=CCU, dst=OWN, request_id=7))

    def steer(self, seconds, actions):
        for _ in range(round(seconds * 5)):
            publish(self.vehicle, imc.RemoteActions(actions=actions, src=CCU, dst=OWN))
            self.vehicle.run(0.2)

    @property
    def place(self):
        return self.truths[-1].x, self.truths[-1].y

    @property
    def height(self):
        return -self.truths[-1].z


@pytest.mark.heavy
@pytest.mark.computing
def test_it_follows_the_stick_and_stays_where_it_is_let_go(tmp_path):
    made = prepare("hexa-00", log_root=tmp_path / "log", state_folder=tmp_path / "db")
    flown = Steered(made.vehicle)
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    flown.order(STEER)
    flown.vehicle.run(1.0)
    assert "the vehicle is on the ground, a Takeoff must come first" in flown.replies[-1]
    flown.order(PLAN)
    flown.vehicle.run(20.0)
    flown.order(STEER)
    flown.steer(2.0, "")
    start, heading, height = flown.place, flown.truths[-1].psi, flown.height
    flown.steer(4.0, "Pitch=-127")
    moved = [now - before for now, before in zip(flown.place, start, strict=True)]
    along = math.cos(heading) * moved[0] + math.sin(heading) * moved[1]
    assert 10.0 < along < 22.0
    assert abs(math.sin(heading) * moved[0] - math.cos(heading) * moved[1]) < 2.0
    flown.steer(4.0, "Pitch=0;Roll=0")
    held = flown.place
    flown.vehicle.run(10.0)  # the operator is silent
    assert math.dist(held, flown.place) < 2.0
    assert abs(flown.height - height) < 1.5
    flown.steer(2.0, "Heading=127")
    turned = math.remainder(flown.truths[-1].psi - heading, math.tau)
    assert math.radians(40.0) < turned < math.radians(100.0)
    psi = flown.truths[-1].psi
    flown.steer(3.0, "Heading=0")
    assert abs(math.remainder(flown.truths[-1].psi - psi, math.tau)) < math.radians(20.0)
    below = flown.height
    flown.steer(4.0, "Thrust=127")
    assert 4.0 < flown.height - below < 10.0
    flown.steer(60.0, "Thrust=-127")  # to the ground, at the rate of a landing
    assert flown.height < 0.3
    assert max(abs(each.w) for each in flown.truths[-1000:]) < 1.2
    landed = len(flown.truths)
    flown.steer(100.0, "Thrust=0")
    assert max(-each.z for each in flown.truths[landed:]) < 0.05, "released, it stays on the ground"
    publish(flown.vehicle, imc.TeleoperationDone(src=CCU, dst=OWN))
    flown.vehicle.run(2.0)
    assert flown.replies[-1] == "plan completed"
    flown.vehicle.close()
