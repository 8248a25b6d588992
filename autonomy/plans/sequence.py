"""The maneuvers of a plan one after the other, and what is left of a plan from one of them on."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise

import imc

FINISH = "_done_"  # the destination that ends a plan
DONE = "ManeuverIsDone"
DONE_CONDITIONS = ("", "true", DONE)  # conditions that hold when a maneuver is done


def main_sequence(plan: imc.PlanSpecification) -> tuple[list[imc.PlanManeuver], list[str]]:
    """The maneuvers along the first transitions, each once, and remarks on everything that leaves this chain."""
    nodes, remarks = _nodes(plan), list[str]()
    if plan.start_man_id not in nodes:
        return [], [f"the plan has no maneuver {plan.start_man_id!r} to begin with"]
    leaving: dict[str, list[imc.PlanTransition]] = {name: [] for name in nodes}
    for arrow in _arrows(plan):
        leaving.setdefault(arrow.source_man, []).append(arrow)
    following = {name: leaving[name][0].dest_man if leaving[name] else FINISH for name in nodes}
    names = along_first_transitions(plan.start_man_id, following)
    for name in names:
        arrows = leaving[name]
        if len(arrows) > 1 or any(arrow.conditions.strip() not in DONE_CONDITIONS for arrow in arrows):
            remarks.append(f"{name}: the conditions of what follows are not shown")
    if (back := following[names[-1]]) in nodes:
        remarks.append(f"{names[-1]}: the way back to {back} is not shown")
    remarks += [f"{name}: is beside the way that is shown" for name in nodes if name not in names]
    return [nodes[name] for name in names], remarks


def along_first_transitions(start: str, following: Mapping[str, str]) -> list[str]:
    """The maneuvers from `start` on, until one would repeat; `following` has the first destination of each."""
    names: dict[str, None] = {}
    while start in following and start not in names:
        names[start] = None
        start = following[start]
    return list(names)


def reachable_maneuvers(start: str, destinations: Mapping[str, Iterable[str]]) -> set[str]:
    """The maneuvers to which a way leads from `start`, itself included; `destinations` has those of each."""
    reached, waiting = {start}, [start]
    while waiting:
        for name in destinations[waiting.pop()]:
            if name in destinations and name not in reached:
                reached.add(name)
                waiting.append(name)
    return reached


def remaining_plan(plan: imc.PlanSpecification, maneuver: str, *, takeoff: bool = False) -> imc.PlanSpecification:
    """The plan from a maneuver on: what cannot be reached from there is left out, names stay.

    Parameters that earlier maneuvers have set are set as the first one begins. With `takeoff` it begins with the
    Takeoff of the plan, for an aircraft on the ground. Raises ValueError for a maneuver that the plan does not have.
    """
    nodes = _nodes(plan)
    if maneuver not in nodes:
        raise ValueError(f"the plan has no maneuver {maneuver!r}")
    earlier: list[imc.PlanManeuver] = []
    for node in main_sequence(plan)[0]:
        if node.maneuver_id == maneuver:
            break
        earlier.append(node)
    else:
        earlier = []
    destinations: dict[str, list[str]] = {name: [] for name in nodes}
    for arrow in _arrows(plan):
        if arrow.source_man in nodes:
            destinations[arrow.source_man].append(arrow.dest_man)
    kept = reachable_maneuvers(maneuver, destinations)
    first = nodes[maneuver]
    nodes[maneuver] = first.replace(start_actions=(*_latest(earlier), *first.start_actions))
    start = next(
        (n for n in earlier if takeoff and isinstance(n.data, imc.Takeoff) and n.maneuver_id not in kept), None
    )
    lead = [] if start is None else [start]
    way = sequential_transitions([*(node.maneuver_id for node in lead), maneuver])
    return plan.replace(
        start_man_id=lead[0].maneuver_id if lead else maneuver,
        maneuvers=(*lead, *(nodes[name] for name in nodes if name in kept)),
        transitions=(*way, *(arrow for arrow in _arrows(plan) if arrow.source_man in kept)),
    )


def sequential_plan(plan_id: str, maneuvers: Mapping[str, imc.Message]) -> imc.PlanSpecification:
    """A plan of maneuvers by name, one after the other."""
    names = list(maneuvers)
    return imc.PlanSpecification(
        plan_id=plan_id,
        start_man_id=names[0],
        maneuvers=tuple(imc.PlanManeuver(maneuver_id=name, data=data) for name, data in maneuvers.items()),
        transitions=sequential_transitions(names),
    )


def sequential_transitions(names: Sequence[str]) -> tuple[imc.PlanTransition, ...]:
    """Transitions from each maneuver to the next one, as it is done."""
    return tuple(imc.PlanTransition(source_man=a, dest_man=b, conditions=DONE) for a, b in pairwise(names))


def _latest(maneuvers: list[imc.PlanManeuver]) -> Iterator[imc.SetEntityParameters]:
    """The last values of all parameters that maneuvers set."""
    found: dict[str, dict[str, imc.Message]] = {}
    for maneuver in maneuvers:
        for action in (*maneuver.start_actions, *maneuver.end_actions):
            if isinstance(action, imc.SetEntityParameters):
                entries = [entry for entry in action.params if isinstance(entry, imc.EntityParameter)]
                found.setdefault(action.name, {}).update({entry.name: entry for entry in entries})
    yield from (imc.SetEntityParameters(name=name, params=tuple(values.values())) for name, values in found.items())


def _nodes(plan: imc.PlanSpecification) -> dict[str, imc.PlanManeuver]:
    items = (item for item in plan.maneuvers if isinstance(item, imc.PlanManeuver) and item.data is not None)
    return {item.maneuver_id: item for item in items}


def _arrows(plan: imc.PlanSpecification) -> Iterator[imc.PlanTransition]:
    return (arrow for arrow in plan.transitions if isinstance(arrow, imc.PlanTransition))
