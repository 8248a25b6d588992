"""Rejects orders over zenoh of systems that are not in [General] Consoles: each is named once, and gets the reason."""

import time
from collections.abc import Callable

import imc
from imc.console_acl import NOT_LISTED, OVER_ZENOH, ConsoleAcl, OrderRefusals, message_type_name
from imc.discovery import displayable_name
from runtime.zenoh.presence import ProcessPart
from support.log_limit import ReportLimit

ANYBODY = ConsoleAcl((), lambda _: None)


class UnlistedConsoles:
    """The rule of one process of a vehicle, `part`; None stands for a relay, which rejects nothing.

    `consoles` may command. `warn` gets a sentence for the log book, `send(system, packet)` an answer to a system; only
    the main process of a vehicle writes or sends anything. `rejected` counts orders, `dropped` messages that other
    vehicles publish beyond the reports that are taken from all. All may be called from any thread.
    """

    def __init__(
        self,
        consoles: ConsoleAcl,
        part: ProcessPart | None,
        warn: Callable[[str], None],
        send: Callable[[int, bytes], object],
    ) -> None:
        self.rejected: int = 0
        self.dropped: int = 0
        self._consoles = consoles if part is not None else ANYBODY
        self._says = part is not None and part.process == "main"
        self._refusals = OrderRefusals(part.vehicle, part.system) if part is not None else OrderRefusals("", 0)
        self._warn = warn
        self._send = send
        self._named, self._named_publishers = ReportLimit(), ReportLimit()

    def may_send(self, packet: bytes) -> bool:
        """Whether the source of a packet (SMALLEST_PACKET or longer) is listed, or only reports."""
        return self._consoles.is_open or self._consoles.allows(
            imc.packet_source(packet), OVER_ZENOH, imc.packet_id(packet)
        )

    def reject(self, packet: bytes, name: str) -> str:
        """Count an order of a system that calls itself `name`, and name it once; returns the reason."""
        source = imc.packet_source(packet)
        self.rejected += 1
        if self._says and self._named.is_due(source):
            who = _describe(source, name)
            self._warn(f"packet from {who} over zenoh dropped: {NOT_LISTED} (see [General] Consoles)")
        return self._refusals.reason(packet, source)

    def drop(self, packet: bytes, name: str) -> None:
        """Count a message that another vehicle, which calls itself `name`, publishes, and name this vehicle once."""
        source = imc.packet_source(packet)
        self.dropped += 1
        if self._says and self._named_publishers.is_due(source):
            what = message_type_name(imc.packet_id(packet))
            self._warn(
                f"{what} of {_describe(source, name)} over zenoh dropped, as will be all that is no report: "
                "the system is not in [General] Consoles"
            )

    def reject_and_answer(self, packet: bytes, name: str) -> None:
        """Reject an order that is no query, and send the reason to its source."""
        self.reject(packet, name)
        if self._says and (answer := self._refusals.answer(packet, time.time())):
            self._send(imc.packet_source(packet), answer)


def _describe(source: int, name: str) -> str:
    """A system with its id and, if it has another one, its name."""
    name = displayable_name(name)
    return f"0x{source:04X} ({name})" if name not in ("", f"0x{source:04X}") else f"0x{source:04X}"
