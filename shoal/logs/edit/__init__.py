"""Makes logs of logs: cut, merged, imported."""

from shoal.logs.edit.atomic import new_file, new_folder
from shoal.logs.edit.cutting import Selection, Watch, choose, cut, wanted
from shoal.logs.edit.merging import merge

__all__ = [
    "Selection",
    "Watch",
    "choose",
    "cut",
    "merge",
    "new_file",
    "new_folder",
    "wanted",
]
