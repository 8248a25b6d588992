"""Logs on disk: reads messages, columns and tables, writes packets."""

from imc.lsf.byte_reader import Members, ReportProgress, open_reader, unpacked_chunks
from imc.lsf.damage_list import DamageList
from imc.lsf.gzip_members import COMPRESSIONS, Compression, compress_member
from imc.lsf.log import Log
from imc.lsf.log_files import SUFFIXES, find_log, log_file_names
from imc.lsf.neptus_index import read_neptus_index, write_neptus_index
from imc.lsf.parallel_gunzip import ParallelMap
from imc.lsf.position_columns import positions
from imc.lsf.scanner import Batch, read_at_offsets, scan
from imc.lsf.schema_gzip import gzip_schema
from imc.lsf.writer import LsfWriter

__all__ = [
    "COMPRESSIONS",
    "SUFFIXES",
    "Batch",
    "Compression",
    "DamageList",
    "Log",
    "LsfWriter",
    "Members",
    "ParallelMap",
    "ReportProgress",
    "compress_member",
    "find_log",
    "gzip_schema",
    "log_file_names",
    "open_reader",
    "positions",
    "read_at_offsets",
    "read_neptus_index",
    "scan",
    "unpacked_chunks",
    "write_neptus_index",
]
