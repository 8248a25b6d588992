"""The parameters that users of the page have changed, so that a change can be undone, once."""

import asyncio
from collections import deque
from dataclasses import dataclass
from itertools import count

from shoal.console.vehicle_orders import OrderError
from shoal.network import AsyncRemoteVehicle, is_same_value
from support.terminal_text import printable

MOST_CHANGES = 50  # of a vehicle; the oldest is forgotten
SHOWN = 10


@dataclass
class ParameterChange:
    """A parameter that `user` has set to the text `after`; `undone_by` is empty while the change stands."""

    number: int
    user: str
    entity: str
    name: str
    before: str
    after: str
    undone_by: str = ""


class ParameterChanges:
    """The changes of each vehicle, by its name. One at a time is made or undone on a vehicle, also by several users."""

    def __init__(self) -> None:
        self._numbers = count(1)
        self._made: dict[str, deque[ParameterChange]] = {}
        self._locks: dict[str, asyncio.Lock] = {}

    def view(self, vehicle: str) -> list[dict[str, object]]:
        """The latest changes for the page, the newest first."""
        made = list(self._made.get(vehicle, ()))[-SHOWN:]
        return [
            {
                "number": each.number,
                "user": each.user,
                "text": printable(f"{each.entity}: {each.name} {each.before} → {each.after}"),
                "undone": each.undone_by,
            }
            for each in reversed(made)
        ]

    def words_of(self, vehicle: str, number: object) -> dict[str, str]:
        """The entity and the parameter of a change, and the value that it has replaced; empty if it is unknown."""
        change = self._find(vehicle, number)
        if change is None:
            return {}
        return {"entity": change.entity, "parameter": change.name, "value": change.before}

    async def set(self, user: str, vehicle: AsyncRemoteVehicle, entity: str, name: str, value: str) -> str:
        """Set a parameter, and keep its value before. Raises NetworkError with the vehicle's reason."""
        system = vehicle.system.name
        async with self._lock(system):
            before = (await vehicle.param.get(entity)).get(name)
            after = (await vehicle.param.set(entity, {name: value})).get(name, value)
            if before is not None and not is_same_value(before, after):
                made = self._made.setdefault(system, deque(maxlen=MOST_CHANGES))
                made.append(ParameterChange(next(self._numbers), user, entity, name, before, after))
            return f"{entity}: {name} = {after}"

    async def undo(self, user: str, vehicle: AsyncRemoteVehicle, number: object) -> str:
        """Restore the value before a change. Raises OrderError if the change does not stand any more, NetworkError."""
        system = vehicle.system.name
        async with self._lock(system):
            change = self._find(system, number)
            if change is None:
                raise OrderError("this change is not known: set the value instead")
            if change.undone_by:
                raise OrderError(f"{change.undone_by} has undone this change already")
            now = (await vehicle.param.get(change.entity)).get(change.name, "")
            if not is_same_value(now, change.after):
                raise OrderError(
                    f"{change.entity}: {change.name} is {now} now, not {change.after}: set the value instead"
                )
            await vehicle.param.set(change.entity, {change.name: change.before})
            change.undone_by = user
            return f"{change.entity}: {change.name} = {change.before}, as before"

    def _find(self, vehicle: str, number: object) -> ParameterChange | None:
        return next((each for each in self._made.get(vehicle, ()) if each.number == number), None)

    def _lock(self, vehicle: str) -> asyncio.Lock:
        return self._locks.setdefault(vehicle, asyncio.Lock())
