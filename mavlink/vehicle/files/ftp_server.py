"""MAVLink's file transfer protocol (mavlink.io/en/services/ftp.html), for reading only.

The answers fit what stations really do, where the protocol leaves it open:
- A session has the number that the client asked with; opening again replaces it. MAVSDK and MAVProxy ignore the number
  in the answer, QGroundControl and pymavlink take it from there.
- The last packet of a file completes its burst, and no "end of file" follows: MAVSDK takes any refusal for a failure.
  Who asks for a burst at the end gets "end of file", as QGroundControl does.
- A burst that is requested again while it runs continues: MAVSDK does not survive data that it has already.
"""

from collections import OrderedDict
from collections.abc import Hashable
from contextlib import closing
from dataclasses import dataclass, field

from mavlink.vehicle.files.ftp_messages import (
    MOST_DATA,
    WRITING,
    FtpError,
    FtpErrorCode,
    FtpOpcode,
    FtpRequest,
    checksum,
    format_entry,
)
from mavlink.vehicle.files.virtual_files import VirtualFiles
from mavlink.vehicle.interfaces import OpenFile

MOST_ASKERS, MOST_SESSIONS = 16, 5  # in all, and sessions of each asker
MOST_ANSWERS = 16  # kept of each asker, for repeated requests
BURST = 500  # packets; limits what is sent to a client that is gone
SLICE = 1 << 16  # bytes that are added to a checksum at a time
FRESH = 1.0  # s that the listing of a folder serves new requests


@dataclass(slots=True)
class _Burst:
    request: FtpRequest
    offset: int
    step: int = 0


@dataclass(slots=True)
class _Session:
    file: OpenFile
    used: float
    burst: _Burst | None = None


@dataclass(slots=True)
class _Sum:
    """A checksum that is being calculated."""

    request: FtpRequest
    file: OpenFile
    offset: int = 0
    value: int = 0


@dataclass(slots=True)
class _Dialogue:
    """State that is kept of one client."""

    active_at: float
    sessions: dict[int, _Session] = field(default_factory=dict[int, _Session])
    answers: OrderedDict[bytes, bytes] = field(default_factory=OrderedDict[bytes, bytes])
    sum: _Sum | None = None
    path: bytes | None = None  # of the folder with `names`
    names: list[bytes] = field(default_factory=list[bytes])
    listed: float = 0.0

    def remember(self, request: FtpRequest, answer: bytes) -> bytes:
        self.answers[request.raw] = answer
        if len(self.answers) > MOST_ANSWERS:
            self.answers.popitem(last=False)
        return answer

    def close_session(self, number: int) -> None:
        session = self.sessions.pop(number, None)
        if session is not None:
            session.file.close()
        for raw in [raw for raw, answer in self.answers.items() if answer[2] == number]:
            del self.answers[raw]

    def end_sum(self) -> None:
        if self.sum is not None:
            self.sum.file.close()
            self.sum = None

    def clear(self) -> None:
        for number in list(self.sessions):
            self.close_session(number)
        self.end_sum()
        self.answers.clear()
        self.path = None


class FtpServer:
    """Answers requests for the files of a tree; whoever asks is known by any value, such as (system, component).

    A session that is idle for `timeout` seconds is closed. Nothing raises: what fails is rejected.
    """

    def __init__(self, tree: VirtualFiles, *, timeout: float = 60.0):
        self._tree = tree
        self._timeout = timeout
        self._dialogues: dict[Hashable, _Dialogue] = {}

    def receive(self, asker: Hashable, payload: bytes, now: float) -> bytes | None:
        """The payload that answers one of FILE_TRANSFER_PROTOCOL; None if none is due, or `next_payload` has it."""
        request = FtpRequest.parse(payload)
        if request is None:
            return None
        self.forget_silent(now)
        dialogue = self._dialogue(asker, now)
        if dialogue is None:
            return request.refuse(FtpError(FtpErrorCode.NO_SESSIONS))
        if request.raw in dialogue.answers:
            return dialogue.answers[request.raw]
        try:
            return self._serve(dialogue, request, now)
        except FtpError as refusal:
            return request.refuse(refusal)
        except OSError as error:
            return request.refuse(FtpError.of(error))

    def is_busy(self, asker: Hashable) -> bool:
        """Whether `next_payload` has something to do for an asker."""
        dialogue = self._dialogues.get(asker)
        return dialogue is not None and (
            dialogue.sum is not None or any(session.burst for session in dialogue.sessions.values())
        )

    def next_payload(self, asker: Hashable, now: float) -> bytes | None:
        """The next payload for an asker; None if there is none, or not yet. A call reads 64 KiB at most."""
        dialogue = self._dialogues.get(asker)
        if dialogue is None:
            return None
        if dialogue.sum is not None and (answer := _add_up(dialogue, dialogue.sum)) is not None:
            return answer
        for number, session in dialogue.sessions.items():
            if session.burst is not None:
                dialogue.sessions[number] = dialogue.sessions.pop(number)  # to the end: it is the others' turn
                session.used = now
                return _next_packet(session, session.burst)
        return None

    def forget_silent(self, now: float) -> None:
        """Close idle sessions."""
        since = now - self._timeout
        for asker, dialogue in list(self._dialogues.items()):
            for number in [number for number, session in dialogue.sessions.items() if session.used < since]:
                dialogue.close_session(number)
            if not dialogue.sessions and dialogue.active_at < since:
                self._dialogues.pop(asker).clear()

    def close(self) -> None:
        for dialogue in self._dialogues.values():
            dialogue.clear()
        self._dialogues.clear()

    def _dialogue(self, asker: Hashable, now: float) -> _Dialogue | None:
        """Dialogue of a client; a new one takes the place of the longest silent one that has no file open, if any."""
        dialogue = self._dialogues.get(asker)
        if dialogue is None:
            if len(self._dialogues) >= MOST_ASKERS:
                idle = [(d.active_at, key) for key, d in self._dialogues.items() if not d.sessions and d.sum is None]
                if not idle:
                    return None
                del self._dialogues[min(idle, key=lambda item: item[0])[1]]
            dialogue = self._dialogues[asker] = _Dialogue(now)
        dialogue.active_at = now
        return dialogue

    def _serve(self, dialogue: _Dialogue, request: FtpRequest, now: float) -> bytes | None:
        """Raises FtpError or OSError."""
        if request.opcode in WRITING:
            raise FtpError(FtpErrorCode.PROTECTED)
        if request.opcode == FtpOpcode.NONE:
            return request.answer()
        if request.opcode == FtpOpcode.RESET:
            dialogue.clear()
            return request.answer()
        if request.opcode in (FtpOpcode.TERMINATE, FtpOpcode.READ, FtpOpcode.BURST):
            return _use_session(dialogue, request, now)
        if request.opcode not in (FtpOpcode.LIST, FtpOpcode.LIST_WITH_TIME, FtpOpcode.OPEN, FtpOpcode.CHECKSUM):
            raise FtpError(FtpErrorCode.UNKNOWN)
        if request.size > MOST_DATA:
            raise FtpError(FtpErrorCode.DATA_SIZE)
        if request.opcode == FtpOpcode.OPEN:
            return self._open(dialogue, request, now)
        if request.opcode == FtpOpcode.CHECKSUM:
            return self._begin_sum(dialogue, request)
        return self._list(dialogue, request, now)

    def _open(self, dialogue: _Dialogue, request: FtpRequest, now: float) -> bytes:
        if request.session not in dialogue.sessions and len(dialogue.sessions) >= MOST_SESSIONS:
            raise FtpError(FtpErrorCode.NO_SESSIONS)
        file = self._tree.open(request.data)
        dialogue.close_session(request.session)
        dialogue.sessions[request.session] = _Session(file, now)
        return dialogue.remember(request, request.answer(file.size.to_bytes(4, "little")))

    def _begin_sum(self, dialogue: _Dialogue, request: FtpRequest) -> bytes | None:
        if dialogue.sum is None or dialogue.sum.request.raw != request.raw:
            file = self._tree.open(request.data)
            dialogue.end_sum()
            dialogue.sum = _Sum(request, file)
            return _add_up(dialogue, dialogue.sum)
        return None

    def _list(self, dialogue: _Dialogue, request: FtpRequest, now: float) -> bytes:
        """List a folder; the rest comes from the same listing, also if the folder has changed meanwhile."""
        age = now - dialogue.listed
        if dialogue.path != request.data or age > (self._timeout if request.offset else FRESH):
            dialogue.path = None
            dialogue.names = [name for name, _ in self._tree.list_entry_names(request.data)]
            dialogue.path, dialogue.listed = request.data, now
        data = b""
        names = dialogue.names[request.offset : request.offset + MOST_DATA]
        with closing(self._tree.entries(request.data, names)) as entries:
            for entry in entries:
                line = format_entry(entry, request.opcode == FtpOpcode.LIST_WITH_TIME)
                if len(data) + len(line) > MOST_DATA:
                    break
                data += line
        if not data:
            raise FtpError(FtpErrorCode.END)
        return request.answer(data)


def _use_session(dialogue: _Dialogue, request: FtpRequest, now: float) -> bytes | None:
    session = dialogue.sessions.get(request.session)
    if session is None:
        raise FtpError(FtpErrorCode.SESSION)
    session.used = now
    if request.opcode == FtpOpcode.TERMINATE:
        dialogue.close_session(request.session)
        return dialogue.remember(request, request.answer())
    if request.opcode == FtpOpcode.READ:
        data = session.file.read(request.offset, request.count)
        if not data:
            raise FtpError(FtpErrorCode.END)
        return request.answer(data)
    if session.burst is None or session.burst.request.raw != request.raw:
        session.burst = None
        if request.offset >= session.file.size:
            raise FtpError(FtpErrorCode.END)
        session.burst = _Burst(request, request.offset)
    return None


def _next_packet(session: _Session, burst: _Burst) -> bytes:
    """The next packet of a burst."""
    request, offset = burst.request, burst.offset
    burst.step += 1
    try:
        data = session.file.read(offset, request.count)
        if not data:
            raise FtpError(FtpErrorCode.END)  # it has become shorter
    except (FtpError, OSError) as error:
        session.burst = None
        refusal = error if isinstance(error, FtpError) else FtpError.of(error)
        return request.refuse(refusal, step=burst.step, offset=offset)
    burst.offset += len(data)
    complete = burst.offset >= session.file.size or burst.step == BURST
    if complete:
        session.burst = None
    return request.answer(data, step=burst.step, offset=offset, complete=complete)


def _add_up(dialogue: _Dialogue, running: _Sum) -> bytes | None:
    """Add a piece to a checksum; the answer when it is done."""
    try:
        data = running.file.read(running.offset, SLICE)
    except OSError as error:
        dialogue.end_sum()
        return running.request.refuse(FtpError.of(error))
    running.value = checksum(data, running.value)
    running.offset += len(data)
    if data and running.offset < running.file.size:
        return None
    dialogue.end_sum()
    return dialogue.remember(running.request, running.request.answer(running.value.to_bytes(4, "little")))
