"""What a task is made of: handlers, parameters, scripts, entities."""

from runtime.task.activation import Activation, ActivationError
from runtime.task.entities import SYSTEM_ENTITY, Entities, Entity, EntityError, State, Systems, allot
from runtime.task.handlers import (
    HIGHEST_RATE,
    Ticker,
    consume,
    consumers,
    expect,
    expectations,
    periodic,
    rate_of,
    tickers,
)
from runtime.task.logbook import Logbook, one_line, with_place
from runtime.task.parameters import Parameter, ParameterError, SharedOption, find_parameter, param
from runtime.task.script import Inbox, Script
from runtime.task.task import Task, listing_options, shared_options

__all__ = [
    "HIGHEST_RATE",
    "SYSTEM_ENTITY",
    "Activation",
    "ActivationError",
    "Entities",
    "Entity",
    "EntityError",
    "Inbox",
    "Logbook",
    "Parameter",
    "ParameterError",
    "Script",
    "SharedOption",
    "State",
    "Systems",
    "Task",
    "Ticker",
    "allot",
    "consume",
    "consumers",
    "expect",
    "expectations",
    "find_parameter",
    "listing_options",
    "one_line",
    "param",
    "periodic",
    "rate_of",
    "shared_options",
    "tickers",
    "with_place",
]
