"""Checks of a crew before a dive or a flight, from the vehicle's own messages. What is unknown is not in order."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

import imc
from autonomy.plans import PlanEstimate
from imc.coordinates import area_contains
from shoal.console.vehicle_view import position, word
from shoal.network import NetworkSystem
from support.terminal_text import printable
from support.text_length import list_first
from support.wgs84 import offset

M = TypeVar("M", bound=imc.Message)
Color = Literal["green", "yellow", "red"]
NAMED = 4  # entities in a line
DAY = 86_400.0  # s
GPS_WEAK = 5.0  # HDOP
NEAR, FAR = 30.0, 100.0  # m between the fix and the estimate
LOW, EMPTY = 20.0, 10.0  # % of the battery that are left after the plan
FULL, FULLEST = 85, 95  # % of the disk
CLOCK_OFF, CLOCK_WRONG = 1.0, 10.0  # s
CALIBRATED = 3600.0  # s
SILENT = 2.0  # s
KINDS = (
    imc.Calibration,
    imc.EntityState,
    imc.EstimatedState,
    imc.FuelLevel,
    imc.GpsFix,
    imc.NavigationUncertainty,
    imc.OperationalLimits,
    imc.StorageUsage,
    imc.VehicleState,
)
"""The messages that the checks are made from."""


@dataclass(frozen=True)
class DiveCheck:
    """A line of the list: `value` in words, and the message or program that it comes from."""

    name: str
    color: Color
    value: str
    source: str


@dataclass(frozen=True)
class PlanChoice:
    """The plan that is to be carried out: its estimate by the vehicle, or why there is none; and all that are stored.

    `stored` is None if the vehicle gives no list.
    """

    name: str = ""
    estimate: PlanEstimate | None = None
    trouble: str = ""
    stored: Sequence[str] | None = None


class DiveChecks:
    """The checks of one vehicle as it is now. `is_live` is whether it is on a network now, and not in a log."""

    def __init__(self, system: NetworkSystem, plan: PlanChoice, *, is_live: bool) -> None:
        self._system, self._plan, self._is_live = system, plan, is_live
        clocks = (imc.EstimatedState, imc.VehicleState, imc.Heartbeat)
        times = [found.timestamp for kind in clocks if (found := system.latest_message(kind)) is not None]
        self._silence = system.age if is_live else 0.0  # s
        self._now = max(times, default=math.nan) + self._silence
        announce = system.latest_message(imc.Announce)
        self._is_submarine = announce is not None and announce.sys_type == imc.SystemType.UUV

    def rows(self) -> list[DiveCheck]:
        """All checks in the order in which a crew looks."""
        checks: list[Callable[[], DiveCheck | None]] = [
            self._link, self._mode, self._entities, self._leaks, self._fix, self._navigation, self._stored_plan,
            self._battery, self._limits, self._disk, self._clock, self._calibration,
        ]  # fmt: skip
        return [self._aged(found) for check in checks if (found := check()) is not None]

    def _aged(self, check: DiveCheck) -> DiveCheck:
        """A line that is in order only if the vehicle is not silent."""
        if check.color != "green" or self._silence <= SILENT:
            return check
        return replace(check, color="yellow", value=f"{check.value}; last message {self._silence:.0f} s ago")

    def _latest(self, kind: type[M], oldest: float) -> M | None:
        """The newest message of a type, if it is not older than `oldest` s."""
        found = self._system.latest_message(kind)
        return found if found is not None and self._now - found.timestamp <= oldest else None

    def _link(self) -> DiveCheck | None:
        if not self._is_live:
            return None
        system, source = self._system, "this console"
        if system.conflict_text:
            return DiveCheck("Link", "red", printable(system.conflict_text), source)
        ways = ", ".join(sorted(system.links)) or "none"
        if not system.is_there:
            return DiveCheck("Link", "red", f"lost; it was reached over {ways}", source)
        color: Color = "green" if system.age <= SILENT else "yellow"
        return DiveCheck("Link", color, f"{ways}; last message {system.age:.1f} s ago", source)

    def _mode(self) -> DiveCheck:
        state, mode = self._latest(imc.VehicleState, 5.0), imc.VehicleState.OpMode
        if state is None:
            return _unknown("Mode", "VehicleState")
        colors: dict[int, Color] = {mode.SERVICE: "green", mode.ERROR: "red", mode.BOOT: "red"}
        words = word(mode, state.op_mode)
        if state.op_mode == mode.ERROR and state.last_error:
            words += f": {printable(state.last_error)}"
        return DiveCheck("Mode", colors.get(state.op_mode, "yellow"), words, "VehicleState")

    def _entities(self) -> DiveCheck:
        kinds, states = imc.EntityState.State, list(self._system.latest_entity_messages(imc.EntityState))
        if not states:
            return _unknown("Entities", "EntityState")
        bad = [each for each in states if each.state in (kinds.ERROR, kinds.FAILURE)]
        doubtful = [each for each in states if each.state != kinds.NORMAL and each not in bad]
        if not bad and not doubtful:
            return DiveCheck("Entities", "green", f"all {len(states)} are normal", "EntityState")
        color: Color = "red" if bad else "yellow"
        names = [f"{self._system.label(each.src_ent)}: {each.description}" for each in (*bad, *doubtful)]
        return DiveCheck("Entities", color, printable(list_first(names, NAMED)), "EntityState")

    def _leaks(self) -> DiveCheck | None:
        sensors = [
            each
            for each in self._system.latest_entity_messages(imc.EntityState)
            if "leak sensor" in self._system.label(each.src_ent).lower()
        ]
        if not sensors:
            return _unknown("Leaks", "EntityState of leak sensors", "yellow") if self._is_submarine else None
        wet = [each for each in sensors if each.state != imc.EntityState.State.NORMAL]
        words = [f"{self._system.label(each.src_ent)}: {each.description}" for each in wet]
        color: Color = "red" if wet else "green"
        text = printable(list_first(words, NAMED)) if wet else f"{len(sensors)} sensors are dry"
        return DiveCheck("Leaks", color, text, "EntityState")

    def _fix(self) -> DiveCheck:
        fix, valid = self._latest(imc.GpsFix, 5.0), imc.GpsFix.Validity
        if fix is None:
            return _unknown("GPS fix", "GpsFix", since=self._since(imc.GpsFix))
        if not fix.validity & valid.VALID_POS:
            return DiveCheck("GPS fix", "red", f"no valid position, {fix.satellites} satellites", "GpsFix")
        has_hdop = bool(fix.validity & valid.VALID_HDOP) and math.isfinite(fix.hdop)
        color: Color = "green" if has_hdop and fix.hdop <= GPS_WEAK else "yellow"
        return DiveCheck(
            "GPS fix",
            color,
            f"{fix.satellites} satellites, {f'HDOP {fix.hdop:.1f}' if has_hdop else 'no HDOP'}",
            "GpsFix",
        )

    def _navigation(self) -> DiveCheck:
        state, doubt = self._latest(imc.EstimatedState, 3.0), self._latest(imc.NavigationUncertainty, 5.0)
        if state is None:
            return _unknown("Position", "EstimatedState", since=self._since(imc.EstimatedState))
        lat, lon, _ = position(state)
        if not math.isfinite(lat + lon):
            return DiveCheck("Position", "red", "the vehicle does not know it", "EstimatedState")
        words, color = ["its uncertainty is unknown"], "yellow"
        if doubt is not None:
            spread = 2.0 * math.sqrt(max(doubt.x, doubt.y, 0.0))
            words, color = [f"within {spread:.1f} m (2 σ)"], "green" if spread <= NEAR else "yellow"
        fix = self._latest(imc.GpsFix, 5.0)
        if fix is not None and fix.validity & imc.GpsFix.Validity.VALID_POS:
            known = math.isfinite(fix.lat + fix.lon)
            apart = math.hypot(*offset(lat, lon, fix.lat, fix.lon)) if known else math.inf
            words.append(f"{apart:.0f} m from the GPS fix")
            color = "red" if not apart <= FAR else "yellow" if apart > NEAR else color
        found: Color = "red" if color == "red" else "yellow" if color == "yellow" else "green"
        return DiveCheck("Position", found, ", ".join(words), "EstimatedState, NavigationUncertainty, GpsFix")

    def _stored_plan(self) -> DiveCheck | None:
        if not self._is_live:
            return None
        plan, source = self._plan, "the vehicle's own check of the plan (PlanControl, LOAD)"
        if not plan.name:
            if plan.stored is None:
                return DiveCheck("Plan", "red", f"unknown: {plan.trouble or 'no answer'}", "PlanDB")
            if not plan.stored:
                return DiveCheck("Plan", "red", "none is stored", "PlanDB")
            return DiveCheck("Plan", "yellow", f"none is chosen of {len(plan.stored)}", "PlanDB")
        name = printable(plan.name)
        if plan.estimate is None:
            return DiveCheck("Plan", "red", f"{name}: unknown: {printable(plan.trouble)}", source)
        if plan.estimate.rejected:
            return DiveCheck("Plan", "red", f"{name} would be rejected: {printable(plan.estimate.rejected)}", source)
        if math.isnan(plan.estimate.seconds):
            return DiveCheck("Plan", "yellow", f"{name}: not checked while a plan is carried out", source)
        return DiveCheck("Plan", "green", f"{name} would start; {plan.estimate.seconds:.0f} s", source)

    def _battery(self) -> DiveCheck:
        fuel = self._latest(imc.FuelLevel, 60.0)
        if fuel is None or not math.isfinite(fuel.value):
            return _unknown("Battery", "FuelLevel", since=self._since(imc.FuelLevel))
        needed = math.nan if self._plan.estimate is None else self._plan.estimate.energy
        left = fuel.value - (0.0 if math.isnan(needed) else needed)
        color: Color = "red" if left < EMPTY else "yellow" if left < LOW or math.isnan(needed) else "green"
        words = f"{fuel.value:.0f} %"
        words += "; what the plan needs is unknown" if math.isnan(needed) else f", {left:.0f} % after the plan"
        return DiveCheck("Battery", color, words, "FuelLevel, and the estimate of the plan")

    def _limits(self) -> DiveCheck:
        limits, mask = self._system.latest_message(imc.OperationalLimits), imc.OpLimitsMask
        if limits is None:
            return _unknown("Limits and area", "OperationalLimits", "yellow")
        words = [
            text
            for bit, text in (
                (mask.MAX_DEPTH, f"depth at most {limits.max_depth:g} m"),
                (mask.MIN_ALT, f"altitude at least {limits.min_altitude:g} m"),
                (mask.MAX_ALT, f"altitude at most {limits.max_altitude:g} m"),
                (mask.MAX_SPEED, f"speed at most {limits.max_speed:g} m/s"),
            )
            if limits.mask & bit
        ]
        color: Color = "green" if words else "yellow"
        if limits.mask & mask.AREA:
            state = self._latest(imc.EstimatedState, 3.0)
            place = (math.nan, math.nan) if state is None else position(state)[:2]
            known = math.isfinite(limits.lat + limits.lon + limits.orientation)
            inside = known and area_contains(limits, *place)
            size = f"area {limits.length:.0f} m × {limits.width:.0f} m"
            words.append(f"{size}: the vehicle is {'inside' if inside else 'outside, or its position is unknown'}")
            color = "green" if inside else "red"
        return DiveCheck("Limits and area", color, ", ".join(words) or "none are set", "OperationalLimits")

    def _disk(self) -> DiveCheck:
        storage = self._latest(imc.StorageUsage, 90.0)
        if storage is None:
            return _unknown("Free disk", "StorageUsage", "yellow", self._since(imc.StorageUsage))
        color: Color = "red" if storage.value >= FULLEST else "yellow" if storage.value >= FULL else "green"
        return DiveCheck("Free disk", color, f"{storage.available} MiB free, {storage.value} % used", "StorageUsage")

    def _clock(self) -> DiveCheck:
        fix, valid = self._latest(imc.GpsFix, 5.0), imc.GpsFix.Validity
        if fix is not None and fix.validity & valid.VALID_TIME and math.isfinite(fix.utc_time):
            off = (fix.timestamp - fix.utc_time + DAY / 2.0) % DAY - DAY / 2.0
            return _clock_check(off, "the time of the GPS", "GpsFix")
        if not self._is_live or not math.isfinite(self._system.clock):
            return _unknown("Clock", "GpsFix, Heartbeat", "yellow")
        return _clock_check(self._system.clock, "the clock of this computer", "its messages")

    def _calibration(self) -> DiveCheck:
        found = self._system.latest_message(imc.Calibration)
        if found is None:
            since = "since this console started" if self._is_live else "in this log up to now"
            return DiveCheck("Calibration", "yellow", f"unknown: none was seen {since}", "Calibration")
        age = self._now - found.timestamp
        color: Color = "green" if age <= CALIBRATED else "yellow"
        return DiveCheck("Calibration", color, f"{age / 60.0:.0f} min ago", "Calibration")

    def _since(self, kind: type[imc.Message]) -> float:
        found = self._system.latest_message(kind)
        return math.nan if found is None else self._now - found.timestamp


def _unknown(name: str, source: str, color: Color = "red", since: float = math.nan) -> DiveCheck:
    """A line of what the vehicle does not report; `since` is the age of its last message (s)."""
    words = f"unknown: the last one is {since:.0f} s old" if math.isfinite(since) else "unknown: nothing was received"
    return DiveCheck(name, color, words, source)


def _clock_check(off: float, compared: str, source: str) -> DiveCheck:
    color: Color = "green" if abs(off) < CLOCK_OFF else "yellow" if abs(off) < CLOCK_WRONG else "red"
    return DiveCheck("Clock", color, f"{abs(off):.1f} s {'ahead of' if off > 0.0 else 'behind'} {compared}", source)
