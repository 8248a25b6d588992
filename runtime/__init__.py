"""The kernel, bus and vehicle that tasks run on; what a task's author needs is imported from here."""

from runtime.activation import ActivationError
from runtime.entities import Entity, State
from runtime.frame import Frame
from runtime.handlers import consume, periodic
from runtime.parameters import ParameterError, param
from runtime.script import Script
from runtime.task import Task
from runtime.timer import Timer

__all__ = [
    "ActivationError",
    "Entity",
    "Frame",
    "ParameterError",
    "Script",
    "State",
    "Task",
    "Timer",
    "consume",
    "param",
    "periodic",
]
