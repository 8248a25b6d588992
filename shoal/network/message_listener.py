"""A reader of messages, which may be slow, and the kinds of damage to packets."""

import asyncio
from collections import deque
from collections.abc import Collection

import imc
from shoal.network.message_requests import MessageUse
from shoal.network.system_table import NetworkSystem

MOST_WAITING = 8192  # messages in front of a slow reader


class MessageListener:
    """Messages from a system, or to it, of some types, in the order of arrival; of all systems and types without.

    `lost` is how many were too many for the reader. `use` has links bring them. `takes_old`: also the last ones
    before, if they were kept.
    """

    def __init__(
        self,
        system: NetworkSystem | None,
        kinds: Collection[type[imc.Message]],
        use: MessageUse,
        *,
        takes_old: bool = False,
    ) -> None:
        self.lost: int = 0
        self.use = use
        self.takes_old = takes_old
        self.system: NetworkSystem | None = system
        self._kinds = tuple(kinds)
        self._waiting: deque[tuple[NetworkSystem, imc.Message, bytes]] = deque()
        self._news = asyncio.Event()

    def put(self, system: NetworkSystem, message: imc.Message, packet: bytes) -> None:
        mine = self.system
        if (mine is not None and mine is not system and message.dst != mine.id) or (
            self._kinds and not isinstance(message, self._kinds)
        ):
            return
        if len(self._waiting) >= MOST_WAITING:
            self._waiting.popleft()
            self.lost += 1
        self._waiting.append((system, message, packet))
        self._news.set()

    async def next(self, timeout: float | None = None) -> tuple[NetworkSystem, imc.Message]:
        """The next message and who sent it. Raises TimeoutError."""
        return (await self.next_with_packet(timeout))[:2]

    async def next_with_packet(self, timeout: float | None = None) -> tuple[NetworkSystem, imc.Message, bytes]:
        """The same, and the packet as it came. Raises TimeoutError."""
        while not self._waiting:
            self._news.clear()
            async with asyncio.timeout(timeout):  # wait_for of Python 3.11 loses a cancellation now and then
                await self._news.wait()
        return self._waiting.popleft()

    def take_all(self) -> list[tuple[NetworkSystem, imc.Message]]:
        """The messages that have arrived and were not read."""
        waiting, self._waiting = self._waiting, deque()
        return [(system, message) for system, message, _ in waiting]


def check_message_type(kind: object) -> type[imc.Message]:
    """The type itself. Raises TypeError for what is none, such as the name of one."""
    if isinstance(kind, type) and issubclass(kind, imc.Message):
        return kind
    raise TypeError(f"{kind!r} is not a type of message, such as imc.EstimatedState")


def require_message_instance(message: object) -> imc.Message:
    """The message itself. Raises TypeError for what is none, such as a type of them."""
    if isinstance(message, imc.Message):
        return message
    raise TypeError(f"{message!r} is not a message, such as imc.Heartbeat()")


def damage_kind(reason: str) -> str:
    """The kind of an error in a packet, without its numbers: there must not be a count for each."""
    if "CRC" in reason:
        return "wrong CRC"
    if "too short" in reason or "inside a message" in reason:
        return f"schema mismatch: {reason.partition(':')[0]}"
    return reason.partition(":")[0].partition(" 0x")[0]
