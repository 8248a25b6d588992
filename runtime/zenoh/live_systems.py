"""Systems that are on the bus themselves, by the tokens of their processes."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

from runtime.zenoh.key_expressions import PREFIX

if TYPE_CHECKING:
    import zenoh

EVERYBODY = f"{PREFIX}/*/@alive/*/*"
MOST_TOKENS = 4096


class LiveSystems:
    """The vehicles of which a process runs on the bus: their ids, and these by the names in their keys."""

    def __init__(self) -> None:
        self.systems: frozenset[int] = frozenset()
        self.ids: Mapping[str, frozenset[int]] = {}
        self._tokens: dict[str, int] = {}
        self._subscriber: Any = None

    def open(self, session: "zenoh.Session") -> None:
        import zenoh

        listen: Any = session.liveliness().declare_subscriber
        self._subscriber = listen(EVERYBODY, zenoh.handlers.Callback(self._note, indirect=False), history=True)

    def close(self) -> None:
        if self._subscriber is not None:
            self._subscriber.undeclare()

    def _note(self, sample: "zenoh.Sample") -> None:
        """A token has appeared or gone; called from zenoh's thread."""
        import zenoh

        key = str(sample.key_expr)
        if cast(Any, sample).kind == zenoh.SampleKind.DELETE:
            self._tokens.pop(key, None)
        elif len(self._tokens) < MOST_TOKENS:
            try:
                self._tokens[key] = int(key.split("/")[3], 16)
            except ValueError:
                return  # none of ours
        self.systems = frozenset(self._tokens.values())
        ids: dict[str, set[int]] = {}
        for token, system in self._tokens.items():
            ids.setdefault(token.split("/")[1], set()).add(system)
        self.ids = {name: frozenset(numbers) for name, numbers in ids.items()}
