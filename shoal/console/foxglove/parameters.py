"""Parameters of the vehicles' tasks as a viewer names them: VEHICLE/ENTITY/PARAMETER."""

import asyncio
import math
import re
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import cast

from shoal.console.access.authority import AuthorityError, Permit
from shoal.console.foxglove.protocol import GivenParameter, Json
from shoal.network import AsyncRemoteVehicle, Network, NetworkError
from support.terminal_text import printable

FRESH = 10.0  # s for which all parameters of a vehicle are not read again
_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?([eE][-+]?\d+)?")

FindVehicle = Callable[[object], AsyncRemoteVehicle]
Report = Callable[[str], object]


class ParameterAccess:
    """Reads and sets parameters of all vehicles. What cannot be read or set is reported, and missing in the values."""

    def __init__(self, network: Network, find_vehicle: FindVehicle) -> None:
        self._network, self._find = network, find_vehicle
        self._read: dict[str, tuple[float, Mapping[str, Mapping[str, str]]]] = {}
        self._reading: dict[str, asyncio.Lock] = {}

    async def get(self, names: Collection[str], report: Report) -> list[Json]:
        """The parameters of these names, or all."""
        if not names:
            systems = [system.name for system in self._network.vehicles()]
            found = await asyncio.gather(*(self._all_of(name, report) for name in systems))
            return [value for values in found for value in values]
        wanted = _by_entity(names, report)
        found = await asyncio.gather(*(self._some_of(place, wanted[place], report) for place in wanted))
        return [value for values in found for value in values]

    async def set(self, values: Iterable[GivenParameter], permit: Permit, report: Report) -> list[Json]:
        """Set parameters that `permit` allows; returns those that the vehicle has accepted."""
        texts: dict[str, str] = {}
        for value in values:
            text = value_text(value.value)
            if text is None:
                report(f"{printable(value.name)}: a parameter is a number, true or false, a text, or a list of them")
            else:
                texts[value.name] = text
        found: list[Json] = []
        for (system, entity), names in _by_entity(texts, report).items():
            wanted = {name: texts[f"{system}/{entity}/{name}"] for name in names}
            try:
                vehicle = self._find(system)
                for name, text in wanted.items():
                    permit(system, "set", {"entity": entity, "parameter": name, "value": text})
                accepted = await vehicle.param.set(entity, wanted)
            except (AuthorityError, NetworkError) as error:
                report(printable(f"{system}: {error}"))
                continue
            self._read.pop(system, None)
            found += values_of(system, entity, accepted)
        return found

    async def _all_of(self, system: str, report: Report) -> list[Json]:
        async with self._reading.setdefault(system, asyncio.Lock()):
            read_at, values = self._read.get(system, (-math.inf, {}))
            if time.monotonic() - read_at > FRESH:
                try:
                    values = await self._find(system).param.list()
                except NetworkError as error:
                    report(printable(f"{system}: {error}"))
                    return []
                self._read[system] = time.monotonic(), values
        return [value for entity, known in values.items() for value in values_of(system, entity, known)]

    async def _some_of(self, place: tuple[str, str], names: Collection[str], report: Report) -> list[Json]:
        system, entity = place
        try:
            values = await self._find(system).param.get(entity)
        except NetworkError as error:
            report(printable(f"{system}: {error}"))
            return []
        return values_of(system, entity, {name: values[name] for name in names if name in values})


def values_of(system: str, entity: str, values: Mapping[str, str]) -> list[Json]:
    """The parameters of an entity with their names and types."""
    return [{"name": f"{system}/{entity}/{name}", **_typed(text)} for name, text in values.items()]


def _by_entity(names: Iterable[str], report: Report) -> dict[tuple[str, str], list[str]]:
    found: dict[tuple[str, str], list[str]] = {}
    for name in names:
        parts = name.split("/")
        if len(parts) == 3:
            found.setdefault((parts[0], parts[1]), []).append(parts[2])
        else:
            report(f"{printable(name)} is no parameter: their names are VEHICLE/ENTITY/PARAMETER")
    return found


def _typed(text: str) -> Json:
    if text in ("true", "false"):
        return {"value": text == "true"}
    if _NUMBER.fullmatch(text) and math.isfinite(float(text)):
        return {"value": float(text), "type": "float64"}
    return {"value": printable(text)}


def value_text(value: object) -> str | None:
    """A value of JSON as in a profile; None if a profile has none like it."""
    match value:
        case bool():
            return str(value).lower()
        case int() | str():
            return str(value)
        case float():
            return str(int(value)) if value.is_integer() and abs(value) < 2**53 else repr(value)
        case list():
            texts = [value_text(item) for item in cast(list[object], value) if not isinstance(item, list)]
            return None if None in texts or len(texts) < len(cast(list[object], value)) else ", ".join(map(str, texts))
        case _:
            return None
