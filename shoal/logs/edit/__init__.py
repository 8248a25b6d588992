"""Cuts, merges and imports logs."""

from shoal.logs.edit.cut_log import cut
from shoal.logs.edit.merge_logs import merge

__all__ = [
    "cut",
    "merge",
]
