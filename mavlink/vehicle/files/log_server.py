"""The vehicle's logs by the older messages LOG_REQUEST_LIST and LOG_REQUEST_DATA; they are only read."""

from collections import deque
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import islice
from typing import Any

from mavlink import Fields
from mavlink.vehicle.files.virtual_files import VirtualFiles
from mavlink.vehicle.interfaces import OpenFile

CHUNK = 90
DATA = b"Data.lsf"  # and the suffix of its compression
MOST_LOGS = 500  # the latest
MOST_RANGES = 32  # that one asker may have waiting
LONGEST_RANGE = 5000 * CHUNK  # bytes; MAVProxy asks for a whole log, and again when nothing comes
MOST_ASKERS = 16
FRESH = 5.0  # s that the list of logs serves new requests


@dataclass(frozen=True, slots=True)
class LogFile:
    """A log; `time` is when it began, in s since 1970."""

    path: bytes
    size: int
    time: int


@dataclass(slots=True)
class _Range:
    """Bytes of a log that are still to be sent."""

    log: int
    offset: int
    end: int


@dataclass(slots=True)
class _Reader:
    """State of one asker: the logs by the numbers that it received, beginning at `first`."""

    active_at: float
    first: int
    logs: list[LogFile]
    entries: deque[int] = field(default_factory=deque[int])
    ranges: deque[_Range] = field(default_factory=deque[_Range])
    opened: tuple[int, OpenFile] | None = None

    def close(self) -> None:
        if self.opened is not None:
            self.opened[1].close()
            self.opened = None


class LogServer:
    """Sends the logs in a folder of a tree, which are in <day>/<log>/Data.lsf with any suffix.

    They are numbered without gaps from the oldest on, as stations expect it; an asker's numbers stay the same until it
    asks for the list again. A log that grows is sent as long as it was when it was listed.
    """

    def __init__(self, tree: VirtualFiles, folder: bytes, *, timeout: float = 60.0):
        self._tree = tree
        self._folder = folder
        self._timeout = timeout
        self._readers: dict[Hashable, _Reader] = {}
        self._logs: list[LogFile] = []
        self._found: float | None = None
        self._handlers: Mapping[str, Callable[[_Reader, Mapping[str, Any]], None]] = {
            "LOG_REQUEST_LIST": self._list,
            "LOG_REQUEST_DATA": self._read,
            "LOG_REQUEST_END": self._end,
        }

    def receive(self, asker: Hashable, name: str, values: Mapping[str, Any], now: float, *, first: int = 0) -> None:
        """A message of a station; `next_message` has the answers.

        Logs are numbered from `first` on: 1 for ArduPilot's.
        """
        handler = self._handlers.get(name)
        if handler is None:
            return
        self.forget_silent(now)
        reader = self._readers.get(asker)
        if reader is None or reader.first != first or (name == "LOG_REQUEST_LIST" and values["start"] <= first):
            reader = self._meet(asker, first, now)
        reader.active_at = now
        handler(reader, values)

    def is_busy(self, asker: Hashable) -> bool:
        """Whether `next_message` has something for an asker."""
        reader = self._readers.get(asker)
        return reader is not None and bool(reader.entries or reader.ranges)

    def next_message(self, asker: Hashable, now: float) -> tuple[str, Fields] | None:
        """Name and fields of the next message for an asker: LOG_ENTRY or LOG_DATA; None if there is none."""
        reader = self._readers.get(asker)
        if reader is None:
            return None
        if reader.entries:
            return "LOG_ENTRY", self._entry(reader, reader.entries.popleft())
        if not reader.ranges:
            return None
        reader.active_at = now
        wanted = reader.ranges[0]
        offset, count = wanted.offset, min(CHUNK, wanted.end - wanted.offset)
        data = self._data(reader, wanted.log, offset, count)
        wanted.offset += len(data)
        if len(data) < count or wanted.offset >= wanted.end:
            reader.ranges.popleft()
        number = reader.first + wanted.log
        return "LOG_DATA", {"id": number, "ofs": offset, "count": len(data), "data": data.ljust(CHUNK, b"\0")}

    def forget_silent(self, now: float) -> None:
        for asker, reader in list(self._readers.items()):
            if reader.active_at < now - self._timeout:
                self._readers.pop(asker).close()

    def close(self) -> None:
        for reader in self._readers.values():
            reader.close()
        self._readers.clear()

    def _meet(self, asker: Hashable, first: int, now: float) -> _Reader:
        """A new list for an asker, in place of its former one, or of that of the longest silent asker."""
        if asker not in self._readers and len(self._readers) >= MOST_ASKERS:
            self._readers.pop(min(self._readers, key=lambda key: self._readers[key].active_at)).close()
        if self._found is None or not 0.0 <= now - self._found < FRESH:
            latest = list(islice(self._latest_first(), MOST_LOGS))
            self._logs, self._found = latest[::-1], now
        if asker in self._readers:
            self._readers[asker].close()
        reader = self._readers[asker] = _Reader(now, first, self._logs)
        return reader

    def _list(self, reader: _Reader, values: Mapping[str, Any]) -> None:
        reader.entries.clear()
        if not reader.logs:
            reader.entries.append(0)  # reports that there are none
            return
        low, high = max(values["start"] - reader.first, 0), min(values["end"] - reader.first, len(reader.logs) - 1)
        reader.entries.extend(range(low, high + 1))

    def _read(self, reader: _Reader, values: Mapping[str, Any]) -> None:
        number, offset = values["id"] - reader.first, values["ofs"]
        if not 0 <= number < len(reader.logs):
            return
        if reader.ranges and reader.ranges[0].log != number:
            reader.ranges.clear()
        end = offset + min(values["count"], LONGEST_RANGE)
        waiting = any(known.offset <= offset and end <= known.end for known in reader.ranges)
        if not waiting and len(reader.ranges) < MOST_RANGES:
            reader.ranges.append(_Range(number, offset, end))

    def _end(self, reader: _Reader, values: Mapping[str, Any]) -> None:
        reader.ranges.clear()
        reader.entries.clear()
        reader.close()

    def _entry(self, reader: _Reader, number: int) -> Fields:
        count = len(reader.logs)
        if not count:
            return {"id": 0, "num_logs": 0, "last_log_num": 0, "time_utc": 0, "size": 0}
        log = reader.logs[number]
        return {
            "id": reader.first + number,
            "num_logs": count,
            "last_log_num": reader.first + count - 1,
            "time_utc": log.time,
            "size": log.size,
        }

    def _data(self, reader: _Reader, number: int, offset: int, count: int) -> bytes:
        """Bytes of a log; none at its end, or if it cannot be read."""
        log = reader.logs[number]
        try:
            if reader.opened is None or reader.opened[0] != number:
                reader.close()
                reader.opened = number, self._tree.open(log.path)
            return reader.opened[1].read(offset, min(count, log.size - offset))
        except OSError:
            return b""

    def _latest_first(self) -> Iterator[LogFile]:
        for day in reversed(self._folders(self._folder)):
            for folder in reversed(self._folders(b"/".join((self._folder, day)))):
                log = self._log(b"/".join((self._folder, day, folder)), _began(day, folder))
                if log is not None:
                    yield log

    def _log(self, path: bytes, time: int | None) -> LogFile | None:
        """The log in a folder; None if there is none, or an empty one: stations do not take it."""
        try:
            files = [
                name for name, is_folder in self._tree.list_entry_names(path) if name.startswith(DATA) and not is_folder
            ]
            entry = next(self._tree.entries(path, files), None)
        except OSError:  # it was removed just now
            return None
        if entry is None or not entry.size:
            return None
        return LogFile(path + b"/" + entry.name, entry.size, entry.changed if time is None else time)

    def _folders(self, path: bytes) -> list[bytes]:
        try:
            return [name for name, is_folder in self._tree.list_entry_names(path) if is_folder]
        except OSError:
            return []


def _began(day: bytes, log: bytes) -> int | None:
    """Time at which a log began, by the names of its folders: <YYYYMMDD>/<HHMMSS>[_label]; None if they are others."""
    try:
        text = f"{day.decode('ascii')}{log[:6].decode('ascii')}"
        return int(datetime.strptime(text, "%Y%m%d%H%M%S").replace(tzinfo=UTC).timestamp())
    except ValueError:
        return None
