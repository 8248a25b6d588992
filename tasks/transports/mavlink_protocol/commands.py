"""The command protocol: each order is carried out once, and acknowledged to whom gave it."""

import math
from collections.abc import Callable, Mapping

from mavlink import ReceivedMessage, statustext
from tasks.transports.mavlink_protocol import inquiries, steering
from tasks.transports.mavlink_protocol.orders import REPEATED, Dialogue, Order, Reply, Result, order_of
from tasks.transports.mavlink_protocol.session import Session

Command = Callable[[Session, Order, float], Reply | None]
COMMANDS: Mapping[int, Command] = {**inquiries.COMMANDS, **steering.COMMANDS}


def obey(session: Session, message: ReceivedMessage, now: float, commands: Mapping[int, Command] = COMMANDS) -> None:
    """Carry out COMMAND_LONG or COMMAND_INT, acknowledge it, and send the reason if it is refused.

    An order that takes time is acknowledged when the vehicle has answered, and before that as in progress if that
    takes long.
    """
    system, command = session.autopilot, message.values["command"]
    key = message.system, message.component, command
    last = session.dialogues.get(key)
    if last is not None and last.repeats(message, system.orders, now):
        acknowledge(session, message, last.reply or Reply(Result.IN_PROGRESS), now)
        return
    system.orders += command in steering.COMMANDS
    dialogue = Dialogue(message, now + REPEATED * session.speed, now + session.patience, system.orders)

    def finish(reply: Reply) -> None:
        if dialogue.reply is None:
            dialogue.reply = reply
            acknowledge(session, message, reply, now)

    order = order_of(message, finish)
    refused = system.refusal and command in steering.COMMANDS
    command_of = _refused if refused else commands.get(order.command, _unsupported)
    reply = command_of(session, order, now)
    if reply is not None:
        session.dialogues.pop(key, None)
        acknowledge(session, message, reply, now)
        return
    session.dialogues[key] = dialogue


def look_after(session: Session, now: float) -> float | None:
    """Tell who waits for an answer that it takes time; returns when the next one has waited long, in s since 1970."""
    for key, dialogue in list(session.dialogues.items()):
        if dialogue.reply is not None and now >= dialogue.until:
            del session.dialogues[key]
    waiting = [d for d in session.dialogues.values() if d.reply is None and d.impatient < math.inf]
    for dialogue in waiting:
        if now >= dialogue.impatient:
            dialogue.impatient = math.inf
            acknowledge(session, dialogue.message, Reply(Result.IN_PROGRESS), now)
    return min((d.impatient for d in waiting if d.impatient < math.inf), default=None)


def acknowledge(session: Session, message: ReceivedMessage, reply: Reply, now: float) -> None:
    progress = 255 if reply.result is Result.IN_PROGRESS else 0
    session.answer(message, "COMMAND_ACK", command=message.values["command"], result=reply.result, progress=progress)
    if reply.reason:
        session.say(statustext.WARNING, reply.reason, now)


def _unsupported(session: Session, order: Order, now: float) -> Reply:
    return Reply(Result.UNSUPPORTED)


def _refused(session: Session, order: Order, now: float) -> Reply:
    return Reply(Result.DENIED, session.autopilot.refusal)
