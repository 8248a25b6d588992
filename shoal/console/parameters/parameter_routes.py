"""Requests of the page about parameters: values, descriptions, what the profile sets, and orders to change them."""

import asyncio
import math
from collections.abc import Callable, Mapping

from starlette.requests import Request
from starlette.responses import Response

from shoal.console.json_request import json_response, refusal_response
from shoal.console.parameters.parameter_changes import ParameterChanges
from shoal.console.parameters.profile_settings import ParameterSetting, ProfileSettings
from shoal.console.vehicle_orders import carry_out
from shoal.network import AsyncRemoteVehicle, NetworkError, ParameterDescription, describe_parameters, is_same_value
from support.terminal_text import printable

Finder = Callable[[object], AsyncRemoteVehicle]
FROM_HERE = "types, ranges and defaults are those of Shoal's task of this name: the vehicle gives none"
VALUES_ONLY = "this vehicle gives values only: no units, ranges and defaults"


class ParameterRoutes:
    """Answers about the parameters of vehicles, and orders that change them.

    `vehicle(name)` is the vehicle of a name; it raises NetworkError if there is none. `settings` are those of the
    profile, where the vehicle runs in this process.
    """

    def __init__(self, vehicle: Finder, settings: ProfileSettings | None = None) -> None:
        self._vehicle, self._settings = vehicle, settings
        self._changes = ParameterChanges()

    async def values(self, request: Request) -> Response:
        """The entities of a vehicle, or the values of one of them."""
        try:
            vehicle = self._vehicle(request.query_params.get("vehicle"))
            entity = request.query_params.get("entity")
            if entity is None:
                return json_response({"ok": True, "entities": sorted(await vehicle.param.entity_ids())})
            return json_response({"ok": True, "values": await vehicle.param.get(entity)})
        except NetworkError as error:
            return refusal_response(error)

    async def details(self, request: Request) -> Response:
        """All that is known of the parameters of an entity, and the latest changes of those of the vehicle."""
        entity = request.query_params.get("entity", "")
        try:
            vehicle = self._vehicle(request.query_params.get("vehicle"))
            found = (await describe_parameters(vehicle, [entity])).get(entity, {})
        except NetworkError as error:
            return refusal_response(error)
        settings = self._settings
        here: Mapping[str, ParameterSetting] = {}
        saved: Mapping[str, str] = {}
        if settings is not None:
            here, saved = settings.of_entity(entity), await asyncio.to_thread(settings.saved, entity)
        rows = {name: _row(each, here, saved) for name, each in found.items()}
        sources = {each.source for each in found.values()}
        task = "" if settings is None else settings.section(entity)
        note = f"[{task}]" if task else "" if "vehicle" in sources else FROM_HERE if "Shoal" in sources else VALUES_ONLY
        changes = self._changes.view(vehicle.system.name)
        return json_response({"ok": True, "values": rows, "note": note if rows else "", "changes": changes})

    def complete(self, vehicle: str, words: Mapping[str, object]) -> Mapping[str, object]:
        """The words of an order, with those of the change that it is to undo, for the log book."""
        return {**words, **self._changes.words_of(vehicle, words.get("change"))}

    async def carry_out(self, user: str, vehicle: AsyncRemoteVehicle, order: str, words: Mapping[str, object]) -> str:
        """Carry out any order of a user, see `vehicle_orders.carry_out`; changes of parameters can be undone."""
        if order == "undo":
            return await self._changes.undo(user, vehicle, words.get("change"))
        if order != "set":
            return await carry_out(vehicle, order, words)
        given = {name: value for name, value in words.items() if isinstance(value, str)}
        entity, name, value = (given.get(word, "") for word in ("entity", "parameter", "value"))
        return await self._changes.set(user, vehicle, entity, name, value)


def _row(
    described: ParameterDescription, settings: Mapping[str, ParameterSetting], saved: Mapping[str, str]
) -> dict[str, object]:
    """The page's data of a parameter; what is unknown is null."""
    name, setting = described.name, settings.get(described.name)
    default = described.default if setting is None else setting.default
    differs = setting is not None and not is_same_value(setting.text, described.value or "")
    return {
        "value": described.value,
        "unit": described.unit if described.unit != "1" else "",
        "default": default,
        "notes": _notes(described, default),
        "editable": described.editable,
        "file": None if setting is None else setting.text,
        "differs": differs,
        "where": None if setting is None else printable(setting.where),
        "origin": [] if setting is None else _origin(setting, saved.get(name), differs=differs),
    }


def _notes(described: ParameterDescription, default: str | None) -> list[str]:
    """The description of a parameter, and a line with its type, range, choices and default, if known."""
    parts = [described.type or ""]
    bounds = (("at least", described.minimum), ("at most", described.maximum))
    parts.append(
        ", ".join(f"{words} {bound:.10g}" for words, bound in bounds if bound is not None and math.isfinite(bound))
    )
    parts.append(f"one of {', '.join(described.choices)}" if described.choices else "")
    parts.append("" if default is None else f"default {default or '(empty)'}")
    parts.append("" if described.editable is not False else "set only before the start")
    lines = [described.description, "; ".join(filter(None, parts))]
    return [printable(line) for line in lines if line]


def _origin(setting: ParameterSetting, saved: str | None, *, differs: bool) -> list[tuple[str, str]]:
    """Lines on where the value of a parameter comes from, each with its kind: "warn" or ""."""
    source = f"from {setting.where}" if ":" in setting.where else f"from the {setting.where}"
    if setting.replaced:
        source += f", instead of {', '.join(setting.replaced)}"
    changed = f"set since the start, when it was {setting.text or '(empty)'} {source}"
    lines = [(changed, "warn") if differs else (source, "")]
    if saved is not None:
        lines.append((f"saved for the next start: {saved}", ""))
    return [(printable(text), kind) for text, kind in lines]
