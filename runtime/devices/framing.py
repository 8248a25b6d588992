"""Cuts what a device sends into lines and frames: no input or output, and bounded memory."""

import math
from collections.abc import Callable, Mapping
from typing import Protocol

LONGEST_LINE = 1024  # bytes
LONGEST_FRAME = 4096  # bytes

Size = Callable[[bytes], int | None]
"""Size of the frame at the beginning of some bytes; None if more bytes are needed, 0 if it is no frame."""


def parse_number(text: str) -> float:
    """A number that a device has written. Raises ValueError for what float() takes, too: nan, inf, 1e999 and 1_5."""
    value = float(text)
    if not math.isfinite(value) or "_" in text:
        raise ValueError(f"not a number: {text!r}")
    return value


class Splitter(Protocol):
    """Takes bytes in any portions, and gives complete pieces.

    `skipped_bytes` is how many are in none, `damaged` counts the pieces among them that could be recognized as such.
    """

    skipped_bytes: int
    damaged: int

    def reset(self, *, midway: bool) -> None:
        """Forget an unfinished piece. With `midway` the next bytes may be the end of a piece that began before."""
        ...

    def feed(self, data: bytes) -> list[bytes]:
        """The pieces that these bytes complete, in order."""
        ...

    @property
    def unfinished_bytes(self) -> int:
        """Bytes of an unfinished piece."""
        ...


class RawChunks:
    """Leaves every portion as it is, such as a datagram."""

    def __init__(self) -> None:
        self.skipped_bytes = self.damaged = 0

    @property
    def unfinished_bytes(self) -> int:
        return 0

    def reset(self, *, midway: bool) -> None:
        pass

    def feed(self, data: bytes) -> list[bytes]:
        return [data]


class LineSplitter:
    """Lines that end with `end`; carriage returns and spaces around them are removed, and empty lines left out.

    A line of more than `longest` bytes is skipped. If it begins midway, so is what comes before the first end: the
    second half of " 1500.123" is a number, too.
    """

    def __init__(self, *, longest: int = LONGEST_LINE, end: bytes = b"\n"):
        self.skipped_bytes: int = 0
        self.damaged: int = 0
        self._longest = longest
        self._end = end
        self._part = b""
        self._lost = False  # whether the line that is coming in is skipped

    @property
    def unfinished_bytes(self) -> int:
        return len(self._part)

    def reset(self, *, midway: bool) -> None:
        self.skipped_bytes += len(self._part)
        self._part, self._lost = b"", midway

    def feed(self, data: bytes) -> list[bytes]:
        first, *rest = (self._part + data).split(self._end)
        if not rest:
            self._keep(first)
            return []
        complete = [b"" if self._lost else first, *rest[:-1]]
        if self._lost:
            self.skipped_bytes += len(first)
        self._part, self._lost = b"", False
        self._keep(rest[-1])
        found: list[bytes] = []
        for line in complete:
            if len(line) > self._longest:
                self.skipped_bytes += len(line)
                self.damaged += 1
            elif line := line.strip():
                found.append(line)
        return found

    def _keep(self, part: bytes) -> None:
        """Wait for the end of a line, but not for that of one that is too long: only what may begin an end is kept."""
        if self._lost or len(part) > self._longest:
            self.damaged += not self._lost
            kept = len(self._end) - 1
            self.skipped_bytes += max(0, len(part) - kept)
            part, self._lost = part[len(part) - kept :] if kept else b"", True
        self._part = part


class FrameSplitter:
    """Frames that begin with certain bytes.

    `kinds` has, for the first bytes of each kind of frame, a function that returns its size. `valid` returns whether a
    frame is undamaged; else its first byte is skipped, and the search continues at the second, so that no good frame is
    lost in a damaged one. Frames have at most `longest` bytes.
    """

    def __init__(
        self,
        kinds: Mapping[bytes, Size],
        *,
        valid: Callable[[bytes], bool] = lambda _: True,
        longest: int = LONGEST_FRAME,
    ):
        if not kinds or not all(kinds):
            raise ValueError("a frame begins with at least one byte")
        self.skipped_bytes: int = 0
        self.damaged: int = 0
        self._kinds = dict(kinds)
        self._valid = valid
        self._longest = longest
        self._data = b""

    @property
    def unfinished_bytes(self) -> int:
        return len(self._data)

    def reset(self, *, midway: bool) -> None:
        self.skipped_bytes += len(self._data)
        self._data = b""

    def feed(self, data: bytes) -> list[bytes]:
        data, at, found = self._data + data, 0, list[bytes]()
        places = {mark: -1 for mark in self._kinds}
        while at < len(data):
            for mark, place in places.items():  # each part of the data is searched once for each mark
                if place < at:
                    place = data.find(mark, at)
                    places[mark] = place if place >= 0 else len(data)
            mark = min(places, key=places.__getitem__)
            start = places[mark]
            if start == len(data):
                start -= self._begun(data, at)
                self.skipped_bytes += start - at
                at = start
                break
            self.skipped_bytes += start - at
            at = start
            size = self._size(mark, data, start)
            if size is None:
                break
            frame = data[at : at + size]
            if size and self._valid(frame):
                found.append(frame)
                at += size
            else:
                self.damaged += size > 0
                self.skipped_bytes += 1
                at += 1
        self._data = data[at:]
        return found

    def _size(self, mark: bytes, data: bytes, start: int) -> int | None:
        """The size of the frame that may begin at `start`: None if more bytes are needed, 0 if it is none."""
        head = data[start : start + self._longest]
        size = self._kinds[mark](head)
        if size is None:
            return None if len(head) < self._longest else 0
        if not 0 < size <= self._longest:
            return 0
        return size if size <= len(head) else None

    def _begun(self, data: bytes, at: int) -> int:
        """The number of last bytes that may be the first ones of a mark."""
        counts = [n for mark in self._kinds for n in range(1, len(mark)) if data.endswith(mark[:n], at)]
        return max(counts, default=0)


def line_size_function(longest: int = LONGEST_LINE) -> Size:
    """The size of a frame that is a line: up to and with the line feed."""

    def size(head: bytes) -> int | None:
        end = head.find(b"\n", 0, longest)
        return end + 1 if end >= 0 else None if len(head) < longest else 0

    return size
