"""Answers requests for what a vehicle does not have."""

import imc
from runtime import Task, consume
from runtime.task import consumer_methods
from support.log_limit import LogLimit

Restart = imc.RestartSystem.Type
Power = imc.PowerOperation.Op
Lbl = imc.LblConfig.Op
Actions = imc.RemoteActionsRequest.Op
SWITCHES = (Power.PWR_DOWN, Power.SCHED_PWR_DOWN, Power.PWR_UP, Power.SCHED_PWR_UP)
COST = 20  # a warning in the log book counts as so many replies


class Equipment(Task):
    """Rejects requests for missing equipment: otherwise a console would wait for an answer.

    For beacons and remote actions the answer is an empty list, for the power PWR_DOWN_ABORTED; the log book has the
    reason of each refusal. A request that another task of the profile takes is left to that task.
    """

    def start(self) -> None:
        self._refusals = LogLimit("more requests are rejected")
        others = [task for task in self.vehicle.tasks if task is not self]
        self._taken = {consumer.type.__name__ for task in others for consumer in consumer_methods(type(task))}

    @consume(others=True)
    def refuse_lbl_config(self, request: imc.LblConfig) -> None:
        if request.op not in (Lbl.GET_CFG, Lbl.SET_CFG) or not self._answers(request):
            return
        if request.op == Lbl.SET_CFG:
            self._refuse(request, f"the {len(request.beacons)} beacons are not used: there is no LBL receiver")
        self.reply(request, imc.LblConfig(op=Lbl.CUR_CFG))

    @consume(others=True)
    def answer_remote_actions_query(self, request: imc.RemoteActionsRequest) -> None:
        if request.op == Actions.QUERY and self._answers(request):
            self.reply(request, imc.RemoteActionsRequest(op=Actions.REPORT))

    @consume(others=True)
    def refuse_power_operation(self, request: imc.PowerOperation) -> None:
        if request.op in SWITCHES and self._answers(request):
            self._refuse(request, "no task here switches the power: shut the computer down instead")
            if request.op in (Power.PWR_DOWN, Power.SCHED_PWR_DOWN):
                self.reply(request, imc.PowerOperation(op=Power.PWR_DOWN_ABORTED))

    @consume(others=True)
    def refuse_power_channel_control(self, request: imc.PowerChannelControl) -> None:
        if self._answers(request):
            self._refuse(request, f"there is no power channel {request.name!r}")

    @consume(others=True)
    def refuse_restart(self, request: imc.RestartSystem) -> None:
        if self._answers(request):
            entity = self.vehicle.entities.label(self.system, request.dst_ent) or f"entity {request.dst_ent}"
            names: dict[int, str] = {Restart.DUNE: "the vehicle's program", Restart.SYSTEM: "the computer"}
            self._refuse(request, f"no restart of {names.get(request.type, entity)} by message")

    def _answers(self, request: imc.Message) -> bool:
        return type(request).__name__ not in self._taken and self.is_for_me(request) and request.src != self.system

    def _refuse(self, request: imc.Message, reason: str) -> None:
        if self.vehicle.daemon.reply_quota.try_acquire(request.src, COST, self.now):
            text = f"{type(request).__name__} from {self.vehicle.systems.name(request.src)}: {reason}"
            self._refusals.write(self.log.warning, text, self.now)
