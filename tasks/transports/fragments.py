"""Puts messages together that come in pieces."""

import imc
from imc.fragments import FragmentAssembler
from runtime import State, Task, consume, param, periodic
from support.log_limit import ReportLimit


class Fragments(Task):
    """Puts the packets together that other systems send as MessagePart, and delivers them as if they came whole.

    A message that stays incomplete for the timeout is asked for once, and forgotten after another one; a system that
    begins many loses the oldest. The log book names once who loses messages, the state of the entity counts them.
    """

    reception_timeout: float = param(
        1800.0, "s", "Time after which missing pieces are asked for.", name="Reception timeout", minimum=1
    )

    def start(self) -> None:
        self._assembler = FragmentAssembler()
        self._malformed, self._lost = ReportLimit(), ReportLimit()

    @consume(others=True)
    def on_message_part(self, part: imc.MessagePart) -> None:
        if part.src == self.system or not self.is_addressed_or_broadcast(part):
            return
        try:
            packet = self._assembler.add(part, self.now)
            if packet is not None:
                self.relay(packet)
        except imc.DecodeError as error:
            if self._malformed.is_due(part.src):
                name = self.vehicle.systems.name(part.src)
                self.log.warning(f"pieces of a message from {name} dropped: {error.reason}; no more are reported")

    @periodic(1.0)
    def ask_again(self) -> None:
        """Ask for the pieces that are late, drop what does not come, and report it."""
        kind = imc.MessagePartControl
        for system, uid, message in self._assembler.overdue_messages(self.now - self.reception_timeout):
            message.asked = True
            request = kind(op=kind.Op.REQUEST_RETRANSMIT, uid=uid, frag_ids=message.format_missing_parts(), dst=system)
            self.publish(request)
        self._assembler.expire(self.now - 2.0 * self.reception_timeout)
        for system, why in self._assembler.given_up:
            if self._lost.is_due((system, why)):
                name = self.vehicle.systems.name(system)
                self.log.warning(f"message in pieces from {name} lost: {why}; further ones are counted")
        if counts := self._assembler.counts:
            listed = ", ".join(f"{number} {what}" for what, number in counts.items())
            self.set_entity_state(State.NORMAL, f"{len(self._assembler)} incomplete; {listed}")
