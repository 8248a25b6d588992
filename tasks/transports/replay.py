"""Plays a log onto the bus, in the order of the file and at the times of the log."""

from collections.abc import Iterator
from pathlib import Path

import imc
from imc.lsf import Log
from runtime import State, Task, Timer, consume, param
from runtime.kernel import SECOND
from tasks.transports.recording import Due, Recording

BATCH = 200  # packets in one go, so that others have their turn while a replay is behind
BREATH = 1e-6  # s, so that time passes however many packets are due at once
REPORTED = 5
BROADCAST = (0xFFFF, 0xFFF0)

Op = imc.ReplayControl.Op


class Replay(Task):
    """Plays a log of Shoal or DUNE: every message with the header that it has in the log.

    ReplayControl starts a log of the vehicle's log folder, stops, pauses and resumes.
    """

    load_at_start: str = param("", "", "Log to play from the start, a folder or a file.", editable=False)
    replay_messages: list[str] = param([], "", "Names of the messages to play; empty plays all.")
    entities: list[str] = param([], "", "Labels of the log's entities that this task takes over.", editable=False)
    time_multiplier: float = param(1.0, "1", "Seconds of the log in one second of the vehicle's clock.", minimum=1e-3)
    seconds_to_skip: float = param(
        0.0, "s", "Begin of the log that is left out.", name="Seconds to skip", aliases=("Seconds To Skip",), minimum=0
    )
    keep_time: bool = param(True, "", "Leave the times of the log in the messages, instead of those of the replay.")
    longest_pause: float = param(3600.0, "s", "A longer one is taken for a step of the log's clock.", minimum=0.0)
    exit_at_end: bool = param(False, "", "Stop the vehicle when the log has been played.")

    def configure(self) -> None:
        self._entities = {label: self.reserve(label).id for label in self.entities if label}

    def start(self) -> None:
        self._recording: Recording | None = None
        self._packets: Iterator[Due] = iter(())
        self._next: Due | None = None
        self._timer: Timer | None = None
        self._paused_at: int | None = None
        self._loading = 0
        if self.load_at_start:
            self._load(Path(self.load_at_start))
        else:
            self.set_entity_state(State.NORMAL, "idle")

    def stop(self) -> None:
        self._leave()

    @consume(others=True)
    def control(self, request: imc.ReplayControl) -> None:
        """Start, stop, pause or resume, as the own system or an operator asks."""
        operator = request.src & 0xE000 == 0x4000 and request.dst in BROADCAST
        if request.src != self.system and request.dst != self.system and not operator:
            return
        if request.op == Op.START:
            root = self.vehicle.log_root.resolve()
            path = (root / request.file).resolve()
            if path.is_relative_to(root):
                self._load(path)
            else:
                self.log.error(f"{request.file!r} is not in the log folder {root}")
        elif request.op == Op.STOP:
            self._leave()
            self.set_entity_state(State.NORMAL, "stopped")
        elif request.op == Op.PAUSE and self._paused_at is None and self._recording is not None:
            self._paused_at = self.now_ns
            self._cancel()
        elif request.op == Op.RESUME and self._paused_at is not None:
            self._begin_ns += self.now_ns - self._paused_at
            self._paused_at = None
            self._play()

    def _load(self, path: Path) -> None:
        self._leave()
        self._loading += 1
        self.set_entity_state(State.BOOT, f"opening {path.name}")
        arguments = (path, [name for name in self.replay_messages if name], self._entities, self.longest_pause)
        self.offload(_open, *arguments, then=lambda opened, turn=self._loading: self._begin(opened, turn))

    def _begin(self, opened: Recording | str, turn: int) -> None:
        if turn != self._loading:
            return
        if isinstance(opened, str):
            self._refuse(opened)
            return
        for label in opened.missing:
            self.log.warning(f"the log has no entity {label!r}")
        source = opened.log.schema_source
        self.log.info(f"playing {opened.log.path} with {source.name if source else 'the built-in definitions'}")
        self.set_entity_state(State.NORMAL, f"playing {opened.log.path.parent.name}")
        self._recording, self._packets = opened, iter(opened)
        self._begin_ns, self._played, self._malformed = self.now_ns, 0, 0
        self._play()

    def _play(self) -> None:
        """Relay what is due, and come back when the next packet is."""
        self._timer = None
        for _ in range(BATCH):
            try:
                due = self._next or next(self._packets, None)
            except OSError as error:
                self._leave()
                self._refuse(f"{error.filename}: {error.strerror}")
                return
            if due is None:
                self._end()
                return
            self._next = due
            if due.elapsed >= self.seconds_to_skip:
                wait = self._begin_ns - self.now_ns
                wait += round((due.elapsed - self.seconds_to_skip) / self.time_multiplier * SECOND)
                if wait > 0:
                    self._timer = self.after(wait / SECOND, self._play)
                    return
                self._emit(due)
            self._next = None
        self._timer = self.after(BREATH, self._play)

    def _emit(self, due: Due) -> None:
        packet = due.packet
        if not self.keep_time:
            since = imc.header(packet).timestamp - due.origin - self.seconds_to_skip
            packet = imc.with_header(packet, timestamp=self._begin_ns / SECOND + since / self.time_multiplier)
        try:
            self.relay(packet)
            self._played += 1
        except imc.DecodeError:
            self._malformed += 1

    def _end(self) -> None:
        recording = self._recording
        if recording is None:
            return
        self._leave()
        losses = recording.log.losses
        if losses:
            first = "; ".join(f"{loss.reason} at {loss.offset} ({loss.length} bytes)" for loss in losses[:REPORTED])
            self.log.warning(f"{len(losses)} damaged places in {recording.log.path.name}: {first}")
        for name, count in recording.foreign.items():
            self.log.warning(f"{count} packets not played: {name}")
        if self._malformed:
            self.log.warning(f"{self._malformed} packets not played: malformed")
        if recording.timeline.steps:
            self.log.warning(f"the log's clock steps {recording.timeline.steps} times")
        left_out = recording.foreign.total() + self._malformed
        self.log.info(f"played {self._played} packets, left out {left_out}")
        self.set_entity_state(State.NORMAL, "finished" + (f", {len(losses)} damaged places" if losses else ""))
        if self.exit_at_end:
            self.vehicle.stop()

    def _refuse(self, reason: str) -> None:
        self.log.error(reason)
        self.set_entity_state(State.FAILURE, reason)
        if self.exit_at_end:
            self.vehicle.stop(1)

    def _leave(self) -> None:
        self._cancel()
        self._recording, self._packets, self._next, self._paused_at = None, iter(()), None, None
        self._loading += 1

    def _cancel(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


def _open(path: Path, types: list[str], entities: dict[str, int], longest_pause: float) -> Recording | str:
    """The recording at `path`, or why it cannot be played."""
    try:
        return Recording(Log(path), types, entities, longest_pause)
    except OSError as error:
        return f"{path}: {error.strerror or error}"
    except ValueError as error:
        return str(error)
