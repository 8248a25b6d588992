"""Reads the tree of a scenario file."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import imc
from autonomy.plans.yaml import PlanFileError, plan_from_node
from runtime.profile import Profile, resolve_root_copy
from shoal.missions import load_plan
from shoal.scenarios.captures import Capture, read_captures
from shoal.scenarios.conditions import read_condition
from shoal.scenarios.event_reader import ScheduledAction, VehicleInfo, event_names, read_events
from shoal.scenarios.expectation_reader import ExpectationReader
from shoal.scenarios.link_reader import read_links
from shoal.scenarios.links import LinkModel
from shoal.scenarios.message_names import ExpressionScope
from shoal.scenarios.option_shorthands import EnabledTasks, start_settings, world_settings
from shoal.scenarios.scenario import Scenario, ScenarioSetting, VehicleSpec
from shoal.scenarios.scenario_profiles import ScenarioProfiles, parameter_setting
from shoal.scenarios.value_reader import (
    read_choice,
    read_mapping,
    read_nonempty_text,
    read_seconds,
    read_whole_number,
)
from support.located_yaml import Node

KEYS = (
    *("scenario", "description", "seed", "vehicle", "vehicles", "world", "links", "captures", "events", "expect"),
    *("metrics", "limit", "settle", "stop when"),
)
VEHICLE_KEYS = ("profile", "modes", "name", "seed", "start", "parameters", "plan")


class _ReadVehicle(NamedTuple):
    """A vehicle as far as it is read: its node, profile and modes, and its name."""

    node: Node
    profile: Profile
    modes: frozenset[str]
    name: str


class ScenarioReader:
    """Reads the scenario in a tree; all that is wrong is an error with file and line."""

    def __init__(self, root: Node, path: Path, profiles: ScenarioProfiles, variant: str = ""):
        self._root = root
        self._path = path
        self._profiles = profiles
        self._variant = variant
        self._nodes: dict[str, Node] = {}
        self._schemas: dict[str, imc.Schema] = {}
        self._links: tuple[LinkModel, ...] = ()
        self._capture_units: dict[str, str] = {}

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
        self._links = links = read_links(nodes["links"], self._schemas) if "links" in nodes else ()
        captures = self._read_captures(limit)
        expected = ExpectationReader(self._scope, {spec.name for spec in specs if spec.plan is not None})
        counts = {name: "" for link in links for name in link.metric_names}
        metrics = tuple(expected.metrics(nodes["metrics"], counts)) if "metrics" in nodes else ()
        units = counts | {metric.name: metric.unit for metric in metrics}
        name = read_nonempty_text(nodes["scenario"]) if "scenario" in nodes else self._own_name
        return Scenario(
            f"{name} [{self._variant}]" if self._variant else name,
            self._path,
            nodes["description"].text() if "description" in nodes else "",
            read_whole_number(nodes["seed"]) if "seed" in nodes else 0,
            specs,
            tuple(expected.expectations(nodes["expect"], units)) if "expect" in nodes else (),
            metrics,
            links,
            self._events(vehicles, specs, {link.name for link in links}, limit),
            limit=limit,
            settle=self._time("settle", 0.0),
            stop_when=read_condition(nodes["stop when"], self._scope()) if "stop when" in nodes else None,
            captures=captures,
        )

    @property
    def _own_name(self) -> str:
        return self._path.name.removesuffix(".yaml").removesuffix(".scenario").removesuffix(".study")

    def _time(self, key: str, default: float) -> float:
        return read_seconds(self._nodes[key]) if key in self._nodes else default

    def _scope(self, node: Node | None = None) -> ExpressionScope:
        """Vehicle whose messages a text means: the one that `node` names, or the only one."""
        if node is not None:
            return replace(self._scope(), vehicle=read_choice(node, self._schemas, "vehicle"))
        only = next(iter(self._schemas)) if len(self._schemas) == 1 else ""
        return ExpressionScope(self._schemas, only, self._links, self._capture_units)

    def _read_captures(self, limit: float) -> tuple[Capture, ...]:
        if "captures" not in self._nodes:
            return ()
        scopes = {"": self._scope()} | {name: replace(self._scope(), vehicle=name) for name in self._schemas}
        events = event_names(self._nodes["events"]) if "events" in self._nodes else []
        captures, self._capture_units = read_captures(self._nodes["captures"], scopes, events, limit)
        return captures

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
            modes = self._profiles.read_modes(parts.get("modes") or node.with_content([]), profile)
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
        """Reject vehicles that start at several times: they share one clock."""
        first = specs[0]
        for each, spec in zip(vehicles, specs, strict=True):
            if spec.start_ns != first.start_ns:
                start = each.node.mapping().get("start")
                wrong = start.mapping().get("time", each.node) if start is not None else each.node
                wrong.fail(f"{spec.name} and {first.name} start at different times: give both the same start: {{time}}")

    def _check_world(self, vehicles: list[_ReadVehicle]) -> None:
        """Reject what no vehicle has: it would prove nothing."""
        for key, node in self._nodes["world"].mapping().items() if "world" in self._nodes else ():
            alone = node.with_content({key: node})
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
        return read_events(self._nodes["events"], vehicle_infos, links, limit, self._scope())
