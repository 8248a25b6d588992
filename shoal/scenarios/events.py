"""Reads the events of a scenario file: what happens, and when."""

import math
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import imc
from autonomy.plans.yaml import read_field
from runtime.fault_injection import Biased, Crash, Fault, FaultError, Noisy, Silent, Stuck
from shoal.scenarios.acts import Act, Break, Cut, Drain, Leak, Say, Set
from shoal.scenarios.conditions import Condition, Scope, read_condition
from shoal.scenarios.scenario import ScenarioFileError
from shoal.scenarios.stage import Stage
from shoal.scenarios.values import known, number, one_of, option_text, seconds, told, word
from support.located_yaml import Node
from support.text import with_suggestion

TIMES = ("at", "when", "after", "vehicle")
HEADER = ("src", "src_ent", "dst", "dst_ent")


class Role(NamedTuple):
    """What is known of a vehicle when events are read: its messages, the sections of its tasks, and its plan."""

    schema: imc.Schema
    sections: Collection[str]
    plan: imc.PlanSpecification | None


@dataclass(frozen=True, eq=False)
class Occurrence:
    """An act at a time `at` (s from the start), or `after` so many seconds when a condition holds; it happens once.

    It ends after `lasting` seconds. `where` is its place in the file.
    """

    act: Act
    where: str
    at: float = 0.0
    when: Condition | None = None
    after: float = 0.0
    lasting: float = math.inf

    def arm(self, stage: Stage) -> None:
        """Prepare it. Raises ScenarioFileError with the place in the file if a vehicle cannot do it."""
        try:
            self.act.check(stage)
            if self.when is not None:
                stage.when(self.when, lambda: self._wait(stage, stage.time + self.after))
        except ValueError as error:
            raise ScenarioFileError(f"{self.where}: {error}") from None
        if self.when is None:
            self._wait(stage, self.at)
        else:
            stage.unhappened[self] = f"{self.where}: has not happened: {self.when.text} did not hold"

    def _wait(self, stage: Stage, time: float) -> None:
        stage.unhappened[self] = f"{self.where}: has not happened: the run ended before {time:g} s"
        stage.at(time, lambda: self._begin(stage))

    def _begin(self, stage: Stage) -> None:
        del stage.unhappened[self]
        end = self.act.begin(stage, self.lasting)
        if end is not None and math.isfinite(self.lasting):
            stage.at(stage.time + self.lasting, end)


def read_events(
    node: Node, roles: Mapping[str, Role], links: Collection[str], limit: float = math.inf
) -> tuple[Occurrence, ...]:
    """The events in a file, by the names of vehicles and links; none may be later than `limit` (s).

    Raises the error of the file.
    """
    return tuple(_event(item, roles, links, limit) for item in node.items())


def _event(node: Node, roles: Mapping[str, Role], links: Collection[str], limit: float) -> Occurrence:
    given = node.mapping()
    kinds = [kind for kind in (*KINDS, "cut") if kind in given]
    if not kinds:
        wrong = next((key for key in given if key not in (*TIMES, "for")), "")
        node.fail(with_suggestion(f"expected one of {', '.join((*KINDS, 'cut'))}", wrong, (*KINDS, "cut")))
    if len(kinds) > 1:
        given[kinds[1]].fail(f"an event is of one kind: {kinds[0]} or {kinds[1]}")
    kind = kinds[0]
    more = KINDS[kind].more if kind in KINDS else ("for",)
    parts = known(node, kind, *TIMES, *more)
    if "for" in parts and not seconds(parts["for"]) > 0.0:
        parts["for"].fail("for must be above 0")
    if ("at" in parts) == ("when" in parts):
        node.fail("an event has either a time, at: 60 s, or a condition, when: EstimatedState.depth > 3")
    if "after" in parts and "when" not in parts:
        parts["after"].fail("after is the time from a condition: it needs when")
    at = seconds(parts["at"]) if "at" in parts else 0.0
    if at >= limit:
        parts["at"].fail(f"at: {at:g} s is not before the end of the run, at {limit:g} s")
    schemas = {name: role.schema for name, role in roles.items()}
    only = next(iter(roles)) if len(roles) == 1 else ""
    vehicle = one_of(parts["vehicle"], roles, "vehicle") if "vehicle" in parts else only
    if kind == "cut":
        act: Act = Cut(vehicle, one_of(parts["cut"], links, "link"))
    elif not vehicle:
        node.fail("there are several vehicles: write vehicle: NAME")
    else:
        act = KINDS[kind].read(parts, vehicle, roles[vehicle])
    return Occurrence(
        act,
        node.where,
        at,
        read_condition(parts["when"], Scope(schemas, vehicle)) if "when" in parts else None,
        seconds(parts["after"]) if "after" in parts else 0.0,
        seconds(parts["for"]) if "for" in parts else math.inf,
    )


Parts = dict[str, Node]


class _Kind(NamedTuple):
    """How to read an event of a kind, and what else it may say."""

    read: Callable[[Parts, str, Role], Act]
    more: tuple[str, ...] = ()


def _broken(kind: str, fault: Callable[[Parts, Role], Fault]) -> Callable[[Parts, str, Role], Act]:
    def read(parts: Parts, vehicle: str, role: Role) -> Act:
        task = _task(parts[kind], role)
        try:
            made = fault(parts, role)
            made.check(role.schema)
        except FaultError as error:
            parts[kind].fail(str(error))
        return Break(vehicle, task, made, parts[kind].where)

    return read


def _task(node: Node, role: Role) -> str:
    """The section of a task; the hint for the last word of one is the whole."""
    found = word(node)
    whole = [section for section in role.sections if re.split(r"[./]", section)[-1] == found]
    if found not in role.sections and whole:
        node.fail(f"there is no task {found!r} (did you mean {' or '.join(map(repr, whole))}?)")
    return one_of(node, role.sections, "task")


def _names(parts: Parts) -> tuple[str, ...]:
    node = parts.get("of")
    if node is None:
        return ()
    if node.content == []:
        node.fail("names no message")
    return node.texts() if isinstance(node.content, list) else (word(node),)


def _field(parts: Parts, role: Role, amount: str) -> tuple[str, str, float]:
    """Message, field, and an amount in the unit of the field."""
    for key in ("of", "field", amount):
        if key not in parts:
            raise FaultError(f"{key!r} is missing: of: GpsFix, field: lat, {amount}: 0.001°")
    message, name = word(parts["of"]), word(parts["field"])
    infos = role.schema.fields(role.schema[message]) if message in role.schema else ()
    unit = next((info.unit for info in infos if info.name == name), "")
    return message, name, number(parts[amount], unit)


def _leak(parts: Parts, vehicle: str, role: Role) -> Act:
    sensor = word(parts["leak"])
    return Leak(vehicle, "" if sensor == "all" else sensor)


def _drain(parts: Parts, vehicle: str, role: Role) -> Act:
    level = number(parts["drain"], "%")
    if not 0.0 <= level <= 100.0:
        parts["drain"].fail("a level is from 0 % to 100 %")
    return Drain(vehicle, level, parts["drain"].where)


def _set(parts: Parts, vehicle: str, role: Role) -> Act:
    given = parts["set"].mapping()
    if not given or not all(node.mapping() for node in given.values()):
        parts["set"].fail("sets nothing: write {TASK: {OPTION: VALUE}}")
    return Set(
        vehicle,
        {task: {option: option_text(item) for option, item in node.mapping().items()} for task, node in given.items()},
    )


def _message(parts: Parts, vehicle: str, role: Role) -> Act:
    node = parts["message"]
    message, texts = _plain(node, role.schema, outer=True)
    if texts.get("dst"):
        node.fail(f"dst is a number, not {texts['dst']!r}")
    try:
        made = imc.from_dict(message, role.schema)
    except imc.DecodeError as error:
        node.fail(str(error))
    words = f"message {type(made).__name__}"
    return Say(vehicle, made, words, texts.get("src", ""), texts.get("src_ent", ""), texts.get("dst_ent", ""))


def _plain(node: Node, schema: imc.Schema, *, outer: bool = False) -> tuple[dict[str, object], dict[str, str]]:
    """A message as a dictionary, and what is a name in its header."""
    parts = node.mapping(required=("abbrev",))
    abbrev = one_of(parts["abbrev"], schema.types, "message")
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
            plain[name] = told(item, lambda value, info=info: read_field(info, value))
    return plain, texts


def _plan(parts: Parts, vehicle: str, role: Role) -> Act:
    word_ = one_of(parts["plan"], PLAN, "order")
    if word_ == "start" and role.plan is None:
        parts["plan"].fail(f"{vehicle} has no plan")
    plan = role.plan if word_ == "start" else None
    request = imc.PlanControl(op=PLAN[word_], arg=plan, plan_id=role.plan.plan_id if role.plan else "")
    return Say(vehicle, request, f"plan {word_}")


def _abort(parts: Parts, vehicle: str, role: Role) -> Act:
    if parts["abort"].value() is not True:
        parts["abort"].fail("write abort: true")
    return Say(vehicle, imc.Abort(), "abort")


PLAN: Mapping[str, int] = MappingProxyType({"start": imc.PlanControl.Op.START, "stop": imc.PlanControl.Op.STOP})
KINDS: Mapping[str, _Kind] = MappingProxyType(
    {
        "silent": _Kind(_broken("silent", lambda parts, _: Silent(_names(parts))), ("of", "for")),
        "stuck": _Kind(_broken("stuck", lambda parts, _: Stuck(_names(parts))), ("of", "for")),
        "biased": _Kind(
            _broken("biased", lambda parts, role: Biased(*_field(parts, role, "by"))), ("of", "field", "by", "for")
        ),
        "noisy": _Kind(
            _broken("noisy", lambda parts, role: Noisy(*_field(parts, role, "deviation"))),
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
