"""Records the messages of the bus to LSF logs, in DUNE's folder layout."""

import os
from datetime import UTC, datetime
from pathlib import Path
from typing import ClassVar

import imc
from imc import LoggingControl
from imc.discovery import Services
from imc.lsf import COMPRESSIONS, gzip_schema
from imc.schema import message_named
from runtime import Entity, State, Task, consume, param
from runtime.snapshot import SnapshotError
from support.file_errors import describe_os_error
from support.file_names import file_name_part
from support.log_limit import Trouble
from tasks.transports.imc_links.own_announce import SYSTEM_TYPES, announcement
from tasks.transports.log_folder import LogFolder, LogRemovedError, log_line, sync_and_close, utc_text
from tasks.transports.log_series import LogSeries

MIB = 1 << 20
LONGEST_BACKLOG = 8 * MIB  # bytes, compressed, that wait while the disk refuses them
MOST_LOGS, SPAN = 10, 60.0  # logs begun by request in so many seconds
ANNOUNCE_PERIOD = 10.0  # s

Op = imc.LoggingControl.Op
Phase = imc.PlanControlState.State


class Logging(Task):
    """Records messages of all systems to <log root>/<vehicle>/<YYYYMMDD>/<HHMMSS>[_label]/ (UTC).

    A log begins with LoggingControl STARTED and, if closed normally, ends with STOPPED. LoggingControl requests start a
    new log (with a label), stop logging, and ask for the name of the log. So that each log can be read alone, the task
    publishes Announce and the plan that is being carried out when a log begins, and queries the EntityInfo of each own
    entity at its first message.
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
    unrecorded_messages: list[str] = param(
        ["CompressedImage"],
        "",
        "Names of messages that are not recorded, unless Transports names them: the pictures that consoles ask for "
        "would fill the disk.",
        usable=message_named,
    )
    system_type: str = param("uuv", "", "Kind of system in Announce.", choices=SYSTEM_TYPES)
    loopback_internal_messages: bool = param(True, "", "Record the messages of this task itself.", editable=False)

    transient: ClassVar[tuple[str, ...]] = ("_logs",)
    lost = ""
    """Missing parts of the log, for people; empty if it is complete."""

    def configure(self) -> None:
        if not hasattr(self, "_logs"):  # it continues if the task is restarted
            self._logs = LogSeries(self.vehicle.log_root / self.system_name, self._synchronize)
        schema = self.vehicle.bus.messages
        names = {name for name in self.transports if name}
        self._unknown = sorted(name for name in names if name not in schema)
        self._wanted: set[type[imc.Message]] = {schema[name] for name in names.difference(self._unknown)}
        if names:
            self._wanted |= {imc.EntityInfo, imc.LoggingControl, imc.Announce}
        unrecorded = {name for name in self.unrecorded_messages if name in schema and name not in names}
        self._unwanted: set[type[imc.Message]] = {schema[name] for name in unrecorded}
        self._recorded: set[type[imc.Message]] = set()
        self._limit = self.lsf_volume_size * MIB or float("inf")

    def start(self) -> None:
        self.vehicle.keeps_log = True
        self._name = self._label = ""
        self._trouble = Trouble()
        self._asked: set[int] = set()  # own entities seen in this log
        self._requested: list[float] = []  # when logs were begun by request
        self._wish: str | None = None  # label of a log that is to begin
        self._plan: imc.PlanSpecification | None = None
        self._flying = False
        self._state: imc.EstimatedState | None = None
        self._recording, self._full, self._syncing, self._lost, self._lost_since = True, False, 0, 0, 0.0
        self._unsynced: list[Path] = []
        if self._unknown:
            self.log.warning(f"Transports: no such message: {', '.join(self._unknown)}")
        self._open()
        self.after(self.flush_interval, self._tick)

    def after_restore(self) -> None:
        """Continue in a new log, with the usual first packets, but publish nothing."""
        name = self._name
        if not self._recording:
            return
        folder = self._new_log()
        if (error := self._settle()) is not None:
            raise SnapshotError(f"the log cannot be written: {describe_os_error(error)}")
        folder.data.write(self._packet(imc.LoggingControl(op=Op.STARTED, name=name), self.entity))
        folder.data.write(self._packet(self._announcement(), self.entity))
        for entity in self.vehicle.entities:
            if entity.id in self._asked:
                info = imc.EntityInfo(id=entity.id, label=entity.label, component=entity.component)
                folder.data.write(self._packet(info, entity))
        if self._plan is not None and self._flying:
            folder.data.write(self._packet(self._plan, self.entity))

    def stop(self) -> None:
        self._recording = False
        self._close()
        waiting = (
            f"{self._logs.unwritten_bytes / MIB:.1f} MiB of messages are not on the disk"
            if self._logs.waiting_logs
            else ""
        )
        lost = f"{self._lost} messages were lost, from {utc_text(self._lost_since)} on" if self._lost else ""
        if trouble := ", ".join(words for words in (waiting, lost) if words):
            self.lost = f"{trouble}: {self._trouble.reason}"
            self.log.error(self.lost)
        self._logs.close_without_flush()

    @consume(others=True, packets=True)
    def record(self, message: imc.Message, packet: bytes) -> None:
        """Append the packet to the log."""
        log = self._logs.current
        if type(message) not in self._recorded and not self._is_to_record(message):
            return
        if log is None or self._full:
            self._lose()
            return
        data = log.data
        try:
            data.write(packet)
        except OSError as error:
            self._fail(error)
        if message.src_ent not in self._asked and message.src == self.system:
            self._asked.add(message.src_ent)
            if not isinstance(message, imc.EntityInfo):
                self.publish(imc.QueryEntityInfo(id=message.src_ent, dst=self.system, dst_ent=message.src_ent))
        if data.size >= self._limit:
            self._restart(self._label)

    def _is_to_record(self, message: imc.Message) -> bool:
        """Whether a message is to be recorded; remembers the types of which all are."""
        kind = type(message)
        if kind in self._unwanted or (self._wanted and kind not in self._wanted):
            return False
        if kind is LoggingControl:
            return not self._is_mark(message)  # own marks are in the log already, see _mark
        self._recorded.add(kind)
        return True

    @consume
    def on_log_book_entry(self, entry: imc.LogBookEntry) -> None:
        """Append a line to the console log."""
        log = self._logs.current
        if log is None or self._full:
            return
        try:
            log.text.write(log_line(entry))
        except OSError as error:
            self._fail(error)

    @consume
    def store_estimated_state(self, state: imc.EstimatedState) -> None:
        self._state = state

    @consume
    def store_plan(self, plan: imc.PlanSpecification) -> None:
        if plan.src_ent != self.entity.id:
            self._plan = plan

    @consume
    def track_plan_execution(self, state: imc.PlanControlState) -> None:
        self._flying = state.state in (Phase.INITIALIZING, Phase.EXECUTING)

    @consume(others=True)
    def on_logging_control(self, request: imc.LoggingControl) -> None:
        """Start a new log, stop, or reply with the name of the log, as requested by the own system or an operator."""
        if not self.is_for_me(request):
            return
        if request.op == Op.REQUEST_START:
            if self._plan is not None and (request.src, request.src_ent) == (self._plan.src, self._plan.src_ent):
                self._plan = None  # the sender of the plan ends it, or publishes the next one now
            self._wish_for(file_name_part(request.name))
        elif request.op == Op.REQUEST_STOP:
            self._recording, self._wish = False, None
            self._close()
            self.set_entity_state(State.NORMAL, "stopped")
        elif request.op == Op.REQUEST_CURRENT_NAME:
            self.reply(request, imc.LoggingControl(op=Op.CURRENT_NAME, name=self._name))

    def _wish_for(self, label: str) -> None:
        """Begin a log now or, if there were many requests, or the disk is full, as soon as possible."""
        waiting, self._wish = self._wish is not None, label
        if not self._grant() and not waiting:
            why = self._trouble.reason or f"{MOST_LOGS} logs were requested within {SPAN:g} s"
            self.log.warning(f"the next log begins later, with the label of the last request: {why}")

    def _grant(self) -> bool:
        """Begin the log that was requested, unless it is too early."""
        recent = [time for time in self._requested if time > self.now - SPAN]
        if self._wish is None:
            return True
        if self._full or len(recent) >= MOST_LOGS:
            return False
        label, self._wish, self._requested = self._wish, None, [*recent, self.now]
        self._restart(label)
        return True

    def _restart(self, label: str) -> None:
        self._close()
        self._recording, self._label = True, label
        self._open()

    def _open(self) -> None:
        name = self._begin()
        log = self._new_log()
        self._asked.clear()
        trouble = self._settle()
        # A virtual run must not depend on which folders exist, so it publishes the name without _2, _3 ...
        self._name = name if self.vehicle.has_virtual_time else log.name
        self._mark(Op.STARTED)
        if trouble is None:
            self._recover()
        else:
            self._fail(trouble)
        self._announce()
        if self._plan is not None and self._flying:
            self.publish(self._plan.replace(src_ent=self.entity.id, timestamp=-1.0))

    def _begin(self) -> str:
        """Name of a log that begins now."""
        begin = datetime.fromtimestamp(self.now_ns // 1_000_000_000, UTC)
        return f"{begin:%Y%m%d/%H%M%S}" + (f"_{label}" if (label := file_name_part(self._label)) else "")

    def _new_log(self) -> LogFolder:
        configuration = self.vehicle.profile.dump().encode(errors="surrogateescape")
        files = {"IMC.xml.gz": gzip_schema(self.vehicle.bus.messages), "Config.ini": configuration}
        return self._logs.begin(self._begin(), self.lsf_compression_method, files)

    def _packet(self, message: imc.Message, entity: Entity) -> bytes:
        return imc.encode_with_header(message, self.now, self.system, entity.id, message.dst, message.dst_ent)

    def _announce(self) -> None:
        """Publish who and where the vehicle is."""
        self._announced = self.now
        self.publish(self._announcement())

    def _announcement(self) -> imc.Announce:
        services = Services.from_system_info(imc=imc.builtin().version)
        return announcement(self.system_name, self.system_type, self._state, str(services))

    def _close(self) -> None:
        """End the log with a STOPPED mark; what the disk does not accept now is written later."""
        if self._logs.current is not None:
            self._mark(Op.STOPPED)
            self._logs.end()
            self._name = ""
            if (error := self._settle()) is not None:
                self._fail(error)

    def _mark(self, op: imc.LoggingControl.Op) -> None:
        """Publish and write the start or stop of the log, ahead of messages that are still on their way to `record`."""
        mark = self.publish(imc.LoggingControl(op=op, name=self._name))
        try:
            if self._logs.current is not None:
                self._logs.current.data.write(imc.encode(mark))
        except OSError as error:
            self._fail(error)

    def _is_mark(self, message: imc.Message) -> bool:
        own = message.src == self.system and message.src_ent == self.entity.id
        return own and getattr(message, "op", None) in (Op.STARTED, Op.STOPPED)

    def _tick(self) -> None:
        self.after(self.flush_interval, self._tick)
        error = self._settle()
        if error is not None:
            self._fail(error)
        elif self._recording:
            self._recover()
            if self.now - self._announced >= ANNOUNCE_PERIOD:
                self._announce()
        self._grant()

    def _settle(self) -> OSError | None:
        """Write what waits; returns the error that prevents it."""
        log, error = self._logs.current, None
        try:
            self._logs.flush()
        except LogRemovedError as removed:
            self._fail(removed)
            if log is not None and log.removed:
                self._open()
                assert self._logs.current is not None
                self._logs.move_unwritten(log, self._logs.current)
        except OSError as refused:
            error = refused
        if log is not None and log.made:
            self.vehicle.log_folder = log.path
        return error

    def _synchronize(self, log: LogFolder) -> None:
        """Put a log on the disk in another thread; not needed in virtual time."""
        if self.vehicle.has_virtual_time:
            return
        self._unsynced += log.take_unsynced()
        if self._syncing >= 2:
            self._unsynced += [log.data.path] if log.data.path not in self._unsynced else []
            return
        beside, self._unsynced = self._unsynced, []
        self._syncing += 1
        self.offload(sync_and_close, os.dup(log.data.fileno()), beside, then=self._synchronized)

    def _synchronized(self, error: OSError | None) -> None:
        self._syncing -= 1
        if error is not None:
            self._fail(error)

    def _lose(self) -> None:
        if self._recording:
            self._lost_since = self._lost_since if self._lost else self.now
            self._lost += 1

    def _fail(self, error: OSError) -> None:
        """Report the error; the next tick tries again."""
        reason = f"{error.strerror or error}" + (f": {error.filename}" if error.filename else "")
        self._trouble.report(reason, self.log.error, f"messages cannot be recorded: {reason}")
        if not self._full and self._logs.unwritten_bytes > LONGEST_BACKLOG:
            self._full = True
            self.log.error(f"{LONGEST_BACKLOG // MIB} MiB wait for the disk: from now on messages are lost")
        self.set_entity_state(State.FAILURE, reason)

    def _recover(self) -> None:
        if reason := self._trouble.end():
            since = f", from {utc_text(self._lost_since)} on" if self._lost else ""
            self.log.warning(f"messages are recorded again; {self._lost} were lost{since}")
            if self._lost:
                self.lost: str = f"{self._lost} messages were lost{since}: {reason}"
        self._lost, self._full = 0, False
        self.set_entity_state(State.NORMAL, f"recording {self._name}")
