"""Reads logs: which systems and entities send in them, when, and what; writes new ones."""

from runtime.logs.clock_steps import without_strays
from runtime.logs.names import KEPT, NAMING, Names, UnknownName, type_name, types_called
from runtime.logs.packet_headers import Array, Block, blocks, headers
from runtime.logs.run_logs import RUN_FILE, Place, folder_called, logs_of_run, missing_logs, place_bytes, place_of
from runtime.logs.summary import PacketCount, Summary, summarize
from runtime.logs.writer import new_log

__all__ = [
    "KEPT",
    "NAMING",
    "RUN_FILE",
    "Array",
    "Block",
    "Names",
    "PacketCount",
    "Place",
    "Summary",
    "UnknownName",
    "blocks",
    "folder_called",
    "headers",
    "logs_of_run",
    "missing_logs",
    "new_log",
    "place_bytes",
    "place_of",
    "summarize",
    "type_name",
    "types_called",
    "without_strays",
]
