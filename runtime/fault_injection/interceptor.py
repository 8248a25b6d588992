"""Stands between a task and the bus while the task has a fault."""

from collections.abc import Callable
from typing import Any

import imc
from imc.reserved_ids import UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from runtime.bus import Frame
from runtime.task import Entity, Task

Item = imc.Message | Frame
PublishFilter = Callable[[Any], Item | None]  # from what the task publishes to what others receive; None is nothing


class PublishInterceptor:
    """Passes what one task publishes and shares through the `filters` in the order in which they began.

    With `keeps_last`, `last` has the latest message or frame of each kind, as the task itself would have it. `crashes`
    counts those that keep the task from starting, `acted` has the ids of the spoils that have changed something.
    The task gets its own methods back when nothing is left to do, so that tasks without faults cost nothing.
    """

    def __init__(self, task: Task):
        self.task = task
        self.filters: list[PublishFilter] = []
        self.last: dict[object, Item] = {}
        self.keeps_last = False
        self.crashes = 0
        self.acted: set[int] = set[int]()

    def attach_or_detach(self) -> None:
        """Take the place between the task and its bus if there is a reason, else leave it."""
        own = vars(self.task)
        if self.filters or self.keeps_last:
            own["publish"], own["publish_frame"] = self._publish, self._publish_frame
        else:
            own.pop("publish", None)
            own.pop("publish_frame", None)

    def sensor_key(self, item: Item) -> object:
        """The key of the values of one sensor: type, entity, and the number that some have."""
        if isinstance(item, Frame):
            return Frame, item.camera
        return type(item), item.src_ent, getattr(item, "id", None)

    def _publish(self, message: Any, *, keep_time: bool = False, entity: Entity | None = None) -> imc.Message:
        task = self.task
        if not isinstance(message, imc.Message):
            return type(task).publish(task, message)
        speaker = (entity or task.entity).id if message.src_ent == UNKNOWN_ENTITY else message.src_ent
        message = message.replace(src_ent=speaker)
        published = self._spoilt(message)
        if isinstance(published, imc.Message):
            return type(task).publish(task, published, keep_time=keep_time)
        timestamp = message.timestamp if keep_time else task.now
        source = task.system if message.src == UNKNOWN_SYSTEM else message.src
        return task.vehicle.bus.decode(
            imc.encode_with_header(message, timestamp, source, speaker, message.dst, message.dst_ent)
        )

    def _publish_frame(self, frame: Frame) -> None:
        published = self._spoilt(frame)
        if isinstance(published, Frame):
            type(self.task).publish_frame(self.task, published)

    def _spoilt(self, item: Item) -> Item | None:
        published: Item | None = item
        for spoil in self.filters:
            before, published = published, spoil(published)
            if published is not before:
                self.acted.add(id(spoil))
            if published is None:
                break
        if self.keeps_last:
            self.last[self.sensor_key(item)] = item
        return published
