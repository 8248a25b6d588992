"""Watches the messages of vehicles for conditions and expressions."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import imc
from runtime.kernel import SECOND
from runtime.vehicle import Vehicle
from shoal.scenarios.expression_functions import WorldBottom
from shoal.scenarios.operands import MessageSelector
from support.terminal_text import with_suggestion
from tasks.simulated_world import world_of

OnMessage = Callable[[float], object]
"""Called with the time since the start of the run (s)."""

MessageSlots = list[Any]


class _Listener:
    """Whom to tell of messages of a kind, and where to keep them: (entity, list, place)."""

    def __init__(self, on_message: OnMessage):
        self.on_message = on_message
        self.slots: list[tuple[int | None, MessageSlots, int]] = []


class _Tap:
    """Hears the messages of a kind that one vehicle publishes."""

    transient = True

    def __init__(self, vehicle: Vehicle):
        self._system = vehicle.system
        self._kernel = vehicle.kernel
        self._start_ns = vehicle.kernel.now_ns
        self.last: imc.Message | None = None
        self.listeners: list[_Listener] = []

    def receive(self, message: imc.Message) -> None:
        if message.src != self._system:
            return
        self.last = message
        entity, now = message.src_ent, (self._kernel.now_ns - self._start_ns) / SECOND
        for listener in self.listeners:
            concerned = False
            for wanted, latest, place in listener.slots:
                if wanted is None or wanted == entity:
                    latest[place] = message
                    concerned = True
            if concerned:
                listener.on_message(now)


class MessageMonitor:
    """Keeps the latest messages that are watched, and tells when one has arrived."""

    def __init__(self, vehicles: Mapping[str, Vehicle]):
        self._vehicles = vehicles
        self._taps: dict[tuple[str, type[imc.Message]], _Tap] = {}

    def latest_message_getter(self, vehicle: str, kind: type[imc.Message]) -> Callable[[], imc.Message | None]:
        """A function that returns the last message of a kind that a vehicle has published."""
        tap = self._tap(vehicle, kind)
        return lambda: tap.last

    def add_subscriber(self, groups: Sequence[Sequence[MessageSelector]], on_message: OnMessage) -> list[MessageSlots]:
        """The latest messages of each group, None if there is none yet; the lists are filled as they arrive.

        `on_message` is called once for each message that is watched. Raises ValueError if a vehicle has no such entity.
        """
        found: list[MessageSlots] = []
        listeners: dict[_Tap, _Listener] = {}
        for group in groups:
            latest: MessageSlots = [None] * len(group)
            found.append(latest)
            for place, selector in enumerate(group):
                if issubclass(selector.kind, WorldBottom):
                    latest[place] = self._bottom(selector.vehicle)
                    continue
                tap = self._tap(selector.vehicle, selector.kind)
                if tap not in listeners:
                    listeners[tap] = _Listener(on_message)
                    tap.listeners.append(listeners[tap])
                listeners[tap].slots.append((self._entity(selector), latest, place))
        return found

    def _bottom(self, vehicle: str) -> WorldBottom:
        seabed = world_of(self._vehicles[vehicle].daemon).seabed
        if seabed is None:
            raise ValueError(f"the world of {vehicle} has no bottom: its profile has neither soundings nor a depth")
        return WorldBottom(seabed)

    def _tap(self, vehicle: str, kind: type[imc.Message]) -> _Tap:
        key = vehicle, kind
        if key not in self._taps:
            self._taps[key] = tap = _Tap(self._vehicles[vehicle])
            self._vehicles[vehicle].observe(kind, tap.receive)
        return self._taps[key]

    def _entity(self, selector: MessageSelector) -> int | None:
        if not selector.entity:
            return None
        entities = self._vehicles[selector.vehicle].entities
        entity = entities.find(selector.entity)
        if entity is None:
            labels = [entity.label for entity in entities]
            raise ValueError(
                with_suggestion(
                    f"{selector.vehicle} has no entity with the label {selector.entity!r}", selector.entity, labels
                )
            )
        return entity.id


def missing_messages(selectors: Sequence[MessageSelector], latest: MessageSlots) -> list[str]:
    """The messages that never arrived, for people."""
    return [
        f"{selector.kind.__name__}{f'[{selector.entity}]' if selector.entity else ''} of {selector.vehicle}"
        for selector, message in zip(selectors, latest, strict=True)
        if message is None
    ]
