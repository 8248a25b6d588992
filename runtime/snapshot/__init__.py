"""The state of a vehicle as plain values, saved and restored."""

from runtime.snapshot.allowlist import SnapshotError
from runtime.snapshot.input_journal import Journals
from runtime.snapshot.snapshot import (
    STATE,
    SUFFIX,
    Snapshot,
    keep_beside_log,
    load,
    load_file,
    restore,
    run_with_snapshots,
    save,
)

__all__ = [
    "STATE",
    "SUFFIX",
    "Journals",
    "Snapshot",
    "SnapshotError",
    "keep_beside_log",
    "load",
    "load_file",
    "restore",
    "run_with_snapshots",
    "save",
]
