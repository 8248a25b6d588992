"""The same without asyncio: the event loop runs in a thread of its own."""

import asyncio
import concurrent.futures
import threading
from collections.abc import AsyncGenerator, Callable, Coroutine, Generator
from contextlib import suppress
from functools import wraps
from typing import Any, Concatenate, Final, ParamSpec, TypeVar, overload

import imc
from shoal.network.link import NetworkError
from shoal.network.logs import AsyncRemoteLogs
from shoal.network.network import Network
from shoal.network.parameters import AsyncRemoteParameters
from shoal.network.plans import AsyncRemotePlans
from shoal.network.remote_vehicle import AsyncRemoteVehicle

P = ParamSpec("P")
T = TypeVar("T")
M = TypeVar("M", bound=imc.Message)
ENDED = "the connection to the vehicle has been closed"
IN_PROGRESS = "`progress` cannot ask the vehicle: store the state and ask when `start` has returned, or use asyncio"


class LoopThread:
    """An event loop in a thread; `call` runs a coroutine there and waits for its result."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._lock = threading.Lock()  # what is called before the end is canceled by it; nothing is called after it
        self._has_ended = False
        self._thread = threading.Thread(target=self._loop.run_forever, name="shoal network", daemon=True)
        self._thread.start()

    def call(self, coroutine: Coroutine[Any, Any, T]) -> T:
        here = threading.current_thread() is self._thread  # to wait here would be to wait for ever
        with self._lock:
            if here or self._has_ended:
                coroutine.close()
                raise NetworkError(ENDED if self._has_ended else IN_PROGRESS)
            future = asyncio.run_coroutine_threadsafe(coroutine, self._loop)
        try:
            return future.result()
        except concurrent.futures.CancelledError:
            raise NetworkError(ENDED) from None
        except BaseException:  # also Ctrl-C: waiting on the network must end
            future.cancel()
            raise

    def close(self) -> None:
        """End the loop; calls that other threads wait for raise NetworkError."""
        if threading.current_thread() is self._thread:
            raise NetworkError(IN_PROGRESS)
        with self._lock:
            self._has_ended = True
            future = asyncio.run_coroutine_threadsafe(_cancel_others(), self._loop)
        try:
            future.result()
        finally:
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()
            self._loop.close()


async def _cancel_others() -> None:
    others = asyncio.all_tasks() - {asyncio.current_task()}
    for task in others:
        task.cancel()
    await asyncio.gather(*others, return_exceptions=True)


class _BlockingProxy:
    """The face of an asyncio object for programs without asyncio."""

    def __init__(self, portal: LoopThread, target: object) -> None:
        self._portal, self._target = portal, target

    @staticmethod
    def blocking(method: Callable[Concatenate[Any, P], Coroutine[Any, Any, T]]) -> Callable[Concatenate[Any, P], T]:
        """The same method, but it waits for the result."""

        @wraps(method)
        def wait(face: _BlockingProxy, *args: P.args, **named: P.kwargs) -> T:
            return face._portal.call(method(face._target, *args, **named))

        return wait


class RemotePlans(_BlockingProxy):
    """The plans of a vehicle; `progress` is called in the thread of the network."""

    list: Final = _BlockingProxy.blocking(AsyncRemotePlans.list)
    get: Final = _BlockingProxy.blocking(AsyncRemotePlans.get)
    put: Final = _BlockingProxy.blocking(AsyncRemotePlans.put)
    delete: Final = _BlockingProxy.blocking(AsyncRemotePlans.delete)
    status: Final = _BlockingProxy.blocking(AsyncRemotePlans.status)
    estimate: Final = _BlockingProxy.blocking(AsyncRemotePlans.estimate)
    start: Final = _BlockingProxy.blocking(AsyncRemotePlans.start)
    stop: Final = _BlockingProxy.blocking(AsyncRemotePlans.stop)


class RemoteParameters(_BlockingProxy):
    """The parameters of a vehicle, by the label of the entity; values are texts."""

    entity_ids: Final = _BlockingProxy.blocking(AsyncRemoteParameters.entity_ids)
    list: Final = _BlockingProxy.blocking(AsyncRemoteParameters.list)
    get: Final = _BlockingProxy.blocking(AsyncRemoteParameters.get)
    set: Final = _BlockingProxy.blocking(AsyncRemoteParameters.set)
    save: Final = _BlockingProxy.blocking(AsyncRemoteParameters.save)


class RemoteLogs(_BlockingProxy):
    """The logs of a vehicle."""

    list: Final = _BlockingProxy.blocking(AsyncRemoteLogs.list)
    fetch: Final = _BlockingProxy.blocking(AsyncRemoteLogs.fetch)


class RemoteVehicle(_BlockingProxy):
    """A vehicle on the network, for programs without asyncio; `shoal.connect` makes it."""

    def __init__(self, portal: LoopThread, vehicle: AsyncRemoteVehicle) -> None:
        super().__init__(portal, vehicle)
        self._vehicle = vehicle
        self.plan: RemotePlans = RemotePlans(portal, vehicle.plan)
        self.param: RemoteParameters = RemoteParameters(portal, vehicle.param)
        self.log: RemoteLogs = RemoteLogs(portal, vehicle.log)

    @property
    def name(self) -> str:
        return self._vehicle.name

    @property
    def id(self) -> int:
        """IMC id of the vehicle."""
        return self._vehicle.id

    latest: Final = _BlockingProxy.blocking(AsyncRemoteVehicle.latest)
    send: Final = _BlockingProxy.blocking(AsyncRemoteVehicle.send)
    request: Final = _BlockingProxy.blocking(AsyncRemoteVehicle.request)
    abort: Final = _BlockingProxy.blocking(AsyncRemoteVehicle.abort)

    @overload
    def messages(self, kind: type[M], /, *, where: str = "") -> Generator[M]: ...
    @overload
    def messages(self, *kinds: type[imc.Message], where: str = "") -> Generator[imc.Message]: ...

    def messages(self, *kinds: type[imc.Message], where: str = "") -> Generator[imc.Message]:
        """The messages of some types that the vehicle sends from now on and that match an expression."""
        stream: AsyncGenerator[imc.Message] = self._vehicle.messages(*kinds, where=where)
        try:
            while True:
                yield self._portal.call(_next(stream))
        finally:
            with suppress(NetworkError):  # the connection has been closed before
                self._portal.call(_close(stream))


async def _next(stream: AsyncGenerator[M]) -> M:
    return await anext(stream)


async def _close(stream: AsyncGenerator[M]) -> None:
    await stream.aclose()


class VehicleConnection:
    """A vehicle by its name, as a context manager of both kinds: `with` and `async with`; or `open` and `close`."""

    def __init__(self, name: str, network: Callable[[], Network], timeout: float | None) -> None:
        self._name = name
        self._make = network
        self._timeout = timeout
        self._network: Network | None = None
        self._portal: LoopThread | None = None

    async def __aenter__(self) -> AsyncRemoteVehicle:
        self._network = network = self._make()
        await network.__aenter__()
        try:
            return AsyncRemoteVehicle(network, await network.find_system(self._name, self._timeout))
        except BaseException:
            await network.__aexit__()
            raise

    async def __aexit__(self, *_: object) -> None:
        network, self._network = self._network, None
        if network is not None:
            await network.__aexit__()

    def open(self) -> RemoteVehicle:
        """The vehicle until `close`, for the cells of a notebook."""
        self.close()
        portal = LoopThread()
        try:
            vehicle = RemoteVehicle(portal, portal.call(self.__aenter__()))
        except BaseException:
            portal.close()
            raise
        self._portal = portal
        return vehicle

    def close(self) -> None:
        """End the connection, if it is open."""
        portal, self._portal = self._portal, None
        if portal is not None:
            try:
                portal.call(self.__aexit__())
            finally:
                portal.close()

    def __enter__(self) -> RemoteVehicle:
        return self.open()

    def __exit__(self, *_: object) -> None:
        self.close()
