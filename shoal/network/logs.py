"""The logs of a vehicle, over the FTP server that it announces."""

import asyncio
import os
import re
import time
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import imc
from imc.discovery import PERIOD, Endpoint, Services
from shoal.network.link import NetworkError, NoAnswer
from shoal.network.network import Network
from shoal.network.system_table import NetworkSystem
from support.file_errors import add_path_to_errors
from support.terminal_text import quoted

if TYPE_CHECKING:
    from ftplib import FTP

PATIENCE = 20.0  # s of silence of the server; TCP doubles its pauses when packets get lost
SHORT = 3.0  # s for a connection, while there is another address to try
BLOCK = 1 << 16  # bytes
LONGEST_ANSWER = 32 << 20  # bytes of an answer or a list of files
MOST_LOGS = 10000
PART = ".part"
OTHER = ".other"
CURE = "pip install 'shoal[ftp]' on its computer, and start it again"
_NAME = re.compile(r"[^/\\\0]{1,200}")
_ADDRESS = re.compile(r"\d+\.\d+\.\d+\.\d+")


class RemoteFile(NamedTuple):
    """A file as a server describes it: its size in bytes, and when it was changed last (s since 1970; 0 if unknown)."""

    size: int = 0
    changed: float = 0.0


@dataclass(frozen=True)
class RemoteLog:
    """A log on the vehicle: its name is date and time, such as 20260101/120000_survey.

    files: sizes in bytes by file. changed: when they were changed last, in whole s since 1970; 0 where that is unknown.
    """

    name: str
    files: dict[str, int]
    changed: dict[str, float] = field(default_factory=dict[str, float])

    @property
    def size(self) -> int:
        return sum(self.files.values())  # integers


class AsyncRemoteLogs:
    """The logs of one vehicle."""

    def __init__(self, network: Network, system: NetworkSystem) -> None:
        self._network = network
        self._system = system

    async def list(self) -> list[RemoteLog]:
        """All logs, the oldest first. Raises NetworkError if the vehicle serves none."""
        places = await self._places()
        return await asyncio.to_thread(list_logs, places)

    async def fetch(self, log: RemoteLog, folder: Path, progress: Callable[[int], object] = lambda _: None) -> Path:
        """Copy a log into a folder, below the name of the vehicle; returns where it is.

        What is there already is not transferred again, also a part of a file, if size and date, or its first and its
        last 64 KiB, are as they are there; else it is transferred from the beginning, and a whole file that differs is
        kept with .other behind its name. `progress` gets the number of bytes of each step, in another thread. Raises
        NetworkError, and OSError for the folder.
        """
        if not _is_name(self._system.name):  # a stranger may announce any
            raise NetworkError(f"{quoted(self._system.name)} cannot be the name of a folder: no log of it is fetched")
        places = await self._places()
        target = folder / self._system.name / log.name
        await asyncio.to_thread(fetch_log, places, log, target, progress)
        return target

    async def _places(self) -> Sequence[Endpoint]:
        """The servers of the vehicle's logs, as it announces them every 10 s; first the source of its packets."""
        self._network.subscribe(self._system, (imc.Announce,))
        deadline = time.monotonic() + 1.2 * PERIOD
        while (left := deadline - time.monotonic()) > 0.0:
            # Of several entities: the log begins with an Announce of the vehicle, too.
            texts = [announce.services for announce in self._system.latest_entity_messages(imc.Announce)]
            if places := [place for text in texts for place in Services.parse(text).endpoints("ftp")]:
                near = set(_ADDRESS.findall(" ".join(self._system.addresses)))
                return sorted(dict.fromkeys(places), key=lambda place: place.address not in near)
            try:
                await self._network.next_message(self._system, imc.Announce, left, takes_old=True)
            except NoAnswer:
                break
        raise NetworkError(f"{self._system.name} serves no logs: Transports.FTP does not run there; {CURE}")


@contextmanager
def _session(places: Sequence[Endpoint]) -> Generator["FTP"]:
    """A session with a server, at the first of its addresses that answers; what goes wrong in it is a NetworkError."""
    import ftplib  # slow to import, and few need it

    class BoundedFTP(ftplib.FTP):
        """A session that takes no answer or list without end."""

        taken = 0

        def putcmd(self, line: str) -> None:
            self.taken = 0
            super().putcmd(line)

        def count(self, line: str) -> str:
            self.taken += len(line)
            if self.taken > LONGEST_ANSWER:
                self.close()
                raise ftplib.error_proto(f"its answer is longer than {LONGEST_ANSWER >> 20} MiB")
            return line

        def getline(self) -> str:
            return self.count(super().getline())

        def retrlines(self, cmd: str, callback: Callable[[str], object] | None = None) -> str:
            take = callback or print
            return super().retrlines(cmd, lambda line: take(self.count(line)))

    place = places[0]
    try:
        with BoundedFTP(timeout=PATIENCE) as session:
            for place in places:
                is_last = place == places[-1]
                try:
                    session.connect(place.address, place.port, PATIENCE if is_last else SHORT)
                except OSError:
                    if is_last:
                        raise
                    continue
                break
            session.timeout = PATIENCE
            assert session.sock is not None  # it is connected
            session.sock.settimeout(PATIENCE)
            session.login()
            session.voidcmd("TYPE I")
            yield session
    except (*ftplib.all_errors, ValueError) as error:  # the latter: a name that is not UTF-8, or an answer that is odd
        if isinstance(error, OSError) and error.filename is not None:
            raise  # of our own disk
        where = ", ".join(map(str, places[: places.index(place) + 1]))
        raise NetworkError(f"the server of logs at {where}: {error}") from None


def list_logs(places: Sequence[Endpoint]) -> list[RemoteLog]:
    """The logs that a server has, the oldest first. Raises NetworkError."""
    found: list[RemoteLog] = []
    with _session(places) as session:
        if (at_once := list_logs_at_once(session)) is not None:
            return at_once
        for day in list_folder(session, "", "dir"):
            for log in list_folder(session, f"/{day}", "dir"):
                files = list_folder(session, f"/{day}/{log}", "file")
                sizes = {name: facts.size for name, facts in files.items()}
                changed = {name: facts.changed for name, facts in files.items()}
                found.append(RemoteLog(f"{day}/{log}", sizes, changed))
                if len(found) >= MOST_LOGS:
                    return found
    return sorted(found, key=lambda log: log.name)


def list_logs_at_once(session: "FTP") -> list[RemoteLog] | None:
    """The logs that a server of Shoal lists in one answer; None if it does not."""
    import ftplib

    try:
        first, *lines = session.sendcmd("SITE TREE").splitlines()
    except ftplib.error_perm:
        return None
    if first != "211-":
        return None
    found: dict[str, RemoteLog] = {}
    for line in lines[:-1]:
        words, _, path = line.partition("; ")
        facts = {key: value for key, _, value in (each.partition("=") for each in words.strip().lower().split(";"))}
        parts = path.removeprefix("/").split("/")
        if not all(map(_is_name, parts)) or len(parts) != (3 if facts.get("type") == "file" else 2):
            continue
        log = found.setdefault("/".join(parts[:2]), RemoteLog("/".join(parts[:2]), {}))
        if len(parts) > 2:
            log.files[parts[2]], log.changed[parts[2]] = _facts(facts)
    return sorted(found.values(), key=lambda log: log.name)[:MOST_LOGS]


def list_folder(session: "FTP", folder: str, kind: str) -> dict[str, RemoteFile]:
    """The content of a folder, by name. A server may send anything: a name must not lead elsewhere on this computer."""
    found: dict[str, RemoteFile] = {}
    for name, facts in session.mlsd(folder or "/"):
        if facts.get("type") == kind and _is_name(name):
            found[name] = _facts(facts)
    return dict(sorted(found.items()))


def _is_name(name: str) -> bool:
    return bool(_NAME.fullmatch(name)) and name not in (".", "..")


def _facts(facts: Mapping[str, str]) -> RemoteFile:
    size = facts.get("size", "0")
    return RemoteFile(int(size) if size.isdecimal() else 0, _date(facts.get("modify", "")))


def _date(text: str) -> float:
    """A date of MLSD, such as 20260101120000, in UTC; 0 if it is none."""
    try:
        return datetime.strptime(text[:14], "%Y%m%d%H%M%S").replace(tzinfo=UTC).timestamp()
    except ValueError:
        return 0.0


def _agrees(session: "FTP", source: str, path: Path, size: int) -> bool:
    """Whether so much of a file is as on the server, as far as its first and last piece show."""
    if not size:
        return True
    with path.open("rb") as ours:
        for start in {0, max(0, size - BLOCK)}:
            ours.seek(start)
            piece = ours.read(min(BLOCK, size - start))
            if piece != _piece(session, source, start, len(piece)):
                return False
    return True


def _piece(session: "FTP", source: str, start: int, size: int) -> bytes:
    import ftplib

    with session.transfercmd(f"RETR {source}", start or None) as line, line.makefile("rb") as data:
        found = data.read(size)
    with suppress(ftplib.error_temp):  # 426: we did not wait for the rest
        session.voidresp()
    return found


def _retrieve(session: "FTP", source: str, start: int, end: int, write: Callable[[bytes], object]) -> None:
    """Take a file from one byte to another: a server may send more than it has announced, or without end."""
    import ftplib

    with session.transfercmd(f"RETR {source}", start or None) as line, line.makefile("rb") as data:
        while start < end and (block := data.read1(min(BLOCK, end - start))):
            write(block)
            start += len(block)
        has_more = start >= end and bool(data.read1(1))
    try:
        session.voidresp()
    except ftplib.error_temp:  # 426: we did not wait for the rest
        if not has_more:
            raise
    if start < end:
        raise ftplib.error_proto(f"{source} ended after {start} of {end} bytes")


def _is_there(session: "FTP", source: str, path: Path, size: int, changed: float) -> bool:
    """Whether we have all of a file. A part of it gets another name to be continued, so does a file that differs."""
    try:
        ours = path.stat()
    except FileNotFoundError:
        return False
    if ours.st_size == size and changed and int(ours.st_mtime) == int(changed):
        return True
    if not _agrees(session, source, path, min(size, ours.st_size)):
        path.replace(path.with_name(path.name + OTHER))
        return False
    if ours.st_size < size:  # a log that was being written: what is there is its beginning
        path.replace(path.with_name(path.name + PART))
        return False
    return True


def fetch_log(places: Sequence[Endpoint], log: RemoteLog, target: Path, progress: Callable[[int], object]) -> None:
    target.mkdir(parents=True, exist_ok=True)
    with _session(places) as session:
        for name, size in log.files.items():
            final, part, changed = target / name, target / (name + PART), log.changed.get(name, 0.0)
            source = f"/{log.name}/{name}"
            if _is_there(session, source, final, size, changed):
                progress(size)
                continue
            done = part.stat().st_size if part.exists() else 0
            if done > size or not _agrees(session, source, part, done):
                part.unlink()
                done = 0
            progress(done)
            with part.open("ab", buffering=0) as out:

                def write(block: bytes) -> None:
                    rest = memoryview(block)
                    with add_path_to_errors(out.name):  # an error without a file would be the server's
                        while rest:
                            rest = rest[out.write(rest) :]
                    progress(len(block))

                _retrieve(session, source, done, size, write)
            if changed:
                with suppress(OSError):  # some disks keep no dates; then the pieces are compared
                    os.utime(part, (changed, changed))
            part.replace(final)
