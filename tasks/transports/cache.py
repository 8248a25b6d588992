"""Keeps what an operator has set, so that it is still set when the vehicle starts again."""

from collections.abc import Mapping
from pathlib import Path

import imc
from imc.layout import FOOTER_SIZE, HEADER_SIZE
from imc.reserved_ids import OPERATORS
from imc.schema import message_named
from runtime import Task, consume, param, periodic
from runtime.bus import Subscription
from support.atomic_files import remove_file, write_file
from support.file_errors import describe_os_error
from support.log_limit import LogLimit

Op = imc.CacheControl.Op
FORGET = "CacheControl CLEAR forgets it"


def is_setting(message: imc.Message) -> bool:
    """Whether a message sets something; LblConfig also asks, and answers."""
    return not isinstance(message, imc.LblConfig) or message.op == imc.LblConfig.Op.SET_CFG


class Cache(Task):
    """Stores the last message of some types that an operator has sent to this vehicle, and repeats them at the start.

    They are in the folder Cache of the vehicle's state, one file each. CacheControl stores a message, repeats all, or
    forgets all. On a virtual clock, where nothing may come from an earlier run, they are kept in memory.
    """

    messages: list[str] = param(
        ["OperationalLimits", "LblConfig"], "", "Names of the messages that are kept.", usable=message_named
    )

    def configure(self) -> None:
        schema = self.vehicle.bus.messages
        self._kinds = {schema[name] for name in self.messages if name in schema}

    def start(self) -> None:
        self._lines = LogLimit("more CacheControl comes")
        self._kept: dict[str, bytes] = {}
        self._changed: set[str] = set()
        self._writing = False
        for kind in sorted(self._kinds, key=lambda kind: kind.ID):
            self.vehicle.bus.subscribe(Subscription(kind, self._keep, self, others=True))
        if self.vehicle.has_virtual_time:
            return
        for path in sorted(self._folder.glob("*.imc")):
            try:
                packet = path.read_bytes()
                message = self.vehicle.bus.decode(packet)
            except (OSError, imc.DecodeError) as error:
                reason = describe_os_error(error, path) if isinstance(error, OSError) else f"{path}: {error}"
                self.log.warning(f"{path.stem} has to be set again, the cache cannot be read: {reason}")
                continue
            if type(message) in self._kinds and is_setting(message):
                self._kept[path.stem] = packet
        self._repeat()

    def stop(self) -> None:
        if self._changed and not self.vehicle.has_virtual_time:
            self._report(write_files(self._folder, self._news()))

    @consume(others=True)
    def on_cache_control(self, request: imc.CacheControl) -> None:
        if not self.is_for_me(request):
            return
        name = self.vehicle.systems.name(request.src)
        inner = request.message
        if request.op == Op.STORE and inner is not None and type(inner) in self._kinds and is_setting(inner):
            self._store(inner)
        elif request.op == Op.LOAD:
            self._repeat()
        elif request.op == Op.CLEAR:
            self._clear()
            self._lines.write(self.log.info, f"cleared by {name}", self.now)
        elif request.op in (Op.STORE, Op.COPY):
            if request.op == Op.COPY:
                what = "no copies are made"
            else:
                what = f"{'nothing' if request.message is None else type(request.message).__name__} cannot be kept"
            kept = ", ".join(self.messages)
            text = f"CacheControl from {name} rejected: {what}; only {kept} can be kept, on this vehicle"
            self._lines.write(self.log.warning, text, self.now)

    @property
    def _folder(self) -> Path:
        return self.vehicle.state_folder / self.system_name / "Cache"

    def _repeat(self) -> None:
        """Publish what is kept, to this vehicle."""
        for name, packet in self._kept.items():
            message = self.vehicle.bus.decode(packet)
            self.publish(message.replace(timestamp=-1.0, src=self.system, src_ent=self.entity.id, dst=self.system))
            text = f"{name} is what an operator has set before; {FORGET}"
            self._lines.write(self.log.info, text, self.now)

    def _keep(self, message: imc.Message) -> None:
        """Keep a message of an operator to this vehicle, unless a value in it cannot be."""
        if message.src in OPERATORS and self.is_for_me(message) and is_setting(message) and not imc.validate(message):
            self._store(message)

    def _store(self, message: imc.Message) -> None:
        name, packet = type(message).__name__, imc.encode(message)
        if self._kept.get(name, b"")[HEADER_SIZE:-FOOTER_SIZE] != packet[HEADER_SIZE:-FOOTER_SIZE]:
            self._kept[name] = packet
            self._changed.add(name)

    def _clear(self) -> None:
        self._changed |= self._kept.keys()
        self._kept.clear()

    @periodic(1.0)
    def write_changes(self) -> None:
        """Write what has changed, in another thread."""
        if self._changed and not self._writing and not self.vehicle.has_virtual_time:
            news, self._writing = self._news(), True
            self._changed.clear()
            self.offload(write_files, self._folder, news, then=self._written)

    def _news(self) -> dict[str, bytes | None]:
        return {name: self._kept.get(name) for name in sorted(self._changed)}

    def _written(self, error: OSError | None) -> None:
        self._writing = False
        self._report(error)

    def _report(self, error: OSError | None) -> None:
        if error is not None:
            self.log.error(f"the cache cannot be written: {describe_os_error(error)}")


def write_files(folder: Path, files: Mapping[str, bytes | None]) -> OSError | None:
    """Write files, each whole or not at all, and remove those without content; returns what prevents it."""
    try:
        for name, data in files.items():
            path = folder / f"{name}.imc"
            if data is None:
                remove_file(path)
            else:
                write_file(path, data)
    except OSError as error:
        return error
    return None
