"""What a running vehicle asks of a log: who speaks in it, when, and what it holds."""

from runtime.logs.clocks import without_strays
from runtime.logs.names import KEPT, NAMING, UNKNOWN_ENTITY, Names, UnknownName, type_name, types_called
from runtime.logs.packet_headers import Array, Block, blocks, headers
from runtime.logs.summary import PacketCount, Summary, summarize
from runtime.logs.writing import new_log

__all__ = [
    "KEPT",
    "NAMING",
    "UNKNOWN_ENTITY",
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
