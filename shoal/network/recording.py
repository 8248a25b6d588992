"""Records what a console receives from vehicles: a log for each."""

import asyncio
import math
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from itertools import chain, count
from pathlib import Path
from typing import Any

import imc
from imc.lsf import LsfWriter, gzip_schema
from shoal.network.message_listener import MessageListener
from shoal.network.network import Network
from shoal.network.system_table import NetworkSystem
from support.atomic_files import sync_path
from support.file_errors import add_path_to_errors
from support.file_names import file_name_of

DATA = "Data.lsf.gz"
SCHEMA = "IMC.xml.gz"
BLOCK = 1 << 15  # unpacked bytes of a compressed block, which a full disk loses as a whole
FLUSH = 1.0  # s; what a killed process may lose
OVERHEAD = 64  # bytes of a compressed block beside its contents
LOOK = 0.2  # s between looks for new vehicles
AGAIN = 1.5  # s between questions for the labels of entities
QUESTIONS = 8
LATEST = 253402300800.0  # s since 1970: the year 10000


class VehicleRecording:
    """The log of one vehicle; times are in s since 1970 UTC. Raises OSError.

    `count`, `first` and `last` are of the messages that the log has: not of those that a full disk did not take.
    The file can be read at any time, also after the process was killed, or the disk is full.
    """

    def __init__(self, folder: Path, schema: imc.Schema) -> None:
        self.folder = folder
        self.pending: int = 0
        self.has_name: bool = False
        self.count: int = 0
        self.first: float = math.nan
        self.last: float = math.nan
        self._received: tuple[int, float, float] = (0, math.nan, math.nan)
        definitions = gzip_schema(schema)
        self._beside = len(definitions)
        folder.mkdir(parents=True)
        try:
            with add_path_to_errors(folder / SCHEMA):
                (folder / SCHEMA).write_bytes(definitions)
            self._writer = LsfWriter(folder / DATA, block=BLOCK)
        except OSError:
            with suppress(OSError):
                (folder / SCHEMA).unlink(missing_ok=True)
                folder.rmdir()
            raise

    @property
    def size(self) -> int:
        """Bytes on the disk, and at most those of what is not written yet."""
        return self._beside + self._writer.size + (self.pending + OVERHEAD if self.pending else 0)

    def write(self, message: imc.Message, packet: bytes) -> None:
        """Add a packet; it is on the disk after the next `flush`, or earlier."""
        self.pending += len(packet)
        self.has_name |= isinstance(message, imc.Announce)
        count, first, last = self._received
        if 0.0 < message.timestamp < LATEST:  # one that is no time does not hide the others
            first = message.timestamp if math.isnan(first) else min(first, message.timestamp)
            last = message.timestamp if math.isnan(last) else max(last, message.timestamp)
        self._received = count + 1, first, last
        size = self._writer.size
        self._writer.write(packet)
        if self._writer.size > size:
            self._note_written()

    def flush(self) -> None:
        """Hand all packets to the operating system."""
        self._writer.flush()
        self._note_written()

    def close(self) -> None:
        """Flush and close; then the log is on the disk, also if the power fails."""
        self._writer.close()
        self._note_written()
        for path in (self.folder / DATA, self.folder / SCHEMA, self.folder, self.folder.parent):
            sync_path(path)

    def _note_written(self) -> None:
        self.count, self.first, self.last = self._received
        self.pending = 0


class RecordingEnd(Exception):
    """The reason why a recording has ended too early."""


class NetworkRecorder:
    """Records vehicles below a folder, each in a folder of its own, until `stop` is set or `limit` bytes are reached.

    `wants` decides by its name whether a vehicle is recorded, also one that appears later. Packets are written as they
    came, once, also if they came over several networks. `report` gets the name and the folder of each vehicle when its
    log begins.
    """

    def __init__(
        self,
        network: Network,
        folder: Path,
        wants: Callable[[str], bool],
        kinds: Collection[type[imc.Message]] = (),
        *,
        limit: float = math.inf,
        report: Callable[[str, Path], object] = lambda _, __: None,
    ) -> None:
        self.recordings: dict[str, VehicleRecording] = {}
        self.lost: dict[str, int] = {}
        self.stop: asyncio.Event = asyncio.Event()
        self._network, self._folder, self._wants = network, folder, wants
        self._kinds = (*kinds, imc.Announce, imc.EntityInfo, imc.EntityList) if kinds else ()
        self._limit, self._report = limit, report
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._listeners: dict[str, MessageListener] = {}

    async def run(self, duration: float | None = None) -> None:
        """Record until the end. Raises RecordingEnd at the limit, OSError if the disk does not take more.

        All logs are closed afterward.
        """
        looking = asyncio.create_task(self._look())
        end = asyncio.create_task(self.stop.wait())
        try:
            deadline = math.inf if duration is None else time.monotonic() + duration
            while not end.done() and (left := deadline - time.monotonic()) > 0.0:
                waiting = {looking, end, *self._tasks.values()}
                done, _ = await asyncio.wait(waiting, timeout=min(left, FLUSH), return_when=asyncio.FIRST_COMPLETED)
                for task in done - {end}:
                    task.result()
                for recording in self.recordings.values():
                    recording.flush()
        finally:
            await self._close([looking, end, *self._tasks.values()])

    async def _close(self, tasks: list[asyncio.Task[Any]]) -> None:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        for name, listener in self._listeners.items():
            self._network.close_listener(listener)
            self.lost[name] = listener.lost
        failures: list[OSError] = []
        for recording in self.recordings.values():
            try:
                recording.close()
            except OSError as error:
                failures.append(error)
        if failures:
            raise failures[0]

    async def _look(self) -> None:
        """Begin to listen to vehicles as they appear."""
        while True:
            for system in self._network.vehicles():
                if system.name not in self._tasks and self._wants(system.name):
                    self._network.subscribe(system, (imc.Announce,))  # also the last one, if it is kept
                    self._listeners[system.name] = self._network.listen(system, self._kinds)
                    self._tasks[system.name] = asyncio.create_task(self._record(system))
            await asyncio.sleep(LOOK)

    async def _record(self, system: NetworkSystem) -> None:
        listener = self._listeners[system.name]
        asked_at, questions, has_labels = -math.inf, 0, False
        while True:
            now = time.monotonic()
            if not has_labels and questions < QUESTIONS and system.id is not None and now - asked_at > AGAIN:
                asked_at, questions = now, questions + 1
                self._network.send(system, imc.EntityList(op=imc.EntityList.Op.QUERY))
            try:
                _, message, packet = await listener.next_with_packet(AGAIN)
            except TimeoutError:
                continue
            if message.src not in system.ids:
                continue  # sent to it, not by it
            has_labels |= isinstance(message, imc.EntityList) and message.op == imc.EntityList.Op.REPORT
            self._write(system, message, packet)

    def _write(self, system: NetworkSystem, message: imc.Message, packet: bytes) -> None:
        recording = self.recordings.get(system.name)
        if recording is None:
            recording = self._begin(system)
        announce = None if recording.has_name else system.latest_message(imc.Announce)
        self._require_room(len(packet) + (0 if announce is None else len(imc.encode(announce))))
        if announce is not None:  # the log has the vehicle's name from it; it may be older than the log
            announce = announce.replace(timestamp=message.timestamp)
            recording.write(announce, imc.encode(announce))
        recording.write(message, packet)

    def _begin(self, system: NetworkSystem) -> VehicleRecording:
        name = file_name_of(system.name)
        own = name if system.id is None else f"{name}-{system.id:04X}"
        names = chain((name, own), (f"{own}-{number}" for number in count(2)))  # strangers may choose names alike
        folder = next(path for path in map(self._folder.joinpath, names) if not path.exists())
        self._require_room(len(gzip_schema(self._network.messages)) + OVERHEAD)
        recording = VehicleRecording(folder, self._network.messages)
        self.recordings[system.name] = recording
        self._report(system.name, recording.folder)
        return recording

    def _require_room(self, size: int) -> None:
        """Raise RecordingEnd if so many bytes more would be beyond the limit."""
        if sum(recording.size for recording in self.recordings.values()) + size + OVERHEAD > self._limit:  # integers
            raise RecordingEnd("the limit is reached")
