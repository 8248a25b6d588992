"""The keys of signed links, each in a file, and the time of signatures, which a restart does not set back."""

import os
from contextlib import suppress
from pathlib import Path

from mavlink import LinkUrl, Signing, SigningTime, parse_link_url, read_key
from runtime import Task
from support.atomic_files import write_file
from support.file_errors import add_path_to_errors, describe_os_error
from support.log_limit import ReportLimit
from tasks.transports.imc_links.sockets import network_time_scale

SYNC_PERIOD = 5.0  # s
AHEAD = 60.0  # s, of a clock that is behind: more than was not on the disk when the power failed
DIGITS = 20  # of a time in the file, always as many, so that one write replaces it
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
    """Reads the keys of a task's links; links with the same key share what they have received.

    The time is kept in the vehicle's state folder: a clock that was never set does not repeat times that were used.
    That of an accepted frame is written before the frame has an effect: the process may be killed at any moment.
    """

    def __init__(self, task: Task):
        self._task = task
        self._file = _TimeFile(task.vehicle.state_folder / task.system_name / "MAVLink time")
        self._speed, self._start = network_time_scale(task), task.vehicle.start_time
        self._signings: dict[bytes, Signing] = {}
        self._readable, self._unsaved = ReportLimit(), ReportLimit()
        self._time: SigningTime | None = None
        self._due = 0.0

    def signing(self, path: str) -> Signing:
        """The signatures with the key in a file. Raises ValueError with the reason if it cannot be used."""
        try:
            file = Path(path).expanduser()
            key = read_key(file)
            if os.name == "posix" and file.stat().st_mode & OTHERS and self._readable.is_due(path):
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
            self._time is not None
            and not self._task.vehicle.has_virtual_time
            and now >= self._due
            and self._file.is_older_than(self._time.latest)
        ):
            self._due = now + SYNC_PERIOD * self._speed
            self._keep(self._time.latest)
            self._task.offload(self._file.sync, then=self._report)

    def close(self) -> None:
        if self._time is not None and not self._task.vehicle.has_virtual_time:
            self._keep(self._time.latest)
            self._report(self._file.sync())
        self._file.close()

    def _begin(self) -> SigningTime:
        if self._task.vehicle.has_virtual_time:
            return SigningTime(self._now)
        try:
            saved = self._file.read()
        except (OSError, ValueError) as error:
            saved = 0
            reason = describe_os_error(error) if isinstance(error, OSError) else error
            text = "earlier frames could be repeated to this vehicle, unless its clock is right"
            self._task.log.error(f"the time of the last signature is unknown: {reason}: {text}")
        time = SigningTime(self._now, saved, saved, self._keep)
        if saved >= time.now:  # the clock is behind: the times used since then are unknown
            time = SigningTime(self._now, saved + round(AHEAD * TICKS), saved, self._keep)
        return time

    def _keep(self, time: int) -> None:
        self._report(self._file.write(time))

    def _now(self) -> float:
        """The time of others: on a scaled clock the vehicle's own passes faster."""
        return self._start + (self._task.now - self._start) / self._speed

    def _report(self, error: OSError | None) -> None:
        if error is not None and self._unsaved.is_due():
            self._task.log.error(f"the time of signatures cannot be saved: {error.filename}: {error.strerror}")


class _TimeFile:
    """The latest time that was used, in a file; it never becomes less. Methods return what prevents them."""

    def __init__(self, path: Path):
        self._path = path
        self._descriptor = -1
        self._written = self._synced = 0

    def read(self) -> int:
        """0 if there is no file. Raises OSError, ValueError, which name it."""
        try:
            with add_path_to_errors(self._path):
                return max(0, int(self._path.read_bytes()[:DIGITS]))
        except FileNotFoundError:
            return 0
        except ValueError:
            raise ValueError(f"{self._path}: holds no time") from None

    def is_older_than(self, time: int) -> bool:
        """Whether a time is later than what is on the disk."""
        return time > self._synced

    def write(self, time: int) -> OSError | None:
        """Replace the time by a later one: the system has it then, also if the process is killed."""
        try:
            if self._descriptor < 0:
                if not self._path.exists():
                    write_file(self._path, b"%0*d\n" % (DIGITS, 0))
                self._descriptor = os.open(self._path, os.O_RDWR)
            os.lseek(self._descriptor, 0, os.SEEK_SET)
            if time > _parsed(os.read(self._descriptor, DIGITS)):  # another task may have written, too
                os.lseek(self._descriptor, 0, os.SEEK_SET)
                os.write(self._descriptor, b"%0*d\n" % (DIGITS, time))
            self._written = time
        except OSError as error:
            return error if error.filename else OSError(error.errno, error.strerror, str(self._path))
        return None

    def sync(self) -> OSError | None:
        """Put what was written on the disk, where it is also if the power fails."""
        if self._descriptor < 0:
            return None
        time = self._written
        try:
            os.fsync(self._descriptor)
        except OSError as error:
            return OSError(error.errno, error.strerror, str(self._path))
        self._synced = time
        return None

    def close(self) -> None:
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def _parsed(content: bytes) -> int:
    """The time in a file; 0 if there is none."""
    with suppress(ValueError):
        return max(0, int(content))
    return 0
