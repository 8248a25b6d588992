"""Messages and fields of MAVLink's common set that pymavlink's dialects lack, since those are ArduPilot's.

Source: MAVLink's common.xml of 2026-07, and its rules for the order of fields and CRC_EXTRA ("Serialization").
"""

import struct
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from fastcrc import crc16

TYPES: Mapping[str, str] = {
    "char": "s",
    "uint8_t": "B",
    "int8_t": "b",
    "uint16_t": "H",
    "int16_t": "h",
    "uint32_t": "I",
    "int32_t": "i",
    "uint64_t": "Q",
    "int64_t": "q",
    "float": "f",
    "double": "d",
}


class ExtraMessage(NamedTuple):
    """A message: `declared` has its fields in the order of the definition, "TYPE NAME" or "TYPE[LENGTH] NAME"."""

    id: int
    name: str
    declared: tuple[str, ...]

    @property
    def wire_fields(self) -> list[tuple[str, str, int]]:
        """Name, struct character and length (0: no array) of each field in wire order: the largest types first."""
        fields = [(name, TYPES[kind], length) for kind, length, name in map(_parsed, self.declared)]
        return sorted(fields, key=lambda field: -struct.calcsize(f"<{field[1]}"))

    @property
    def crc_extra(self) -> int:
        kinds = {name: kind for kind, _, name in map(_parsed, self.declared)}
        content = f"{self.name} ".encode()
        for name, _, length in self.wire_fields:
            content += f"{kinds[name]} {name} ".encode() + (bytes((length,)) if length else b"")
        checksum = crc16.mcrf4xx(content)
        return checksum & 0xFF ^ checksum >> 8


MESSAGES: Sequence[ExtraMessage] = (
    ExtraMessage(80, "COMMAND_CANCEL", ("uint8_t target_system", "uint8_t target_component", "uint16_t command")),
    ExtraMessage(
        300,
        "PROTOCOL_VERSION",
        (
            "uint16_t version",
            "uint16_t min_version",
            "uint16_t max_version",
            "uint8_t[8] spec_version_hash",
            "uint8_t[8] library_version_hash",
        ),
    ),
    ExtraMessage(397, "COMPONENT_METADATA", ("uint32_t time_boot_ms", "uint32_t file_crc", "char[100] uri")),
    ExtraMessage(
        435,
        "AVAILABLE_MODES",
        (
            "uint8_t number_modes",
            "uint8_t mode_index",
            "uint8_t standard_mode",
            "uint32_t custom_mode",
            "uint32_t properties",
            "char[35] mode_name",
        ),
    ),
    ExtraMessage(
        436, "CURRENT_MODE", ("uint8_t standard_mode", "uint32_t custom_mode", "uint32_t intended_custom_mode")
    ),
    ExtraMessage(
        410,
        "EVENT",
        (
            "uint8_t destination_component",
            "uint8_t destination_system",
            "uint32_t id",
            "uint32_t event_time_boot_ms",
            "uint16_t sequence",
            "uint8_t log_levels",
            "uint8_t[40] arguments",
        ),
    ),
    ExtraMessage(437, "AVAILABLE_MODES_MONITOR", ("uint8_t seq",)),
)

EXTENSIONS: Mapping[str, Sequence[tuple[str, str]]] = {
    "MISSION_CURRENT": (("mission_id", "I"), ("fence_id", "I"), ("rally_points_id", "I")),
    "MISSION_COUNT": (("opaque_id", "I"),),
    "MISSION_ACK": (("opaque_id", "I"),),
    # without the target, two clients would take each other's answers
    "TIMESYNC": (("target_system", "B"), ("target_component", "B")),
}
"""Fields at the end of messages, by name of the message: their names and struct characters."""


def _parsed(text: str) -> tuple[str, int, str]:
    """Type, length (0: no array) and name in a declaration."""
    kind, name = text.split()
    kind, _, length = kind.rstrip("]").partition("[")
    return kind, int(length or "0"), name
