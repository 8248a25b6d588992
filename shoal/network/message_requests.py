"""The messages that somebody here needs of each system, and the end of asking for them."""

import asyncio
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from typing import Self

from shoal.network.link import EVERYBODY, EVERYTHING, NetworkLink
from shoal.network.system_table import NetworkSystem, NetworkSystemTable

LINGER = 5.0  # s after the last use, since the next one often comes soon; all messages end at once
ALL = ""  # in place of the name of a message


class MessageRequests:
    """Counts the uses of each message of each system; links bring it until a while after the last one.

    What was received before an end is forgotten when the message is asked for again, so that it is not taken for new.
    """

    def __init__(self, links: Sequence[NetworkLink], systems: NetworkSystemTable) -> None:
        self._links, self._systems = links, systems
        self._uses: Counter[tuple[str, str]] = Counter()
        self._ending: dict[tuple[str, str], asyncio.TimerHandle] = {}
        self._ended: set[tuple[str, str]] = set()  # by system, which is not EVERYBODY
        self._is_closed = False

    def begin(self, system: str, messages: Collection[str]) -> None:
        """Use messages of a system, or of EVERYBODY; EVERYTHING is possible."""
        for place in _places(system, messages):
            self._uses[place] += 1
            ending = self._ending.pop(place, None)
            if ending is not None:
                ending.cancel()
        self._forget_ended(system, messages)
        for link in self._links:
            link.subscribe(system, messages)

    def end(self, system: str, messages: Collection[str]) -> None:
        """End one use that has begun in the same words."""
        for place in _places(system, messages):
            self._uses[place] -= 1
            if self._uses[place] or self._is_closed:
                continue
            del self._uses[place]
            if place[1] == ALL:
                self._stop(place)
            else:
                self._ending[place] = asyncio.get_running_loop().call_later(LINGER, self._stop, place)

    def close(self) -> None:
        """Ask links for nothing any more: they close."""
        self._is_closed = True
        for ending in self._ending.values():
            ending.cancel()

    def _stop(self, place: tuple[str, str]) -> None:
        self._ending.pop(place, None)
        system, message = place
        words = (message,) if message != ALL else EVERYTHING
        if any([link.unsubscribe(system, words) for link in self._links]):
            for each in self._named(system):
                names = words or {name for name, _ in each.latest}
                self._ended |= {(each.name, name) for name in names if not self._is_brought(each.name, name)}

    def _forget_ended(self, system: str, messages: Collection[str]) -> None:
        """Forget messages that links have not brought meanwhile; those of UDP and TCP bring all that they have."""
        for each in self._named(system):
            names = {message for name, message in self._ended if name == each.name}
            for message in names.intersection(messages) if messages else names:
                self._ended.discard((each.name, message))
                if any(link.delivers_all for link in each.links.values()):
                    each.forget_latest(message)

    def _is_brought(self, system: str, message: str) -> bool:
        places = ((system, message), (system, ALL), (EVERYBODY, message), (EVERYBODY, ALL))
        return any(place in self._uses or place in self._ending for place in places)

    def _named(self, system: str) -> list[NetworkSystem]:
        """The systems of a name, or all."""
        return [each for each in self._systems.values() if system in (EVERYBODY, each.name)]


def _places(system: str, messages: Collection[str]) -> Iterator[tuple[str, str]]:
    return ((system, message) for message in (messages or (ALL,)))


class MessageUse:
    """A use of some messages of a system, until it is closed, or the end of a `with`."""

    def __init__(self, requests: MessageRequests, system: str, messages: Collection[str]) -> None:
        self._requests, self._system, self._messages = requests, system, frozenset(messages)
        self._is_closed = False
        requests.begin(system, self._messages)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End it; again, this does nothing."""
        if not self._is_closed:
            self._is_closed = True
            self._requests.end(self._system, self._messages)
