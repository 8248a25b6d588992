"""A vehicle that runs elsewhere: its messages, plans, parameters; requests to it."""

import asyncio
from collections.abc import AsyncGenerator, Mapping
from contextlib import suppress
from typing import TypeVar, overload

import imc
from imc.discovery import Services
from imc.reserved_ids import UNKNOWN_SYSTEM
from shoal.network.link import NetworkError, NoAnswer, Refused
from shoal.network.logs import AsyncRemoteLogs
from shoal.network.message_filter_expression import parse_message_filter
from shoal.network.message_listener import check_message_type, require_message_instance
from shoal.network.network import Network
from shoal.network.parameters import AsyncRemoteParameters
from shoal.network.plans import AsyncRemotePlans
from shoal.network.system_table import NetworkSystem

M = TypeVar("M", bound=imc.Message)
ANNOUNCED = 0.3  # s for the Announce that a vehicle keeps for those who come


class AsyncRemoteVehicle:
    """A vehicle on the network, for programs with asyncio; `shoal.connect` makes it.

    plan: its plans. param: its parameters. log: its logs. network: all else that is received.
    """

    def __init__(self, network: Network, system: NetworkSystem) -> None:
        self.network = network
        self.system = system
        self.plan: AsyncRemotePlans = AsyncRemotePlans(network, system)
        self.param: AsyncRemoteParameters = AsyncRemoteParameters(network, system)
        self.log: AsyncRemoteLogs = AsyncRemoteLogs(network, system)
        self._has_asked = False

    @property
    def name(self) -> str:
        return self.system.name

    @property
    def id(self) -> int:
        """IMC id of the vehicle."""
        return UNKNOWN_SYSTEM if self.system.id is None else self.system.id

    async def latest(self, kind: type[M], *, entity: str = "", timeout: float | None = None) -> M:
        """The last message of a type, of one entity (label) if it is named; waits for the first one.

        Messages of the type are received from then on.

        Raises NoAnswer if none comes in time.
        """
        self.network.subscribe(self.system, (kind,))
        found = self.system.latest_message(kind, entity)
        if found is not None:
            return found
        return await self.network.next_message(self.system, kind, timeout, entity, takes_old=True)

    @overload
    def messages(self, kind: type[M], /, *, where: str = "") -> AsyncGenerator[M]: ...
    @overload
    def messages(self, *kinds: type[imc.Message], where: str = "") -> AsyncGenerator[imc.Message]: ...

    async def messages(self, *kinds: type[imc.Message], where: str = "") -> AsyncGenerator[imc.Message]:
        """The messages that the vehicle sends from now on: of some types, or all, that match an expression.

        Raises ValueError for a wrong expression, VehicleLost when the vehicle ends or falls silent.
        """
        test = parse_message_filter(where, tuple(map(check_message_type, kinds)), self.network.messages)
        stream = self.network.stream(self.system, kinds)
        try:
            async for message in stream:
                if test(message):
                    yield message
        finally:
            await stream.aclose()

    async def send(self, message: imc.Message) -> None:
        """Send a message once; whether it arrives is not known.

        Raises EncodeError if it does not fit a packet, Refused if the vehicle announces that it does not have it.
        """
        self.network.check_is_there(self.system)
        await self._check_type(message)
        self.network.send(self.system, message)

    async def _check_type(self, message: imc.Message) -> None:
        """Raise Refused if the vehicle announces that it cannot read a message. One of the user's waits for that."""
        kind, usual = type(require_message_instance(message)), imc.builtin()
        ours = imc.definition_checksum(kind)
        theirs = imc.definition_checksum(usual.by_id(kind.ID)) if kind.ID in usual.types_by_id else ""
        own = self._announced()
        if own is None and ours != theirs and not self._has_asked:
            self._has_asked = True
            self.network.subscribe(self.system, (imc.Announce,))
            with suppress(TimeoutError):
                async with asyncio.timeout(ANNOUNCED):
                    while (own := self._announced()) is None:
                        await asyncio.sleep(ANNOUNCED / 20)
        if own is None or isinstance(message, imc.Unknown) or ours == (theirs := own.get(kind.ID, theirs)):
            return
        what = f"{kind.__name__} (id {kind.ID})"
        if not theirs:
            raise Refused(f"{self.name} has no message {what}: name its file in [General] Messages there")
        raise Refused(f"{self.name} defines {what} in another way: use the same file here and in [General] Messages")

    def _announced(self) -> Mapping[int, str] | None:
        """The messages of its own that the vehicle announces; the Announce that begins its log lacks them."""
        announced = (
            Services.parse(found.services).message_checksums
            for found in self.system.latest_entity_messages(imc.Announce)
        )
        return next((messages for messages in announced if messages is not None), None)

    async def request(self, message: imc.Message, answer: type[M], *, timeout: float | None = None) -> M:
        """Send a message, again and again, until a message of a type comes to us or to all. Raises NoAnswer.

        If both have a field `request_id`, that of the answer is the one of the request. Raises Refused like `send`.
        """
        await self._check_type(message)
        number = getattr(message, "request_id", None)

        def fits(reply: imc.Message) -> M | None:
            if not isinstance(reply, answer) or reply.dst not in (UNKNOWN_SYSTEM, self.network.console.id):
                return None
            return reply if getattr(reply, "request_id", number) == number else None

        return await self.network.request(self.system, message, (answer,), fits, timeout=timeout)

    async def abort(self) -> None:
        """Stop everything at once, of all vehicles that have this name or its id.

        Raises NetworkError, such as NoAnswer, if one of them does not confirm it.
        """
        aborted: set[object] = set()
        troubles: list[str] = []
        while new := [each for each in self._namesakes() if not each[2] <= aborted]:
            aborted = aborted.union(*(parts for _, _, parts in new))
            found = await asyncio.gather(*(self._abort(s, n) for s, n, _ in new), return_exceptions=True)
            if other := next((e for e in found if e is not None and not isinstance(e, NetworkError)), None):
                raise other
            if isinstance(found[0], NetworkError) and not self.system.conflict_text and not troubles:
                raise found[0]
            troubles += [f"0x{n:04X}: {error}" for (_, n, _), error in zip(new, found, strict=True) if error]
        if self.system.has_duplicate_identity:
            troubles.append("they cannot be distinguished: perhaps only one has confirmed it")
        if troubles:
            raise NoAnswer(f"{self.system.conflict_text}; Abort was sent to all, but {'; '.join(troubles)}")

    def _namesakes(self) -> list[tuple[NetworkSystem, int, set[object]]]:
        """The systems of this name or id, by id, and the keys of all that receive their packets."""
        systems = [self.system, *self.system.systems_with_same_id]
        return [(each, id, {(each.name, id), *each.parts}) for each in systems for id in each.ids]

    async def _abort(self, system: NetworkSystem, number: int) -> None:
        error = imc.VehicleState.OpMode.ERROR
        before = system.latest_message(imc.VehicleState)
        known = before.last_error_time if before is not None and before.op_mode == error else None

        def confirms(message: imc.Message) -> bool | None:
            """Aborted, or where a transport does not carry that, an error that the vehicle did not have before."""
            if isinstance(message, imc.VehicleState):
                return True if message.op_mode == error and message.last_error_time != known else None
            return True if isinstance(message, imc.Aborted) else None

        await self.network.request(system, imc.Abort(), (imc.Aborted, imc.VehicleState), confirms, number=number)
