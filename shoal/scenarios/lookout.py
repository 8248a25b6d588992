"""Watches the messages of vehicles for conditions and expressions."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import imc
from runtime.kernel import SECOND
from runtime.vehicle import Vehicle
from shoal.scenarios.functions import Bottom
from shoal.scenarios.operands import Watch
from support.text import with_suggestion
from tasks.simulated_world import world_of

Told = Callable[[float], object]
"""Called with the time since the start of the run (s)."""

Seen = list[Any]


class _Watcher:
    """Whom to tell of messages of a kind, and where to keep them: (entity, list, place)."""

    def __init__(self, told: Told):
        self.told = told
        self.slots: list[tuple[int | None, Seen, int]] = []


class _Ear:
    """Hears the messages of a kind that one vehicle publishes."""

    transient = True

    def __init__(self, vehicle: Vehicle):
        self._system = vehicle.system
        self._kernel = vehicle.kernel
        self._start_ns = vehicle.kernel.now_ns
        self.last: imc.Message | None = None
        self.watchers: list[_Watcher] = []

    def hear(self, message: imc.Message) -> None:
        if message.src != self._system:
            return
        self.last = message
        entity, now = message.src_ent, (self._kernel.now_ns - self._start_ns) / SECOND
        for watcher in self.watchers:
            concerned = False
            for wanted, seen, place in watcher.slots:
                if wanted is None or wanted == entity:
                    seen[place] = message
                    concerned = True
            if concerned:
                watcher.told(now)


class Lookout:
    """Keeps the latest messages that are watched, and tells when one has arrived."""

    def __init__(self, vehicles: Mapping[str, Vehicle]):
        self._vehicles = vehicles
        self._ears: dict[tuple[str, type[imc.Message]], _Ear] = {}

    def keep(self, vehicle: str, kind: type[imc.Message]) -> Callable[[], imc.Message | None]:
        """Tells the last message of a kind that a vehicle has published."""
        ear = self._ear(vehicle, kind)
        return lambda: ear.last

    def watch(self, groups: Sequence[Sequence[Watch]], told: Told) -> list[Seen]:
        """The latest messages of each group of watches, None if there is none yet; the lists are filled as they arrive.

        `told` is called once for each message that is watched. Raises ValueError if a vehicle has no such entity.
        """
        found: list[Seen] = []
        watchers: dict[_Ear, _Watcher] = {}
        for group in groups:
            seen: Seen = [None] * len(group)
            found.append(seen)
            for place, watch in enumerate(group):
                if issubclass(watch.kind, Bottom):
                    seen[place] = self._bottom(watch.vehicle)
                    continue
                ear = self._ear(watch.vehicle, watch.kind)
                if ear not in watchers:
                    watchers[ear] = _Watcher(told)
                    ear.watchers.append(watchers[ear])
                watchers[ear].slots.append((self._entity(watch), seen, place))
        return found

    def _bottom(self, vehicle: str) -> Bottom:
        seabed = world_of(self._vehicles[vehicle].daemon).seabed
        if seabed is None:
            raise ValueError(f"the world of {vehicle} has no bottom: its profile has neither soundings nor a depth")
        return Bottom(seabed)

    def _ear(self, vehicle: str, kind: type[imc.Message]) -> _Ear:
        key = vehicle, kind
        if key not in self._ears:
            self._ears[key] = ear = _Ear(self._vehicles[vehicle])
            self._vehicles[vehicle].tap(kind, ear.hear)
        return self._ears[key]

    def _entity(self, watch: Watch) -> int | None:
        if not watch.entity:
            return None
        entities = self._vehicles[watch.vehicle].entities
        entity = entities.find(watch.entity)
        if entity is None:
            labels = [entity.label for entity in entities]
            raise ValueError(
                with_suggestion(f"{watch.vehicle} has no entity with the label {watch.entity!r}", watch.entity, labels)
            )
        return entity.id


def missing(watches: Sequence[Watch], seen: Seen) -> list[str]:
    """The messages that never arrived, for people."""
    return [
        f"{watch.kind.__name__}{f'[{watch.entity}]' if watch.entity else ''} of {watch.vehicle}"
        for watch, message in zip(watches, seen, strict=True)
        if message is None
    ]
