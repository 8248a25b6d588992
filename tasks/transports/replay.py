"""Plays the messages of a log on the bus, in the order of the file and at their times."""

from collections.abc import Callable, Iterator
from pathlib import Path

import imc
from runtime import ParameterError, State, Task, Timer, consume, param, periodic
from runtime.kernel import SECOND
from support.file_errors import describe_os_error
from tasks.transports.replayed_log import (
    LogTime,
    OpenedLog,
    ReplayedLog,
    ReplayedPacket,
    ReplaySelection,
    SkippedPackets,
    open_log,
    open_recording_at,
)

BATCH = 200  # packets per call, so that other tasks can run while a replay is late
BREATH = 1e-6  # s, so that time advances even if many packets are due at the same time
SHORTEST_ROUND = 1.0  # s, minimum duration of a loop
REPORTED = 5
STAY = -1.0

Op = imc.ReplayControl.Op


class Replay(Task):
    """Plays a log of Shoal or DUNE: every message with its header from the log.

    ReplayControl starts a log from the vehicle's log folder (without a name the last one), stops, pauses and
    resumes; the parameter `Position` jumps to a time.
    """

    load_at_start: str = param("", "", "Log to play when the task starts, a folder or a file.", editable=False)
    replay_messages: list[str] = param([], "", "Names of the messages to play; empty plays all.")
    replay_systems: list[str] = param([], "", "Names or ids of the systems to play; empty plays all.")
    replay_entities: list[str] = param([], "", "Labels of the log's entities to play; empty plays all.")
    entities: list[str] = param([], "", "Labels of the log's entities that this task plays as its own.", editable=False)
    time_multiplier: float = param(1.0, "1", "Seconds of the log in one second of the vehicle's clock.", minimum=1e-3)
    seconds_to_skip: float = param(
        0.0, "s", "Time to skip at the start.", name="Seconds to skip", aliases=("Seconds To Skip",), minimum=0
    )
    begin: str = param(
        "", "", "Time to begin at, instead of Seconds to skip: 90, 1h30min or 2026-01-01T00:05:00 (UTC).", name="From"
    )
    end: str = param("", "", "Time to end at, like From; empty plays to the end.", name="To")
    position: float = param(STAY, "s", "Set it to jump to this time of the log.", minimum=STAY)
    loop: bool = param(False, "", "Start again at the end.")
    keep_time: bool = param(True, "", "Keep the times of the log in the messages, instead of the times of the replay.")
    longest_pause: float = param(3600.0, "s", "A longer pause counts as a step of the log's clock.", minimum=0.0)
    exit_at_end: bool = param(False, "", "Stop the vehicle when the log has been played.")

    _followers: tuple[Callable[[Path, SkippedPackets], object], ...] = ()
    _recording: ReplayedLog | None = None
    _paused_at: int | None = None

    def configure(self) -> None:
        self._entities = {label: self.reserve_entity(label).id for label in self.entities if label}
        self._from = self._place("From", self.begin) or LogTime(self.seconds_to_skip)
        self._choice = ReplaySelection(
            tuple(filter(None, self.replay_messages)),
            tuple(filter(None, self.replay_systems)),
            tuple(filter(None, self.replay_entities)),
            self._place("To", self.end),
        )
        if self._recording is None:
            self._speed = self.time_multiplier
        elif self.position >= 0.0:
            self.seek(LogTime(self.position))
        elif self._speed != self.time_multiplier:
            self._continue_from(self.elapsed)
        self.position = STAY

    def start(self) -> None:
        self._path: Path | None = Path(self.load_at_start) if self.load_at_start else None
        self._packets: Iterator[ReplayedPacket] = iter(())
        self._next: ReplayedPacket | None = None
        self._timer: Timer | None = None
        self._loading = self._played = self._malformed = 0
        self._base = 0.0
        self._leave()
        if self._path is not None:
            self._load(self._path)
        else:
            self.set_entity_state(State.NORMAL, "idle")

    def stop(self) -> None:
        self._leave()

    @property
    def elapsed(self) -> float:
        """The present time in the log (s)."""
        now = self.now_ns if self._paused_at is None else self._paused_at
        return self._base + (now - self._begin_ns) / SECOND * self._speed

    @property
    def paused(self) -> bool:
        return self._paused_at is not None

    def add_jump_listener(self, follower: Callable[[Path, SkippedPackets], object]) -> None:
        """Call `follower(path, passed)` when a log begins, and after each jump in it, before its next packet."""
        self._followers += (follower,)

    @consume(others=True)
    def on_replay_control(self, request: imc.ReplayControl) -> None:
        """Start, stop, pause or resume, as requested by the own system or an operator."""
        if not self.is_for_me(request):
            return
        if request.op == Op.START:
            root = self.vehicle.log_root.resolve()
            path = (root / request.file).resolve()
            if not request.file and self._path is not None:
                self._load(self._path)
            elif path.is_relative_to(root):
                self._load(path)
            else:
                self.log.error(f"{request.file!r} is not in the log folder {root}")
        elif request.op == Op.STOP:
            self._leave()
            self.set_entity_state(State.NORMAL, "stopped")
        elif request.op == Op.PAUSE:
            self.pause()
        elif request.op == Op.RESUME:
            self.resume()

    def pause(self) -> None:
        if self._paused_at is None and self._recording is not None:
            self._paused_at = self.now_ns
            self._cancel()
            self.report_position()

    def resume(self) -> None:
        if self._paused_at is not None:
            self._begin_ns += self.now_ns - self._paused_at
            self._paused_at = None
            self.report_position()
            if not self._seeking:
                self._play()

    def seek(self, place: LogTime) -> None:
        """Continue from another place of the log, or wait there if paused."""
        if self._recording is not None:
            self._cancel()
            self._seeking = True
            self._loading += 1
            self.offload(open_recording_at, self._recording, place, then=self._landing(place))

    def skip(self, seconds: float) -> None:
        """Jump by `seconds` of the log, forward or (negative) back."""
        if self._recording is not None:
            self.seek(LogTime(max(0.0, self.elapsed + seconds)))

    @periodic(1.0)
    def report_position(self) -> None:
        """Report the present time in the log."""
        if self._recording is not None:
            doing = "playing" if self._paused_at is None else "paused in"
            self.set_entity_state(
                State.NORMAL, f"{doing} {self._recording.log.path.parent.name} at {self.elapsed:.0f} s"
            )

    def _load(self, path: Path) -> None:
        self._leave()
        self._path = path
        self.set_entity_state(State.BOOT, f"opening {path.name}")
        arguments = path, self._choice, self._entities, self.longest_pause, self._from
        self.offload(open_log, *arguments, then=self._landing(self._from))

    def _landing(self, place: LogTime) -> "Callable[[OpenedLog | str], None]":
        """A callback that continues at `place`, unless a newer request came meanwhile."""
        turn = self._loading
        return lambda opened: self._land(opened, place) if turn == self._loading else None

    def _land(self, opened: OpenedLog | str, place: LogTime) -> None:
        if isinstance(opened, str):
            self._leave()
            self._refuse(opened)
            return
        recording, self._packets, self._next, passed = opened
        self._seeking = False
        if recording is not self._recording:
            for label in recording.missing:
                self.log.warning(f"the log has no entity {label!r}")
            source = recording.log.schema_source
            self.log.info(f"playing {recording.log.path} with {source.name if source else 'the built-in definitions'}")
            self._recording, self._played, self._malformed = recording, 0, 0
        if self._next is None and place.seconds > 0.0:
            if self.exit_at_end and not self._played:
                self._leave()
                self._refuse("there is nothing to play from this place of the log on")
                return
            self.log.warning("nothing to play from this place of the log")
        self._continue_from(place.elapsed(self._next.origin) if self._next is not None else 0.0)
        for follow in self._followers:
            follow(recording.log.path, passed)
        self.report_position()
        if self._paused_at is None:
            self._play()

    def _continue_from(self, elapsed: float) -> None:
        self._base, self._begin_ns, self._speed = elapsed, self.now_ns, self.time_multiplier
        if self._paused_at is not None:
            self._paused_at = self.now_ns
        elif self._timer is not None:
            self._cancel()
            self._play()

    def _play(self) -> None:
        """Relay the packets that are due, and set a timer for the next."""
        self._timer = None
        for _ in range(BATCH):
            try:
                due = self._next or next(self._packets, None)
            except OSError as error:
                self._leave()
                self._refuse(describe_os_error(error))
                return
            if due is None:
                self._end()
                return
            self._next = due
            wait = self._begin_ns - self.now_ns + round((due.elapsed - self._base) / self._speed * SECOND)
            if wait > 0:
                self._timer = self.after(wait / SECOND, self._play)
                return
            self._emit(due)
            self._next = None
        self._timer = self.after(BREATH, self._play)

    def _emit(self, due: ReplayedPacket) -> None:
        packet = due.packet
        if not self.keep_time:
            since = imc.header(packet).timestamp - due.origin - self._base
            packet = imc.with_header(packet, timestamp=self._begin_ns / SECOND + since / self._speed)
        try:
            self.relay(packet)
            self._played += 1
        except imc.DecodeError:
            self._malformed += 1

    def _end(self) -> None:
        recording = self._recording
        if recording is None:
            return
        if self.loop and self._played:
            self._timer = self.at(max(self._begin_ns / SECOND + SHORTEST_ROUND, self.now + BREATH), self._again)
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
        skipped = recording.foreign.total() + self._malformed
        self.log.info(f"played {self._played} packets, skipped {skipped}")
        self.set_entity_state(State.NORMAL, "finished" + (f", {len(losses)} damaged places" if losses else ""))
        if self.exit_at_end:
            self.vehicle.stop()

    def _again(self) -> None:
        self._timer = None
        self.seek(self._from)

    def _refuse(self, reason: str) -> None:
        self.log.error(reason)
        self.set_entity_state(State.FAILURE, reason)
        if self.exit_at_end:
            self.vehicle.stop(1)

    def _leave(self) -> None:
        self._cancel()
        self._recording, self._packets, self._next, self._paused_at = None, iter(()), None, None
        self._seeking = False
        self._loading += 1

    def _cancel(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _place(self, name: str, text: str) -> LogTime | None:
        try:
            return LogTime.parse(text) if text else None
        except ValueError as error:
            raise ParameterError(name, str(error)) from None
