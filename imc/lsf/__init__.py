"""Logs on disk: reads messages, columns and tables, writes packets."""

from imc.lsf.byte_reader import ReportShare, chunks
from imc.lsf.damage_list import Losses
from imc.lsf.definitions import packed_schema
from imc.lsf.gzip_members import COMPRESSIONS, Compression, gzip_member
from imc.lsf.log import Log
from imc.lsf.log_files import SUFFIXES, find_log
from imc.lsf.neptus_index import read_neptus_index, write_neptus_index
from imc.lsf.parallel_gunzip import Spread
from imc.lsf.position_columns import positions
from imc.lsf.scanner import Batch, at_each, scan
from imc.lsf.writer import LsfWriter

__all__ = [
    "COMPRESSIONS",
    "SUFFIXES",
    "Batch",
    "Compression",
    "Log",
    "Losses",
    "LsfWriter",
    "ReportShare",
    "Spread",
    "at_each",
    "chunks",
    "find_log",
    "gzip_member",
    "packed_schema",
    "positions",
    "read_neptus_index",
    "scan",
    "write_neptus_index",
]
