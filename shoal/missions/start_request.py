"""Requests a plan as soon as the vehicle is ready, in the name of its Daemon."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import imc
from imc.reserved_ids import UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from runtime.kernel import SECOND
from runtime.vehicle import Vehicle

READY = imc.PlanControlState.State.READY
CALM = imc.VehicleState.OpMode.SERVICE


class PlanStartRequest:
    """Publishes a request when the vehicle has reported SERVICE and, after that, a READY plan engine.

    It acts as an operator: it watches the bus, and snapshots do not contain it. `refused` is called with a reason if
    either report takes longer than `patience` (s). `is_vehicle_ready` is True once SERVICE was reported,
    `is_sent` once the request was published.
    """

    transient = True

    def __init__(
        self,
        vehicle: Vehicle,
        request: imc.PlanControl,
        *,
        patience: float = 120.0,
        refused: Callable[[str], object] = lambda _: None,
        is_vehicle_ready: bool = False,
        is_sent: bool = False,
    ):
        self.is_vehicle_ready: bool = is_vehicle_ready
        self.is_sent: bool = is_sent
        self._vehicle = vehicle
        self._request = request
        self._patience = patience
        self._refused = refused
        self._deadline = 0
        vehicle.observe(imc.VehicleState, self._watch)
        vehicle.observe(imc.PlanControlState, self._ask)

    def is_answered_by(self, answer: imc.PlanControl) -> bool:
        """Whether a reply is for this request, not for that of another operator."""
        ours = (answer.op, answer.request_id) == (self._request.op, self._request.request_id)
        return ours and self._vehicle.daemon.is_reply_to_me(answer)

    def schedule_timeout(self) -> None:
        """Start the timeout."""
        self._deadline = self._vehicle.kernel.now_ns + round(self._patience * SECOND)
        self._vehicle.kernel.at(self._deadline, self._lose_patience, self._deadline)

    def _watch(self, state: imc.VehicleState) -> None:
        if not self.is_vehicle_ready and state.src == self._vehicle.system and state.op_mode == CALM:
            self.is_vehicle_ready = True
            self.schedule_timeout()

    def _ask(self, state: imc.PlanControlState) -> None:
        if self.is_vehicle_ready and not self.is_sent and state.src == self._vehicle.system and state.state == READY:
            self.is_sent = True
            self._vehicle.daemon.publish(self._request)

    def _lose_patience(self, deadline: int) -> None:
        if not self.is_sent and deadline == self._deadline:
            self._refused(f"vehicle not ready within {self._patience:g} s")


class LoggedStartRequest(NamedTuple):
    """A request in a log, and the state of its PlanStartRequest at a time."""

    request: imc.PlanControl
    is_vehicle_ready: bool
    is_sent: bool


def find_start_request(
    packets: Iterable[tuple[int, bytes]], schema: imc.Schema, vehicle: Vehicle, time: float
) -> LoggedStartRequest | None:
    """The request in a run's log, and its state before a time (s since 1970 UTC); None if there is none."""
    calm, daemon = False, vehicle.daemon.entity.id
    for _, packet in packets:
        head = imc.header(packet)
        if head.src != vehicle.system or head.id not in (imc.VehicleState.ID, imc.PlanControl.ID):
            continue
        message = schema.decode(packet)
        if isinstance(message, imc.VehicleState):
            calm = calm or (message.op_mode == CALM and head.timestamp < time)
        elif (
            isinstance(message, imc.PlanControl)
            and message.type == imc.PlanControl.Type.REQUEST
            and (head.src_ent, head.dst) == (daemon, vehicle.system)
        ):
            request = message.replace(timestamp=-1.0, src=UNKNOWN_SYSTEM, src_ent=UNKNOWN_ENTITY)
            return LoggedStartRequest(request, calm, head.timestamp < time)
    return None
