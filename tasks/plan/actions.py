"""The actions of a plan: sets parameters at its events, activates payloads ahead of them."""

import math
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import imc
from autonomy.plans import Actions, PlanGraph, PlanNode
from runtime.task import EntityTable, Task
from support.terminal_text import with_suggestion

if TYPE_CHECKING:
    from runtime.vehicle import Vehicle

Publish = Callable[[imc.Message], object]


class ActivationTimes:
    """The times (s) that entities take to become active: as they report them, else as the vehicle has them."""

    def __init__(self, entities: EntityTable):
        self._entities = entities
        self._act_times: dict[int, float] = {}

    def receive(self, entity: imc.EntityInfo) -> None:
        self._act_times[entity.id] = float(entity.act_time)

    def of(self, label: str) -> float:
        """The time (s), 0 for an unknown entity."""
        entity = self._entities.find(label)
        return 0.0 if entity is None else self._act_times.get(entity.id, float(entity.activation_time))


class PlanActions:
    """Publishes the actions of one plan.

    The parameters of all entities that it touches are pushed at its start and popped at its end. Entities are activated
    `lead(label)` s before their event, if it can be foreseen; `activated` has their labels.
    """

    def __init__(self, graph: PlanGraph, publish: Publish, lead: Callable[[str], float]):
        self.activated: set[str] = set()
        self._graph = graph
        self._publish = publish
        self._lead = lead
        self._early: set[str] = set()
        self._labels = list(dict.fromkeys(action.name for _, action in _all_settings(graph)))

    @property
    def preparation_time(self) -> float:
        """Time (s) that the activations at the start take."""
        start = self._graph.nodes[self._graph.start].start_actions
        return max(self._leads([*_settings(self._graph.plan.start_actions), *_settings(start)]), default=0.0)

    def begin_plan(self) -> None:
        """The plan begins."""
        for label in self._labels:
            self._publish(imc.PushEntityParameters(name=label))
        self._fire(self._graph.plan.start_actions)
        self.activate(self._graph.nodes[self._graph.start])

    def begin_maneuver(self, node: PlanNode) -> None:
        """A maneuver begins."""
        self.activate(node)
        self._early.discard(node.name)
        self._fire(node.start_actions, activations=False)

    def end_maneuver(self, node: PlanNode) -> None:
        """A maneuver ends."""
        self._fire(node.end_actions)

    def activate_ahead(self, name: str, seconds: float, duration: Callable[[str], float]) -> None:
        """The maneuver `name` ends in `seconds`: activate in time what the following maneuvers need."""
        _, *later = self._graph.sequence_from(name)
        for node in later:
            if not math.isfinite(seconds):
                return
            if seconds <= max(self._leads(_settings(node.start_actions)), default=-1.0):
                self.activate(node)
            seconds += duration(node.name)

    def activate(self, node: PlanNode) -> None:
        """Activate what a maneuver needs, once."""
        if node.name not in self._early:
            self._early.add(node.name)
            self._fire(node.start_actions, others=False)

    def end_plan(self) -> None:
        """The plan ends."""
        self._fire(self._graph.plan.end_actions)
        for label in self._labels:
            self._publish(imc.PopEntityParameters(name=label))

    def _leads(self, settings: Iterable[imc.SetEntityParameters]) -> list[float]:
        return [self._lead(setting.name) for setting in settings if any(map(_activates, setting.params))]

    def _fire(self, actions: Actions, *, activations: bool = True, others: bool = True) -> None:
        for action in actions:
            if not isinstance(action, imc.SetEntityParameters):
                if action is not None and others:
                    self._publish(action)
                continue
            plain = tuple(p for p in action.params if not _activates(p))
            if plain and others:
                self._publish(action.replace(params=plain))
            active = tuple(p for p in action.params if _activates(p))
            if active and activations:
                self.activated.add(action.name)
                self._publish(action.replace(params=active))


def unsupported_setting_reasons(graph: PlanGraph, vehicle: "Vehicle") -> Iterator[str]:
    """Objections to actions that set what the vehicle does not have, or to a value that it cannot take.

    What is not there is not active, and an entity without activation always is: a console may write that it is so.
    Entities of other processes of the vehicle are known by name only.
    """
    remote = {label for (system, _), label in vehicle.entities.remote_labels.items() if system == vehicle.system}
    for name, action in _all_settings(graph):
        task = vehicle.task_by_label(action.name)
        if task is None and action.name in remote:
            continue
        for entry in action.params:
            if isinstance(entry, imc.EntityParameter) and (
                reason := _unsupported_reason(action.name, entry, task, vehicle)
            ):
                yield f"{name}: {reason}"


def _unsupported_reason(label: str, entry: imc.EntityParameter, task: Task | None, vehicle: "Vehicle") -> str:
    if task is None:
        if (entry.name, entry.value) == ("Active", "false"):
            return ""
        known = [task.entity.label for task in vehicle.tasks]
        return with_suggestion(f"the vehicle has no entity {label!r}", label, known)
    parameter = task.parameter_set.find(entry.name)
    if parameter is None:
        if entry.name == "Active" and entry.value in ("true", "false"):
            return ""
        return with_suggestion(f"{label} has no parameter {entry.name!r}", entry.name, task.parameter_set.declarations)
    if not parameter.editable:
        return f"{label}: {entry.name} cannot be changed while the vehicle runs"
    try:
        parameter.parse_strict(entry.value)
    except ValueError as error:
        return f"{label}: {entry.name}: {error}"
    return ""


def _all_settings(graph: PlanGraph) -> Iterator[tuple[str, imc.SetEntityParameters]]:
    """All settings of a plan, with the name of what they belong to."""
    plan = graph.plan
    found = [(plan.plan_id, plan.start_actions), (plan.plan_id, plan.end_actions)]
    found += [(name, actions) for name, n in graph.nodes.items() for actions in (n.start_actions, n.end_actions)]
    yield from ((name, action) for name, actions in found for action in _settings(actions))


def _settings(actions: Actions) -> list[imc.SetEntityParameters]:
    return [action for action in actions if isinstance(action, imc.SetEntityParameters)]


def _activates(parameter: imc.Message | None) -> bool:
    return isinstance(parameter, imc.EntityParameter) and parameter.name == "Active" and parameter.value == "true"
