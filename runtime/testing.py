"""Runs tasks without a profile, in virtual time: feed messages, look at what they publish."""

import tempfile
from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

import imc
from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime.bus import Frame
from runtime.devices import InputScript, ScriptedInputs
from runtime.fault_injection import FaultInjector, Injection
from runtime.kernel import SECOND, Clock, VirtualClock, nanoseconds
from runtime.task import Parameter, Task
from runtime.vehicle import Vehicle, section_name

M = TypeVar("M", bound=imc.Message)
START = 1_767_225_600  # 2026-01-01T00:00:00Z
ABSOLUTE = 1e8  # timestamps above are s since 1970, below seconds from the start
LAUV_NOPTILUS_1 = 0x001A


@dataclass
class Run:
    """The result of a simulation: `messages` in order of publication, except those fed in and the Daemon's.

    `log` has the texts of the log book, including the Daemon's; `sent` the names of devices and what was sent to them.
    """

    vehicle: Vehicle
    tasks: list[Task]
    messages: list[imc.Message] = field(default_factory=list[imc.Message])
    packets: list[bytes] = field(default_factory=list[bytes])
    frames: list[Frame] = field(default_factory=list[Frame])
    log: list[str] = field(default_factory=list[str])
    sent: list[tuple[str, bytes]] = field(default_factory=list[tuple[str, bytes]])

    @property
    def task(self) -> Any:
        """The first task under test."""
        return self.tasks[0]

    def of(self, kind: type[M]) -> list[M]:
        """The messages of a type."""
        return [message for message in self.messages if isinstance(message, kind)]


class NoProfile:
    """Stands in for the ini file: `settings` has the options of each section."""

    def __init__(self, settings: Mapping[str, Mapping[str, str]] | None = None):
        self._settings = {section: dict(options) for section, options in (settings or {}).items()}

    @property
    def base_folder(self) -> Path:
        return Path()

    def find_file(self, section: str, option: str) -> Path:
        return Path(self.value(section, option))

    def set(self, section: str, parameters: Mapping[str, Parameter], values: Mapping[str, Any]) -> None:
        """Let a section also have the options that are given by attribute."""
        for parameter in parameters.values():
            if parameter.attribute in values:
                text = parameter.format(values[parameter.attribute])
                self._settings.setdefault(section, {})[parameter.name] = text

    def value(self, section: str, option: str, default: str = "") -> str:
        return self._settings.get(section, {}).get(option, "") or default

    def options(self, section: str) -> Mapping[str, str]:
        return self._settings.get(section, {})

    def dump(self) -> str:
        return ""

    def override(self, assignment: str) -> None:
        """Ignored: there is no profile to change."""


def simulate(
    tasks: type[Task] | Sequence[type[Task] | tuple[type[Task], dict[str, Any]]],
    feed: Iterable[imc.Message] = (),
    *,
    seconds: float | None = None,
    seed: int = 0,
    section: str = "",
    system: str = "lauv-noptilus-1",
    system_id: int = LAUV_NOPTILUS_1,
    start: float = START,
    log_root: Path | None = None,
    script: Callable[..., Coroutine[Any, Any, Any]] | None = None,
    keep_going: bool = False,
    clock: Clock | None = None,
    settings: Mapping[str, Mapping[str, str]] | None = None,
    messages: imc.Schema | None = None,
    stream: InputScript | Mapping[str, InputScript] | None = None,
    faults: Iterable[Injection] = (),
    **parameters: Any,
) -> Run:
    """Run tasks in virtual time and return what they published.

    `tasks` is a class, with its parameters as further keyword arguments by attribute name, or a list of classes and
    (class, parameters). `feed` is published at its timestamps: seconds from the start, or absolute; a message without
    source is the vehicle's own, one without timestamp is published at the start. The run takes `seconds`, by default
    until the end of the feed, or 1 s without a feed. `script` is a coroutine function that runs along with the tasks.
    `settings` stands in for the profile: texts by section and option. `messages` is the schema of the vehicle, if it
    has messages of its own. Exceptions of tasks are raised.

    No device is opened: `stream` is what the task's device sends: bytes or text at the speed of the line, the path of a
    file of such, or a list of (seconds, bytes or text), in which None unplugs the device until the next portion. Of
    several devices it is a dictionary by name. The run then takes at least until the end of the stream.

    `faults` are what goes wrong with tasks, by default with the first: `Injection(Silent(), start=5.0, duration=3.0)`.
    """
    wanted = [tasks] if isinstance(tasks, type) else list(tasks)
    with tempfile.TemporaryDirectory() as folder:
        profile = NoProfile(settings)
        vehicle = Vehicle(
            system,
            system_id,
            clock=clock or VirtualClock(nanoseconds(start)),
            profile=profile,
            seed=seed,
            keep_going=keep_going,
            log_root=log_root or Path(folder) / "log",
            state_folder=Path(folder) / "db",
            messages=messages,
        )
        vehicle.recordings = recordings = None if stream is None else ScriptedInputs(stream)
        made: list[Task] = []
        try:
            given = [item if isinstance(item, tuple) else (item, parameters) for item in wanted]
            names = [section if section and not index else section_name(cls) for index, (cls, _) in enumerate(given)]
            for name, (cls, values) in zip(names, given, strict=True):
                profile.set(name, cls.parameters(), values)
            for name, (cls, values) in zip(names, given, strict=True):
                made.append(vehicle.add(cls, _unused(name, made), **values))
            run = Run(vehicle, made, sent=recordings.sent if recordings is not None else [])
            fed = [_fed(message, vehicle) for message in feed]
            _record(run, {id(message) for _, message, _ in fed})
            vehicle.start()
            for at, message, packet in fed:
                vehicle.kernel.at(at, vehicle.bus.deliver_and_send, message, packet, None)
            broken = FaultInjector(vehicle)
            for injection in faults:
                broken.schedule(replace(injection, task=injection.task or made[0].name))
            if script is not None:
                vehicle.kernel.soon(vehicle.daemon.start_script, script)
            if recordings is not None:
                vehicle.run(0.0)  # the tasks start, and open their devices
            last = max(max((at for at, _, _ in fed), default=0), recordings.end if recordings is not None else 0)
            rest = (last - vehicle.kernel.now_ns + 1) / SECOND
            vehicle.run(seconds if seconds is not None else max(1.0 if not fed else 0.0, rest))
        finally:
            vehicle.close()
    return run


def _record(run: Run, fed: set[int]) -> None:
    """Record what is published, except the fed messages (by identity) and the Daemon's."""
    system = run.vehicle.system

    def record(message: imc.Message, packet: bytes) -> None:
        if id(message) not in fed and not (message.src == system and message.src_ent == 0):
            run.messages.append(message)
            run.packets.append(packet)

    def note(entry: imc.LogBookEntry) -> None:
        run.log.append(entry.text)

    run.vehicle.observe(imc.Message, record, packets=True)
    run.vehicle.observe(imc.LogBookEntry, note)
    run.vehicle.observe(Frame, run.frames.append)


def _unused(name: str, made: list[Task]) -> str:
    taken = {task.name for task in made}
    return name if name not in taken else f"{name}/{len(taken)}"


def _fed(message: imc.Message, vehicle: Vehicle) -> tuple[int, imc.Message, bytes]:
    seconds = max(0.0, message.timestamp)
    if seconds < ABSOLUTE:
        seconds += vehicle.start_time
    source = vehicle.system if message.src == UNKNOWN_SYSTEM else message.src
    packet = imc.encode_with_header(message, seconds, source, message.src_ent, message.dst, message.dst_ent)
    return nanoseconds(seconds), vehicle.bus.decode(packet), packet
