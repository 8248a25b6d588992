"""Reads the events of a scenario file: what happens, and when."""

import math
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import imc
from autonomy.plans.yaml import read_field
from runtime.fault_injection import Biased, Crash, Fault, FaultError, Noisy, Silent, Stuck
from shoal.scenarios.actions import Action, CutLink, DrainBattery, InjectFault, SendMessage, SetParameters, SimulateLeak
from shoal.scenarios.event_timing import TIMING_KEYS, EventTiming, read_timing
from shoal.scenarios.message_names import ExpressionScope
from shoal.scenarios.run_context import RunContext
from shoal.scenarios.scenario import ScenarioFileError
from shoal.scenarios.value_reader import (
    convert_node_value,
    read_choice,
    read_mapping,
    read_nonempty_text,
    read_number,
    read_option_text,
    read_seconds,
)
from support.located_yaml import Node
from support.terminal_text import with_suggestion

COMMON = (*TIMING_KEYS, "vehicle", "name")
HEADER = ("src", "src_ent", "dst", "dst_ent")


class VehicleInfo(NamedTuple):
    """Description of a vehicle for the reader of events: its messages, the sections of its tasks, and its plan."""

    schema: imc.Schema
    sections: Collection[str]
    plan: imc.PlanSpecification | None


@dataclass(frozen=True, eq=False)
class ScheduledAction:
    """An action at its times. It ends after `duration` seconds. `name` is what captures call it."""

    action: Action
    timing: EventTiming
    duration: float = math.inf
    name: str = ""

    def schedule(self, context: RunContext) -> None:
        """Prepare it. Raises ScenarioFileError with the place in the file if a vehicle cannot do it."""
        try:
            self.action.check(context)
            self.timing.schedule(context, lambda: self._begin(context))
        except ValueError as error:
            raise ScenarioFileError(str(error), self.timing.where) from None

    def _begin(self, context: RunContext) -> None:
        for watch in context.event_watchers.get(self.name, ()):
            watch()
        end = self.action.begin(context, self.duration)
        if end is not None and math.isfinite(self.duration):
            context.call_at(context.time + self.duration, end)


def read_events(
    node: Node,
    vehicle_infos: Mapping[str, VehicleInfo],
    links: Collection[str],
    limit: float = math.inf,
    scope: ExpressionScope | None = None,
) -> tuple[ScheduledAction, ...]:
    """The events in a file, by the names of vehicles and links; none may be later than `limit` (s).

    `scope` has what conditions may name besides the messages of the vehicles. Raises the error of the file.
    """
    schemas = {name: vehicle_info.schema for name, vehicle_info in vehicle_infos.items()}
    scope = scope or ExpressionScope(schemas)
    event_names(node)
    return tuple(_event(item, vehicle_infos, links, limit, scope) for item in node.items())


def event_names(node: Node) -> list[str]:
    """The names of the events in a file that have one. Raises the error of the file if two are the same."""
    found: list[str] = []
    for item in node.items():
        given = item.mapping().get("name")
        if given is None:
            continue
        name = read_nonempty_text(given)
        if name in found:
            given.fail(f"there are two events {name!r}: give each a name of its own")
        found.append(name)
    return found


def _event(
    node: Node, vehicle_infos: Mapping[str, VehicleInfo], links: Collection[str], limit: float, scope: ExpressionScope
) -> ScheduledAction:
    given = node.mapping()
    kinds = [kind for kind in (*EVENT_KINDS, "cut") if kind in given]
    if not kinds:
        wrong = next((key for key in given if key not in (*COMMON, "for")), "")
        node.fail(with_suggestion(f"expected one of {', '.join((*EVENT_KINDS, 'cut'))}", wrong, (*EVENT_KINDS, "cut")))
    if len(kinds) > 1:
        given[kinds[1]].fail(f"an event is of one kind: {kinds[0]} or {kinds[1]}")
    kind = kinds[0]
    more = EVENT_KINDS[kind].more if kind in EVENT_KINDS else ("for",)
    parts = read_mapping(node, kind, *COMMON, *more)
    duration = read_seconds(parts["for"]) if "for" in parts else math.inf
    if not duration > 0.0:
        parts["for"].fail("for must be above 0")
    only = next(iter(vehicle_infos)) if len(vehicle_infos) == 1 else ""
    vehicle = read_choice(parts["vehicle"], vehicle_infos, "vehicle") if "vehicle" in parts else only
    timing = read_timing(node, parts, replace(scope, vehicle=vehicle), limit)
    if math.isfinite(duration) and duration > timing.period:
        parts["for"].fail(f"for: {duration:g} s is longer than every: {timing.period:g} s")
    if kind == "cut":
        action: Action = CutLink(vehicle, read_choice(parts["cut"], links, "link"))
    elif not vehicle:
        node.fail("there are several vehicles: write vehicle: NAME")
    else:
        action = EVENT_KINDS[kind].read(parts, vehicle, vehicle_infos[vehicle])
    return ScheduledAction(action, timing, duration, parts["name"].text() if "name" in parts else "")


Parts = dict[str, Node]


class _Kind(NamedTuple):
    """Reader of an event of a kind, and its further keys."""

    read: Callable[[Parts, str, VehicleInfo], Action]
    more: tuple[str, ...] = ()


def _broken(kind: str, fault: Callable[[Parts, VehicleInfo], Fault]) -> Callable[[Parts, str, VehicleInfo], Action]:
    def read(parts: Parts, vehicle: str, vehicle_info: VehicleInfo) -> Action:
        task = _task(parts[kind], vehicle_info)
        try:
            made = fault(parts, vehicle_info)
            made.check(vehicle_info.schema)
        except FaultError as error:
            parts[kind].fail(str(error))
        return InjectFault(vehicle, task, made, parts[kind].where)

    return read


def _task(node: Node, vehicle_info: VehicleInfo) -> str:
    """The section of a task; the hint for the last word of one is the whole."""
    found = read_nonempty_text(node)
    whole = [section for section in vehicle_info.sections if re.split(r"[./]", section)[-1] == found]
    if found not in vehicle_info.sections and whole:
        node.fail(f"there is no task {found!r} (did you mean {' or '.join(map(repr, whole))}?)")
    return read_choice(node, vehicle_info.sections, "task")


def _names(parts: Parts) -> tuple[str, ...]:
    node = parts.get("of")
    if node is None:
        return ()
    if node.content == []:
        node.fail("names no message")
    return node.texts() if isinstance(node.content, list) else (read_nonempty_text(node),)


def _field(parts: Parts, vehicle_info: VehicleInfo, amount: str) -> tuple[str, str, float]:
    """Message, field, and an amount in the unit of the field."""
    for key in ("of", "field", amount):
        if key not in parts:
            raise FaultError(f"{key!r} is missing: of: GpsFix, field: lat, {amount}: 0.001°")
    message, name = read_nonempty_text(parts["of"]), read_nonempty_text(parts["field"])
    infos = vehicle_info.schema.fields(vehicle_info.schema[message]) if message in vehicle_info.schema else ()
    unit = next((info.unit for info in infos if info.name == name), "")
    return message, name, read_number(parts[amount], unit)


def _leak(parts: Parts, vehicle: str, vehicle_info: VehicleInfo) -> Action:
    sensor = read_nonempty_text(parts["leak"])
    return SimulateLeak(vehicle, "" if sensor == "all" else sensor)


def _drain(parts: Parts, vehicle: str, vehicle_info: VehicleInfo) -> Action:
    level = read_number(parts["drain"], "%")
    if not 0.0 <= level <= 100.0:
        parts["drain"].fail("a level is from 0 % to 100 %")
    return DrainBattery(vehicle, level, parts["drain"].where)


def _set(parts: Parts, vehicle: str, vehicle_info: VehicleInfo) -> Action:
    given = parts["set"].mapping()
    if not given or not all(node.mapping() for node in given.values()):
        parts["set"].fail("sets nothing: write {TASK: {OPTION: VALUE}}")
    return SetParameters(
        vehicle,
        {
            task: {option: read_option_text(item) for option, item in node.mapping().items()}
            for task, node in given.items()
        },
    )


def _message(parts: Parts, vehicle: str, vehicle_info: VehicleInfo) -> Action:
    node = parts["message"]
    message, texts = _plain(node, vehicle_info.schema, outer=True)
    if texts.get("dst"):
        node.fail(f"dst is a number, not {texts['dst']!r}")
    try:
        made = imc.from_dict(message, vehicle_info.schema)
    except imc.DecodeError as error:
        node.fail(str(error))
    words = f"message {type(made).__name__}"
    return SendMessage(vehicle, made, words, texts.get("src", ""), texts.get("src_ent", ""), texts.get("dst_ent", ""))


def _plain(node: Node, schema: imc.Schema, *, outer: bool = False) -> tuple[dict[str, object], dict[str, str]]:
    """A message as a dictionary, and what is a name in its header."""
    parts = node.mapping(required=("abbrev",))
    abbrev = read_choice(parts["abbrev"], schema.types, "message")
    infos = {info.name: info for info in schema.fields(schema[abbrev])}
    plain: dict[str, object] = {"abbrev": abbrev}
    texts: dict[str, str] = {}
    for name, item in parts.items():
        if name == "abbrev":
            continue
        if outer and name in HEADER:
            value = item.value()
            if isinstance(value, str):
                texts[name] = value
            else:
                plain[name] = value
        elif name not in infos:
            item.fail(with_suggestion(f"{abbrev} has no field {name!r}", name, infos))
        elif infos[name].type == "message":
            plain[name] = _plain(item, schema)[0]
        elif infos[name].type == "message-list":
            plain[name] = [_plain(one, schema)[0] for one in item.items()]
        else:
            info = infos[name]
            plain[name] = convert_node_value(item, lambda value, info=info: read_field(info, value))
    return plain, texts


def _plan(parts: Parts, vehicle: str, vehicle_info: VehicleInfo) -> Action:
    word_ = read_choice(parts["plan"], PLAN, "order")
    if word_ == "start" and vehicle_info.plan is None:
        parts["plan"].fail(f"{vehicle} has no plan")
    plan = vehicle_info.plan if word_ == "start" else None
    request = imc.PlanControl(op=PLAN[word_], arg=plan, plan_id=vehicle_info.plan.plan_id if vehicle_info.plan else "")
    return SendMessage(vehicle, request, f"plan {word_}")


def _abort(parts: Parts, vehicle: str, vehicle_info: VehicleInfo) -> Action:
    if parts["abort"].value() is not True:
        parts["abort"].fail("write abort: true")
    return SendMessage(vehicle, imc.Abort(), "abort")


PLAN: Mapping[str, int] = MappingProxyType({"start": imc.PlanControl.Op.START, "stop": imc.PlanControl.Op.STOP})
EVENT_KINDS: Mapping[str, _Kind] = MappingProxyType(
    {
        "silent": _Kind(_broken("silent", lambda parts, _: Silent(_names(parts))), ("of", "for")),
        "stuck": _Kind(_broken("stuck", lambda parts, _: Stuck(_names(parts))), ("of", "for")),
        "biased": _Kind(
            _broken("biased", lambda parts, vehicle_info: Biased(*_field(parts, vehicle_info, "by"))),
            ("of", "field", "by", "for"),
        ),
        "noisy": _Kind(
            _broken("noisy", lambda parts, vehicle_info: Noisy(*_field(parts, vehicle_info, "deviation"))),
            ("of", "field", "deviation", "for"),
        ),
        "crash": _Kind(_broken("crash", lambda parts, _: Crash()), ("for",)),
        "leak": _Kind(_leak, ("for",)),
        "drain": _Kind(_drain),
        "set": _Kind(_set, ("for",)),
        "message": _Kind(_message),
        "plan": _Kind(_plan),
        "abort": _Kind(_abort),
    }
)
