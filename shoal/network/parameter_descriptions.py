"""Descriptions of a vehicle's parameters: types, units, ranges; and whether a text fits them."""

import asyncio
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import imc
from runtime.task import Parameter
from runtime.vehicle import TaskImportError, find_task
from shoal.network.link import NoAnswer
from shoal.network.remote_vehicle import AsyncRemoteVehicle
from support.float32 import shortest_float32

Type = imc.TypedEntityParameter.Type
Visibility = imc.TypedEntityParameter.Visibility
SCOPES = ("global", "idle", "plan", "maneuver")
AT_ONCE = 16  # entities that are asked; a vehicle gives a console 200 answers a second
LARGEST = float(np.finfo(np.float32).max)
_KINDS: dict[int, tuple[type[bool] | type[int] | type[float] | type[str], bool]] = {
    Type.BOOL: (bool, False),
    Type.INT: (int, False),
    Type.FLOAT: (float, False),
    Type.STRING: (str, False),
    Type.LIST_BOOL: (bool, True),
    Type.LIST_INT: (int, True),
    Type.LIST_FLOAT: (float, True),
    Type.LIST_STRING: (str, True),
}


@dataclass(frozen=True)
class ParameterDescription:
    """A parameter of a running vehicle; texts are as in a profile, None or empty is unknown.

    `source` is the origin: "vehicle", "Shoal" (its task of this name), or none. The default is that of Shoal's task:
    a vehicle does not give it.
    """

    entity: str
    name: str
    value: str | None
    type: str = ""
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    size: tuple[int, int] | None = None
    default: str | None = None
    scope: str = ""
    visibility: str = ""
    editable: bool | None = None
    description: str = ""
    source: str = ""

    def refusal(self, text: str) -> str:
        """Reason why the vehicle would not take a text; empty if nothing speaks against it."""
        kinds = {name: kind for name, kind in ((_type_name(number), kind) for number, kind in _KINDS.items())}
        if self.editable is False:
            return "cannot be changed while the vehicle runs"
        if self.type not in kinds:
            return ""
        kind, is_list = kinds[self.type]
        empty: Any = [] if is_list else kind()
        declared = Parameter(
            default=empty,
            unit=self.unit,
            description="",
            name=self.name,
            type=kind,
            is_list=is_list,
            minimum=self.minimum,
            maximum=self.maximum,
            choices=_values(kind, self.choices),
            size=self.size,
        )
        try:
            if text.strip() or is_list or kind is not str:
                declared.parse_strict(text)
        except ValueError as error:
            return str(error)
        return ""


async def describe_parameters(
    vehicle: AsyncRemoteVehicle, entities: Iterable[str]
) -> dict[str, dict[str, ParameterDescription]]:
    """The parameters of some entities, by label and name, with all that is known of them.

    The vehicle is asked for types and ranges; where it gives none, its values are known, and for a Shoal vehicle what
    Shoal's task of the same name declares. Raises NoAnswer or PartialAnswer if values are unknown.
    """
    labels = list(dict.fromkeys(entities))
    values, typed = await asyncio.gather(vehicle.param.read(labels), _ask_types(vehicle, labels))
    components: dict[str, str] = {}
    if vehicle.system.is_shoal:
        ids = await vehicle.param.entity_ids()
        components = await vehicle.param.components({label: ids[label] for label in values if label in ids})
    found: dict[str, dict[str, ParameterDescription]] = {}
    for entity, texts in values.items():
        declared = _declared(components.get(entity, ""))
        known = {p.name: p for p in typed.get(entity, ())}
        found[entity] = {
            name: _merge(entity, name, text, known.get(name), declared.get(name)) for name, text in texts.items()
        }
    return found


async def _ask_types(vehicle: AsyncRemoteVehicle, entities: Iterable[str]) -> dict[str, list[imc.TypedEntityParameter]]:
    """Descriptions by each entity of its parameters; one that does not answer is missing, as of older vehicles."""
    room = asyncio.Semaphore(AT_ONCE)

    async def ask(entity: str) -> list[imc.TypedEntityParameter]:
        op = imc.QueryTypedEntityParameters.Op
        request = imc.QueryTypedEntityParameters(
            op=op.REQUEST, request_id=vehicle.network.next_request_id(), entity_name=entity
        )

        def answer(message: imc.Message) -> list[imc.TypedEntityParameter] | None:
            if not isinstance(message, imc.QueryTypedEntityParameters) or message.op != op.REPLY:
                return None
            if (message.request_id, message.entity_name) != (request.request_id, entity):
                return None
            return [entry for entry in message.parameters if isinstance(entry, imc.TypedEntityParameter)]

        async with room:
            return await vehicle.network.request(vehicle.system, request, (type(request),), answer)

    first, *others = list(entities) or [""]
    found: dict[str, list[imc.TypedEntityParameter]] = {}
    try:
        found[first] = await ask(first)  # one that does not support the query ignores it: the others are not asked
    except NoAnswer:
        if not vehicle.system.is_shoal:
            return {}
    answers = await asyncio.gather(*map(ask, others), return_exceptions=True)
    for entity, reply in zip(others, answers, strict=True):
        if isinstance(reply, list):
            found[entity] = reply
        elif not isinstance(reply, NoAnswer):
            raise reply
    return found


def _merge(
    entity: str, name: str, text: str, typed: imc.TypedEntityParameter | None, declared: Parameter | None
) -> ParameterDescription:
    found = ParameterDescription(entity, name, text)
    if declared is not None:
        found = replace(
            found,
            type=declared.xml_type_name,
            unit=declared.unit,
            minimum=declared.minimum,
            maximum=declared.maximum,
            choices=tuple(map(str, declared.choices)),
            size=declared.size,
            default=declared.format(declared.default),
            scope=declared.scope,
            visibility=declared.visibility,
            editable=declared.editable,
            description=declared.description,
            source="Shoal",
        )
    if typed is None or typed.type not in _KINDS:
        return found
    locked = typed.visibility in (Visibility.USER_NOT_EDITABLE, Visibility.DEVELOPER_NOT_EDITABLE)
    bounds = (typed.min_value, typed.max_value) if typed.min_value < typed.max_value else (-math.inf, math.inf)
    low, high = map(shortest_float32, bounds)
    size = (typed.list_min_size, typed.list_max_size)
    return replace(
        found,
        type=_type_name(typed.type),
        unit=typed.units,
        minimum=None if low <= -LARGEST else low,
        maximum=None if high >= LARGEST else high,
        choices=tuple(word.strip() for word in typed.values_list.split(",") if word.strip()),
        size=size if 0 < size[1] >= size[0] else None,
        scope=SCOPES[typed.scope] if typed.scope < len(SCOPES) else "",
        visibility="user" if typed.visibility in (Visibility.USER, Visibility.USER_NOT_EDITABLE) else "developer",
        editable=not locked,
        description=typed.description,
        source="vehicle",
    )


def _declared(component: str) -> dict[str, Parameter]:
    """The declarations of Shoal's task of this name; none if there is none here."""
    try:
        task = find_task(component) if component else None
    except TaskImportError:
        return {}
    return {parameter.name: parameter for parameter in task.parameters().values()} if task is not None else {}


def _type_name(number: int) -> str:
    kind, is_list = _KINDS[number]
    name = {bool: "boolean", int: "integer", float: "real", str: "string"}[kind]
    return f"list:{name}" if is_list else name


def _values(kind: type[bool] | type[int] | type[float] | type[str], choices: tuple[str, ...]) -> tuple[Any, ...]:
    """Choices as values; none if one of them is no such value, as then their meaning is unknown."""
    if kind is str:
        return choices
    try:
        numbers = tuple(map(float, choices))
        values = tuple(map(kind, numbers))
    except (ValueError, OverflowError):
        return ()
    return values if values == numbers else ()
