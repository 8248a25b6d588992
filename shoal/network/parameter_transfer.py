"""All parameters of a vehicle to a file, and those of a file to a vehicle, each read back."""

import asyncio
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import Literal, NamedTuple

import imc
from shoal.network.link import NetworkError, NoAnswer
from shoal.network.message_listener import MessageListener
from shoal.network.parameter_descriptions import describe_parameters
from shoal.network.parameter_file import FileSection, VehicleParameters
from shoal.network.parameters import PartialAnswer, is_same_value, refusal_reasons
from shoal.network.remote_vehicle import AsyncRemoteVehicle
from support.terminal_text import suggestion

Outcome = Literal["set", "unchanged", "rejected", "no answer"]
SETTLING = 1.5  # s; an entity that is to be activated answers only when it is
AGAIN = 0.2  # s between readings until then


class PlannedChange(NamedTuple):
    """The parameters of one entity: `values` as requested, `before` as they are; texts by name."""

    entity: str
    values: Mapping[str, str]
    before: Mapping[str, str]


class ParameterOutcome(NamedTuple):
    """The result for one parameter; `value` is its value now, None if that is unknown."""

    entity: str
    name: str
    wanted: str
    before: str
    value: str | None
    outcome: Outcome
    reason: str = ""


class UnfitParameters(NetworkError):
    """Parameters that the vehicle does not have or would reject; the text has a line for each."""


async def dump_parameters(vehicle: AsyncRemoteVehicle) -> VehicleParameters:
    """The parameters of all entities, as received; entities that do not answer are `unknown`."""
    labels, unknown = await vehicle.param.entity_ids(), tuple[str, ...]()
    received = time.time()
    try:
        values: Mapping[str, Mapping[str, str]] = await vehicle.param.read(labels)
    except PartialAnswer as error:
        values, unknown = error.found, error.missing
    components = await vehicle.param.components({label: labels[label] for label in values if label in labels})
    return VehicleParameters(vehicle.name, vehicle.id, received, values, components, unknown)


async def check_parameters(vehicle: AsyncRemoteVehicle, sections: Iterable[FileSection]) -> list[PlannedChange]:
    """The changes that the parameters of a file would make. Nothing is sent but questions.

    Raises UnfitParameters with all that is wrong; NoAnswer if the vehicle does not report its own.
    """
    sections = [section for section in sections if section.values]
    labels = await vehicle.param.entity_ids()
    tasks: dict[str, list[str]] = {}
    if any(section.name not in labels for section in sections if not section.is_label):
        for label, component in (await vehicle.param.components(labels)).items():
            tasks.setdefault(component, []).append(label)
    wrong: list[str] = []
    entities: list[tuple[str, FileSection]] = []
    for section in sections:
        found = [section.name] if section.name in labels else [] if section.is_label else tasks.get(section.name, [])
        if first := next((other for entity, other in entities if [entity] == found), None):
            wrong.append(f"{section.where}: the parameters of {found[0]} are already in {first.where}")
        elif len(found) == 1:
            entities.append((found[0], section))
        elif found:
            wrong.append(f"{section.where}: the entities {', '.join(found)} are of this task: add Entity Label = ...")
        else:
            hint = suggestion(section.name, labels) or "`shoal param VEHICLE list` lists them"
            wrong.append(f"{section.where}: no entity {section.name!r}; {hint}")
    known = await describe_parameters(vehicle, [entity for entity, _ in entities]) if entities else {}
    changes: list[PlannedChange] = []
    for entity, section in entities:
        has = known.get(entity, {})
        before = {name: described.value or "" for name, described in has.items()}
        for name, (text, where) in section.values.items():
            if name not in has:
                hint = suggestion(name, has) if has else f"{entity} has none"
                wrong.append(f"{where}: {entity} has no parameter {name!r}{hint and f'; {hint}'}")
            elif not is_same_value(before[name], text) and (reason := has[name].refusal(text)):
                wrong.append(f"{where}: {entity}:{name}: {reason}")
        changes.append(PlannedChange(entity, {name: text for name, (text, _) in section.values.items()}, before))
    if wrong:
        raise UnfitParameters("\n".join(wrong))
    return changes


async def load_parameters(vehicle: AsyncRemoteVehicle, changes: Iterable[PlannedChange]) -> list[ParameterOutcome]:
    """Set what differs, entity by entity, and read it back. Raises VehicleLost.

    A vehicle that is not Shoal's gets each order once.
    """
    found: list[ParameterOutcome] = []
    for change in changes:
        found += await _set(vehicle, change)
    return found


async def _set(vehicle: AsyncRemoteVehicle, change: PlannedChange) -> list[ParameterOutcome]:
    entity, before = change.entity, change.before
    different = {name: text for name, text in change.values.items() if not is_same_value(before[name], text)}
    now: Mapping[str, str] | None = before
    refusals, has_answered = _Refusals(different), True
    if different:
        listener = vehicle.network.listen(vehicle.system, (imc.LogBookEntry,))
        try:
            has_answered = await _order(vehicle, entity, different)
            now = await _read_back(vehicle, entity, change, lambda: refusals.read(listener))
            refusals.read(listener)
        finally:
            vehicle.network.close_listener(listener)
    found: list[ParameterOutcome] = []
    for name, text in change.values.items():
        value = None if now is None else now[name]
        outcome, reason = "unchanged", ""
        if name in different and value is not None and is_same_value(value, text):
            outcome = "set"
        elif name in different and (value is None or not (has_answered or name in refusals.reasons)):
            outcome, reason = "no answer", "" if value is None else f"it is still {value}"
        elif name in different:
            outcome, reason = "rejected", refusals.reasons.get(name, f"it is {value}")
        found.append(ParameterOutcome(entity, name, text, before[name], value, outcome, reason))
    return found


class _Refusals:
    """The reasons in the log book of the vehicle for values that it rejects, by name."""

    def __init__(self, values: Mapping[str, str]) -> None:
        self._values = values
        self.reasons: dict[str, str] = {}

    def read(self, listener: MessageListener) -> set[str]:
        """Take in what has arrived by now; the names of all values that are rejected."""
        for _, message in listener.take_all():
            if isinstance(message, imc.LogBookEntry):
                self.reasons |= refusal_reasons(message, self._values)
        return set(self.reasons)


async def _order(vehicle: AsyncRemoteVehicle, entity: str, values: Mapping[str, str]) -> bool:
    """Send the values; whether the vehicle has answered, by what it has set or by its log book."""
    params = tuple(imc.EntityParameter(name=name, value=text) for name, text in values.items())
    refused: set[str] = set()

    def answer(message: imc.Message) -> bool | None:
        if isinstance(message, imc.LogBookEntry):
            refused.update(refusal_reasons(message, values))
            return True if refused >= values.keys() else None
        if not isinstance(message, imc.EntityParameters) or message.name != entity:
            return None
        names = {entry.name for entry in message.params if isinstance(entry, imc.EntityParameter)}
        return True if names and names <= values.keys() else None

    request = imc.SetEntityParameters(name=entity, params=params)
    kinds = (imc.EntityParameters, imc.LogBookEntry)
    try:
        return await vehicle.network.request(vehicle.system, request, kinds, answer)
    except NoAnswer:
        return False


async def _read_back(
    vehicle: AsyncRemoteVehicle, entity: str, change: PlannedChange, read_refused: Callable[[], set[str]]
) -> dict[str, str] | None:
    """The values that the entity has now; None if it does not report them. Waits a little for requested ones."""

    def answer(message: imc.Message) -> dict[str, str] | None:
        """All parameters: a late answer to the order has only those that were set."""
        if not isinstance(message, imc.EntityParameters) or message.name != entity:
            return None
        values = {entry.name: entry.value for entry in message.params if isinstance(entry, imc.EntityParameter)}
        return values if values.keys() >= change.before.keys() else None

    query = imc.QueryEntityParameters(name=entity, visibility="developer", scope="global")
    until, found = time.monotonic() + SETTLING, None
    with suppress(NoAnswer):
        while True:
            found = await vehicle.network.request(vehicle.system, query, (imc.EntityParameters,), answer)
            late = {name for name, text in change.values.items() if not is_same_value(found[name], text)}
            if late <= read_refused() or time.monotonic() > until:
                break
            await asyncio.sleep(AGAIN)
    return found
