"""Parts of a task: handlers, parameters, scripts, entities."""

from runtime.task.activation import Activation, ActivationError
from runtime.task.decorators import (
    HIGHEST_RATE,
    Ticker,
    consume,
    consumer_methods,
    expect,
    expected_methods,
    periodic,
    periodic_methods,
    rate_of,
)
from runtime.task.entity_system_tables import (
    SYSTEM_ENTITY,
    Entity,
    EntityError,
    EntityTable,
    State,
    SystemTable,
    assign_ids,
)
from runtime.task.logbook import Logbook, format_exception_line, with_location
from runtime.task.parameters import Parameter, ParameterError, SharedOption, find_parameter, param
from runtime.task.script import Inbox, Script
from runtime.task.section_options import section_reference_options, shared_options
from runtime.task.task import Task

__all__ = [
    "HIGHEST_RATE",
    "SYSTEM_ENTITY",
    "Activation",
    "ActivationError",
    "Entity",
    "EntityError",
    "EntityTable",
    "Inbox",
    "Logbook",
    "Parameter",
    "ParameterError",
    "Script",
    "SharedOption",
    "State",
    "SystemTable",
    "Task",
    "Ticker",
    "assign_ids",
    "consume",
    "consumer_methods",
    "expect",
    "expected_methods",
    "find_parameter",
    "format_exception_line",
    "param",
    "periodic",
    "periodic_methods",
    "rate_of",
    "section_reference_options",
    "shared_options",
    "with_location",
]
