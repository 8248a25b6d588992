"""An actor of imcpy, as a user writes it: finds the vehicle, starts a plan, and prints what came of it as JSON."""

import json
import sys
import time

import imcpy
from imcpy.actors import DynamicActor
from imcpy.decorators import Periodic, Subscribe

VEHICLE, PLAN = sys.argv[1:3]


class Actor(DynamicActor):
    """Starts a plan when the vehicle is ready, and stops when it is executed."""

    def __init__(self):
        super().__init__(imc_id=0x4042)
        self.heartbeat.append(VEHICLE)
        self.began = time.monotonic()
        self.found = {"states": 0}
        self.ready = self.finished = False

    def on_connect(self, node_id):
        self.found.setdefault("connected", list(node_id))
        self.found["services"] = self.resolve_node_id(node_id).services_string

    @Subscribe(imcpy.EstimatedState)
    def count(self, message):
        self.found["states"] += 1
        self.found["lat"] = message.lat

    @Subscribe(imcpy.PlanControl)
    def answered(self, message):
        if message.type != imcpy.PlanControl.TypeEnum.REQUEST and message.request_id == 7:
            self.found.setdefault("answer", [message.type == imcpy.PlanControl.TypeEnum.SUCCESS, message.info])

    @Subscribe(imcpy.PlanControlState)
    def follow(self, message):
        executing = message.state == imcpy.PlanControlState.StateEnum.EXECUTING
        if executing and message.plan_id == PLAN and self.found["states"] >= 3:
            self.found["executing"] = message.plan_id
            self.finish()

    @Subscribe(imcpy.VehicleState)
    def watch(self, message):
        self.ready = message.op_mode != imcpy.VehicleState.OperationModeEnum.BOOT

    @Periodic(1)
    def start(self):
        if time.monotonic() - self.began > 40:
            self.finish()
        if self.ready and self.found["states"] and "answer" not in self.found:
            goto = imcpy.Goto()
            goto.lat, goto.lon = self.found["lat"] + 1e-4, -0.151947
            goto.speed, goto.speed_units = 1.2, imcpy.SpeedUnits.METERS_PS
            goto.z, goto.z_units = 2.0, imcpy.ZUnits.DEPTH
            step = imcpy.PlanManeuver()
            step.maneuver_id, step.data = "go", goto
            plan = imcpy.PlanSpecification()
            plan.plan_id = PLAN
            plan.start_man_id = "go"
            plan.maneuvers.append(step)
            request = imcpy.PlanControl()
            request.type = imcpy.PlanControl.TypeEnum.REQUEST
            request.op = imcpy.PlanControl.OperationEnum.START
            request.plan_id, request.request_id, request.arg = PLAN, 7, plan
            self.send(VEHICLE, request)

    def finish(self):
        if not self.finished:
            self.finished = True
            print(json.dumps(self.found), flush=True)
            self.stop()


Actor().run()
