"""Meaning of the parameters, as files that stations download (mavlink.io/en/services/component_metadata.html)."""

import json
import lzma
import math
import struct
from collections.abc import Callable, Mapping
from functools import cached_property
from itertools import takewhile
from typing import Any

import numpy as np

from mavlink.vehicle.files import checksum
from mavlink.vehicle.interfaces import ParameterDeclaration
from mavlink.vehicle.parameters.names import LONGEST
from mavlink.vehicle.parameters.table import REAL32, ParameterEntry, ParameterTable

VERSION = 1  # QGroundControl accepts no other, though the schema has newer ones
PARAMETERS = 1  # COMP_METADATA_TYPE_PARAMETER
GENERAL_URI, PARAMETERS_URI = "mftp:///general.json", "mftp:///parameters.json.xz"
CATEGORIES: Mapping[str, str] = {"user": "Standard", "developer": "Developer"}
FEWEST_DECIMALS, DIGITS = 3, 3
PACKED = struct.Struct("<HHH")
PLAIN, WITH_DEFAULTS = 0x671B, 0x671C
PACKED_INT32, PACKED_REAL32, HAS_DEFAULT = 3, 4, 0x10


class ComponentMetadata:
    """The files that describe a vehicle's parameters; they are made when they are first read, and then stay the same.

    `general.json` names the others; COMPONENT_METADATA has its address `uri` and its checksum `crc`. Beside them are
    the parameters and their values in ArduPilot's packed form, which MAVProxy and Mission Planner ask for first.
    """

    uri = GENERAL_URI

    def __init__(self, model: str, parameters: ParameterTable):
        self._model = model
        self._table = parameters

    @property
    def crc(self) -> int:
        return checksum(self.general)

    @property
    def files(self) -> Mapping[str, Callable[[], bytes]]:
        """Files by name, for VirtualFiles."""
        return {
            "general.json": lambda: self.general,
            "parameters.json": lambda: self.parameters,
            "parameters.json.xz": lambda: self.compressed_parameters,
            "@PARAM/param.pck": lambda: packed_parameters(self._table, with_defaults=False),
            "@PARAM/param.pck?withdefaults=1": lambda: packed_parameters(self._table, with_defaults=True),
        }

    @cached_property
    def general(self) -> bytes:
        described = {"type": PARAMETERS, "uri": PARAMETERS_URI, "fileCrc": checksum(self.compressed_parameters)}
        content = {"version": VERSION, "vendorName": "Shoal", "modelName": self._model, "metadataTypes": [described]}
        return _json(content)

    @cached_property
    def parameters(self) -> bytes:
        return _json({"version": VERSION, "parameters": [parameter_metadata(entry) for entry in self._table]})

    @cached_property
    def compressed_parameters(self) -> bytes:
        """An eighth of the size, in 3 ms; with the checksum and dictionary that small decoders can do."""
        filters = [{"id": lzma.FILTER_LZMA2, "preset": 1, "dict_size": 1 << 18}]
        return lzma.compress(self.parameters, check=lzma.CHECK_CRC32, filters=filters)


def parameter_metadata(entry: ParameterEntry) -> dict[str, Any]:
    """A parameter by the schema of COMP_METADATA_TYPE_PARAMETER, with its names in the profile, limits and choices."""
    parameter, label = entry.declaration, entry.view.label
    found: dict[str, Any] = {
        "name": entry.id,
        "type": "Float" if entry.type == REAL32 else "Int32",
        "shortDesc": f"{label}: {parameter.name}",
        "longDesc": f"{parameter.description} In the profile: [{entry.view.section}] {parameter.name}",
        "group": label,
        "category": CATEGORIES[parameter.visibility],
    }
    if parameter.unit not in ("", "1"):
        found["units"] = parameter.unit
    limits = {"min": parameter.minimum, "max": parameter.maximum}
    numbers = {
        name: entry.to_number(limit) for name, limit in limits.items() if limit is not None and abs(limit) < math.inf
    }
    if offered := _offered(parameter):
        found["values"] = [{"value": value, "description": text} for value, text in offered.items()]
        numbers = {"min": min(offered), "max": max(offered)}
    numbers["default"] = entry.to_number(parameter.default)
    if entry.type == REAL32:
        found["decimalPlaces"] = _decimals(numbers["default"] or numbers.get("max", 0))
    return found | numbers


def packed_parameters(table: ParameterTable, *, with_defaults: bool) -> bytes:
    """All parameters as in ArduPilot's param.pck: each name shares its beginning with the one before."""
    data = PACKED.pack(WITH_DEFAULTS if with_defaults else PLAIN, len(table), len(table))
    before = b""
    for entry in table:
        name = entry.id.encode()
        shared = len(list(takewhile(lambda pair: pair[0] == pair[1], zip(before, name, strict=False))))
        common = min(shared, len(name) - 1, LONGEST - 1)
        kind = PACKED_REAL32 if entry.type == REAL32 else PACKED_INT32
        values = (entry.value, entry.to_number(entry.declaration.default)) if with_defaults else (entry.value,)
        data += bytes((kind | (HAS_DEFAULT if with_defaults else 0), common | len(name) - common - 1 << 4))
        data += name[common:] + np.array(values, "<f4" if entry.type == REAL32 else "<i4").tobytes()
        before = name
    return data


def _offered(parameter: ParameterDeclaration) -> dict[int | float, str]:
    """The values that a parameter can have, and their meaning; none if it can have any within its limits."""
    if parameter.type is bool:
        return {0: "false", 1: "true"}
    if parameter.type is str:
        return dict(enumerate(parameter.choices))
    return {value: parameter.format(value) for value in sorted(parameter.choices)}


def _decimals(value: float) -> int:
    """Number of decimals that show a value such as this; stations show few if none are given."""
    return max(FEWEST_DECIMALS, DIGITS - 1 - math.floor(math.log10(abs(value)))) if value else FEWEST_DECIMALS


def _json(content: object) -> bytes:
    return json.dumps(content, ensure_ascii=False, separators=(",", ":"), allow_nan=False).encode(errors="replace")
