"""Frames of a log: the page's data at the present time of the log, whole tracks, and the log book up to now."""

from bisect import bisect_right
from collections import deque
from typing import Any

import imc
from shoal.console.logs.log_link import LogLink
from shoal.console.page_feed import LOG_ENTRIES, PageFeed
from shoal.console.vehicle_view import ArrivalTimes, word
from shoal.network import Network, NetworkSystem
from support.terminal_text import printable


class LoggedTimes(ArrivalTimes):
    """The times that messages of a log have: those of their arrival are not in it."""

    def position_time(self, system: NetworkSystem, state: imc.EstimatedState) -> float:
        return state.timestamp

    def since(self, system: NetworkSystem, state: imc.EntityState) -> float:
        return min(super().since(system, state), state.timestamp)


class LogFeed(PageFeed):
    """The frames of a `LogLink`, which plays on `network`."""

    def __init__(self, network: Network, player: LogLink) -> None:
        super().__init__(network)
        self._player = player
        self._entries = [(time, _entry(player, message)) for time, message in player.states.entries]
        self._entry_times = [time for time, _ in self._entries]
        self._shown = 0
        for number, rows in player.states.tracks.items():
            self._tracks[player.system_name(number)] = deque([lat, lon, depth] for _, lat, lon, depth in rows)
        player.on_jump(self._restart)
        self._restart()

    def _restart(self) -> None:
        """Forget all that pages have, and what vehicles have sent: a newer message must not hide an older one."""
        for system in self._network.systems.values():
            system.latest.clear()
        self._times = LoggedTimes(self._now)
        self._sent.clear()
        self._log.clear()
        self._shown = max(0, self._entries_until_now() - LOG_ENTRIES)
        for viewer in self._viewers:
            viewer.needs_all = True

    def _now(self) -> float:
        return self._player.now

    def _frame_head(self) -> dict[str, Any]:
        return {**super()._frame_head(), "replay": self._player.describe()}

    def _ask_for_states(self, now: float) -> None:
        """A log answers nothing."""

    def _entries_until_now(self) -> int:
        return bisect_right(self._entry_times, self._player.position)

    def _read_messages(self) -> list[list[object]]:
        assert self._listener is not None
        self._listener.take_all()
        end = self._entries_until_now()
        found = [entry for _, entry in self._entries[self._shown : end]]
        self._shown = max(self._shown, end)
        self._log.extend(found)
        return found


def _entry(player: LogLink, message: imc.LogBookEntry) -> list[object]:
    kind = word(imc.LogBookEntry.Type, message.type)
    name = player.system_name(message.src)
    label = player.states.names.labels.get((message.src, message.src_ent), "")
    return [round(message.htime, 1), name, kind, *map(printable, (message.context, message.text, label))]
