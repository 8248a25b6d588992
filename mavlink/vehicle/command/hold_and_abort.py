"""Effect of commands of ground stations: plans that are started and stopped, a hold, an Abort."""

from collections.abc import Callable

import imc
from autonomy.plans import sequential_plan
from mavlink import Mode, is_maneuvering, statustext
from mavlink.vehicle.arming_checks import WORKING
from mavlink.vehicle.interfaces import VehiclePort
from mavlink.vehicle.mission import MissionStore, OnReply, PlanClient, PlanReply
from mavlink.vehicle.model import VehicleModel


class VehicleControl:
    """The vehicle that commands act on; `send_statustext(severity, text)` sends to all stations."""

    def __init__(
        self,
        model: VehicleModel,
        port: VehiclePort,
        plans: PlanClient,
        mission: MissionStore,
        send_statustext: Callable[[int, str], object],
    ):
        self.model = model
        self.plans = plans
        self.mission = mission
        self.send_statustext = send_statustext
        self._port = port

    @property
    def imc_id(self) -> int:
        return self._port.imc_id

    def age(self, time: float) -> float:
        """Seconds since a time (s since 1970) in which the program could receive something."""
        return self._port.age(time)

    def publish(self, message: imc.Message) -> None:
        """Send a message to the vehicle."""
        self._port.publish(message.replace(dst=self._port.imc_id))

    def hold(self, now: float, then: OnReply = lambda _: None) -> None:
        """Hold: keep station here if it moves, is armed or is under water; otherwise only show the mode.

        A vehicle that cannot keep station at least stops.
        """
        model = self.model
        vehicle = model.latest.vehicle
        able = vehicle is not None and vehicle.op_mode in WORKING
        holds = model.mode is Mode.HOLD and is_maneuvering(vehicle)
        model.held = True
        if not able or holds or not (model.armed_or_moving or model.is_submerged):
            then(PlanReply(True))
            return

        def judge(outcome: PlanReply) -> None:
            if outcome.done:
                then(outcome)
            else:
                self.send_statustext(statustext.WARNING, f"Cannot hold, stopping: {outcome.reason}")
                self.plans.stop(now, then)

        station = model.station_keeping()
        if station is None:
            judge(PlanReply(False, "the position is unknown"))
        else:
            self.plans.start(sequential_plan("hold", {"1": station}), judge, now)

    def abort(self, now: float) -> None:
        """Abort what the vehicle does."""
        abort = imc.Abort(dst=self._port.imc_id)
        self._port.publish(abort)
        self.model.update(abort, "", now)  # a task does not receive its own messages
        self.send_statustext(statustext.EMERGENCY, "Abort")
