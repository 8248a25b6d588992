"""The kernel, bus and vehicle that tasks run on; what a task's author needs is imported from here."""

from runtime.bus import Frame
from runtime.kernel import Timer
from runtime.task import (
    ActivationError,
    Entity,
    Inbox,
    ParameterError,
    Script,
    State,
    Task,
    consume,
    expect,
    param,
    periodic,
)
from support.diagnostics import ConfigWarning

__all__ = [
    "ActivationError",
    "ConfigWarning",
    "Entity",
    "Frame",
    "Inbox",
    "ParameterError",
    "Script",
    "State",
    "Task",
    "Timer",
    "consume",
    "expect",
    "param",
    "periodic",
]
