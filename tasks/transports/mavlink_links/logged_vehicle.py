"""The vehicle of a log as ground stations see it: what it was and did, and no orders."""

import math
from collections.abc import Callable, Mapping
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import imc
from imc.discovery import Services
from imc.lsf import Log
from mavlink import KINDS, Dialect, Flavor, Mode, mavlink_system_id, mode_number
from mavlink.translate import from_imc
from mavlink.vehicle import (
    GUIDED_PLANS,
    VehicleEndpoint,
    VehicleEquipment,
    VehicleIdentity,
    VehicleModel,
    VehicleOptions,
    VehiclePort,
)
from mavlink.vehicle.mission import REST_SUFFIX, OnReply, PlanClient, PlanReply
from runtime.logs import SystemNames
from runtime.profile import read_sections
from runtime.task import Entity, State
from support.diagnostics import ProfileError

REFUSAL = "This is a replay of a log: no orders are carried out"
CONFIGURATION = "Config.ini"  # of Shoal and DUNE, beside a log
SECTION = "Transports.MAVLink"
MOST_PLANS = 64
FIRST_TIME, LAST_TIME = 946_684_800.0, 4_102_444_800.0  # s: years 2000 and 2100
TYPES: Mapping[int, str] = {
    imc.SystemType.UUV: "submarine",
    imc.SystemType.USV: "boat",
    imc.SystemType.UAV: "copter",
}
MODES: Mapping[str, Mode] = {
    **dict.fromkeys(("AUTO", "MISSION"), Mode.MISSION),
    **dict.fromkeys(("LOITER", "POSHOLD", "ALT_HOLD", "HOLD", "BRAKE", "CIRCLE", "SURFTRAK"), Mode.HOLD),
    **dict.fromkeys(("RTL", "SMART_RTL", "SURFACE", "QRTL"), Mode.RETURN),
    **dict.fromkeys(("LAND", "QLAND"), Mode.LAND),
    "GUIDED": Mode.GUIDED,
    "TAKEOFF": Mode.TAKEOFF,
    "OFFBOARD": Mode.OFFBOARD,
    "MANUAL": Mode.MANUAL,
}
"""Meaning of the modes of other autopilots; in all others a pilot steers."""


class LoggedIdentity(NamedTuple):
    """Writer of a log: IMC id, name, kind of vehicle, id in MAVLink, height of the geoid above the ellipsoid in m."""

    imc_id: int
    name: str
    kind: str
    system: int
    undulation: float


def identify_log_owner(path: Path, wanted: str = "") -> LoggedIdentity | str:
    """The owner of a log, or its system with a name or id; else why there is none."""
    try:
        log = Log(path)
        owner = next((imc.header(packet).src for _, packet in log.packets()), None)
        if owner is None:
            return f"{path}: there is no message in this log"
        names, announced = SystemNames(), dict[int, Any]()
        for message in log.messages("Announce") if "Announce" in log.schema else ():
            names.learn(message)
            announced.setdefault(message.src, message)
            if owner in announced and not wanted:
                break
        if wanted:
            (owner,) = names.find_system_ids((wanted,), announced) or (owner,)
    except (OSError, ValueError) as error:
        return f"{path}: {error}"
    about, options = announced.get(owner), _configured(log.path.parent)
    kind, number = options.get("Vehicle Kind", ""), options.get("System Id", "")
    announced_id = Services.parse(about.services).mavlink_id if about is not None else 0
    chosen = int(number) if number.isdecimal() and len(number) <= 3 else 0
    return LoggedIdentity(
        owner,
        names.system_name(owner),
        kind if kind in KINDS else TYPES.get(about.sys_type if about is not None else -1, "submarine"),
        chosen or announced_id or mavlink_system_id(owner),
        _number(options.get("Geoid Undulation", "")),
    )


def _configured(folder: Path) -> Mapping[str, str]:
    """The options of MAVLink in the vehicle's configuration; none without that, or if it is damaged."""
    try:
        return read_sections(folder / CONFIGURATION).get(SECTION, {})
    except (ProfileError, OSError, ValueError):
        return {}


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        return 0.0
    return value if abs(value) <= 120.0 else 0.0


class LoggedPlans(PlanClient):
    """Rejects all requests, and finds plans among those of the log until now."""

    def __init__(self, port: VehiclePort) -> None:
        super().__init__(port)
        self._stored: dict[str, imc.PlanSpecification] = {}
        self._requested: dict[tuple[type[imc.Message], int, int], imc.PlanSpecification] = {}

    def learn(self, message: imc.PlanDB | imc.PlanControl) -> None:
        """Take the plan of an answer of the vehicle, and that of a request once it has succeeded."""
        kinds, plan = type(message).Type, message.arg if isinstance(message.arg, imc.PlanSpecification) else None
        if message.type == kinds.REQUEST:
            if plan is not None:
                self._requested[type(message), message.src, message.request_id] = plan
                if len(self._requested) > MOST_PLANS:
                    del self._requested[next(iter(self._requested))]
            return
        if message.type == kinds.IN_PROGRESS:
            return
        requested = self._requested.pop((type(message), message.dst, message.request_id), None)
        if message.type == kinds.SUCCESS and (plan := plan or requested) is not None:
            self.add_plan(plan)

    def add_plan(self, plan: imc.PlanSpecification) -> None:
        self._stored.pop(plan.plan_id, None)
        self._stored[plan.plan_id] = plan
        for name in list(islice(self._stored, max(0, len(self._stored) - MOST_PLANS))):
            del self._stored[name]

    def forget(self) -> None:
        self._stored.clear()
        self._requested.clear()

    def fetch(self, plan_id: str, then: OnReply, now: float) -> None:
        plan = self._stored.get(plan_id)
        then(PlanReply(plan is not None, "" if plan is not None else "the log does not have it", plan))

    def start(self, plan: imc.PlanSpecification, then: OnReply, now: float) -> None:
        then(PlanReply(False, REFUSAL))

    def stop(self, now: float, then: OnReply = lambda _: None) -> None:
        then(PlanReply(False, REFUSAL))

    def store(self, plan: imc.PlanSpecification, then: OnReply, now: float) -> None:
        then(PlanReply(False, REFUSAL))

    def remove(self, plan_id: str, then: OnReply, now: float) -> None:
        then(PlanReply(False, REFUSAL))


class LoggedVehicle(VehicleModel):
    """The state of a logged vehicle; `elapsed()` is the present time in the log, in s, by which its figures age.

    `now()` is the time of the replay: stations see times that advance also while it is paused, and never go back.
    Messages of a log come with that in their headers.
    """

    def __init__(
        self,
        identity: VehicleIdentity,
        port: VehiclePort,
        options: VehicleOptions,
        *,
        elapsed: Callable[[], float],
        now: Callable[[], float],
        enumerations: Mapping[str, Mapping[int, str]],
    ) -> None:
        self._elapsed = elapsed
        self._now = now
        self._enumerations = enumerations
        self._parts: dict[int, Entity] = {}
        self._lasting: dict[type[imc.Message], tuple[imc.Message, str]] = {}
        self._date: float | None = None
        super().__init__(identity, port, options, self._parts.values)

    def reset(self) -> None:
        """Forget all but home."""
        self.latest.clear()
        self._parts.clear()
        self._lasting.clear()
        self.notices.clear()
        self.held = self.health.supervisor_silent = self.health.aborted = False

    def label(self, entity: int) -> str:
        """The label of an entity of the log, as far as it is known."""
        return self._parts[entity].label if entity in self._parts else f"entity {entity}"

    def learn_entities(self, message: imc.Message, date: float = math.nan) -> None:
        """Take the entities that a message names; `date` is its time in the log, in s since 1970."""
        self._date = date if FIRST_TIME < date < LAST_TIME else self._date
        match message:
            case imc.EntityInfo(label=label) if label:
                self._part(message.id or message.src_ent).label = label
            case imc.EntityList(op=imc.EntityList.Op.REPORT):
                for entry in message.list.split(";"):
                    label, _, number = entry.rpartition("=")
                    if label and number.isdecimal():
                        self._part(int(number)).label = label
            case imc.EntityState():
                part = self._part(message.src_ent)
                known = message.state in set(State)
                part.state, part.stateful = State(message.state) if known else State.NORMAL, known
                part.description = message.description
            case _:
                pass

    def update(self, message: imc.Message, label: str, now: float) -> None:
        """Take a message; imported logs have modes only when they change."""
        super().update(message, label, now)
        if isinstance(message, imc.AutopilotMode | imc.ArmingState):
            self._lasting[type(message)] = message, label

    def age(self, received: float) -> float:
        """Seconds since `received` in the time of the log."""
        return self._elapsed() - received

    def forget_old(self) -> None:
        if self.latest.vehicle is None:
            for message, label in self._lasting.values():
                self.latest.update(message, label, self._elapsed())
        super().forget_old()

    def state_boot_time_ms(self, state: imc.EstimatedState) -> int:
        elapsed = self._elapsed()
        received = self.latest.received_at(imc.EstimatedState)
        return from_imc.boot_ms(self._now() - elapsed + (received or elapsed), self.boot)

    def utc(self, now: float) -> float:
        """The date in the log."""
        return now if self._date is None else self._date

    @property
    def mode(self) -> Mode:
        """Mode by its name, if an autopilot sent nothing else."""
        name = self._mode_name
        return MODES.get(name, Mode.TELEOPERATION) if name else super().mode

    def custom_mode(self, flavor: Flavor) -> int:
        number = mode_number(self._mode_name, self.kind.type, flavor, self._enumerations)
        return super().custom_mode(flavor) if number is None else number

    @property
    def _mode_name(self) -> str:
        mode = self.latest.get(imc.AutopilotMode) if self.latest.vehicle is None else None
        return "" if mode is None else mode.mode

    def _part(self, number: int) -> Entity:
        return self._parts.setdefault(number, Entity(number, f"entity {number}", ""))


class LoggedEndpoint(VehicleEndpoint):
    """The logged vehicle as stations see it: it rejects all orders, and its plans are those of the log."""

    model: LoggedVehicle

    def __init__(
        self,
        dialect: Dialect,
        model: LoggedVehicle,
        port: VehiclePort,
        equipment: VehicleEquipment,
        warn: Callable[[str], object],
    ) -> None:
        self._logged_plans = LoggedPlans(port)
        super().__init__(dialect, model, port, equipment, warn=warn, plans=self._logged_plans, refusal=REFUSAL)

    def reset(self) -> None:
        """Drop all state but home: the replay continues elsewhere in the log."""
        self.model.reset()
        self._logged_plans.forget()
        self.mission.use_plan("", 0.0)

    def learn_entities_and_plans(self, message: imc.Message, date: float = math.nan) -> None:
        """Take the entities and plans that a message names; `date` is its time in the log, in s since 1970."""
        self.model.learn_entities(message, date)
        match message:
            case imc.PlanDB() | imc.PlanControl():
                self._logged_plans.learn(message)
            case imc.PlanSpecification():
                self._logged_plans.add_plan(message)
                if message.plan_id not in GUIDED_PLANS and not message.plan_id.endswith(REST_SUFFIX):
                    self.mission.use_plan(message.plan_id, 0.0)
            case _:
                pass

    def update_state(self, message: imc.Message, label: str, now: float) -> None:
        """Take a message at a time of the log; that of a plan which is new starts it."""
        before = self.mission.plan
        super().update_state(message, label, now)
        if isinstance(message, imc.PlanControlState) and self.mission.plan is not before:
            self.mission.update(message, now)
