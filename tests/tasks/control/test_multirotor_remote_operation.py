"""Remote operation of the shipped multirotor in its full simulation: it follows the stick, and stays when released."""

import math

import pytest

import imc
from shoal.missions import parse_plan, prepare
from tests.tasks.ideal.aloft import CCU, OWN, publish

PLAN = parse_plan("plan: up\norigin: 41.185°, -8.7062°\nspeed: 2 m/s\nmaneuvers:\n  - takeoff: {altitude: 12}\n")
STEER = imc.PlanSpecification(
    plan_id="console-steer",
    start_man_id="steer",
    maneuvers=[imc.PlanManeuver(maneuver_id="steer", data=imc.Teleoperation(custom=f"src={CCU}"))],
)


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
    publish(flown.vehicle, imc.TeleoperationDone(src=CCU, dst=OWN))
    flown.vehicle.run(2.0)
    assert flown.replies[-1] == "plan completed"
    flown.vehicle.close()
