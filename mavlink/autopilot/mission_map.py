"""Map from the legs of a plan to the items of the mission in an autopilot's memory."""

from collections.abc import Callable, Sequence

import imc
from mavlink.autopilot.leg import Leg
from mavlink.autopilot.mission_builder import MissionBuilder, find_leg_item, item_group_start
from mavlink.autopilot.mission_client import MissionClient, MissionPhase
from mavlink.missions import Item


class MissionMap:
    """Puts plans into the memory if they `upload`, and finds their legs there."""

    def __init__(self, client: MissionClient, *, uploads: bool) -> None:
        self._client, self._uploads = client, uploads
        self._items: Sequence[Item] = ()
        self._item = 0

    def reset(self) -> None:
        """The autopilot has gone, or begun anew: its mission is not to be relied on."""
        self._items, self._item = (), 0
        self._client.reset()

    def upload_plan(self, plan: imc.PlanSpecification, writer: Callable[[], MissionBuilder], now: float) -> None:
        """A plan begins: put it into the memory; content that no item can express ends it with its first leg."""
        if not self._uploads:
            return
        self.reset()
        try:
            self._items = writer().build_plan_items(plan)
        except ValueError as error:
            self._client.fail(f"this plan cannot be put into the autopilot's memory: {error}")
        else:
            self._client.upload(self._items, now)

    def assign_leg_item(self, leg: Leg, writer: Callable[[], MissionBuilder], now: float, *, roams: bool) -> None:
        """Find the item of a leg; a plane's landing alone becomes a mission. Raises ValueError if there is none."""
        client = self._client
        if self._uploads and client.phase is MissionPhase.FAILED:
            raise ValueError(client.error)
        if self._uploads and self._items:
            leg.item = find_leg_item(leg, self._items, self._item)
            if leg.item is None:
                raise ValueError("this leg is not in the autopilot's memory")
            self._item = leg.item
        elif leg.lands and roams:
            items = writer().build_landing_items(leg.lat, leg.lon)
            client.upload(items, now)
            leg.item = len(items) - 1
        if leg.item is not None:
            leg.start = item_group_start(client.items, leg.item)
