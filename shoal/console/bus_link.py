"""The bus of a vehicle in this process, as a network with one system."""

import asyncio
from collections.abc import Callable, Collection
from contextlib import suppress

import imc
from shoal.network import ConsoleIdentity, LinkListener, NetworkLink, ReceivedPacket
from tasks.transports.console import Console, PagePackets

LOOK = 0.1  # s between two looks at the latest messages while somebody watches
IDLE_LOOK = 10.0  # s otherwise
ACTIVE = 5.0  # s after an order in which its effects are followed as if somebody watched


class BusLink(NetworkLink):
    """Brings the messages of the vehicle whose task serves the page, and puts orders on its bus.

    `is_watched()` is whether somebody looks. `on_end()` is called when it brings nothing any more; `close` raises what
    has failed. All calls are made in the thread of the page's event loop; the kernel of the vehicle runs in another
    one.
    """

    name = "bus"
    trouble = ""
    delivers_all = True
    fragment_size = 0

    def __init__(self, task: Console, is_watched: Callable[[], bool] = lambda: True) -> None:
        self._task = task
        self.is_watched: Callable[[], bool] = is_watched
        self.on_end: Callable[[], object] = lambda: None
        self._wanted: set[tuple[str, str]] = set()  # by system, which may be everybody
        self._active_until = 0.0
        self._is_active = False
        self._woken = asyncio.Event()
        self._looking: asyncio.Task[None] | None = None

    @property
    def discovery_timeout(self) -> float:
        return LOOK

    def wake(self) -> None:
        """Look now, since somebody watches."""
        self._woken.set()

    @property
    def awaits_answers(self) -> bool:
        return False

    async def open(self, listener: LinkListener, console: ConsoleIdentity) -> None:
        loop = asyncio.get_running_loop()

        def wake() -> None:
            with suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(self._woken.set)

        packets = self._task.connect_page(console.id, wake)
        listener.on_appeared(self, self._task.system_name, "bus", "", self._task.system)
        self._looking = asyncio.create_task(self._look(listener, packets))
        self._looking.add_done_callback(lambda _: self.on_end())

    def subscribe(self, system: str, messages: Collection[str]) -> None:
        self._wanted |= {(system, message) for message in messages or ("",)}
        self._task.request_messages(messages)

    def unsubscribe(self, system: str, messages: Collection[str]) -> bool:
        self._wanted -= {(system, message) for message in messages or ("",)}
        left = {message for _, message in self._wanted}
        for message in [message for message in messages or ("",) if message not in left]:
            self._task.release_messages((message,) if message else ())
        return True

    def send(self, system: str, message: imc.Message, packet: bytes) -> None:
        self._active_until = asyncio.get_running_loop().time() + ACTIVE
        self._set_active(True)  # before the order, so that no answer is missed
        self._task.take_order(packet)
        self._woken.set()

    async def close(self) -> None:
        if self._looking is not None:
            self._looking.cancel()
            with suppress(asyncio.CancelledError):
                await self._looking

    def _set_active(self, is_active: bool) -> None:
        if is_active != self._is_active:
            self._is_active = is_active
            self._task.set_watched(is_active)

    async def _look(self, listener: LinkListener, packets: PagePackets) -> None:
        loop, name = asyncio.get_running_loop(), self._task.system_name
        while True:
            for packet in packets.take():
                listener.on_packet(self, ReceivedPacket(packet, name))
            self._set_active(self.is_watched() or loop.time() < self._active_until)
            with suppress(TimeoutError):
                async with asyncio.timeout(LOOK if self._is_active else IDLE_LOOK):
                    await self._woken.wait()
            self._woken.clear()
