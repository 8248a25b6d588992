"""Traffic between an autopilot and ground stations, in IMC: missions, commands, parameters, progress."""

import math
import struct
from collections.abc import Callable, Iterator
from typing import Any

import imc
from mavlink.dialect import Dialect
from mavlink.frames import ReceivedMessage
from mavlink.missions import (
    BadItem,
    ConversionContext,
    ConvertedPlan,
    Item,
    MissionCommand,
    MissionResult,
    MissionType,
    first_item_seq,
    opaque_id,
    plan_of,
)
from mavlink.modes import FLAVORS, KINDS, Flavor, VehicleKind, mode_name
from mavlink.positions import Home
from mavlink.translate.measurements_to_imc import AUTOPILOT, ParameterBatch, TranslatedMessages, log_entry, with_times
from support.duplicate_filter import DuplicateFilter

INFORMATION, WARNING = 6, 4  # MAV_SEVERITY
LOWEST = 7  # level of an event: the higher ones are protocol and disabled
SENT_AGAIN = 64  # events among which one that was asked for again is looked for
RESULTS = (
    *("ACCEPTED", "TEMPORARILY_REJECTED", "DENIED", "UNSUPPORTED", "FAILED", "IN_PROGRESS", "CANCELLED"),
    *("COMMAND_LONG_ONLY", "COMMAND_INT_ONLY", "UNSUPPORTED_MAV_FRAME"),
)
ASKING = frozenset({410, 511, 512, 519, 520, 521, 522, 525, 527, 528, 2504, 2505})
"""Commands that only ask for messages: each station sends dozens when it connects."""

FLYING = ("AUTO", "MISSION")  # names of modes
COMPLETE = 5  # MISSION_CURRENT.mission_state
INTEGERS = {1: "B", 2: "b", 3: "H", 4: "h", 5: "I", 6: "i"}
"""MAV_PARAM_TYPE -> struct."""


class TransactionTranslator:
    """Turns what goes to and from one autopilot, a system of a recording, into IMC with labels of entities.

    A mission transferred whole becomes a PlanSpecification or, if IMC cannot express it, a LogBookEntry with the
    reason. Further values of parameters become EntityParameters. `type_` and `autopilot` are those of its HEARTBEAT.
    """

    def __init__(self, dialect: Dialect, system: int, type_: int, autopilot: int) -> None:
        self._system = system
        self._enumerations = dialect.enumerations
        self._kind: VehicleKind = next((kind for kind in KINDS.values() if kind.type == type_), KINDS["copter"])
        self._flavor: Flavor = next((f for f in FLAVORS.values() if f.autopilot == autopilot), FLAVORS["generic"])
        self._parameters = ParameterBatch()
        self._home: Home | None = None
        self._count = 0
        self._items: dict[int, Item] = {}
        self._shown = 0
        self._mission: ConvertedPlan | None = None
        self._flying = False
        self._state: imc.PlanControlState | None = None
        self._events = DuplicateFilter(SENT_AGAIN)
        self._handlers: dict[str, Callable[[ReceivedMessage, Any], TranslatedMessages]] = {
            "HEARTBEAT": self._heartbeat,
            "HOME_POSITION": self._home_position,
            "PARAM_VALUE": self._parameter,
            "COMMAND_ACK": self._answered,
            "MISSION_COUNT": self._begin,
            "MISSION_ITEM_INT": lambda received, values: self._add(values, Item.of(values)),
            "MISSION_ITEM": lambda received, values: self._add(values, Item.of_legacy(values)),
            "MISSION_ACK": self._end,
            "MISSION_CLEAR_ALL": self._clear,
            "MISSION_CURRENT": self._current,
            "MISSION_ITEM_REACHED": self._reached,
            "EVENT": self._event,
        }

    @property
    def message_names(self) -> frozenset[str]:
        """Names of the MAVLink messages that are translated."""
        return frozenset(self._handlers)

    def translate(self, received: ReceivedMessage, time: float) -> Iterator[tuple[str, imc.Message]]:
        """A message from or to the autopilot, in IMC, with `time` (s since 1970 UTC) in the headers."""
        try:
            messages = [*self._handlers[received.name](received, received.values)]
        except BadItem as error:
            messages = [(AUTOPILOT, log_entry(WARNING, "mission", str(error)))]
        if received.name != "PARAM_VALUE" and received.system == self._system:
            messages = [*self._parameters.flush(), *messages]
        yield from with_times(messages, time, 0.0)

    def finish(self, time: float) -> Iterator[tuple[str, imc.Message]]:
        """Remaining messages at the end of the recording."""
        yield from with_times(self._parameters.flush(), time, 0.0)

    def _heartbeat(self, received: ReceivedMessage, m: Any) -> TranslatedMessages:
        if received.system == self._system:
            name = mode_name(m["base_mode"], m["custom_mode"], m["type"], m["autopilot"], self._enumerations)
            self._flying = name in FLYING
        return ()

    def _home_position(self, received: ReceivedMessage, m: Any) -> TranslatedMessages:
        altitude = 0.0 if self._kind.afloat else m["altitude"] / 1e3
        self._home = Home(math.radians(m["latitude"] / 1e7), math.radians(m["longitude"] / 1e7), altitude, altitude)
        return ()

    def _parameter(self, received: ReceivedMessage, m: Any) -> TranslatedMessages:
        """ArduPilot casts integers to floats, others put their bytes there."""
        value, letter = m["param_value"], INTEGERS.get(m["param_type"])
        if letter and self._flavor.bytewise:
            (value,) = struct.unpack_from("<" + letter, received.payload)  # of the bytes: they may be a signaling NaN
        elif letter and math.isfinite(value):
            value = int(value)
        return self._parameters.add(m["param_id"].decode("utf-8", "replace"), value)

    def _answered(self, received: ReceivedMessage, m: Any) -> TranslatedMessages:
        number, result = int(m["command"]), int(m["result"])
        if received.system == self._system and number not in ASKING:
            name = MissionCommand(number).name if number in set(MissionCommand) else f"command {number}"
            answer = RESULTS[result] if result < len(RESULTS) else f"result {result}"
            yield AUTOPILOT, log_entry(INFORMATION if result in (0, 5) else WARNING, "COMMAND_ACK", f"{name}: {answer}")

    def _begin(self, received: ReceivedMessage, m: Any) -> TranslatedMessages:
        if m.get("mission_type", 0) == MissionType.MISSION:
            self._count, self._items = m["count"], {}
        return ()

    def _add(self, m: Any, item: Item) -> TranslatedMessages:
        if item.mission_type == MissionType.MISSION and m["seq"] < self._count:
            self._items[m["seq"]] = item
        return ()

    def _end(self, received: ReceivedMessage, m: Any) -> TranslatedMessages:
        """An ACK ends a transfer: of the autopilot if it was given a mission, of the station if it has read one."""
        if m.get("mission_type", 0) != MissionType.MISSION or not self._count:
            return
        items, count = self._items, self._count
        self._count, self._items = 0, {}
        if m["type"] != MissionResult.ACCEPTED:
            known = m["type"] in set(MissionResult)
            reason = MissionResult(m["type"]).name if known else f"result {m['type']}"
            yield AUTOPILOT, log_entry(WARNING, "mission", f"a mission of {count} items was not accepted: {reason}")
        elif len(items) < count:
            missing = f"the recording lacks {count - len(items)} of its items"
            yield AUTOPILOT, log_entry(WARNING, "mission", f"a mission of {count} items was transferred: {missing}")
        elif (shown := opaque_id(items[seq] for seq in range(count))) != self._shown:
            self._shown = shown
            yield from self._convert([items[seq] for seq in range(count)])

    def _convert(self, items: list[Item]) -> TranslatedMessages:
        self._mission = None
        if len(items) <= first_item_seq(self._flavor):
            return
        try:
            self._mission = plan_of(items, self._flavor, ConversionContext(self._kind, self._home))
        except BadItem as error:
            words = f"the mission of {len(items)} items is no plan of IMC: {error}"
            yield AUTOPILOT, log_entry(WARNING, "mission", words)
        else:
            yield AUTOPILOT, self._mission.plan

    def _clear(self, received: ReceivedMessage, m: Any) -> TranslatedMessages:
        if m.get("mission_type", 0) in (MissionType.MISSION, MissionType.ALL):
            self._mission, self._shown = None, 0
            yield AUTOPILOT, log_entry(INFORMATION, "mission", "the mission was cleared")

    def _reached(self, received: ReceivedMessage, m: Any) -> TranslatedMessages:
        if received.system != self._system:
            return
        words = f"item {m['seq']} of the mission was reached"
        maneuver = self._mission.item_map.maneuver_at(m["seq"]) if self._mission is not None else None
        completed = (
            self._mission is not None
            and maneuver is not None
            and m["seq"] in self._mission.item_map.items_at_maneuver_end(maneuver)
        )
        yield AUTOPILOT, log_entry(INFORMATION, "mission", f"{words}: maneuver {maneuver}" if completed else words)

    def _event(self, received: ReceivedMessage, m: Any) -> TranslatedMessages:
        """Number and arguments of an event; its text is in a file of the autopilot, which is not in the recording."""
        level = m["log_levels"] & 0x0F
        if received.system != self._system or level > LOWEST or self._events.is_duplicate(m["sequence"]):
            return
        arguments = bytes(m["arguments"]).rstrip(b"\0").hex(" ")
        words = f"event {m['id'] & 0xFFFFFF} of component {m['id'] >> 24}"
        yield AUTOPILOT, log_entry(level, "EVENT", f"{words}, arguments {arguments}" if arguments else words)

    def _current(self, received: ReceivedMessage, m: Any) -> TranslatedMessages:
        """Item that the vehicle flies; the item of a mission that the recording lacks is named by number."""
        phases, outcomes = imc.PlanControlState.State, imc.PlanControlState.LastOutcome
        mission = self._mission
        done = m.get("mission_state") == COMPLETE
        flying = self._flying and not done
        man_id = (mission.item_map.maneuver_at(m["seq"]) if mission else str(m["seq"])) if flying else None
        steps = len(mission.item_map.steps) if mission else m.get("total", 0)
        state = imc.PlanControlState(
            state=phases.EXECUTING if flying else phases.READY,
            plan_id=mission.plan.plan_id if mission and flying else "",
            plan_eta=-1,
            plan_progress=min(100.0, 100.0 * m["seq"] / steps) if flying and 0 < steps < 0xFFFF else -1.0,
            man_id=man_id or "",
            man_eta=-1,
            last_outcome=outcomes.SUCCESS if done else outcomes.NONE,
        )
        if state != self._state:
            self._state = state
            yield AUTOPILOT, state
