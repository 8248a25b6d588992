"""Reads logs: which systems and entities send in them, when, and what; writes new ones."""

from runtime.logs.clocks import without_strays
from runtime.logs.names import KEPT, NAMING, Names, UnknownName, type_name, types_called
from runtime.logs.packet_headers import Array, Block, blocks, headers
from runtime.logs.summary import PacketCount, Summary, summarize
from runtime.logs.writing import new_log

__all__ = [
    "KEPT",
    "NAMING",
    "Array",
    "Block",
    "Names",
    "PacketCount",
    "Summary",
    "UnknownName",
    "blocks",
    "headers",
    "new_log",
    "summarize",
    "type_name",
    "types_called",
    "without_strays",
]
