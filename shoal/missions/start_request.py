"""Requests a plan as soon as the vehicle is ready, in the name of its Daemon."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import imc
from imc.addresses import UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from runtime.kernel import SECOND
from runtime.vehicle import Vehicle

READY = imc.PlanControlState.State.READY
CALM = imc.VehicleState.OpMode.SERVICE


class PlanRequest:
    """Publishes a request when the vehicle has reported SERVICE and, after that, a READY plan engine.

    It acts as an operator: it watches the bus, and snapshots do not contain it. `refused` is called with a reason if
    either report takes longer than `patience` (s). `calm` is True once SERVICE was reported, `given` once the request
    was published.
    """

    transient = True

    def __init__(
        self,
        vehicle: Vehicle,
        request: imc.PlanControl,
        *,
        patience: float = 120.0,
        refused: Callable[[str], object] = lambda _: None,
        calm: bool = False,
        given: bool = False,
    ):
        self.calm = calm
        self.given = given
        self._vehicle = vehicle
        self._request = request
        self._patience = patience
        self._refused = refused
        self._deadline = 0
        vehicle.tap(imc.VehicleState, self._watch)
        vehicle.tap(imc.PlanControlState, self._ask)

    def is_answered_by(self, answer: imc.PlanControl) -> bool:
        """Whether a reply is for this request, not for that of another operator."""
        ours = (answer.op, answer.request_id) == (self._request.op, self._request.request_id)
        return ours and self._vehicle.daemon.is_answered_by(answer)

    def begin(self) -> None:
        """Start the timeout."""
        self._deadline = self._vehicle.kernel.now_ns + round(self._patience * SECOND)
        self._vehicle.kernel.at(self._deadline, self._lose_patience, self._deadline)

    def _watch(self, state: imc.VehicleState) -> None:
        if not self.calm and state.src == self._vehicle.system and state.op_mode == CALM:
            self.calm = True
            self.begin()

    def _ask(self, state: imc.PlanControlState) -> None:
        if self.calm and not self.given and state.src == self._vehicle.system and state.state == READY:
            self.given = True
            self._vehicle.daemon.publish(self._request)

    def _lose_patience(self, deadline: int) -> None:
        if not self.given and deadline == self._deadline:
            self._refused(f"vehicle not ready within {self._patience:g} s")


class Given(NamedTuple):
    """A request in a log, and the state of its PlanRequest at a time."""

    request: imc.PlanControl
    calm: bool
    given: bool


def given_in(packets: Iterable[tuple[int, bytes]], schema: imc.Schema, vehicle: Vehicle, time: float) -> Given | None:
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
            return Given(request, calm, head.timestamp < time)
    return None
