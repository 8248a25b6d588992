"""The command protocol: each order is carried out once, and acknowledged to its sender."""

import math
from collections.abc import Callable, Collection, Mapping
from weakref import WeakKeyDictionary

from mavlink import ReceivedMessage, statustext
from mavlink.vehicle.command.message_requests import READING
from mavlink.vehicle.command.request import (
    REPEATED,
    CommandRequest,
    CommandResult,
    MavResult,
    PendingCommand,
    parse_command,
)
from mavlink.vehicle.model import VehicleModel
from mavlink.vehicle.service import Handler, MavlinkService
from mavlink.vehicle.session import Session

WITHOUT_PROGRESS = frozenset({176, 262, 400})
"""Modes and arming: MAVSDK 4 takes "in progress" for the end of these, and gives up."""
PERIODS = 6  # of a station's repetitions, in which these are answered: MAVSDK waits for 2 s
SILENT = "the vehicle does not answer"

Command = Callable[[Session, CommandRequest, float], CommandResult | None]
"""Carries out a request; None if that takes time, and its `finish` is called later."""


class CommandService(MavlinkService):
    """COMMAND_LONG and COMMAND_INT to one component.

    `moving` are the commands that act on the vehicle: they are counted in the model, and rejected with `refusal` if
    that is not empty.
    """

    def __init__(
        self, model: VehicleModel, commands: Mapping[int, Command], moving: Collection[int], refusal: str = ""
    ) -> None:
        self._model = model
        self._commands = commands
        self._moving = moving
        self._refusal = refusal
        self._pending: WeakKeyDictionary[Session, dict[tuple[int, int, int], PendingCommand]] = WeakKeyDictionary()

    @property
    def handlers(self) -> Mapping[str, Handler]:
        return {"COMMAND_LONG": self.receive, "COMMAND_INT": self.receive}

    def receive(self, session: Session, message: ReceivedMessage, now: float) -> None:
        """Carry out a command, acknowledge it, and send the reason if it is rejected.

        An order that takes time is acknowledged when the vehicle has answered, and before that as in progress if that
        takes long, except for those WITHOUT_PROGRESS.
        """
        pending, command = self._pending.setdefault(session, {}), message.values["command"]
        key = message.system, message.component, command
        last = pending.get(key)
        if last is not None and last.is_repeated_by(message, self._model.command_count, now):
            if last.reply is not None or command not in WITHOUT_PROGRESS:
                acknowledge(session, message, last.reply or CommandResult(MavResult.IN_PROGRESS), now)
            return
        self._model.command_count += command in self._moving and not session.refusal
        periods = PERIODS if command in WITHOUT_PROGRESS else 1
        begun = PendingCommand(
            message, now + REPEATED * session.speed, now + periods * session.retry_period, self._model.command_count
        )

        def finish(reply: CommandResult) -> None:
            if begun.reply is None:
                begun.reply = reply
                acknowledge(session, message, reply, now)

        reply = self._carry_out(session, parse_command(message, finish), now)
        if reply is not None:
            pending.pop(key, None)
            acknowledge(session, message, reply, now)
            return
        pending[key] = begun

    def poll(self, now: float) -> None:
        """Report to those who wait for an answer that it takes time."""
        for session, pending in list(self._pending.items()):
            for key, command in list(pending.items()):
                if command.reply is not None and now >= command.until:
                    del pending[key]
            for command in [each for each in pending.values() if each.reply is None]:
                if now < command.progress_due:
                    continue
                command.progress_due = math.inf
                if command.message.values["command"] in WITHOUT_PROGRESS:
                    command.reply = CommandResult(MavResult.FAILED, SILENT)
                acknowledge(session, command.message, command.reply or CommandResult(MavResult.IN_PROGRESS), now)

    @property
    def next_deadline(self) -> float | None:
        waiting = [each for pending in self._pending.values() for each in pending.values() if each.reply is None]
        return min((each.progress_due for each in waiting if each.progress_due < math.inf), default=None)

    def forget(self, session: Session) -> None:
        self._pending.pop(session, None)

    def _carry_out(self, session: Session, order: CommandRequest, now: float) -> CommandResult | None:
        if session.refusal and order.command not in READING:
            return CommandResult(MavResult.DENIED, session.refusal)
        if self._refusal and order.command in self._moving:
            return CommandResult(MavResult.DENIED, self._refusal)
        command = self._commands.get(order.command)
        return CommandResult(MavResult.UNSUPPORTED) if command is None else command(session, order, now)


def acknowledge(session: Session, message: ReceivedMessage, reply: CommandResult, now: float) -> None:
    """Send COMMAND_ACK, and the reason to people."""
    progress = 255 if reply.result is MavResult.IN_PROGRESS else 0
    session.reply(message, "COMMAND_ACK", command=message.values["command"], result=reply.result, progress=progress)
    if reply.reason:
        session.send_statustext(statustext.WARNING, reply.reason, now)
