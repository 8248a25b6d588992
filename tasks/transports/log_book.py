"""Answers consoles that ask for the log book."""

from collections import deque
from collections.abc import Iterable
from itertools import takewhile

import imc
from runtime import Task, consume, param

Command = imc.LogBookControl.Command
ERRORS = (imc.LogBookEntry.Type.ERROR, imc.LogBookEntry.Type.CRITICAL)
LONGEST_REPLY = 30_000  # bytes of entries: a reply fits into one packet and one datagram
OVERHEAD = 20  # bytes of an entry besides its texts, rounded up
COST = 20  # a long reply counts as so many short ones


class LogBook(Task):
    """Keeps the latest entries of the log book, and sends them on request: all, those since a time, or errors.

    A reply has the latest entries that fit into one packet. CLEAR empties what is kept here, not the log.
    """

    maximum_entries: int = param(1000, "1", "Number of entries that are kept.", minimum=1, maximum=100_000)

    def configure(self) -> None:
        kept: Iterable[imc.LogBookEntry] = getattr(self, "_entries", ())
        self._entries = deque(kept, self.maximum_entries)

    @consume
    def on_log_book_entry(self, entry: imc.LogBookEntry) -> None:
        self._entries.append(entry)

    @consume(others=True)
    def on_log_book_control(self, request: imc.LogBookControl) -> None:
        if request.command == Command.REPLY or not self.is_for_me(request):
            return
        if request.command == Command.CLEAR:
            self._entries.clear()
            self.log.info(f"cleared by {self.vehicle.systems.name(request.src)}")
        elif self.vehicle.daemon.reply_quota.try_acquire(request.src, COST, self.now):
            found = [entry for entry in self._entries if entry.htime >= request.htime]
            if request.command == Command.GET_ERR:
                found = [entry for entry in found if entry.type in ERRORS]
            self.reply(request, imc.LogBookControl(command=Command.REPLY, htime=self.now, msg=fit_into_reply(found)))


def fit_into_reply(entries: list[imc.LogBookEntry]) -> tuple[imc.LogBookEntry, ...]:
    """The latest entries that fit into a reply, oldest first."""
    left = LONGEST_REPLY

    def fits(entry: imc.LogBookEntry) -> bool:
        nonlocal left
        left -= OVERHEAD + len(entry.context.encode(errors="replace")) + len(entry.text.encode(errors="replace"))
        return left >= 0

    return tuple(takewhile(fits, reversed(entries)))[::-1]
