"""The state of a vehicle as plain values, saved and restored."""

from runtime.snapshot.allowlist import SnapshotError
from runtime.snapshot.input_journal import InputJournals
from runtime.snapshot.snapshot import (
    STATE,
    SUFFIX,
    Snapshot,
    load,
    load_file,
    restore,
    run_with_snapshots,
    save_beside_log,
    take_snapshot,
)

__all__ = [
    "STATE",
    "SUFFIX",
    "InputJournals",
    "Snapshot",
    "SnapshotError",
    "load",
    "load_file",
    "restore",
    "run_with_snapshots",
    "save_beside_log",
    "take_snapshot",
]
