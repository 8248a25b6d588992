"""Reads logs: which systems and entities send in them, when, and what; writes new ones."""

from runtime.logs.clock_steps import without_outliers
from runtime.logs.header_arrays import Array, PacketBlock, packet_blocks, packet_headers
from runtime.logs.run_logs import (
    RUN_FILE,
    RunPosition,
    encode_run_position,
    find_log_folder,
    logs_of_run,
    missing_logs,
    run_position,
)
from runtime.logs.summary import LogSummary, PacketCount, summarize
from runtime.logs.system_names import KEPT, NAMING, SystemNames, UnknownNameError, find_types, type_name
from runtime.logs.writer import create_log

__all__ = [
    "KEPT",
    "NAMING",
    "RUN_FILE",
    "Array",
    "LogSummary",
    "PacketBlock",
    "PacketCount",
    "RunPosition",
    "SystemNames",
    "UnknownNameError",
    "create_log",
    "encode_run_position",
    "find_log_folder",
    "find_types",
    "logs_of_run",
    "missing_logs",
    "packet_blocks",
    "packet_headers",
    "run_position",
    "summarize",
    "type_name",
    "without_outliers",
]
