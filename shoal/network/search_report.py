"""Sentences on a search for a vehicle: why it takes long, and who is there instead."""

from collections.abc import Callable, Sequence

import imc
from imc.discovery import PERIOD
from shoal.network.link import NetworkLink
from shoal.network.system_table import CONTACT, NetworkSystem
from support.terminal_text import printable, suggestion

EXPLAINED = 2.0  # s after which a search that may take long is explained
LONGEST = 8.0  # s for a system to announce its id, or for Shoal to send data


class SearchReport:
    """Explains searches on some links. `report` gets each sentence on a search that takes long, once.

    `expects_all`: whether a link that does not work is worth a sentence also if others work.
    """

    def __init__(self, links: Sequence[NetworkLink], report: Callable[[str], object], *, expects_all: bool):
        self._links, self._report, self._expects_all = links, report, expects_all
        self._reported = set[str]()

    @property
    def discovery_timeout(self) -> float:
        """The time (s) to wait for a system to appear."""
        return max((link.discovery_timeout for link in self._links), default=0.0)

    @property
    def awaits_answers(self) -> bool:
        """Whether a program has received our announcement and not answered yet."""
        return any(link.awaits_answers for link in self._links)

    @property
    def link_troubles(self) -> list[str]:
        """Troubles of the networks that the user searches."""
        return self._troubles if self._expects_all else []

    def time_left(self, system: NetworkSystem | None, began: float, timeout: float | None, now: float) -> float:
        """The time (s) after which a search ends that `began` earlier; `system` has the name, if one is known."""
        if timeout is not None:
            return began + timeout - now
        left = began + self.discovery_timeout - now
        if system is None or not system.is_there:
            return left
        return max(left, max(began, system.appeared_at) + LONGEST - now, system.contact_timeout)

    def explain(self, past: float, there: Sequence[NetworkSystem]) -> None:
        """Report once why a search, which has taken `past` s, takes longer: no vehicle answers, or sends anything."""
        if past < EXPLAINED:
            return
        late = [system.name for system in there if system.contact_timeout]
        texts = [f"{name} has announced itself; a DUNE vehicle sends data within {CONTACT:g} s" for name in late]
        if not there and self.discovery_timeout > PERIOD:
            why = f"since DUNE announces itself every {PERIOD:g} s"
            texts = [f"no answer yet; waiting up to {self.discovery_timeout:g} s, {why}"]
        for text in texts:
            if text not in self._reported:
                self._reported.add(text)
                self._report(printable(text))

    def no_vehicle_text(self) -> str:
        """The sentence for a network without vehicles."""
        return f"no vehicle is on the network{self._in_brackets(self._troubles)}"

    def not_found_text(self, name: str, system: NetworkSystem | None, vehicles: Sequence[NetworkSystem]) -> str:
        """Reason why a search for a name has found nothing to talk to; `system` has the name, `vehicles` are there."""
        if system is not None and system.conflict_text:
            return f"{name}: {system.conflict_text}; end one of them"
        if system is not None and system.is_there:
            if system.awaits_contact:
                return f"{name} has announced itself, but sent nothing yet; `shoal link {name}` explains why"
            return f"{name} is there, but sends nothing"
        there = [system.name for system in vehicles]
        if there:
            hint = suggestion(name, there) or "`shoal ls` lists them"
            return f"no vehicle {printable(name)!r} on the network; {hint}{self._in_brackets(self.link_troubles)}"
        return self.no_vehicle_text()

    def absence_text(self, system: NetworkSystem) -> str:
        """The sentence for a system that is not there any more."""
        how = "gone; it has ended" if system.has_ended else f"not received any more, for {system.age:.0f} s"
        troubles = [link.trouble for link in self._links if link.trouble and link.name in system.received]
        return f"{system.name} is {how}{self._in_brackets(troubles)}"

    @staticmethod
    def no_answer_text(system: NetworkSystem, request: str, timeout: float, copies: int, *, is_repeated: bool) -> str:
        """The sentence for a request, of which so many copies were sent, without an answer within a time (s)."""
        text = f"{system.name} does not answer {request} within {timeout:.3g} s"
        if not copies:
            return f"{text}, to which no link leads: nothing was sent"
        once = "" if is_repeated else ", which was sent once, since it is no Shoal vehicle and might obey each copy"
        return f"{text}{once}"

    @staticmethod
    def log_book_reason(system: NetworkSystem, console: int) -> str:
        """The reason in the log book of a system for not answering a console (id); empty if it has none."""
        ours = f"packet from 0x{console:04X} "
        texts = [entry.text for entry in system.latest_entity_messages(imc.LogBookEntry) if ours in entry.text]
        return printable(f"its log book: {texts[-1]}") if texts else ""

    @property
    def _troubles(self) -> list[str]:
        return [link.trouble for link in self._links if link.trouble]

    @staticmethod
    def _in_brackets(texts: Sequence[str]) -> str:
        return f" ({'; '.join(texts)})" if texts else ""
