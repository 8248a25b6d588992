"""Reads the tree of a scenario file."""

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import imc
from autonomy.plans.yaml import PlanFileError, plan_from_node
from runtime.profile import Profile, resolve_root_copy
from shoal.missions import COMPLETED, FAILED, LATE, load_plan
from shoal.scenarios.conditions import ExpressionScope, ScenarioCondition, read_condition, read_expression
from shoal.scenarios.event_reader import ScheduledAction, VehicleInfo, read_events
from shoal.scenarios.expectations import Expectation
from shoal.scenarios.link_reader import read_links
from shoal.scenarios.metrics import KINDS_OF_ENUMERATIONS, METRIC_KINDS, Metric
from shoal.scenarios.option_shorthands import EnabledTasks, start_settings, world_settings
from shoal.scenarios.robustness import negate_unless_nan
from shoal.scenarios.scenario import Scenario, ScenarioSetting, VehicleSpec
from shoal.scenarios.scenario_profiles import ScenarioProfiles, parameter_setting
from shoal.scenarios.value_reader import (
    read_choice,
    read_mapping,
    read_nonempty_text,
    read_number,
    read_seconds,
    read_whole_number,
)
from support.located_yaml import Node
from support.terminal_text import with_suggestion

KEYS = (
    *("scenario", "description", "seed", "vehicle", "vehicles", "world", "links", "events", "expect", "metrics"),
    *("limit", "settle", "stop when"),
)
VEHICLE_KEYS = ("profile", "modes", "name", "seed", "start", "parameters", "plan")
TIMES = ("from", "to", "while", "vehicle", "name")
EXPECTED: Mapping[str, tuple[str, ...]] = {  # of each kind, what else may be said; the first kind that is there counts
    "after": ("within", "eventually", "always", "never", *TIMES),
    "until": ("holds", "within", *TIMES),
    "always": TIMES,
    "never": TIMES,
    "eventually": ("within", *TIMES),
    "finally": ("vehicle", "name"),
    "outcome": ("vehicle", "name"),
}
OUTCOMES = (COMPLETED, FAILED, LATE)


class _ReadVehicle(NamedTuple):
    """A vehicle as far as it is read: its node, profile and modes, and its name."""

    node: Node
    profile: Profile
    modes: frozenset[str]
    name: str


class ScenarioReader:
    """Reads the scenario in a tree; all that is wrong is an error with file and line."""

    def __init__(self, root: Node, path: Path, profiles: ScenarioProfiles):
        self._root = root
        self._path = path
        self._profiles = profiles
        self._nodes: dict[str, Node] = {}
        self._schemas: dict[str, imc.Schema] = {}
        self._world_read = False

    def scenario(self) -> Scenario:
        self._nodes = nodes = read_mapping(self._root, *KEYS)
        if ("vehicle" in nodes) == ("vehicles" in nodes):
            self._root.fail("a scenario has either a vehicle or vehicles")
        vehicles = list(self._read_vehicles())
        self._schemas = {each.name: self._profiles.schema(each.node, each.profile) for each in vehicles}
        specs = tuple(self._vehicle_spec(each) for each in vehicles)
        self._check_world(vehicles)
        self._check_times(vehicles, specs)
        limit = self._time("limit", 3600.0)
        if limit <= 0.0:
            nodes["limit"].fail("limit must be above 0")
        links = read_links(nodes["links"], self._schemas) if "links" in nodes else ()
        return Scenario(
            read_nonempty_text(nodes["scenario"]) if "scenario" in nodes else self._own_name,
            self._path,
            nodes["description"].text() if "description" in nodes else "",
            read_whole_number(nodes["seed"]) if "seed" in nodes else 0,
            specs,
            tuple(self._named(self._expectation, "expect", specs)),
            tuple(self._metrics({name for link in links for name in link.metric_names})),
            links,
            self._events(vehicles, specs, {link.name for link in links}, limit),
            limit=limit,
            settle=self._time("settle", 0.0),
            stop_when=read_condition(nodes["stop when"], self._scope()) if "stop when" in nodes else None,
        )

    @property
    def _own_name(self) -> str:
        return self._path.name.removesuffix(".yaml").removesuffix(".scenario").removesuffix(".study")

    def _time(self, key: str, default: float) -> float:
        return read_seconds(self._nodes[key]) if key in self._nodes else default

    def _scope(self, node: Node | None = None) -> ExpressionScope:
        """Whose messages a text means: those of the vehicle that `node` names, or of the only one."""
        if node is not None:
            return ExpressionScope(self._schemas, read_choice(node, self._schemas, "vehicle"))
        return ExpressionScope(self._schemas, next(iter(self._schemas)) if len(self._schemas) == 1 else "")

    def _read_vehicles(self) -> Iterator[_ReadVehicle]:
        many = self._nodes.get("vehicles")
        given = many.mapping() if many is not None else {"": self._nodes["vehicle"]}
        if not given:
            (many or self._root).fail("there is no vehicle")
        for key, node in given.items():
            parts = read_mapping(node, *(part for part in VEHICLE_KEYS if not (key and part == "name")))
            if "profile" not in parts:
                node.fail("'profile' is missing")
            name = key or (read_nonempty_text(parts["name"]) if "name" in parts else "")
            profile = self._profiles.get(parts["profile"], name)
            modes = self._profiles.read_modes(parts.get("modes") or Node([], node.file, node.line, node.error), profile)
            yield _ReadVehicle(node, profile, modes, profile.vehicle)

    def _vehicle_spec(self, vehicle: _ReadVehicle) -> VehicleSpec:
        parts = vehicle.node.mapping()
        tasks = EnabledTasks(vehicle.profile, vehicle.modes)
        found: list[ScenarioSetting] = world_settings(self._nodes["world"], tasks) if "world" in self._nodes else []
        found += start_settings(parts["start"], tasks) if "start" in parts else []
        for section, options in parts["parameters"].mapping().items() if "parameters" in parts else ():
            found += [parameter_setting(section, option, node) for option, node in options.mapping().items()]
        self._profiles.check_settings(vehicle.node, vehicle.profile, vehicle.modes, found)
        return VehicleSpec(
            vehicle.name,
            self._profiles.resolve_profile_name(parts["profile"].text()),
            self._profiles.folder,
            tuple(sorted(vehicle.modes)),
            read_whole_number(parts["seed"]) if "seed" in parts else None,
            tuple(found),
            self._plan(parts["plan"]) if "plan" in parts else None,
            self._profiles.start_ns(vehicle.node, vehicle.profile, found),
            parts["plan"].where if "plan" in parts else "",
            self._plan_file(parts["plan"]) if "plan" in parts and isinstance(parts["plan"].content, str) else None,
        )

    def _check_times(self, vehicles: list[_ReadVehicle], specs: tuple[VehicleSpec, ...]) -> None:
        """Refuse vehicles that start at several times: they share one clock."""
        first = specs[0]
        for each, spec in zip(vehicles, specs, strict=True):
            if spec.start_ns != first.start_ns:
                start = each.node.mapping().get("start")
                wrong = start.mapping().get("time", each.node) if start is not None else each.node
                wrong.fail(f"{spec.name} and {first.name} start at different times: give both the same start: {{time}}")

    def _check_world(self, vehicles: list[_ReadVehicle]) -> None:
        """Refuse what no vehicle has: it would prove nothing."""
        for key, node in self._nodes["world"].mapping().items() if "world" in self._nodes else ():
            alone = Node({key: node}, node.file, node.line, node.error)
            if not any(world_settings(alone, EnabledTasks(each.profile, each.modes)) for each in vehicles):
                node.fail(f"no vehicle has an option for {key}")

    def _plan(self, node: Node) -> imc.PlanSpecification:
        if isinstance(node.content, dict):
            return plan_from_node(node, self._own_name)
        path = self._plan_file(node)
        try:
            return load_plan(path)
        except PlanFileError as error:
            node.fail(str(error))
        except OSError as error:
            node.fail(f"{path}: {error.strerror or error}")

    def _plan_file(self, node: Node) -> Path:
        return resolve_root_copy(self._profiles.folder / read_nonempty_text(node))

    def _events(
        self, vehicles: list[_ReadVehicle], specs: tuple[VehicleSpec, ...], links: set[str], limit: float
    ) -> tuple[ScheduledAction, ...]:
        if "events" not in self._nodes:
            return ()
        vehicle_infos = {
            each.name: VehicleInfo(self._schemas[each.name], EnabledTasks(each.profile, each.modes).names, spec.plan)
            for each, spec in zip(vehicles, specs, strict=True)
        }
        return read_events(self._nodes["events"], vehicle_infos, links, limit)

    def _named(
        self, read: Callable[[Node, tuple[VehicleSpec, ...]], Expectation], key: str, specs: tuple[VehicleSpec, ...]
    ) -> Iterator[Expectation]:
        taken: set[str] = set()
        for node in self._nodes[key].items() if key in self._nodes else ():
            found = read(node, specs)
            if found.name in taken:
                node.fail(f"the name {found.name!r} is used twice: give each a name of its own")
            taken.add(found.name)
            yield found

    def _expectation(self, node: Node, specs: tuple[VehicleSpec, ...]) -> Expectation:
        given = node.mapping()
        kind = next((kind for kind in EXPECTED if kind in given), "")
        if not kind:
            wrong = next((key for key in given if key not in TIMES), "")
            node.fail(
                with_suggestion(f"expected one of {', '.join(EXPECTED)}", wrong, EXPECTED) if wrong else "says nothing"
            )
        parts = read_mapping(node, kind, *EXPECTED[kind])
        scope = self._scope(parts.get("vehicle"))
        name = read_nonempty_text(parts["name"]) if "name" in parts else f"{kind} {parts[kind].text()}"
        if kind == "outcome":
            return self._outcome(node, name, scope, specs)
        condition = read_condition(parts[kind], scope)
        then, steady = self._then(node, kind, scope)
        begin, end = _span(parts)
        return Expectation(
            name,
            kind,
            node.where,
            negated_condition(condition) if kind == "never" else condition,
            then,
            read_condition(parts["while"], scope) if "while" in parts else None,
            begin,
            end,
            read_seconds(parts["within"]) if "within" in parts else math.inf,
            steady,
            vehicle=scope.vehicle,
        )

    def _then(self, node: Node, kind: str, scope: ExpressionScope) -> tuple[ScenarioCondition | None, bool]:
        """What must hold until a condition does, or after it; and whether it must hold all the time."""
        parts = node.mapping()
        if kind == "until":
            if "holds" not in parts:
                node.fail("'holds' is missing: what has to hold until then")
            return read_condition(parts["holds"], scope), False
        if kind != "after":
            return None, False
        ways = [key for key in ("eventually", "always", "never") if key in parts]
        if len(ways) != 1 or "within" not in parts:
            node.fail("after needs within: TIME, and one of eventually, always or never: what has to follow")
        found = read_condition(parts[ways[0]], scope)
        return (negated_condition(found) if ways[0] == "never" else found), ways[0] != "eventually"

    def _outcome(self, node: Node, name: str, scope: ExpressionScope, specs: tuple[VehicleSpec, ...]) -> Expectation:
        parts = node.mapping()
        wanted = read_choice(parts["outcome"], OUTCOMES, "outcome")
        if not scope.vehicle:
            parts["outcome"].fail("there are several vehicles: write vehicle: NAME")
        if next(spec for spec in specs if spec.name == scope.vehicle).plan is None:
            parts["outcome"].fail(f"{scope.vehicle} has no plan")
        return Expectation(name, "outcome", node.where, wanted=wanted, vehicle=scope.vehicle)

    def _metrics(self, taken: set[str]) -> Iterator[Metric]:
        """The metrics; `taken` are the names of counts of links."""
        for name, node in self._nodes["metrics"].mapping().items() if "metrics" in self._nodes else ():
            if name in taken:
                node.fail(f"{name!r} is a count of a link already")
            given = node.mapping()
            kind = next((kind for kind in METRIC_KINDS if kind in given), "")
            if not kind:
                wrong = next(iter(given), "")
                node.fail(with_suggestion(f"expected one of {', '.join(METRIC_KINDS)}", wrong, METRIC_KINDS))
            needed = {"percentile": "of", "time above": "limit", "time below": "limit"}.get(kind, "")
            parts = read_mapping(node, kind, *([needed] if needed else []), "from", "to", "while", "vehicle")
            scope = self._scope(parts.get("vehicle"))
            expression = read_expression(parts[kind], scope)
            if expression.is_enumeration and kind not in KINDS_OF_ENUMERATIONS:
                allowed = " or ".join(KINDS_OF_ENUMERATIONS)
                parts[kind].fail(
                    f"{expression.text} is an enumeration, whose numbers have no {kind}: "
                    f"{allowed} of it, or an expectation such as always"
                )
            bound = math.nan
            if needed:
                if needed not in parts:
                    node.fail(f"{needed!r} is missing")
                bound = read_number(parts[needed], expression.unit if needed == "limit" else "%")
                if needed == "of" and not 0.0 <= bound <= 100.0:
                    parts["of"].fail("a percentage is from 0 to 100")
            yield Metric(
                name,
                kind,
                node.where,
                expression,
                read_condition(parts["while"], scope) if "while" in parts else None,
                *_span(parts),
                bound,
            )


def _span(parts: Mapping[str, Node]) -> tuple[float, float]:
    """Begin and end (s) of what is judged or measured."""
    begin, end = (
        read_seconds(parts[key]) if key in parts else usual for key, usual in (("from", 0.0), ("to", math.inf))
    )
    if end < begin:
        parts["to"].fail("ends before it begins")
    return begin, end


def negated_condition(condition: ScenarioCondition) -> ScenarioCondition:
    """The condition that holds when another one does not."""
    return ScenarioCondition(f"not ({condition.text})", condition.selectors, negate_unless_nan(condition.test))
