"""Merges several logs into one, ordered by time."""

import tempfile
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np

import imc
from imc.layout import SMALLEST_PACKET
from imc.lsf import ReportProgress
from imc.schema import MessageType
from runtime.logs import NAMING, Array, SystemNames, create_log, packet_blocks, type_name
from support.file_errors import add_path_to_errors


class MergeConflict(ValueError):
    """Logs that cannot be merged; the text gives the reason."""


@dataclass
class MergeReport:
    """Written content: packets; copies, skipped because another log has them too; damage; warnings.

    read: bytes of the packets in each log.
    """

    packets: int = 0
    copies: int = 0
    losses: list[tuple[Path, imc.Loss]] = field(default_factory=list[tuple[Path, imc.Loss]])
    read: list[tuple[Path, int]] = field(default_factory=list[tuple[Path, int]])
    warnings: list[str] = field(default_factory=list[str])


def merge(
    logs: list[imc.Log], folder: Path, keep_copies: bool = False, progress: ReportProgress | None = None
) -> MergeReport:
    """Write all packets of the logs, unchanged, to a new log in `folder`, by time and then by log and order.

    A packet without a time follows the one before it. A packet that is in several logs is written once, unless
    `keep_copies`. The packets wait unpacked in a temporary file and take 20 bytes of memory each. Raises MergeConflict
    if the logs define a message in them differently, ValueError if there is no message, FileExistsError, OSError.
    """
    merged = MergeReport()
    with add_path_to_errors(tempfile.gettempdir()), tempfile.TemporaryFile() as spill:
        collected = _SpilledPackets(spill)
        for number, log in enumerate(logs):
            before = collected.size
            merged.losses += [(log.path, loss) for loss in collected.read_log(number, log, progress)]
            merged.read.append((log.path, collected.size - before))
        if not collected.times:
            raise ValueError("there is no message in these logs")
        source = _common_schema(logs, collected.ids)
        merged.warnings = _label_conflicts(logs, collected.names)
        with create_log(folder, source) as writer:
            for packet in collected.in_order(None if keep_copies else merged):
                writer.write(packet)
                merged.packets += 1
    return merged


class _SpilledPackets:
    """The packets of several logs, one after the other in a file."""

    def __init__(self, spill: IO[bytes]):
        self._spill = spill
        self.times, self._ends, self._logs = array("d"), array("q"), array("i")
        self.ids: list[set[int]] = []
        self.names: list[SystemNames] = []
        self._end = 0

    @property
    def size(self) -> int:
        """Bytes of all packets."""
        return self._end

    def read_log(self, number: int, log: imc.Log, progress: ReportProgress | None) -> list[imc.Loss]:
        """Read a log; returns what was damaged."""
        losses: list[imc.Loss] = []
        ids: set[int] = set()
        names = SystemNames()
        latest = 0.0
        for block in packet_blocks(log, losses, progress):
            heads = block.headers
            times = _filled(heads["timestamp"], latest)
            latest = float(times[-1])
            self.times.frombytes(times.tobytes())
            ends = self._end + np.cumsum(heads["size"].astype(np.int64) + SMALLEST_PACKET)
            self._ends.frombytes(ends.tobytes())
            self._logs.frombytes(np.full(len(heads), number, np.int32).tobytes())
            self._end = int(ends[-1])
            self._spill.write(b"".join(block.packets))
            ids.update(np.unique(heads["id"]).tolist())
            for index in np.flatnonzero(np.isin(heads["id"], list(NAMING))):
                try:
                    names.learn(log.schema.decode(block.packets[index]))
                except imc.DecodeError:
                    continue
        self.ids.append(ids)
        self.names.append(names)
        return losses

    def in_order(self, merged: MergeReport | None) -> Iterator[bytes]:
        """The packets by time; if `merged` is given, copies are skipped and counted in it."""
        self._spill.flush()
        data = np.memmap(self._spill, np.uint8, "r")
        times, ends, logs = (np.asarray(column) for column in (self.times, self._ends, self._logs))
        now = np.nan
        group: dict[tuple[bytes, int], int] = {}
        ranks: dict[tuple[bytes, int], int] = {}
        for index in np.argsort(times, kind="stable").tolist():
            packet = data[ends[index - 1] if index else 0 : ends[index]].tobytes()
            if merged is not None:
                if times[index] != now:
                    now = times[index]
                    group.clear()
                    ranks.clear()
                log = int(logs[index])
                # The n-th copy in one log is the n-th in another; repeats within one log are kept.
                rank = ranks[packet, log] = ranks.get((packet, log), 0) + 1
                if group.setdefault((packet, rank), log) != log:
                    merged.copies += 1
                    continue
            yield packet


def _filled(times: Array, latest: float) -> Array:
    """Times, with those that are not finite replaced by the ones before."""
    said = np.concatenate(([latest], times))
    places = np.maximum.accumulate(np.where(np.isfinite(said), np.arange(len(said)), 0))
    return said[places][1:]


def _common_schema(logs: list[imc.Log], ids: list[set[int]]) -> imc.Log:
    """The log whose definitions fit all packets. Raises MergeConflict."""
    reasons: list[str] = []
    for candidate in logs:
        if candidate.schema.sync != logs[0].schema.sync:
            raise MergeConflict(f"{candidate.path} and {logs[0].path} are of IMC versions with different sync numbers")
        reason = next(filter(None, (_misfit(candidate, log, used) for log, used in zip(logs, ids, strict=True))), None)
        if reason is None:
            return candidate
        reasons.append(reason)
    raise MergeConflict(f"no log has definitions that fit all: {'; '.join(dict.fromkeys(reasons))}")


def _misfit(candidate: imc.Log, log: imc.Log, used: set[int]) -> str:
    """Reason why definitions do not fit the messages of a log; empty if they do."""
    for number in sorted(used):
        mine, theirs = candidate.schema.types_by_id.get(number), log.schema.types_by_id.get(number)
        if theirs is not None and (mine is None or _layout(mine) != _layout(theirs)):
            has = "is missing" if mine is None else "has other fields"
            has = f"is {mine.abbrev}" if mine and mine.abbrev != theirs.abbrev else has
            return f"message {number} of {log.path}, {type_name(log.schema, number)}, {has} in {candidate.path}"
    return ""


def _layout(message: MessageType) -> object:
    return message.abbrev, message.wire_codes, [field.attribute for field in message.fields]


def _label_conflicts(logs: list[imc.Log], names: list[SystemNames]) -> list[str]:
    """Entities with different labels in different logs."""
    first: dict[tuple[int, int], tuple[str, Path]] = {}
    found: list[str] = []
    for log, known in zip(logs, names, strict=True):
        for key, label in known.labels.items():
            before, path = first.setdefault(key, (label, log.path))
            if before != label:
                who = f"entity {key[1]} of {known.system_name(key[0])}"
                found.append(f"{who} is {before!r} in {path} and {label!r} in {log.path}")
    return found
