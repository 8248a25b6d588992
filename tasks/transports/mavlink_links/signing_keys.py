"""The keys of signed links, each in a file, and the time of signatures, which a restart does not set back."""

import os
from contextlib import suppress
from pathlib import Path

from mavlink import LinkUrl, Signing, SigningTime, parse_link_url, read_key
from runtime import Task
from support.atomic_files import write_file
from tasks.transports.imc_links.sockets import network_time_scale

SAVE_PERIOD = 60.0  # s
TICKS = 100_000  # per second
OTHERS = 0o077  # what others than the owner may do with a file


def parse_checked_link_url(text: str) -> LinkUrl:
    """`parse_link_url`, which also reads the key. Raises ValueError."""
    url = parse_link_url(text)
    if url.key:
        try:
            read_key(Path(url.key).expanduser())
        except (OSError, ValueError, RuntimeError) as error:
            raise ValueError(f"{url.text}: {_reason(url.key, error)}") from None
    return url


def _reason(path: str, error: Exception) -> str:
    return f"the key {path} cannot be used: {getattr(error, 'strerror', '') or error}"


class SigningKeys:
    """Reads the keys of a task's links; links with the same key share what they have heard.

    The time is kept in the vehicle's state folder: a clock that was never set does not repeat times that were used.
    """

    def __init__(self, task: Task):
        self._task = task
        self._file = task.vehicle.state_folder / task.system_name / "MAVLink time"
        self._speed, self._start = network_time_scale(task), task.vehicle.start_time
        self._signings: dict[bytes, Signing] = {}
        self._reported: set[str] = set()
        self._time: SigningTime | None = None
        self._saved, self._due = 0, 0.0

    def signing(self, path: str) -> Signing:
        """The signatures with the key in a file. Raises ValueError with the reason if it cannot be used."""
        try:
            file = Path(path).expanduser()
            key = read_key(file)
            if path not in self._reported and os.name == "posix" and file.stat().st_mode & OTHERS:
                self._reported.add(path)
                self._task.log.warning(f"other users of this computer can read the key: chmod 600 {path}")
        except (OSError, ValueError, RuntimeError) as error:
            raise ValueError(_reason(path, error)) from None
        if self._time is None:
            self._time = self._begin()
        if key not in self._signings:
            self._signings[key] = Signing(key, self._time)
        return self._signings[key]

    def tick(self, now: float) -> None:
        """Save the time now and then; a disk that is full is reported, and costs nothing else."""
        if (
            self._time is None
            or self._task.vehicle.has_virtual_time
            or now < self._due
            or self._time.latest == self._saved
        ):
            return
        self._due = now + SAVE_PERIOD * self._speed
        self._saved = self._time.latest
        self._task.offload(_save, self._file, self._saved, then=self._report)

    def close(self) -> None:
        if self._time is not None and not self._task.vehicle.has_virtual_time:
            _save(self._file, self._time.latest)

    def _begin(self) -> SigningTime:
        saved = 0
        if not self._task.vehicle.has_virtual_time:
            with suppress(OSError, ValueError):
                saved = int(self._file.read_bytes()[:20])
        time = SigningTime(self._now, known=saved)
        if saved >= time.now:  # the clock is behind: no telling how many times were used since then
            time = SigningTime(self._now, saved + round(SAVE_PERIOD * TICKS), saved)
        return time

    def _now(self) -> float:
        """The time of others: on a scaled clock the vehicle's own passes faster."""
        return self._start + (self._task.now - self._start) / self._speed

    def _report(self, error: OSError | None) -> None:
        if error is not None and "" not in self._reported:
            self._reported.add("")
            self._task.log.error(f"the time of signatures cannot be saved: {error.filename}: {error.strerror}")


def _save(file: Path, time: int) -> OSError | None:
    """Write the time, completely or not at all; returns what prevents it."""
    try:
        write_file(file, b"%d\n" % time)
    except OSError as error:
        return error
    return None
