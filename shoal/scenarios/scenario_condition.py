"""Conditions and numbers of a scenario, which many runs share, and what they look at in a run."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import imc
from imc.expressions import LatestMessages, RobustnessFunction


class MessageSelector(NamedTuple):
    """The messages of a kind that a vehicle publishes, of the entity with this label only if one is given.

    With a `receiver`, those of them that this other vehicle has received.
    """

    kind: type[imc.Message]
    vehicle: str
    entity: str = ""
    receiver: str = ""

    @property
    def text(self) -> str:
        """The messages, for people."""
        entity = f"[{self.entity}]" if self.entity else ""
        receiver = f" at {self.receiver}" if self.receiver else ""
        return f"{self.kind.__name__}{entity} of {self.vehicle}{receiver}"


class BottomSelector(NamedTuple):
    """The bottom in the world of a vehicle."""

    vehicle: str


class ArrivalSelector(NamedTuple):
    """Arrivals of messages: the number, the last one, and those within a `window` (ns)."""

    message: MessageSelector
    window: int = 0


class CaptureSelector(NamedTuple):
    """A value that is captured in the run."""

    name: str


@dataclass(frozen=True, eq=False)
class HeldSelector:
    """Margins of a condition, at all times within so many seconds."""

    condition: "ScenarioCondition"
    seconds: float


Selector: TypeAlias = MessageSelector | BottomSelector | ArrivalSelector | CaptureSelector | HeldSelector


def depends_on_time(selector: Selector) -> bool:
    """Whether what it looks at changes while no message arrives."""
    return isinstance(selector, ArrivalSelector | HeldSelector)


@dataclass(frozen=True, eq=False)
class ScenarioCondition:
    """A condition. `margin(latest)` takes what is in the slot of each of its `selectors`, None for no message yet.

    The margin is positive if the condition holds, with any distance left, and NaN as long as messages are missing that
    decide it. For `holds`, a comparison with a message that is missing is false, as in plans.
    """

    text: str
    selectors: tuple[Selector, ...]
    test: RobustnessFunction

    def margin(self, latest: LatestMessages) -> float:
        return self.test(latest, math.nan)

    def holds(self, latest: LatestMessages) -> bool:
        return self.test(latest, -math.inf) > 0.0


class MessageExpression(NamedTuple):
    """A number that follows from messages. `value` takes what is in each slot; ask `is_known` before.

    `needs_all` if it is known as soon as no slot is None.
    """

    text: str
    selectors: tuple[Selector, ...]
    value: Callable[[LatestMessages], float]
    unit: str
    is_known: Callable[[LatestMessages], bool]
    needs_all: bool = True
    is_enumeration: bool = False
