"""The entities, parameters and cameras of a vehicle's tasks, as the vehicle's side of MAVLink sees them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mavlink.vehicle.camera import is_camera
from runtime import Task
from runtime.task import Entity, Parameter


@dataclass(frozen=True, slots=True)
class TaskParameter:
    """A parameter of a task, as a ParameterView."""

    task: Task
    declaration: Parameter

    @property
    def label(self) -> str:
        return self.task.entity.label

    @property
    def section(self) -> str:
        return self.task.name

    def value(self) -> Any:
        return self.task.parameter_set.value(self.declaration)

    def text(self) -> str:
        """The present value as written in a profile."""
        return self.task.parameter_set.text(self.declaration)


@dataclass(frozen=True, slots=True)
class TaskCamera:
    """A task that takes pictures or detects objects, as a CameraView."""

    task: Task
    video_url: str = ""

    @property
    def entity(self) -> Entity:
        return self.task.entity

    @property
    def parameters(self) -> Sequence[TaskParameter]:
        return task_parameters([self.task])


def task_parameters(tasks: Iterable[Task]) -> list[TaskParameter]:
    """All parameters of tasks, in the order of their declaration."""
    return [TaskParameter(task, each) for task in tasks for each in task.parameter_set.declarations.values()]


def find_cameras(tasks: Iterable[Task], videos: Mapping[str, str]) -> list[TaskCamera]:
    """The cameras among tasks, in the order of their labels; `videos` are addresses by label."""
    found = [task for task in tasks if is_camera(task.parameter_set.declarations)]
    found.sort(key=lambda task: task.entity.label)
    return [TaskCamera(task, videos.get(task.entity.label, "")) for task in found]
