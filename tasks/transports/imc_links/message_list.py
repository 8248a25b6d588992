"""Messages that a transport sends, with rates and entities, in the syntax of DUNE's options."""

import math
from collections.abc import Callable, Iterable

import imc
from imc.reserved_ids import ANNOUNCED, BROADCAST, UNKNOWN_SYSTEM
from imc.schema import message_named
from support.terminal_text import quoted
from tasks.transports.imc_links.custom_filters import Custom, parse_custom

EVERYBODY = (ANNOUNCED, BROADCAST, UNKNOWN_SYSTEM)
MOST_SOURCES = 1024  # whose rate is measured, per type of message
EARLY = 0.1  # of a period: how much sooner or later a message may come, so that a source at just the rate loses none


def parse_rate(item: str) -> tuple[str, float]:
    """The message and the rate (Hz) of an item of `Rate Limiters`: EstimatedState:2. Raises ValueError."""
    name, colon, number = (part.strip() for part in item.partition(":"))
    try:
        hertz = float(number)
    except ValueError:
        hertz = math.nan
    if not (name and colon and 0.0 <= hertz < math.inf):
        raise ValueError(f"{quoted(item)} is not a message and its rate in Hz, such as EstimatedState:2")
    return name, hertz


def parse_entities(item: str) -> tuple[str, frozenset[str]]:
    """The message and the labels of an item of `Filtered Entities`: Voltage:Batteries+GPS. Raises ValueError."""
    name, colon, rest = (part.strip() for part in item.partition(":"))
    labels = frozenset(label.strip() for label in rest.split("+") if label.strip())
    if not (name and colon and labels):
        raise ValueError(f"{quoted(item)} is not a message and its entities, such as Voltage:Batteries+GPS")
    return name, labels


def check_rate_limiter(item: str) -> None:
    """Raises ValueError if an item of `Rate Limiters` has no effect."""
    message_named(parse_rate(item)[0])


def check_entity_filter(item: str) -> None:
    """Raises ValueError if an item of `Filtered Entities` has no effect."""
    message_named(parse_entities(item)[0])


class MessageList:
    """The messages that a transport sends: their types, and which of them pass.

    `names` are those of messages; a message of `rates` passes so often per second and entity, or at any time if it is
    an answer, addressed to who asked; one of `entities` only if an entity with one of these labels sent it; it also has
    to pass the filters of `custom`. Rejected messages do not count for its rate, except where they compare with what
    was sent before. If a message is listed twice, the last item counts. `label(system, entity)` is the label of an
    entity. `unknown` are the names that `schema` does not have.
    Raises ValueError for an item that is not in the syntax.
    """

    def __init__(
        self,
        names: Iterable[str],
        rates: Iterable[str] = (),
        entities: Iterable[str] = (),
        custom: Iterable[str] = (),
        *,
        schema: imc.Schema,
        label: Callable[[int, int], str],
    ):
        wanted = dict.fromkeys(name.strip() for name in names if name.strip())
        periods = dict(parse_rate(item) for item in rates if item.strip())
        labels = dict(parse_entities(item) for item in entities if item.strip())
        made = (parse_custom(item) for item in custom if item.strip())
        further: dict[str, Custom] = {kind.message: kind(words, label) for kind, words in made}
        self.unknown: list[str] = sorted(name for name in {*wanted, *periods, *labels} if name not in schema)
        self.types: tuple[type[imc.Message], ...] = tuple(schema[name] for name in wanted if name in schema)
        filters = {
            schema[name]: _Filter(periods.get(name, math.inf), labels.get(name), label, further.get(name))
            for name in {*periods, *labels, *further}
            if name in schema
        }
        self._filters = {kind: filters.get(kind) for kind in self.types}

    def passes_ignoring_rate(self, message: imc.Message) -> bool:
        """Whether a message would pass if its rate allowed."""
        found = self._filters.get(type(message))
        return type(message) in self._filters and (found is None or found.passes_ignoring_rate(message))

    def passes(self, message: imc.Message, now: float) -> bool:
        """Whether to send a message at the time `now` (s)."""
        try:
            found = self._filters[type(message)]
        except KeyError:
            return False
        return found is None or found.passes(message, now)


class _Filter:
    """Lets messages of some entities through, of each at most so often per second, on average."""

    def __init__(
        self,
        hertz: float,
        labels: frozenset[str] | None,
        label: Callable[[int, int], str],
        custom: Custom | None,
    ):
        self._filter = custom if custom is not None and not custom.remembers else None
        self._change = custom if custom is not None and custom.remembers else None
        self._period = 1.0 / hertz if hertz else math.inf
        self._labels = labels
        self._label = label
        self._due: dict[tuple[int, int], float] = {}

    def passes_ignoring_rate(self, message: imc.Message) -> bool:
        wanted = self._labels is None or self._label(message.src, message.src_ent) in self._labels
        return wanted and self._period != math.inf and (self._filter is None or self._filter(message))

    def passes(self, message: imc.Message, now: float) -> bool:
        if not self.passes_ignoring_rate(message):
            return False
        if message.dst not in (*EVERYBODY, message.src):
            return True
        source = (message.src, message.src_ent)
        period, due = self._period, self._due.get(source, now)
        if due > now + 2.0 * period:  # the clock was set back
            due = now
        slack = EARLY * period
        if now < due - slack:
            return False
        if len(self._due) >= MOST_SOURCES and source not in self._due:
            self._due.clear()
        self._due[source] = max(due, now - slack) + period
        return self._change is None or self._change(message)
