"""Watches the messages of vehicles for conditions and expressions."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import imc
from runtime.kernel import SECOND
from runtime.vehicle import Vehicle
from shoal.scenarios.message_history import ArrivalHistory, CapturedValue, HeldMargin, OnMessage
from shoal.scenarios.scenario_condition import (
    ArrivalSelector,
    BottomSelector,
    CaptureSelector,
    HeldSelector,
    MessageSelector,
    Selector,
    depends_on_time,
)
from shoal.scenarios.world_bottom import WorldBottom
from support.terminal_text import with_suggestion
from tasks.simulated_world import world_of

TICK = 100_000_000  # ns between two judgements of what changes without messages

MessageSlots = list[Any]


class _Listener:
    """The places where messages of a kind are kept: (entity, list, place)."""

    def __init__(self, on_message: OnMessage):
        self.on_message = on_message
        self.slots: list[tuple[int | None, MessageSlots, int]] = []


class _Tap:
    """Receives the messages of a kind that `system` publishes, at a vehicle."""

    transient = True

    def __init__(self, vehicle: Vehicle, system: int):
        self._system = system
        self._kernel = vehicle.kernel
        self._start_ns = vehicle.kernel.now_ns
        self.last: imc.Message | None = None
        self.listeners: list[_Listener] = []
        self.histories: list[tuple[int | None, ArrivalHistory]] = []

    def receive(self, message: imc.Message) -> None:
        if message.src != self._system:
            return
        entity, now = message.src_ent, (self._kernel.now_ns - self._start_ns) / SECOND
        if self.histories:
            concerned = [history for wanted, history in self.histories if wanted is None or wanted == entity]
            for on_message in [on_message for history in concerned for on_message in history.before]:
                on_message(now)
            for history in concerned:
                history.record_arrival()
        self.last = message
        for listener in self.listeners:
            concerned = False
            for wanted, latest, place in listener.slots:
                if wanted is None or wanted == entity:
                    latest[place] = message
                    concerned = True
            if concerned:
                listener.on_message(now)


class MessageMonitor:
    """Keeps the latest messages that are watched, and reports when one has arrived."""

    def __init__(self, vehicles: Mapping[str, Vehicle]):
        self._vehicles = vehicles
        self._kernel = next(iter(vehicles.values())).kernel
        self._start_ns = self._kernel.now_ns
        self._taps: dict[tuple[str, str, type[imc.Message]], _Tap] = {}
        self._histories: dict[ArrivalSelector, ArrivalHistory] = {}
        self._captured: dict[str, CapturedValue] = {}
        self._timed: list[OnMessage] = []

    def latest_message_getter(self, vehicle: str, kind: type[imc.Message]) -> Callable[[], imc.Message | None]:
        """A function that returns the last message of a kind that a vehicle has published."""
        tap = self._tap(MessageSelector(kind, vehicle))
        return lambda: tap.last

    def captured_value(self, name: str) -> CapturedValue:
        """The captured value with this name."""
        return self._captured.setdefault(name, CapturedValue())

    def add_subscriber(self, groups: Sequence[Sequence[Selector]], on_message: OnMessage) -> list[MessageSlots]:
        """The slots of each group: the latest messages, None if there is none yet, filled as they arrive.

        `on_message` is called once for each message that is watched, and, if a group has what changes without
        messages, each `TICK` and just before a message arrives. Raises ValueError if a vehicle has no such entity.
        """
        found: list[MessageSlots] = [[None] * len(group) for group in groups]
        for group, latest in zip(groups, found, strict=True):
            for place, selector in enumerate(group):
                if not isinstance(selector, MessageSelector):
                    latest[place] = self._state(selector, on_message)
        listeners: dict[_Tap, _Listener] = {}
        for group, latest in zip(groups, found, strict=True):
            for place, selector in enumerate(group):
                if not isinstance(selector, MessageSelector):
                    continue
                tap = self._tap(selector)
                if tap not in listeners:
                    listeners[tap] = _Listener(on_message)
                    tap.listeners.append(listeners[tap])
                listeners[tap].slots.append((self._entity(selector), latest, place))
        if any(depends_on_time(selector) for group in groups for selector in group):
            self._call_each_tick(on_message)
        return found

    def _state(self, selector: Selector, on_message: OnMessage) -> object:
        """Initial state in the slot of a selector."""
        if isinstance(selector, BottomSelector):
            return self._bottom(selector.vehicle)
        if isinstance(selector, CaptureSelector):
            captured = self.captured_value(selector.name)
            captured.listeners.append(on_message)
            return captured
        if isinstance(selector, ArrivalSelector):
            history = self._history(selector)
            if not selector.window and on_message not in history.before:
                history.before.append(on_message)
            return history
        assert isinstance(selector, HeldSelector)
        return self._held(selector)

    def _history(self, selector: ArrivalSelector) -> ArrivalHistory:
        if selector not in self._histories:
            history = ArrivalHistory(lambda: self._kernel.now_ns - self._start_ns, selector.window)
            self._tap(selector.message).histories.append((self._entity(selector.message), history))
            self._histories[selector] = history
        return self._histories[selector]

    def _held(self, selector: HeldSelector) -> HeldMargin:
        held, condition = HeldMargin(selector.seconds), selector.condition
        slots: MessageSlots = []

        def update(now: float) -> None:
            held.update(now, condition.margin(slots))

        (slots,) = self.add_subscriber([condition.selectors], update)
        if not any(map(depends_on_time, condition.selectors)):
            self._call_each_tick(update)
        return held

    def _call_each_tick(self, on_message: OnMessage) -> None:
        if not self._timed:
            self._kernel.at(self._kernel.now_ns + TICK, self._tick)
        self._timed.append(on_message)

    def _tick(self) -> None:
        now_ns = self._kernel.now_ns
        for on_message in self._timed:
            on_message((now_ns - self._start_ns) / SECOND)
        self._kernel.at(now_ns + TICK, self._tick)

    def _bottom(self, vehicle: str) -> WorldBottom:
        seabed = world_of(self._vehicles[vehicle].daemon).seabed
        if seabed is None:
            raise ValueError(f"the world of {vehicle} has no bottom: its profile has neither soundings nor a depth")
        return WorldBottom(seabed)

    def _tap(self, selector: MessageSelector) -> _Tap:
        observer = selector.receiver or selector.vehicle
        key = observer, selector.vehicle, selector.kind
        if key not in self._taps:
            self._taps[key] = tap = _Tap(self._vehicles[observer], self._vehicles[selector.vehicle].system)
            self._vehicles[observer].observe(selector.kind, tap.receive)
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


def missing_text(groups: Sequence[Sequence[Selector]], slots: Sequence[MessageSlots]) -> str:
    """Messages that never arrived and values that were never captured, for people; empty if nothing is missing."""
    absent, uncaptured = dict[str, None](), dict[str, None]()
    for group, latest in zip(groups, slots, strict=True):
        for selector, found in zip(group, latest, strict=True):
            if isinstance(selector, MessageSelector) and found is None:
                absent[selector.text] = None
            elif isinstance(selector, CaptureSelector) and not found.is_there:
                uncaptured[f"${selector.name}"] = None
    parts = [f"no {', no '.join(absent)} arrived"] if absent else []
    parts += [f"{', '.join(uncaptured)} was not captured"] if uncaptured else []
    return ", ".join(parts)
