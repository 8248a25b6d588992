"""Records the messages of the bus to LSF logs, in DUNE's folder layout."""

import contextlib
import os
import re
from datetime import UTC, datetime
from pathlib import Path

import imc
from imc.lsf import COMPRESSIONS
from runtime import Entity, State, Task, consume, param
from runtime.problem import nearest, quoted
from tasks.transports.log_folder import LogFolder, definitions

MIB = 1 << 20
LONGEST_BACKLOG = 8 * MIB  # bytes, compressed, that wait while the disk refuses them
LONGEST_LABEL = 100  # bytes

Op = imc.LoggingControl.Op


def message_named(name: str) -> type[imc.Message]:
    """The message type `name`. Raises ValueError, with the closest name, if there is none."""
    schema = imc.builtin()
    if name in schema:
        return schema[name]
    near = nearest(name, (cls.__name__ for cls in imc.messages.BY_ID.values()))
    raise ValueError(f"there is no message {quoted(name)}" + (f"; did you mean {near}?" if near else ""))


class Logging(Task):
    """Records messages of all systems to <log root>/<vehicle>/<YYYYMMDD>/<HHMMSS>[_label]/ (UTC).

    A log begins with LoggingControl STARTED and, if closed normally, ends with STOPPED. LoggingControl requests start a
    new log (with a label), stop logging, and ask for the name of the log. On the first message of each own entity the
    task queries its EntityInfo, so that each log names its entities.
    """

    flush_interval: float = param(5.0, "s", "Longest time that messages wait in memory.", minimum=0.1)
    lsf_compression_method: str = param(
        "gzip",
        "",
        "Compression of Data.lsf.",
        name="LSF Compression Method",
        choices=("none", *COMPRESSIONS),
    )
    lsf_volume_size: int = param(
        0, "MiB", "Size of Data.lsf on disk that starts a new log; 0 means no limit.", name="LSF Volume Size", minimum=0
    )
    transports: list[str] = param([], "", "Names of the messages to record; empty records all.", usable=message_named)
    loopback_internal_messages: bool = param(True, "", "Record the messages of this task itself.", editable=False)

    transient = ("_folder", "_schema")

    def configure(self) -> None:
        schema = imc.builtin()
        names = {name for name in self.transports if name}
        self._unknown = sorted(name for name in names if name not in schema)
        self._wanted: set[type[imc.Message]] = {schema[name] for name in names.difference(self._unknown)}
        if names:
            self._wanted |= {imc.EntityInfo, imc.LoggingControl}
        self._limit = self.lsf_volume_size * MIB or float("inf")

    def start(self) -> None:
        self._folder: LogFolder | None = None
        self._name = self._label = self._trouble = ""
        self._asked: set[int] = set()  # own entities seen in this log
        self._recording, self._full, self._syncing, self._lost = True, False, 0, 0
        self._schema = definitions()
        if self._unknown:
            self.log.warning(f"Transports: no such message: {', '.join(self._unknown)}")
        self._open()
        self.after(self.flush_interval, self._tick)

    @property
    def folder(self) -> Path | None:
        """The folder of the current log."""
        return self._folder.path if self._folder is not None else None

    def restored(self) -> None:
        """Continue in a new log, with the usual first packets, but publish nothing."""
        self._folder, name = None, self._name
        self._schema = definitions()
        if self._recording:
            self._folder = self._new_folder()
            mark = imc.LoggingControl(op=Op.STARTED, name=name)
            self._folder.data.write(self._packet(mark, self.entity))
            for entity in self.vehicle.entities:
                if entity.id in self._asked:
                    info = imc.EntityInfo(id=entity.id, label=entity.label, component=entity.component)
                    self._folder.data.write(self._packet(info, entity))

    def stop(self) -> None:
        self._recording = False
        self._close()

    @consume(others=True, packets=True)
    def record(self, message: imc.Message, packet: bytes) -> None:
        """Append the packet to the log."""
        folder = self._folder
        if folder is None or self._full:
            self._lost += self._recording
            return
        kind = type(message)
        # Own marks are in the log already, see _mark.
        if (self._wanted and kind not in self._wanted) or (kind is imc.LoggingControl and self._is_mark(message)):
            return
        try:
            folder.data.write(packet)
        except OSError as error:
            self._fail(error)
        if message.src == self.system and message.src_ent not in self._asked:
            self._asked.add(message.src_ent)
            if kind is not imc.EntityInfo:
                self.publish(imc.QueryEntityInfo(id=message.src_ent, dst=self.system, dst_ent=message.src_ent))
        if folder.data.size >= self._limit:
            self._restart(self._label)

    @consume
    def note(self, entry: imc.LogBookEntry) -> None:
        """Append a line to the console log."""
        if self._folder is None or self._full:
            return
        kind = next((kind.name for kind in imc.LogBookEntry.Type if kind == entry.type), str(entry.type))
        line = f"{_utc(entry.timestamp)} {kind:8} [{entry.context}] {' '.join(entry.text.split())}\n"
        try:
            self._folder.text.write(line.encode(errors="surrogateescape"))
        except OSError as error:
            self._fail(error)

    @consume(others=True)
    def control(self, request: imc.LoggingControl) -> None:
        """Start a new log, stop, or reply with the name of the log, as requested by the own system or an operator."""
        if not self.concerns(request):
            return
        if request.op == Op.REQUEST_START:
            self._restart(clean_label(request.name))
        elif request.op == Op.REQUEST_STOP:
            self._recording = False
            self._close()
            self.set_entity_state(State.NORMAL, "stopped")
        elif request.op == Op.REQUEST_CURRENT_NAME:
            self.reply(request, imc.LoggingControl(op=Op.CURRENT_NAME, name=self._name))

    def _restart(self, label: str) -> None:
        self._close()
        self._recording, self._label = True, label
        self._open()

    def _open(self) -> None:
        name = self._begin()
        try:
            folder = self._new_folder()
        except OSError as error:
            self._fail(error)
            return
        # A virtual run must not depend on which folders exist, so it publishes the name without _2, _3 ...
        self._name = name if self.vehicle.virtual else folder.physical_name
        self._folder = folder
        self._asked.clear()
        self._mark(Op.STARTED)
        self._recover()

    def _begin(self) -> str:
        """Name of a log that begins now."""
        begin = datetime.fromtimestamp(self.now_ns // 1_000_000_000, UTC)
        return f"{begin:%Y%m%d/%H%M%S}" + (f"_{self._label}" if self._label else "")

    def _new_folder(self) -> LogFolder:
        root = self.vehicle.log_root / self.system_name
        configuration = self.vehicle.profile.dump().encode(errors="surrogateescape")
        return LogFolder(root, self._begin(), self.lsf_compression_method, self._schema, configuration)

    def _packet(self, message: imc.Message, entity: Entity) -> bytes:
        return imc.encode_as(message, self.now, self.system, entity.id, message.dst, message.dst_ent)

    def _close(self) -> None:
        """Close the log with a STOPPED mark."""
        folder = self._folder
        if folder is None:
            return
        self._mark(Op.STOPPED)
        self._folder, self._name, self._full = None, "", False
        try:
            with contextlib.closing(folder):
                folder.flush()
                self._synchronise(folder)
        except OSError as error:
            self._fail(error)

    def _mark(self, op: imc.LoggingControl.Op) -> None:
        """Publish and write the start or stop of the log, ahead of messages that are still on their way to `record`."""
        folder = self._folder
        mark = self.publish(imc.LoggingControl(op=op, name=self._name))
        try:
            if folder is not None:
                folder.data.write(imc.encode(mark))
        except OSError as error:
            self._fail(error)

    def _is_mark(self, message: imc.Message) -> bool:
        own = message.src == self.system and message.src_ent == self.entity.id
        return own and getattr(message, "op", None) in (Op.STARTED, Op.STOPPED)

    def _tick(self) -> None:
        self.after(self.flush_interval, self._tick)
        folder = self._folder
        if not self._recording:
            return
        if folder is None:
            self._open()
            return
        try:
            folder.flush()
        except FileNotFoundError as error:
            self._fail(error)
            self._folder = None
            with contextlib.suppress(OSError):
                folder.close()
            self._open()
        except OSError as error:
            self._fail(error)
        else:
            self._recover()
            self._synchronise(folder)

    def _synchronise(self, folder: LogFolder) -> None:
        """Sync the file to disk in another thread; not needed in virtual time."""
        if not self.vehicle.virtual and self._syncing < 2:
            self._syncing += 1
            self.offload(_synchronise, os.dup(folder.data.fileno()), then=self._synchronised)

    def _synchronised(self, error: OSError | None) -> None:
        self._syncing -= 1
        if error is not None:
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        """Report the error; the next tick tries again."""
        reason = f"{error.strerror or error}" + (f": {error.filename}" if error.filename else "")
        if reason != self._trouble:
            self._trouble = reason
            self.log.error(f"messages cannot be recorded: {reason}")
        self._full = self._folder is not None and self._folder.waiting > LONGEST_BACKLOG
        self.set_entity_state(State.FAILURE, reason)

    def _recover(self) -> None:
        if self._trouble:
            self.log.warning(f"messages are recorded again; {self._lost} were lost")
        self._trouble, self._lost, self._full = "", 0, False
        self.set_entity_state(State.NORMAL, f"recording {self._name}")


def clean_label(text: str) -> str:
    """`text` as part of a folder name: characters unsafe in file names become _, and it is cut to 100 bytes."""
    label = re.sub(r"[^\w.+=@-]", "_", text.strip())
    return label.encode(errors="ignore")[:LONGEST_LABEL].decode(errors="ignore")


def _utc(time: float) -> str:
    try:
        return datetime.fromtimestamp(time, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    except (ValueError, OverflowError, OSError):
        return f"{time:g}"


def _synchronise(file: int) -> OSError | None:
    try:
        os.fsync(file)
        return None
    except OSError as error:
        return error
    finally:
        os.close(file)
