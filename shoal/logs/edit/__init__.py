"""Cuts, merges and imports logs."""

from shoal.logs.edit.atomic import new_file, new_folder
from shoal.logs.edit.cutting import cut
from shoal.logs.edit.merging import merge

__all__ = [
    "cut",
    "merge",
    "new_file",
    "new_folder",
]
