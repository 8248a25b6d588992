"""The serial ports and sockets of a task, and the data that it expects."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

from runtime.devices import (
    Address,
    Device,
    DeviceOwner,
    LineSplitter,
    RawChunks,
    SerialPort,
    Splitter,
    TcpServerAddress,
    UdpSocket,
)
from runtime.kernel import SECOND, Kernel
from runtime.task.decorators import expected_methods, number_or_parameter
from runtime.task.entity_system_tables import Entity, State
from runtime.task.logbook import truncate_utf8

if TYPE_CHECKING:
    from runtime.vehicle import Vehicle

TCP = "tcp://"


@dataclass(slots=True)
class DeviceHealth:
    """The faults of the devices and the data of a task.

    since: time (ns) from which data are expected. devices: the trouble of each device, by name. fresh: time (ns) of the
    last data, by method. shown: the text that the entity has, empty if all is well.
    """

    since: int
    devices: dict[str, str] = field(default_factory=dict[str, str])
    fresh: dict[str, int] = field(default_factory=dict[str, int])
    shown: str = ""


class DeviceTask:
    """The part of a task that opens devices and watches over its data."""

    _devices: tuple[Device, ...] = ()
    _health: DeviceHealth | None = None

    if TYPE_CHECKING:  # what Task has
        vehicle: Vehicle
        entity: Entity
        _kernel: Kernel

        def set_entity_state(self, state: State, description: str = "") -> None: ...

    def serial(
        self,
        port: str,
        baud: int = 9600,
        *,
        lines: Callable[[str], object] | None = None,
        frames: Callable[[bytes], object] | None = None,
        split: Splitter | None = None,
        opened: Callable[[], object] | None = None,
        **settings: Any,
    ) -> Device:
        """Open a serial port, and keep it open until the task stops; call it in `start`.

        `lines` is called with each line, as text without its end; `frames` with the bytes of each piece that `split`
        makes or, without it, with the bytes as they arrive. A piece for which it raises ValueError, LookupError or
        struct.error is counted as bad, and left out. `opened` is called each time that the device has been opened.
        While it cannot be, the entity is in ERROR. `port` may also be tcp://HOST:PORT. `settings` are those of
        serial.Serial: bytesize, parity, stopbits, xonxoff, rtscts, dsrdtr.
        """
        address: Address = SerialPort(port, baud, **settings)
        if port.startswith(TCP):
            host, _, number = port.removeprefix(TCP).rpartition(":")
            address = TcpServerAddress(host.strip("[]"), int(number) if number.isdecimal() else -1)
        return self._attach(address, lines, frames, split, opened)

    def tcp(
        self,
        host: str,
        port: int,
        *,
        lines: Callable[[str], object] | None = None,
        frames: Callable[[bytes], object] | None = None,
        split: Splitter | None = None,
        opened: Callable[[], object] | None = None,
    ) -> Device:
        """Connect to a TCP server, and again whenever the connection ends; else like `serial`."""
        return self._attach(TcpServerAddress(host, port), lines, frames, split, opened)

    def udp(
        self,
        port: int,
        *,
        lines: Callable[[str], object] | None = None,
        frames: Callable[[bytes], object] | None = None,
        split: Splitter | None = None,
        opened: Callable[[], object] | None = None,
        address: str = "127.0.0.1",
        to: tuple[str, int] | None = None,
    ) -> Device:
        """Receive datagrams at a port of `address`, 0.0.0.0 for all interfaces; else like `serial`.

        `to` is the host and port that `write` sends to, and the only host that is listened to. Without it everybody is,
        and `write` answers the last sender. Without `split`, a frame is a datagram.
        """
        return self._attach(UdpSocket(port, address, to), lines, frames, split, opened)

    def note_data(self, method: str) -> None:
        """A method with `@expect` has returned, so its data are fresh."""
        health = self._care()
        health.fresh[method] = self._kernel.now_ns
        if health.shown or self.entity.state is State.BOOT:
            self.check_data()

    def check_data(self) -> None:
        """Show in the entity's state whether a device is missing, or expected data are late."""
        health = self._care()
        words = truncate_utf8("; ".join([*health.devices.values()] or self._late(health)))
        before, health.shown = health.shown, words
        if words:
            if words != before:
                self.set_entity_state(State.ERROR, words)
        elif self.entity.state is State.BOOT or (before and self.entity.description == before):
            waits = any(name not in health.fresh for name in expected_methods(type(self)))
            if not waits:
                self.set_entity_state(State.NORMAL, "active")
            elif before:
                self.set_entity_state(State.BOOT, "waiting for data")

    def _late(self, health: DeviceHealth) -> list[str]:
        found: list[str] = []
        for method, every in expected_methods(type(self)).items():
            limit = number_or_parameter(self, every)
            since = health.fresh.get(method, health.since)
            silent = self._kernel.now_ns - since - self._kernel.stalls.left_out_since(since)
            if 0.0 < limit * SECOND < silent:
                device = self._devices[0] if len(self._devices) == 1 else None
                found.append(f"{method}: no data for {limit:g} s" if device is None else device.no_data_message(limit))
        return found

    def _care(self) -> DeviceHealth:
        if self._health is None:
            self._health = DeviceHealth(self._kernel.now_ns)
        return self._health

    def _attach(
        self,
        address: Address,
        lines: Callable[[str], object] | None,
        frames: Callable[[bytes], object] | None,
        split: Splitter | None,
        opened: Callable[[], object] | None,
    ) -> Device:
        if (lines is None) == (frames is None):
            raise TypeError("a device has either lines or frames, and a method that takes them")
        splitter = split or (RawChunks() if lines is None else LineSplitter())
        name = address.name

        def take(piece: bytes) -> object:
            return lines(piece.decode(errors="replace")) if lines is not None else frames(piece) if frames else None

        def report_trouble(trouble: str) -> None:
            health = self._care()
            if trouble:
                health.devices[name] = trouble
            elif health.devices.pop(name, None) is not None:
                health.since = self._kernel.now_ns
                health.fresh.clear()
            self.check_data()

        device = Device(cast(DeviceOwner, self), address, splitter, take, opened=opened, trouble=report_trouble)
        self._devices = (*self._devices, device)
        recordings = self.vehicle.recordings
        pieces = recordings.input_for(name, address.bytes_per_second) if recordings is not None else None
        if recordings is not None and pieces is not None:
            recordings.end = max(recordings.end, self._kernel.now_ns + max((piece.time for piece in pieces), default=0))
            device.play_recording(pieces, lambda data: recordings.sent.append((name, data)))
        elif recordings is not None or self._kernel.virtual:
            report_trouble(
                f"{name}: not opened in virtual time" if recordings is None else f"{name}: nothing is recorded of it"
            )
        else:
            device.open()
        return device

    def close_devices(self) -> None:
        """Close all devices; the vehicle calls it after `stop`, which may still write to them."""
        devices, self._devices, self._health = self._devices, (), None
        for device in devices:
            device.close()
