"""The same without asyncio: the event loop runs in a thread of its own."""

import asyncio
import threading
from collections.abc import AsyncGenerator, Callable, Coroutine, Generator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar, overload

import imc
from shoal.network.logs import RemoteLog
from shoal.network.network import PATIENCE, Network
from shoal.network.plans import Outcome, StoredPlan
from shoal.network.vehicle import AsyncRemoteVehicle

T = TypeVar("T")
M = TypeVar("M", bound=imc.Message)


class Portal:
    """An event loop in a thread; `call` runs a coroutine there and waits for its result."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="shoal network", daemon=True)
        self._thread.start()

    def call(self, coroutine: Coroutine[Any, Any, T]) -> T:
        future = asyncio.run_coroutine_threadsafe(coroutine, self._loop)
        try:
            return future.result()
        except BaseException:  # also Ctrl-C: what waits on the network must not go on
            future.cancel()
            raise

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


class RemotePlans:
    """The plans of a vehicle; see `AsyncRemoteVehicle.plan` for what can go wrong."""

    def __init__(self, portal: Portal, vehicle: AsyncRemoteVehicle) -> None:
        self._call = portal.call
        self._plans = vehicle.plan

    def list(self) -> list[StoredPlan]:
        """All plans that are stored, by name."""
        return self._call(self._plans.list())

    def get(self, name: str) -> imc.PlanSpecification:
        """A stored plan."""
        return self._call(self._plans.get(name))

    def put(self, plan: imc.PlanSpecification) -> None:
        """Store a plan under its own name."""
        self._call(self._plans.put(plan))

    def delete(self, name: str) -> None:
        """Delete a stored plan."""
        self._call(self._plans.delete(name))

    def status(self) -> imc.PlanControlState:
        """What the plan engine does."""
        return self._call(self._plans.status())

    def start(
        self,
        plan: str | imc.PlanSpecification,
        *,
        wait: bool = True,
        calibrate: bool = False,
        ignore_errors: bool = False,
        progress: Callable[[imc.PlanControlState], object] | None = None,
    ) -> Outcome | None:
        """Start a plan and wait for its end; None without `wait`. `progress` is called in the thread of the network."""
        return self._call(
            self._plans.start(plan, wait=wait, calibrate=calibrate, ignore_errors=ignore_errors, progress=progress)
        )

    def stop(self) -> None:
        """Stop the plan that is running."""
        self._call(self._plans.stop())


class RemoteParameters:
    """The parameters of a vehicle, by the label of the entity; values are texts."""

    def __init__(self, portal: Portal, vehicle: AsyncRemoteVehicle) -> None:
        self._call = portal.call
        self._parameters = vehicle.param

    def entities(self) -> dict[str, int]:
        """The ids of all entities, by label."""
        return self._call(self._parameters.entities())

    def list(self) -> dict[str, dict[str, str]]:
        """The parameters of all entities that have any."""
        return self._call(self._parameters.list())

    def get(self, entity: str) -> dict[str, str]:
        """The parameters of one entity."""
        return self._call(self._parameters.get(entity))

    def set(self, entity: str, values: Mapping[str, str]) -> dict[str, str]:
        """Set parameters of one entity; returns those that were accepted."""
        return self._call(self._parameters.set(entity, values))

    def save(self, entity: str) -> None:
        """Have the vehicle keep the values of an entity for its next start."""
        self._call(self._parameters.save(entity))


class RemoteLogs:
    """The logs of a vehicle."""

    def __init__(self, portal: Portal, vehicle: AsyncRemoteVehicle) -> None:
        self._call = portal.call
        self._logs = vehicle.log

    def list(self) -> list[RemoteLog]:
        """All logs, the oldest first."""
        return self._call(self._logs.list())

    def fetch(self, log: RemoteLog, folder: Path) -> Path:
        """Copy a log into a folder; returns where it is."""
        return self._call(self._logs.fetch(log, folder))


class RemoteVehicle:
    """A vehicle on the network, for programs without asyncio; `shoal.connect` makes it."""

    def __init__(self, portal: Portal, vehicle: AsyncRemoteVehicle) -> None:
        self._portal = portal
        self._vehicle = vehicle
        self.plan = RemotePlans(portal, vehicle)
        self.param = RemoteParameters(portal, vehicle)
        self.log = RemoteLogs(portal, vehicle)

    @property
    def name(self) -> str:
        return self._vehicle.name

    @property
    def id(self) -> int:
        """Its IMC id."""
        return self._vehicle.id

    def latest(self, kind: type[M], *, entity: str = "", timeout: float = PATIENCE) -> M:
        """The last message of a type, of one entity (label) if it is named; waits for the first one."""
        return self._portal.call(self._vehicle.latest(kind, entity=entity, timeout=timeout))

    @overload
    def messages(self, kind: type[M], /, *, where: str = "") -> Generator[M]: ...
    @overload
    def messages(self, *kinds: type[imc.Message], where: str = "") -> Generator[imc.Message]: ...

    def messages(self, *kinds: type[imc.Message], where: str = "") -> Generator[imc.Message]:
        """What the vehicle says from now on, of some types, that matches an expression."""
        stream: AsyncGenerator[imc.Message] = self._vehicle.messages(*kinds, where=where)
        try:
            while True:
                yield self._portal.call(_next(stream))
        finally:
            self._portal.call(_close(stream))

    def send(self, message: imc.Message) -> None:
        """Send a message once; whether it arrives is not known."""
        self._portal.call(self._vehicle.send(message))

    def request(self, message: imc.Message, answer: type[M], *, timeout: float = PATIENCE) -> M:
        """Send a message until a message of a type comes to us or to all."""
        return self._portal.call(self._vehicle.request(message, answer, timeout=timeout))

    def abort(self) -> None:
        """Stop everything at once, and wait until the vehicle confirms it."""
        self._portal.call(self._vehicle.abort())


async def _next(stream: AsyncGenerator[M]) -> M:
    return await anext(stream)


async def _close(stream: AsyncGenerator[M]) -> None:
    await stream.aclose()


class Connection:
    """A vehicle by its name, as a context manager of both kinds: `with` and `async with`."""

    def __init__(self, name: str, network: Callable[[], Network], timeout: float) -> None:
        self._name = name
        self._make = network
        self._timeout = timeout
        self._network: Network | None = None
        self._portal: Portal | None = None

    async def __aenter__(self) -> AsyncRemoteVehicle:
        self._network = network = self._make()
        await network.__aenter__()
        try:
            return AsyncRemoteVehicle(network, await network.find(self._name, self._timeout))
        except BaseException:
            await network.__aexit__()
            raise

    async def __aexit__(self, *_: object) -> None:
        network, self._network = self._network, None
        if network is not None:
            await network.__aexit__()

    def __enter__(self) -> RemoteVehicle:
        self._portal = portal = Portal()
        try:
            return RemoteVehicle(portal, portal.call(self.__aenter__()))
        except BaseException:
            portal.close()
            raise

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        portal, self._portal = self._portal, None
        if portal is not None:
            try:
                portal.call(self.__aexit__())
            finally:
                portal.close()
