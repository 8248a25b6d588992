"""Several vehicles on one kernel: one time, one thread, and to each its own bus, tasks, random numbers and log."""

import logging
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING

import imc
from runtime.bus import Bus
from runtime.kernel import LIVELOCK_EVENTS, Kernel, LivelockError, VirtualClock, WallClock
from runtime.kernel.kernel import SECOND
from runtime.task import Task

if TYPE_CHECKING:
    from runtime.vehicle.vehicle import Vehicle

logger = logging.getLogger("shoal.fleet")


class FleetError(ValueError):
    """A vehicle that cannot join a fleet; the text says why."""


class Neighbour:
    """A transport between the buses of one process: what is published on one is heard on the others at once."""

    def __init__(self, bus: Bus, buses: list[Bus], kinds: tuple[type[imc.Message], ...]):
        self._bus = bus
        self._buses = buses
        self._kinds = kinds

    def open(self, receive: Callable[[bytes], None]) -> None:
        self._buses.append(self._bus)

    def send(self, message: imc.Message, packet: bytes) -> None:
        if isinstance(message, self._kinds):
            for bus in self._buses:
                if bus is not self._bus:
                    bus.hear(message, packet)

    def close(self) -> None:
        self._buses.remove(self._bus)


class Fleet:
    """Vehicles that are built with `fleet=` run on its kernel: `start`, `run`, `close` all of them, or `with` it.

    Each vehicle hears itself alone, unless `connect` says else, and says what it says when it runs by itself, to the
    byte on a virtual clock. One that stops is closed at that moment, and the others go on. A task that fails ends the
    run of all where its vehicle has not `keep_going`, and is restarted where it has.
    `vehicles` are those that are not closed, in the order in which they have joined.
    """

    def __init__(self, clock: WallClock | VirtualClock):
        self.kernel = Kernel(clock)
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
        """Take a vehicle in, as its construction does. Raises FleetError for a name that another one has."""
        if any(other.name == vehicle.name for other in self.vehicles):
            text = f"there is a vehicle {vehicle.name!r} in the fleet already: give each a name of its own"
            raise FleetError(text)
        if self._kinds:
            self._attach(vehicle)
        self.vehicles.append(vehicle)
        self.kernel.livelock_events = LIVELOCK_EVENTS * len(self.vehicles)

    def connect(self, *kinds: type[imc.Message]) -> None:
        """Let all vehicles hear messages of these types of each other, all messages where none is named.

        They hear them in the order of publication, as handlers with `others` do; a log has them as well. Raises
        FleetError for vehicles of the same IMC id, and where the fleet is connected, or a vehicle to something else.
        """
        if self._kinds:
            raise FleetError("the fleet is connected already")
        self._kinds = kinds or (imc.Message,)
        for vehicle in self.vehicles:
            self._attach(vehicle)

    def leave(self, vehicle: "Vehicle") -> None:
        """Let a vehicle go, as its `close` does. Raises what has failed in others while it was being closed."""
        if vehicle not in self.vehicles:
            return
        self.vehicles.remove(vehicle)
        for owner in (vehicle, vehicle.bus):
            self.kernel.discard(owner)
        fatal = self._fatal
        if fatal is not None and not self._closing:
            self._fatal = None
            raise fatal

    def start(self) -> None:
        """Start all vehicles, in the order in which they have joined."""
        for vehicle in self.vehicles:
            vehicle.start()

    def run(self, seconds: float | None = None) -> None:
        """Run for so many seconds, or until `stop`, or until all vehicles have stopped.

        Raises what `keep_going` does not cover, with a note that names vehicle and task, and LivelockError.
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
                if (vehicle := self.of(error.owner)) is not None:
                    error.add_note(f"in {vehicle.name}: {error.owner!r}")
                raise
            if not self._dismiss():
                return

    def stop(self) -> None:
        """End the run of all."""
        self._ending = True
        self.kernel.stop()

    def close(self) -> None:
        """Close all vehicles, in order, and the kernel. An error keeps none from closing; the first one is raised."""
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

    def of(self, owner: object) -> "Vehicle | None":
        """The vehicle of what makes a call or hears messages: a task, or who looks on."""
        if isinstance(owner, Task):
            return owner.vehicle
        return next((vehicle for vehicle in self.vehicles if vehicle.owns(owner)), None)

    @property
    def _closing(self) -> bool:
        return any(vehicle.closing for vehicle in self.vehicles)

    def _attach(self, vehicle: "Vehicle") -> None:
        twin = next((other for other in self.vehicles if other is not vehicle and other.system == vehicle.system), None)
        if twin is not None:
            text = f"{vehicle.name} and {twin.name} have the same IMC id, {vehicle.system:#06x}"
            raise FleetError(f"{text}: give one another id in [IMC Addresses]")
        if vehicle.bus.is_attached:
            raise FleetError(f"the bus of {vehicle.name} reaches other processes already")
        vehicle.bus.attach(Neighbour(vehicle.bus, self._buses, self._kinds))

    def _dismiss(self) -> bool:
        """Close the vehicles that have stopped; whether there were any."""
        found = False
        while (stopped := next((vehicle for vehicle in self.vehicles if vehicle.stopped), None)) is not None:
            stopped.close()
            found = True
        return found

    def _failed(self, owner: object, error: Exception) -> None:
        vehicle = self.of(owner)
        try:
            if vehicle is None:
                error.add_note(f"in {owner!r}, which belongs to no vehicle of the fleet")
                raise error
            vehicle.failed(owner, error)
        except Exception:
            if not self._closing:
                raise
            self._fatal = self._fatal or error

    def _slow(self, owner: object, seconds: float) -> None:
        vehicle = self.of(owner)
        if vehicle is None:
            logger.warning("%r took %.3f s in one handler", owner, seconds)
        else:
            vehicle.slow(owner, seconds)
