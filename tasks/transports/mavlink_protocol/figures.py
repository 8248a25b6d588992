"""The latest messages on the bus that ground stations see; what nobody reports any more is forgotten."""

import math
from collections.abc import Mapping
from typing import TypeVar

import imc

M = TypeVar("M", bound=imc.Message)

LASTING: Mapping[type[imc.Message], float] = {
    imc.EstimatedState: 3.0,
    imc.VehicleState: 3.0,
    imc.SetThrusterActuation: 3.0,
    imc.PathControlState: 3.0,
    imc.PlanControlState: 5.0,
    imc.ArmingState: 5.0,
    imc.AutopilotMode: 5.0,
    imc.FuelLevel: 300.0,
    imc.OperationalLimits: math.inf,
}
USUALLY = 10.0  # s without a report until a figure is unknown


class Figures:
    """The latest message of each kind and source; `label` is that of the entity that sends it."""

    def __init__(self) -> None:
        self._found: dict[type[imc.Message], dict[str, tuple[float, imc.Message]]] = {}

    def take(self, message: imc.Message, label: str, now: float) -> None:
        """Take a new message."""
        if isinstance(message, imc.SetThrusterActuation):
            label = f"{label} {message.id}"
        sources = self._found.setdefault(type(message), {})
        sources.pop(label, None)  # the latest is the last
        sources[label] = now, message

    def latest(self, kind: type[M]) -> M | None:
        """The message of a kind that has come last from any source."""
        messages = list(self.by_label(kind).values())
        return messages[-1] if messages else None

    def by_label(self, kind: type[M]) -> dict[str, M]:
        """The messages of a kind by source, the latest last."""
        sources = self._found.get(kind, {})
        return {label: message for label, (_, message) in sources.items() if isinstance(message, kind)}

    def heard(self, kind: type[imc.Message]) -> float | None:
        """When the latest message of a kind has come, in s since 1970."""
        return max((at for at, _ in self._found.get(kind, {}).values()), default=None)

    def forget_old(self, now: float) -> list[type[imc.Message]]:
        """Forget what is old; returns the kinds of which nothing is left."""
        gone: list[type[imc.Message]] = []
        for kind, sources in list(self._found.items()):
            limit = now - LASTING.get(kind, USUALLY)
            kept = {label: item for label, item in sources.items() if item[0] >= limit}
            if kept:
                self._found[kind] = kept
            else:
                del self._found[kind]
                gone.append(kind)
        return gone
