"""The folder of a campaign: a journal of its rows, and the table made of it."""

from shoal.campaigns.dataset.dataset import (
    JOURNAL,
    LOGS,
    TABLE,
    DataSet,
    DataSetError,
    Recording,
    about_study,
    difference,
    is_data_set,
    open_data_set,
)

__all__ = [
    "JOURNAL",
    "LOGS",
    "TABLE",
    "DataSet",
    "DataSetError",
    "Recording",
    "about_study",
    "difference",
    "is_data_set",
    "open_data_set",
]
