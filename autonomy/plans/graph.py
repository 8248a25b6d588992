"""A plan as a graph of maneuvers, checked."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import imc
from autonomy.plans.conditions import Condition, parse_condition
from autonomy.plans.sequence import FINISH, along_first_transitions, reachable_maneuvers

UNITS = (imc.ZUnits, imc.SpeedUnits)
LONGEST_ID = 255  # bytes
HEIGHTS = ("z", "start_z", "end_z", "travel_z")
SIZES = ("radius", "length", "width", "hstep", "range", "amplitude")
ROUNDING = 0.002  # m or m/s by which a number of 32 bits may be off
Actions = tuple[imc.Message | None, ...]


class PlanError(ValueError):
    """A plan cannot be executed; the text gives the reason."""


@dataclass
class PlanNode:
    """A maneuver of a plan and the transitions that leave it, in their order; the destination FINISH ends the plan."""

    name: str
    maneuver: imc.Message
    start_actions: Actions
    end_actions: Actions
    transitions: list[tuple[Condition, str]] = field(default_factory=list[tuple[Condition, str]])

    def evaluate_transitions(self, latest: Mapping[type[imc.Message], imc.Message], *, done: bool) -> str | None:
        """Destination of the first transition that holds, None if none does. Raises PlanError if none ever will."""
        for condition, destination in self.transitions:
            if condition.holds(latest, done):
                return destination
        if done and self.transitions:
            raise PlanError(f"{self.name}: done, but no condition of a transition holds")
        return FINISH if done else None


@dataclass
class PlanGraph:
    """The maneuvers of a plan by name, the first being `start`."""

    plan: imc.PlanSpecification
    nodes: dict[str, PlanNode]
    start: str

    def sequence_from(self, name: str) -> Iterator[PlanNode]:
        """The maneuvers from `name` on, along their first transitions, until one would repeat."""
        following = {each: node.transitions[0][1] if node.transitions else FINISH for each, node in self.nodes.items()}
        return map(self.nodes.__getitem__, along_first_transitions(name, following))

    @property
    def cyclical(self) -> bool:
        """Whether the first transitions lead back to a maneuver."""
        *_, last = self.sequence_from(self.start)
        return bool(last.transitions) and last.transitions[0][1] in self.nodes

    @property
    def condition_messages(self) -> set[type[imc.Message]]:
        """The messages that conditions use."""
        return {kind for node in self.nodes.values() for c, _ in node.transitions for kind in c.kinds}


def parse_graph(plan: imc.PlanSpecification, supported: Collection[int]) -> PlanGraph:
    """The graph of a plan of `supported` maneuvers (ids). Raises PlanError."""
    if not plan.plan_id.strip():
        raise PlanError("undefined plan id")
    _check_id(plan.plan_id)
    if not plan.maneuvers:
        raise PlanError(f"{plan.plan_id}: no maneuvers")
    nodes: dict[str, PlanNode] = {}
    for item in plan.maneuvers:
        if not isinstance(item, imc.PlanManeuver):
            raise PlanError(f"{plan.plan_id}: {_name(item)} is not a PlanManeuver")
        name, maneuver = item.maneuver_id, item.data
        _check_id(name)
        if name in nodes:
            raise PlanError(f"{name}: maneuver id is used twice")
        if maneuver is None:
            raise PlanError(f"{name}: actual maneuver not specified")
        if maneuver.ID not in supported:
            raise PlanError(f"{name}: maneuver is not supported")
        _check_fields(name, maneuver)
        nodes[name] = PlanNode(name, maneuver, item.start_actions, item.end_actions)
    if plan.start_man_id not in nodes:
        raise PlanError(f"{plan.start_man_id}: invalid start maneuver")
    reached = {plan.start_man_id}
    for item in plan.transitions:
        if not isinstance(item, imc.PlanTransition):
            raise PlanError(f"{plan.plan_id}: {_name(item)} is not a PlanTransition")
        if item.source_man not in nodes:
            raise PlanError(f"invalid maneuver id '{item.source_man}'")
        if item.dest_man not in nodes and item.dest_man != FINISH:
            raise PlanError(f"invalid maneuver id '{item.dest_man}'")
        try:
            condition = parse_condition(item.conditions)
        except ValueError as error:
            raise PlanError(f"{item.source_man}: condition {item.conditions!r}: {error}") from None
        nodes[item.source_man].transitions.append((condition, item.dest_man))
        reached.add(item.dest_man)
    for name in nodes:
        if name not in reached:
            raise PlanError(f"{name}: maneuver has no incoming transition and it's not the initial maneuver")
    graph = PlanGraph(plan, nodes, plan.start_man_id)
    reached = reachable_maneuvers(
        graph.start, {name: [to for _, to in node.transitions] for name, node in nodes.items()}
    )
    for name in nodes:
        if name not in reached:
            raise PlanError(f"{name}: maneuver cannot be reached from {graph.start}")
    return graph


def _lowest(maneuver: imc.Message) -> Iterator[float]:
    """The depths and altitudes (m) of a maneuver without their points."""
    for name in HEIGHTS:
        if getattr(maneuver, f"{name}_units", None) in (imc.ZUnits.DEPTH, imc.ZUnits.ALTITUDE):
            yield getattr(maneuver, name)


def _check_id(text: str) -> None:
    if len(text.encode(errors="surrogateescape")) > LONGEST_ID:
        raise PlanError(f"{text[:20]}...: an id is longer than {LONGEST_ID} bytes")


def _check_fields(name: str, maneuver: imc.Message) -> None:
    for item in imc.fields(type(maneuver)):
        value = getattr(maneuver, item.name)
        if isinstance(value, float) and not math.isfinite(value):
            raise PlanError(f"{name}: {item.name} is not a number")
        if item.enum in UNITS and value not in set(item.enum):
            raise PlanError(f"{name}: {item.name} {value} is not known")
    points: Iterable[object] = getattr(maneuver, "points", ())
    for number, point in enumerate(points):
        if not isinstance(point, imc.PathPoint) or not all(map(math.isfinite, (point.x, point.y, point.z))):
            raise PlanError(f"{name}: point {number} is not a position")
    for size in SIZES:
        if getattr(maneuver, size, 0.0) < 0.0:
            raise PlanError(f"{name}: {size} must not be below 0")
    for coordinate, limit in (("lat", math.pi / 2), ("lon", math.pi)):
        value = getattr(maneuver, coordinate, 0.0)
        if abs(value) > limit:
            raise PlanError(f"{name}: {coordinate} {math.degrees(value):g}° is out of range")
    if not isinstance(maneuver, imc.Takeoff) and any(low < 0.0 for low in _lowest(maneuver)):
        raise PlanError(f"{name}: maneuver above the surface or below the bottom")


def _name(message: imc.Message | None) -> str:
    return "nothing" if message is None else type(message).__name__
