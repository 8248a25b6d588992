"""The fence that stations upload: the area of the operational limits, in the order of its corners."""

from collections.abc import Sequence
from typing import NamedTuple

import imc
from mavlink.missions import Item, fence_items, limits_with_fence
from mavlink.vehicle.interfaces import VehiclePort
from mavlink.vehicle.mission.plan_client import PATIENCE, OnReply, PlanReply
from mavlink.vehicle.vehicle_limits import VehicleLimits


class _Waiting(NamedTuple):
    items: list[Item]
    area: list[Item]
    until: float
    then: OnReply


class FenceStore:
    """A fence of the vehicle at a port; its operational limits show whether it has been taken."""

    def __init__(self, limits: VehicleLimits, port: VehiclePort) -> None:
        self._limits, self._port = limits, port
        self._uploaded: list[Item] = []
        self._area: list[Item] = []
        self._waiting: _Waiting | None = None

    def items(self) -> list[Item]:
        """The corners as they were uploaded; of an area that others have set from its back left on, clockwise."""
        area = self._present()
        return list(self._uploaded) if area and area == self._area else area

    def put(self, items: Sequence[Item], then: OnReply, now: float) -> None:
        """Ask the vehicle for an area, none without items; `then` gets whether it has it. Raises BadItem."""
        limits = limits_with_fence(items, self._limits.message)
        before = self._waiting
        self._waiting = _Waiting(list(items), fence_items(limits), now + PATIENCE, then)
        self._port.publish(limits.replace(dst=self._port.imc_id))
        if before is not None:
            before.then(PlanReply(False, "another one has come"))
        self.poll(now)

    def poll(self, now: float) -> None:
        """Answer when the limits have the area, or have not for too long."""
        waiting = self._waiting
        if waiting is None:
            return
        if self._present() == waiting.area:
            self._uploaded, self._area, self._waiting = waiting.items, waiting.area, None
            waiting.then(PlanReply(True))
        elif now >= waiting.until:
            self._waiting = None
            waiting.then(PlanReply(False, "the operational limits do not take it"))

    @property
    def next_deadline(self) -> float | None:
        return None if self._waiting is None else self._waiting.until

    def _present(self) -> list[Item]:
        limits: imc.OperationalLimits | None = self._limits.message
        return [] if limits is None else fence_items(limits)
