"""The logs of a vehicle, over the FTP server that it announces."""

import asyncio
import re
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import imc
from imc.discovery import PERIOD, Endpoint, Services
from runtime.problem import naming
from shoal.network.link import NetworkError
from shoal.network.network import Network, NoAnswer
from shoal.network.systems import System

if TYPE_CHECKING:
    from ftplib import FTP

PATIENCE = 10.0  # s of silence of the server
BLOCK = 1 << 16  # bytes
MOST_LOGS = 10000
PART = ".part"
CURE = "pip install 'shoal[ftp]' on its computer, and start it again"
_NAME = re.compile(r"[^/\\\0]{1,200}")


@dataclass(frozen=True)
class RemoteLog:
    """A log on the vehicle: its name is date and time, such as 20260101/120000_survey; sizes in bytes by file."""

    name: str
    files: dict[str, int]

    @property
    def size(self) -> int:
        return sum(self.files.values())  # integers


class Logs:
    """The logs of one vehicle."""

    def __init__(self, network: Network, system: System) -> None:
        self._network = network
        self._system = system

    async def list(self) -> list[RemoteLog]:
        """All logs, the oldest first. Raises NetworkError if the vehicle serves none."""
        place = await self._place()
        return await asyncio.to_thread(all_logs, place)

    async def fetch(self, log: RemoteLog, folder: Path, progress: Callable[[int], object] = lambda _: None) -> Path:
        """Copy a log into a folder, below the name of the vehicle; returns where it is.

        What is there already is not transferred again, also a part of a file, if its first and its last 64 KiB are as
        they are there; else it is transferred from the beginning. `progress` gets the number of bytes of
        each step, in another thread. Raises NetworkError, and OSError for the folder.
        """
        place = await self._place()
        target = folder / self._system.name / log.name
        await asyncio.to_thread(_fetch, place, log, target, progress)
        return target

    async def _place(self) -> Endpoint:
        """Where the vehicle serves its logs: it says so in its Announce, every 10 s."""
        self._network.want(self._system, (imc.Announce,))
        deadline = time.monotonic() + 1.2 * PERIOD
        while (left := deadline - time.monotonic()) > 0.0:
            # Of several entities: the log begins with an Announce of the vehicle, too.
            texts = [announce.services for announce in self._system.all_of(imc.Announce)]
            for place in (place for text in texts for place in Services.parse(text).endpoints("ftp")):
                return place
            try:
                await self._network.next(self._system, imc.Announce, left, takes_old=True)
            except NoAnswer:
                break
        raise NetworkError(f"{self._system.name} serves no logs: Transports.FTP does not run there; {CURE}")


@contextmanager
def _session(place: Endpoint) -> Generator["FTP"]:
    """A session with a server; what goes wrong in it is a NetworkError."""
    import ftplib  # slow to import, and few need it

    try:
        with ftplib.FTP(timeout=PATIENCE) as session:
            session.connect(place.address, place.port)
            session.login()
            session.voidcmd("TYPE I")
            yield session
    except (*ftplib.all_errors, ValueError) as error:  # the latter: a name that is not UTF-8, or an answer that is odd
        if isinstance(error, OSError) and error.filename is not None:
            raise  # of our own disk
        raise NetworkError(f"the server of logs at {place}: {error}") from None


def all_logs(place: Endpoint) -> list[RemoteLog]:
    """The logs that a server has, the oldest first. Raises NetworkError."""
    found: list[RemoteLog] = []
    with _session(place) as session:
        for day in names_in(session, "", "dir"):
            for log in names_in(session, f"/{day}", "dir"):
                files = names_in(session, f"/{day}/{log}", "file")
                found.append(RemoteLog(f"{day}/{log}", files))
                if len(found) >= MOST_LOGS:
                    return found
    return sorted(found, key=lambda log: log.name)


def names_in(session: "FTP", folder: str, kind: str) -> dict[str, int]:
    """Names and sizes in a folder. A server may say anything: a name must not lead elsewhere on this computer."""
    found: dict[str, int] = {}
    for name, facts in session.mlsd(folder or "/"):
        if facts.get("type") == kind and _NAME.fullmatch(name) and name not in (".", ".."):
            size = facts.get("size", "0")
            found[name] = int(size) if size.isdecimal() else 0
    return dict(sorted(found.items()))


def _agrees(session: "FTP", source: str, part: Path, size: int) -> bool:
    """Whether a file is the beginning of one of the server, as far as its first and last piece tell."""
    if not size:
        return True
    with part.open("rb") as ours:
        for start in {0, max(0, size - BLOCK)}:
            ours.seek(start)
            piece = ours.read(BLOCK)
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


def _fetch(place: Endpoint, log: RemoteLog, target: Path, progress: Callable[[int], object]) -> None:
    target.mkdir(parents=True, exist_ok=True)
    with _session(place) as session:
        for name, size in log.files.items():
            final, part = target / name, target / (name + PART)
            if final.exists():
                if final.stat().st_size >= size:
                    progress(size)
                    continue
                final.rename(part)  # a log that was being written: what is there is its beginning
            source = f"/{log.name}/{name}"
            done = part.stat().st_size if part.exists() else 0
            if done > size or not _agrees(session, source, part, done):
                part.unlink()
                done = 0
            progress(done)
            with part.open("ab", buffering=0) as out:

                def write(block: bytes) -> None:
                    rest = memoryview(block)
                    with naming(out.name):  # an error without a file would be the server's
                        while rest:
                            rest = rest[out.write(rest) :]
                    progress(len(block))

                session.retrbinary(f"RETR {source}", write, BLOCK, rest=done or None)
            part.rename(final)
