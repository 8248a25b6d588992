"""Several vehicles on one kernel and one thread; each has its own bus, tasks, random numbers and log."""

import logging
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING

import imc
from runtime.bus import Bus
from runtime.kernel import LIVELOCK_EVENTS, SECOND, Clock, Kernel, LivelockError, owner_title
from runtime.task import Task

if TYPE_CHECKING:
    from runtime.vehicle.vehicle import Vehicle

logger: logging.Logger = logging.getLogger("shoal.fleet")


class FleetError(ValueError):
    """A vehicle cannot join a fleet; the text gives the reason."""


class InProcessTransport:
    """A transport between the buses of one process: what is published on one is delivered on the others immediately."""

    def __init__(self, bus: Bus, buses: list[Bus], kinds: tuple[type[imc.Message], ...]):
        self._bus = bus
        self._buses = buses
        self._kinds = kinds

    @property
    def systems(self) -> list[int]:
        return [bus.system for bus in self._buses if bus is not self._bus]

    def open(self, receive: Callable[[bytes], None]) -> None:
        self._buses.append(self._bus)

    def send(self, message: imc.Message, packet: bytes) -> None:
        if isinstance(message, self._kinds) and self._bus in self._buses and message.src not in self.systems:
            for bus in self._buses:
                if bus is not self._bus:
                    bus.deliver(message if bus.messages is self._bus.messages else bus.decode(packet), packet)

    def close(self) -> None:
        if self._bus in self._buses:
            self._buses.remove(self._bus)


class Fleet:
    """Vehicles built with `fleet=` run on its kernel. `start`, `run` and `close` act on all; `with` closes it.

    Without `connect` each vehicle receives only its own messages; its log on a virtual clock is then identical to the
    log of a solo run. A vehicle that stops is closed at that moment, and the others continue. A task that fails is
    restarted if its vehicle has `keep_going`; otherwise it ends the run of all.
    `vehicles` are those that are not closed, in the order in which they joined.
    """

    def __init__(self, clock: Clock):
        self.kernel: Kernel = Kernel(clock)
        self.kernel.on_error = self._failed
        self.kernel.on_slow = self._slow
        self.vehicles: list[Vehicle] = []
        self._buses: list[Bus] = []
        self._kinds: tuple[type[imc.Message], ...] = ()
        self._ending = False
        self._fatal: Exception | None = None

    def __enter__(self) -> "Fleet":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        try:
            self.close()
        except Exception as later:
            if error is None:
                raise
            logger.error("while closing: %r", later)

    def join(self, vehicle: "Vehicle") -> None:
        """Add a vehicle; its constructor does this. Raises FleetError if another vehicle has its name."""
        if any(other.name == vehicle.name for other in self.vehicles):
            text = f"the fleet already has a vehicle {vehicle.name!r}: give each its own name"
            raise FleetError(text)
        if self._kinds:
            self._attach(vehicle)
        self.vehicles.append(vehicle)
        self.kernel.livelock_events = LIVELOCK_EVENTS * len(self.vehicles)

    def connect(self, *kinds: type[imc.Message]) -> None:
        """Let all vehicles receive messages of these types from each other; without types, all messages.

        Handlers with `others` receive them in the order of publication; logs have them too. Raises FleetError if two
        vehicles have the same IMC id, the fleet is already connected, or a vehicle is connected to something else.
        """
        if self._kinds:
            raise FleetError("the fleet is already connected")
        self._kinds = kinds or (imc.Message,)
        for vehicle in self.vehicles:
            self._attach(vehicle)

    def leave(self, vehicle: "Vehicle") -> None:
        """Remove a vehicle; its `close` does this. Raises an error that another vehicle had meanwhile."""
        if vehicle not in self.vehicles:
            return
        self.vehicles.remove(vehicle)
        for owner in (vehicle, vehicle.bus):
            self.kernel.cancel_owner(owner)
        fatal = self._fatal
        if fatal is not None and not self._closing:
            self._fatal = None
            raise fatal

    def start(self) -> None:
        """Start all vehicles, in the order in which they joined."""
        for vehicle in self.vehicles:
            vehicle.start()

    def run(self, seconds: float | None = None) -> None:
        """Run for `seconds`, or until `stop`, or until all vehicles have stopped.

        Raises LivelockError, and the exception of a handler whose vehicle has no `keep_going`, with a note that names
        vehicle and task.
        """
        kernel = self.kernel
        begin = max(kernel.now_ns, kernel.clock.read())
        until = None if seconds is None else begin + round(seconds * SECOND)
        self._ending = False
        self._dismiss()
        while self.vehicles and not self._ending:
            try:
                kernel.run(until)
            except LivelockError as error:
                if (vehicle := self.vehicle_of(error.owner)) is not None:
                    error.add_note(f"in {vehicle.name}: {error.owner!r}")
                raise
            if not self._dismiss():
                return

    def stop(self) -> None:
        """End the run of all vehicles."""
        self._ending = True
        self.kernel.stop()

    def close(self) -> None:
        """Close all vehicles, in order, and the kernel. All are closed even if one fails; the first error is raised."""
        errors: list[Exception] = []
        for vehicle in self.vehicles:
            vehicle.closing = True
        try:
            for vehicle in list(self.vehicles):
                try:
                    vehicle.close()
                except Exception as error:
                    errors.append(error)
        finally:
            self.kernel.close()
        if errors:
            raise errors[0]

    def vehicle_of(self, owner: object) -> "Vehicle | None":
        """The vehicle that the owner of a call or subscription belongs to: a task or an observer."""
        if isinstance(owner, Task):
            return owner.vehicle
        return next((vehicle for vehicle in self.vehicles if vehicle.has_callback_owner(owner)), None)

    @property
    def _closing(self) -> bool:
        return any(vehicle.closing for vehicle in self.vehicles)

    def _attach(self, vehicle: "Vehicle") -> None:
        twin = next((other for other in self.vehicles if other is not vehicle and other.system == vehicle.system), None)
        if twin is not None:
            text = f"{vehicle.name} and {twin.name} have the same IMC id, {vehicle.system:#06x}"
            raise FleetError(f"{text}: change one of them in [IMC Addresses]")
        if vehicle.bus.has_transports:
            raise FleetError(f"the bus of {vehicle.name} is already connected to other processes")
        vehicle.bus.attach_transport(InProcessTransport(vehicle.bus, self._buses, self._kinds))

    def _dismiss(self) -> bool:
        """Close the vehicles that have stopped; return whether there were any."""
        found = False
        while (stopped := next((vehicle for vehicle in self.vehicles if vehicle.stopped), None)) is not None:
            stopped.close()
            found = True
        return found

    def _failed(self, owner: object, error: Exception) -> None:
        vehicle = self.vehicle_of(owner)
        try:
            if vehicle is None:
                error.add_note(f"in {owner_title(owner)}, which does not belong to a vehicle of the fleet")
                raise error
            vehicle.on_task_error(owner, error)
        except Exception:
            if not self._closing:
                raise
            self._fatal = self._fatal or error

    def _slow(self, owner: object, seconds: float, handler: str) -> None:
        vehicle = self.vehicle_of(owner)
        if vehicle is None:
            logger.warning("%s computed for %.3f s in one handler, %s", owner_title(owner), seconds, handler)
        else:
            vehicle.on_slow(owner, seconds, handler)
