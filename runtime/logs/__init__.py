"""Reads logs: which systems and entities send in them, when, and what; writes new ones."""

from runtime.logs.consecutive_run_logs import (
    RUN_FILE,
    RunPosition,
    encode_log_run_position,
    logs_of_run,
    missing_logs,
    read_log_run_position,
    resolve_log_folder,
)
from runtime.logs.log_folder_creation import create_log
from runtime.logs.logged_clock_jumps import without_outliers
from runtime.logs.packet_block_reader import Array, PacketBlock, packet_blocks, packet_headers
from runtime.logs.summary import LogSummary, PacketCount, summarize
from runtime.logs.system_names import (
    KEPT,
    NAMING,
    SystemNames,
    UnknownNameError,
    find_message_ids,
    label_text,
    type_name,
)

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
    "encode_log_run_position",
    "find_message_ids",
    "label_text",
    "logs_of_run",
    "missing_logs",
    "packet_blocks",
    "packet_headers",
    "read_log_run_position",
    "resolve_log_folder",
    "summarize",
    "type_name",
    "without_outliers",
]
