"""The mission that all ground stations and IMC consoles share: its items, its plan, its fence, its progress."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from enum import IntEnum
from typing import TypeAlias

import imc
from autonomy.plans import main_sequence, remaining_plan
from mavlink import FLAVORS, Flavor
from mavlink.missions import (
    Item,
    ItemMap,
    first_item_seq,
    home_item,
    items_of,
    opaque_id,
    plan_of,
)
from mavlink.vehicle.interfaces import VehiclePort
from mavlink.vehicle.mission.fence_store import FenceStore
from mavlink.vehicle.mission.plan_client import OnReply, PlanClient, PlanReply
from mavlink.vehicle.model import GUIDED_PLANS, VehicleModel

Phase: TypeAlias = imc.PlanControlState.State
Ended: TypeAlias = imc.PlanControlState.LastOutcome
NO_PLAN = "no mission has been uploaded"
REST_SUFFIX = "-rest"  # of a mission that continues


class MissionState(IntEnum):
    """MISSION_STATE."""

    NO_MISSION = 1
    NOT_STARTED = 2
    ACTIVE = 3
    PAUSED = 4
    COMPLETE = 5


class MissionStore:
    """A plan of the vehicle as items: the uploaded one, or the one that the vehicle executes.

    `reach(numbers)` gets the numbers of items that are over, home not counted. Items are kept without ArduPilot's item
    0, which is home; stations of that flavor see it.
    """

    def __init__(
        self,
        model: VehicleModel,
        port: VehiclePort,
        plans: PlanClient,
        reach: Callable[[Sequence[int]], object],
    ) -> None:
        self.plan: imc.PlanSpecification | None = None
        self.state: MissionState = MissionState.NO_MISSION
        self.current: int = 0
        self._plans = plans
        self._settings = model.conversion_settings
        self._fence = FenceStore(model.limits, port)
        self._reach = reach
        self._items: list[Item] = []
        self._item_map = ItemMap()
        self._maneuver = ""
        self._next: str | None = None
        self._fetched = ""
        self._phase = Phase.BLOCKED
        self._is_old = False  # the vehicle still flies what was the mission before

    def items(self, flavor: Flavor) -> list[Item]:
        """The items for stations of a flavor, as they were uploaded; item 0 of ArduPilot is the vehicle's home."""
        home = home_item(self._settings().home)
        return ([home] * first_item_seq(flavor) if self.plan is not None else []) + self._items

    def fence(self) -> list[Item]:
        """The corners of the area in the operational limits, in the order in which they were uploaded."""
        return self._fence.items()

    def id(self, flavor: Flavor) -> int:
        """The opaque id, 0 for no mission."""
        return opaque_id(self.items(flavor)) if self.plan is not None else 0

    def put_items(self, items: Sequence[Item], flavor: Flavor, then: OnReply, now: float) -> None:
        """Make uploaded items the mission, once the database has its plan. Raises BadItem."""
        first = first_item_seq(flavor)
        if not items[first:]:
            self.clear(then, now)
            return
        # whether it has to take off first is decided when it is started
        converted = plan_of(items, flavor, replace(self._settings(), aloft=False))

        def adopt(outcome: PlanReply) -> None:
            if outcome.done:
                self._replace(converted.plan, list(items[first:]), converted.item_map.renumbered(-first))
            then(outcome)

        self._plans.store(converted.plan, adopt, now)

    def put_fence(self, items: Sequence[Item], then: OnReply, now: float) -> None:
        """Make uploaded corners the area of the operational limits, once these have it. Raises BadItem."""
        self._fence.put(items, then, now)

    def poll(self, now: float) -> None:
        """Answer for a fence that the vehicle has taken, or does not take."""
        self._fence.poll(now)

    @property
    def next_deadline(self) -> float | None:
        """Time at which a fence has been waiting too long, in s since 1970."""
        return self._fence.next_deadline

    def clear(self, then: OnReply, now: float) -> None:
        """Forget the mission, and delete its plan if it came from here."""
        uploaded = self.plan is not None and self.plan.plan_id == self._settings().name
        self._forget()
        if uploaded:
            self._plans.remove(self._settings().name, lambda _: then(PlanReply(True)), now)
        else:
            then(PlanReply(True))

    def start(self, then: OnReply, now: float, number: int | None = None) -> None:
        """Start the mission, at an item or where it was interrupted; a running one continues."""
        if self.plan is None:
            then(PlanReply(False, NO_PLAN))
            return
        if number is None and self.state is MissionState.ACTIVE:
            then(PlanReply(True))
            return
        maneuver = self._next if number is None else self._item_map.maneuver_at(number)
        plan = self.plan
        if number is not None and maneuver is None:
            then(PlanReply(False, f"no item from {number} on moves the vehicle"))
            return
        aloft, maneuver = self._settings().aloft, maneuver or plan.start_man_id
        maneuver = skip_takeoff(plan, maneuver) if aloft else maneuver
        if maneuver != plan.start_man_id:
            rest = remaining_plan(plan, maneuver, takeoff=not aloft)
            plan = rest.replace(plan_id=plan.plan_id + REST_SUFFIX)  # the database keeps what is started under its name
        self._plans.start(plan, then, now)

    def request_start_check(self, then: OnReply, now: float) -> None:
        """Ask a vehicle that has no plan to do whether the mission could be started now."""
        if self.plan is not None and self._phase is Phase.READY:
            self._plans.load(self.plan.plan_id, then, now)

    def set_current(self, number: int, then: OnReply, now: float) -> bool:
        """Continue at an item: now, or at the start of the mission; False if no item after it moves the vehicle."""
        maneuver = self._item_map.maneuver_at(number) if 0 <= number < len(self._items) else None
        if self.plan is None or maneuver is None:
            return False
        if self.state is MissionState.ACTIVE:
            self.start(then, now, number)
        else:
            self._next, self.current = maneuver, number
            then(PlanReply(True))
        return True

    @property
    def progress(self) -> tuple[int, int, int]:
        """Progress that stations must receive immediately: the state, the item, and the mission."""
        return self.state, self.current, id(self.plan)

    @property
    def flies_replaced_mission(self) -> bool:
        """Whether the vehicle still flies the mission that this one has replaced."""
        return self._is_old

    def update(self, plan: imc.PlanControlState, now: float) -> bool:
        """Follow the vehicle's plan; whether the content of MISSION_CURRENT has changed."""
        before = self.plan, self.state, self.current
        self._phase = Phase(plan.state) if plan.state in set(Phase) else Phase.BLOCKED
        running = self._phase is Phase.EXECUTING
        self._is_old = self._is_old and running
        if self._phase is Phase.INITIALIZING:
            self._leave()  # the report still names the plan before
        elif not self._is_ours(plan.plan_id):
            self._interrupt()
            if running and plan.plan_id not in GUIDED_PLANS and plan.plan_id != self._fetched:
                self._fetched = plan.plan_id
                self._fetch(plan.plan_id, now)
        elif running and not self._is_old:
            self.state, self._next = MissionState.ACTIVE, None
            self._follow(plan.man_id)
        elif self.state is MissionState.ACTIVE:
            self._end(plan)
        self._fetched = self._fetched if running else ""
        return (self.plan, self.state, self.current) != before

    def restore(self, stored: Collection[str], now: float) -> None:
        """Make the plan that was uploaded the mission, if it is among those stored and there is no other."""
        name = self._settings().name
        if self.plan is None and name in stored:
            self._fetch(name, now)

    def on_plan_db(self, reply: imc.PlanDB, now: float) -> None:
        """A console has changed a plan: if it is the mission, or there is none, stations see the new one."""
        if (
            reply.type != imc.PlanDB.Type.SUCCESS
            or reply.plan_id in GUIDED_PLANS
            or reply.plan_id.endswith(REST_SUFFIX)
        ):
            return
        if reply.op == imc.PlanDB.Op.SET and (self.plan is None or self.plan.plan_id == reply.plan_id):
            self._fetch(reply.plan_id, now, changed=True)
        elif reply.op == imc.PlanDB.Op.DEL and self.plan is not None and self.plan.plan_id == reply.plan_id:
            self._forget()

    def use_plan(self, plan_id: str, now: float) -> None:
        """Make a plan of the database the mission; without a name there is none."""
        self._fetched = ""
        if plan_id:
            self._fetch(plan_id, now)
        else:
            self._forget()

    def _fetch(self, plan_id: str, now: float, *, changed: bool = False) -> None:
        def adopt(outcome: PlanReply) -> None:
            if isinstance(outcome.arg, imc.PlanSpecification) and outcome.arg != self.plan:
                listing = items_of(outcome.arg, FLAVORS["generic"], self._settings())
                (self._replace if changed else self._adopt)(outcome.arg, listing.items, listing.item_map)

        self._plans.fetch(plan_id, adopt, now)

    def _is_ours(self, plan_id: str) -> bool:
        return self.plan is not None and plan_id in (self.plan.plan_id, self.plan.plan_id + REST_SUFFIX)

    def _replace(self, plan: imc.PlanSpecification, items: list[Item], table: ItemMap) -> None:
        """Take another mission, also while the vehicle flies the one before, which it continues until it is ordered."""
        flies = self.state is MissionState.ACTIVE or self._is_old
        self._adopt(plan, items, table)
        self._is_old = flies

    def _adopt(self, plan: imc.PlanSpecification, items: list[Item], table: ItemMap) -> None:
        self._forget()
        self.plan, self._items, self._item_map = plan, items, table
        self.state = MissionState.NOT_STARTED

    def _forget(self) -> None:
        self.plan, self._items, self._item_map = None, [], ItemMap()
        self.state, self.current, self._maneuver, self._next = MissionState.NO_MISSION, 0, "", None

    def _follow(self, maneuver: str) -> None:
        if not maneuver or maneuver == self._maneuver:
            return
        over = [
            *self._item_map.items_at_maneuver_end(self._maneuver),
            *self._item_map.commands_at_maneuver_start(maneuver),
        ]
        self._maneuver = maneuver
        if over:
            self._reach(over)
        at = self._item_map.current_item(maneuver)
        self.current = self.current if at is None else at

    def _interrupt(self) -> None:
        """Leave the mission for another plan, such as a hold; it can continue where it was."""
        if self.state is MissionState.ACTIVE:
            self._leave()
            self.state = MissionState.PAUSED

    def _leave(self) -> None:
        """Keep the present item without reporting an end: the mission may continue there, or jump."""
        if self.state is MissionState.ACTIVE:
            self._next = self._maneuver or self._next
        self._maneuver = ""

    def _end(self, plan: imc.PlanControlState) -> None:
        if plan.last_outcome == Ended.SUCCESS:
            over = self._item_map.items_at_maneuver_end(self._maneuver)
            self.state, self._maneuver, self._next = MissionState.COMPLETE, "", None
            if over:
                self._reach(over)
        else:
            self._interrupt()


def skip_takeoff(plan: imc.PlanSpecification, maneuver: str) -> str:
    """The maneuver after a Takeoff, for an aircraft in the air; the Takeoff itself if nothing follows."""
    nodes = main_sequence(plan)[0]
    names = [node.maneuver_id for node in nodes]
    if maneuver not in names:
        return maneuver
    rest = nodes[names.index(maneuver) :]
    return next((node.maneuver_id for node in rest if not isinstance(node.data, imc.Takeoff)), maneuver)
