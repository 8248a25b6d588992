"""Map from the items of a mission to the maneuvers of its plan."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ItemMap:
    """`steps` has the ids of the maneuvers of each item: none for home and for commands that take no time.

    Items that a single maneuver flies, such as the points of a path, all have its id. `first` is the number of the
    first item that is flown.
    """

    steps: tuple[tuple[str, ...], ...] = ()
    first: int = 0

    def items_of(self, maneuver: str) -> tuple[int, ...]:
        """The numbers of the items that a maneuver flies; none for a maneuver of another plan."""
        return tuple(seq for seq, ids in enumerate(self.steps) if maneuver in ids)

    def current_item(self, maneuver: str, point: int = 0) -> int | None:
        """The number for MISSION_CURRENT while a maneuver is executed, at `point` of it; None if it has none."""
        items = self.items_of(maneuver)
        return items[min(max(0, point), len(items) - 1)] if items else None

    def commands_at_maneuver_start(self, maneuver: str) -> tuple[int, ...]:
        """The numbers of the commands that are carried out as a maneuver begins, for MISSION_ITEM_REACHED."""
        items = self.items_of(maneuver)
        if not items or self.steps[items[0]][0] != maneuver:
            return ()
        start = items[0]
        while start > self.first and not self.steps[start - 1]:
            start -= 1
        return tuple(range(start, items[0]))

    def items_at_maneuver_end(self, maneuver: str) -> tuple[int, ...]:
        """The numbers of the items that are over with a maneuver, for MISSION_ITEM_REACHED."""
        items = self.items_of(maneuver)
        if not items or self.steps[items[-1]][-1] != maneuver:
            return ()
        end = items[-1] + 1
        trailing = end if any(self.steps[end:]) else len(self.steps)
        return (*items, *range(end, trailing))

    def maneuver_at(self, seq: int) -> str | None:
        """The maneuver with which a mission continues at item `seq`; None after the last one."""
        return next((ids[0] for ids in self.steps[max(0, seq) :] if ids), None)

    def renumbered(self, by: int) -> "ItemMap":
        """The same with other numbers: 1 more with home as item 0, 1 less without it."""
        steps = (*((),) * by, *self.steps) if by >= 0 else self.steps[-by:]
        return ItemMap(steps, self.first + by)
