"""The mission in an autopilot's memory: written to it, read back and compared, and how far it has been carried out."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any

from mavlink import Fields
from mavlink.missions import Item, MissionCommand, MissionResult

PATIENCE, TRIES = 1.5, 5  # s without an answer, after which the last message is sent again; how often
LATE = 3.0  # s in which an autopilot repeats how far it has come
REDIRECT_PERIOD = 1.0  # s between two requests to continue at another item
SAME_HEIGHT = 0.02  # m; ArduPilot keeps centimeters
FRAMES = {5: 0, 6: 3, 11: 10}  # MAV_FRAME of integers -> the one that older autopilots return
WHOLE, EXACT = 0.51, 0.01  # ArduPilot keeps times and radii as whole numbers
COMPARED: Mapping[int, Mapping[str, float]] = {
    MissionCommand.NAV_WAYPOINT: {"param1": WHOLE},
    MissionCommand.NAV_LOITER_TIME: {"param1": WHOLE},
    MissionCommand.NAV_LOITER_TURNS: {"param1": WHOLE, "param3": WHOLE},
    MissionCommand.NAV_DELAY: {"param1": WHOLE},
    MissionCommand.DO_CHANGE_SPEED: {"param2": EXACT},
}
"""The parameters on which the way depends, and how far they may differ; autopilots do not keep the others."""
UNKNOWN_TOTAL = 0xFFFF


class MissionPhase(Enum):
    """NONE: there is no mission of ours. FAILED: it could not be written; `MissionClient.error` is the reason."""

    NONE = auto()
    WRITING = auto()
    READING = auto()
    READY = auto()
    FAILED = auto()


@dataclass(slots=True)
class MissionClient:
    """Writes a mission and reads it back, as the client of MAVLink's mission protocol.

    The last acknowledgment of an upload may be lost; then autopilots leave the repeated last item unanswered, or
    reject it. What is read back decides.

    `first` is the number of the first item that is flown: ArduPilot keeps its home as item 0. `current` is the item
    that it heads for, -1 if unknown; `reached` the last one that it reports as done. `changed`: another mission has
    come in the place of ours. `begun`: it is at an item that it was ordered to go to.
    """

    send: Callable[[str, Fields], object]
    first: int = 0
    phase: MissionPhase = MissionPhase.NONE
    error: str = ""
    items: Sequence[Item] = ()
    current: int = -1
    reached: int = -1
    changed: bool = False
    begun: bool = False
    _last: tuple[str, Mapping[str, Any]] = ("", {})
    _tries: int = 0
    _due: float = 0.0
    _read: int = 0
    _id: int = 0
    _total: int = UNKNOWN_TOTAL
    _redirected_at: float = -math.inf
    _unsure: bool = False
    _left_at: float = math.inf

    @property
    def busy(self) -> bool:
        return self.phase in (MissionPhase.WRITING, MissionPhase.READING)

    @property
    def ready(self) -> bool:
        return self.phase is MissionPhase.READY and not self.changed

    @property
    def next_deadline(self) -> float:
        """Time at which `tick` has something to do (s): infinite while no answer is awaited."""
        return self._due if self.busy else math.inf

    def upload(self, items: Sequence[Item], now: float) -> None:
        """Put a mission into the memory, in place of what is there."""
        self.reset()
        self.items, self.phase = items, MissionPhase.WRITING
        self._request("MISSION_COUNT", {"count": len(items)}, now)

    def reset(self) -> None:
        """Forget the mission: the autopilot has gone, or it is not needed."""
        self.phase, self.error, self.items, self.changed = MissionPhase.NONE, "", (), False
        self.begun, self.current, self.reached = False, -1, -1
        self._id, self._total, self._redirected_at, self._unsure = 0, UNKNOWN_TOTAL, -math.inf, False

    def fail(self, reason: str) -> None:
        """Give up the mission."""
        self.phase, self.error = MissionPhase.FAILED, reason

    def receive(self, name: str, values: Mapping[str, Any], now: float) -> None:
        """Take a message of the mission protocol that is for us, or for all."""
        if values.get("mission_type"):
            return
        if name == "MISSION_CURRENT":
            self._note_current(values)
        elif name == "MISSION_ITEM_REACHED":
            self.reached = values["seq"]
        elif self.phase is MissionPhase.WRITING:
            self._continue_upload(name, values, now)
        elif self.phase is MissionPhase.READING:
            self._continue_download(name, values, now)

    def may_be_over(self, now: float, *, left: bool) -> bool:
        """Whether an autopilot that has just left its mission may have done it: the report may be lost, or late.

        Autopilots hold or return by themselves after the last item.
        """
        if not left or self.current < len(self.items) - 1:
            self._left_at = math.inf
            return False
        self._left_at = min(self._left_at, now)
        return now - self._left_at < LATE

    def tick(self, now: float) -> None:
        """Send again what was not answered."""
        if not self.busy or now < self._due:
            return
        if self._tries >= TRIES and self._may_be_written:
            self._unsure = True
            self._read_back(now)
            return
        if self._tries >= TRIES:
            doing = "was not taken" if self.phase is MissionPhase.WRITING else "could not be read back"
            self.fail(f"the mission {doing}: no answer for {PATIENCE * TRIES:g} s")
            return
        self._tries += 1
        self._due = now + PATIENCE
        self.send(*self._last)

    def head_for(self, item: int, now: float) -> bool:
        """Whether the autopilot heads for an item, or has passed it since it began; if not, it is ordered to."""
        if self.current == item or (self.begun and self.current > item):
            self.begun = True
            return True
        if now - self._redirected_at >= REDIRECT_PERIOD:
            self._redirected_at = now
            self.send("MISSION_SET_CURRENT", {"seq": item})
        return False

    def is_past(self, item: int) -> bool:
        """Whether the autopilot reports that it has done an item."""
        return self.begun and (self.reached >= item or self.current > item)

    def _request(self, name: str, values: Mapping[str, Any], now: float) -> None:
        self._last, self._tries, self._due = (name, values), 1, now + PATIENCE
        self.send(name, values)

    def _continue_upload(self, name: str, values: Mapping[str, Any], now: float) -> None:
        if name in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
            seq = int(values["seq"])
            if seq < len(self.items):
                self._request("MISSION_ITEM_INT", self.items[seq].fields(seq), now)
        elif name == "MISSION_ACK" and values["type"] == MissionResult.ACCEPTED:
            self._id = values["opaque_id"]
            self._read_back(now)
        elif name == "MISSION_ACK" and self._may_be_written and self._tries > 1:
            self._unsure = True
            self._read_back(now)
        elif name == "MISSION_ACK":
            self.fail(f"the mission was rejected: {_result_text(values['type'])}")

    @property
    def _may_be_written(self) -> bool:
        """Whether all items were sent."""
        return self.phase is MissionPhase.WRITING and self._last[1].get("seq") == len(self.items) - 1

    def _read_back(self, now: float) -> None:
        self.phase, self._read = MissionPhase.READING, self.first
        self._request("MISSION_REQUEST_LIST", {}, now)

    def _continue_download(self, name: str, values: Mapping[str, Any], now: float) -> None:
        if name == "MISSION_COUNT":
            if values["count"] != len(self.items):
                self._fail_comparison(f"it has {values['count']} items instead of {len(self.items)}")
            elif self._last[0] == "MISSION_REQUEST_LIST":
                self._request("MISSION_REQUEST_INT", {"seq": self._read}, now)
        elif name == "MISSION_ITEM_INT" and values["seq"] == self._read:
            if difference := difference_of(self.items[self._read], Item.of(values)):
                self._fail_comparison(f"item {self._read} has another {difference}")
                return
            self._read += 1
            if self._read < len(self.items):
                self._request("MISSION_REQUEST_INT", {"seq": self._read}, now)
            else:
                self.send("MISSION_ACK", {"type": MissionResult.ACCEPTED})
                self.phase = MissionPhase.READY
        elif name == "MISSION_ACK" and values["type"] != MissionResult.ACCEPTED and not self._unsure:
            self.fail(f"the mission could not be read back: {_result_text(values['type'])}")

    def _fail_comparison(self, how: str) -> None:
        self.send("MISSION_ACK", {"type": MissionResult.ERROR})
        self.fail(f"the mission in the autopilot is not the one that was sent: {how}")

    def _note_current(self, values: Mapping[str, Any]) -> None:
        self.current = values["seq"]
        if self.phase is not MissionPhase.READY:
            return
        if self._total == UNKNOWN_TOTAL and values["total"]:
            self._total = values["total"]
        other_id = self._id and values["mission_id"] and values["mission_id"] != self._id
        other_total = values["total"] and self._total not in (UNKNOWN_TOTAL, values["total"])
        self.changed = self.changed or bool(other_id or other_total)


def difference_of(ours: Item, theirs: Item) -> str:
    """Relevant difference in an item that was read back; "" without one."""
    if ours.command != theirs.command:
        return "command"
    if FRAMES.get(ours.frame, ours.frame) != FRAMES.get(theirs.frame, theirs.frame) and (ours.x or ours.y):
        return "frame"
    if (ours.x, ours.y) != (theirs.x, theirs.y):
        return "position"
    if abs(ours.z - theirs.z) > SAME_HEIGHT:
        return "height"
    numbers = COMPARED.get(ours.command, {})
    return next((name for name, off in numbers.items() if abs(getattr(ours, name) - getattr(theirs, name)) > off), "")


def _result_text(result: int) -> str:
    known = result in set(MissionResult)
    return MissionResult(result).name.lower().replace("_", " ") if known else f"result {result}"
