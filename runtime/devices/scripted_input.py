"""Input of a device in a test, in virtual time."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, cast

from runtime.kernel import SECOND, nanoseconds

PORTION = 64  # bytes of a recording without times that arrive at once

InputScript = bytes | str | Path | Iterable[tuple[float, bytes | str | None]]
"""Input that a device sends: bytes or text at the speed of the line, a file of such, or portions with their times.

Times are in s from the start of the device. None instead of a portion unplugs the device; the next portion plugs it in.
"""


class TimedData(NamedTuple):
    """Bytes that arrive at a time (ns from the start); None unplugs the device."""

    time: int
    data: bytes | None


class ScriptedInputs:
    """Recordings in place of devices: one for each, by name, or one for whichever is opened. `sent` is what tasks sent.

    `sent` has the name of the device and the bytes.
    """

    def __init__(self, recordings: InputScript | Mapping[str, InputScript]):
        self._by_name: Mapping[str, InputScript] = {}
        self._any: InputScript | None = None
        if isinstance(recordings, Mapping):
            self._by_name = cast(Mapping[str, InputScript], recordings)
        else:
            self._any = recordings
        self.sent: list[tuple[str, bytes]] = []
        self.end = 0  # ns since 1970; when the last piece arrives

    def input_for(self, name: str, speed: float) -> list[TimedData] | None:
        """The recording for the device `name`, which carries `speed` bytes/s; None if there is none."""
        found = self._by_name.get(name, self._any)
        return None if found is None else recording_to_timed_data(found, speed)


def recording_to_timed_data(recording: InputScript, speed: float) -> list[TimedData]:
    """A recording as portions in the order of time."""
    if isinstance(recording, Path):
        recording = recording.read_bytes()
    if isinstance(recording, bytes | str):
        data = _bytes(recording)
        places = range(0, len(data), PORTION)
        return [
            TimedData(round(min(at + PORTION, len(data)) / speed * SECOND), data[at : at + PORTION]) for at in places
        ]
    timed = [TimedData(nanoseconds(time), None if part is None else _bytes(part)) for time, part in recording]
    return sorted(timed, key=lambda piece: piece.time)


def _bytes(part: bytes | str) -> bytes:
    return part.encode() if isinstance(part, str) else bytes(part)
