"""Which leg of a plan is which item of the mission in an autopilot's memory."""

from collections.abc import Callable, Sequence

import imc
from mavlink.missions import Item
from tasks.control.autopilot.leg import Leg
from tasks.control.autopilot.memory import Memory, Phase
from tasks.control.autopilot.mission import Writer, first_of, item_of


class PlanBook:
    """Puts plans into the memory if they `upload`, and finds their legs there."""

    def __init__(self, memory: Memory, *, uploads: bool) -> None:
        self._memory, self._uploads = memory, uploads
        self._items: Sequence[Item] = ()
        self._item = 0

    def forget(self) -> None:
        """The autopilot has gone, or begun anew: its mission is not to be relied on."""
        self._items, self._item = (), 0
        self._memory.forget()

    def begin(self, plan: imc.PlanSpecification, writer: Callable[[], Writer], now: float) -> None:
        """A plan begins: put it into the memory; what no item can say ends it with its first leg."""
        if not self._uploads:
            return
        self.forget()
        try:
            self._items = writer().write(plan)
        except ValueError as error:
            self._memory.fail(f"this plan cannot be put into the autopilot's memory: {error}")
        else:
            self._memory.write(self._items, now)

    def find(self, leg: Leg, writer: Callable[[], Writer], now: float, *, roams: bool) -> None:
        """Find the item of a leg; a plane's landing alone becomes a mission. Raises ValueError if there is none."""
        memory = self._memory
        if self._uploads and memory.phase is Phase.FAILED:
            raise ValueError(memory.error)
        if self._uploads and self._items:
            leg.item = item_of(leg, self._items, self._item)
            if leg.item is None:
                raise ValueError("this leg is not in the autopilot's memory")
            self._item = leg.item
        elif leg.lands and roams:
            items = writer().land(leg.lat, leg.lon)
            memory.write(items, now)
            leg.item = len(items) - 1
        if leg.item is not None:
            leg.start = first_of(memory.items, leg.item)
