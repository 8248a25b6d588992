"""Reads plans: short YAML for people, messages as JSON for programs."""

import math
from collections.abc import Callable
from functools import partial
from pathlib import PurePath
from typing import Any, cast

import imc
from autonomy.plans.conditions import parse_condition
from autonomy.plans.sequence import DONE, FINISH
from autonomy.plans.yaml.value_codec import Z_UNITS, parse_position, parse_quantity, parse_speed, read_field
from support.diagnostics import LocatedError
from support.located_yaml import Node, parse_yaml_tree
from support.terminal_text import with_suggestion
from support.wgs84 import displace

ALIASES = {"idle": "IdleManeuver"}
END = "end"
MOST = 4096  # maneuvers
FARTHEST = 1e6  # m from the origin; beyond this a plane is no map of the Earth
_SIZES = ("radius", "length", "width", "hstep", "amplitude", "range")  # not below 0
_DEPTHS = ("start_z", "end_z", "travel_z")  # unless they have another unit
_ANGLES = {"lat": 0.5 * math.pi, "lon": math.pi}
_PLACES = (("at",), ("north", "east"), ("lat", "lon"))  # three ways to give a position
_SHORTHANDS = ("at", "north", "east", "speed", *Z_UNITS)
_TARGET_KEYS = ("origin", "speed", *Z_UNITS)
_PLAN_KEYS = ("plan", "description", "namespace", *_TARGET_KEYS, "start", "maneuvers", "on_start", "on_end")
_ITEM_KEYS = ("id", "then", "on_start", "on_end")
PlanValues = dict[str, Any]
Nodes = dict[str, Node]


class PlanFileError(LocatedError):
    """A file that does not hold a plan; the text names file, line and reason."""


def parse_plan(text: str, name: str = "plan", *, json: bool = False) -> imc.PlanSpecification:
    """Parse a plan; `name` stands for the file in errors. Raises PlanFileError.

    YAML has the keys plan, origin, speed, depth (or altitude, height), start, maneuvers; see docs/plans.md.
    """
    try:
        message = imc.from_json(text) if json else PlanReader(parse_yaml_tree(text, name, PlanFileError), name).plan()
        if not isinstance(message, imc.PlanSpecification):
            raise PlanFileError(f"is a {type(message).__name__}, not a PlanSpecification", name)
        imc.encode(message)
    except (imc.DecodeError, imc.EncodeError) as error:
        raise PlanFileError(str(error), name) from None
    return message


def plan_from_node(node: Node, name: str) -> imc.PlanSpecification:
    """The plan in a part of another file. Raises the error of this file; `name` is that of a plan without one."""
    try:
        message = PlanReader(node, name).plan()
        if not isinstance(message, imc.PlanSpecification):
            node.fail(f"is a {type(message).__name__}, not a PlanSpecification")
        imc.encode(message)
    except (imc.DecodeError, imc.EncodeError) as error:
        node.fail(str(error))
    return message


def maneuver_lines(text: str, name: str = "plan") -> dict[str, int]:
    """The line of each maneuver, by its id, in a plan in YAML or a PlanSpecification in JSON. Raises PlanFileError."""
    reader = PlanReader(parse_yaml_tree(text, name, PlanFileError), name)
    reader.plan()
    return reader.lines


class PlanReader:
    """Reads the plan in a tree; `lines` has the line of each maneuver, by its id."""

    def __init__(self, root: Node, name: str):
        self.lines: dict[str, int] = {}
        self._name = name
        self._root = root

    def plan(self) -> imc.Message:
        root = self._mapping(self._root, "a plan")
        if "abbrev" in root:
            message = imc.from_dict(self._root.value())
            items = root["maneuvers"].items() if "maneuvers" in root else []
            self.lines = {item.mapping()["maneuver_id"].text(): item.line for item in items}
            return message
        self._known(root, _PLAN_KEYS)
        maneuvers = root.get("maneuvers")
        if maneuvers is None or not isinstance(maneuvers.content, list) or not maneuvers.content:
            (maneuvers or self._root).fail("maneuvers: expected a list of at least one maneuver")
        if (count := len(maneuvers.content)) > MOST:
            maneuvers.fail(f"{count} maneuvers are more than the {MOST} that a plan may have")
        self._origin = self._read(root["origin"], parse_position) if "origin" in root else None
        self._defaults = self._target(root)
        items = [self._maneuver(node, number) for number, node in enumerate(maneuvers.content, 1)]
        names = [item["maneuver_id"] for item, *_ in items]
        taken: dict[str, Node] = {}
        for name, (_, node, _) in zip(names, items, strict=True):
            if name in (END, FINISH):
                node.fail(f"{name!r} cannot be an id, it ends a plan")
            if taken.setdefault(name, node) is not node:
                node.fail(f"the id {name!r} is used twice")
        self.lines = {name: node.line for name, node in taken.items()}
        start = self._text(root, "start", names[0])
        if start not in names:
            root["start"].fail(with_suggestion(f"there is no maneuver {start!r}", start, names))
        arrows: list[PlanValues] = []
        for (item, node, then), following in zip(items, [*names[1:], None], strict=True):
            arrows += self._arrows(item["maneuver_id"], then, following, names, node)
        return imc.from_dict(
            {
                "abbrev": "PlanSpecification",
                "plan_id": self._text(root, "plan", PurePath(self._name).stem, empty=False),
                "description": self._text(root, "description", ""),
                "vnamespace": self._text(root, "namespace", ""),
                "start_man_id": start,
                "maneuvers": [item for item, *_ in items],
                "transitions": arrows,
                "start_actions": self._actions(root.get("on_start")),
                "end_actions": self._actions(root.get("on_end")),
            }
        )

    def _maneuver(self, node: Node, number: int) -> tuple[PlanValues, Node, Node | None]:
        item = self._mapping(node, "a maneuver")
        kinds = [key for key in item if key not in _ITEM_KEYS]
        if len(kinds) != 1:
            node.fail(
                "expected one maneuver with its fields, such as goto: {...}, and optionally id, then, on_start, on_end"
            )
        cls = self._kind(kinds[0], item[kinds[0]])
        fields = self._mapping(item[kinds[0]], "the fields of a maneuver", optional=True)
        name = self._text(item, "id", f"{cls.__name__}{number}", empty=False)
        made = {
            "abbrev": "PlanManeuver",
            "maneuver_id": name,
            "data": self._fields(cls, fields, item[kinds[0]]),
            "start_actions": self._actions(item.get("on_start")),
            "end_actions": self._actions(item.get("on_end")),
        }
        return made, node, item.get("then")

    def _fields(self, cls: type[imc.Message], nodes: Nodes, where: Node) -> PlanValues:
        infos = {info.name: info for info in imc.fields(cls)}
        values: PlanValues = {"abbrev": cls.__name__}
        values |= {key: value for key, value in self._defaults.items() if key in infos}
        target = self._target(nodes)
        values |= {key: value for key, value in target.items() if key in infos}
        given = [key for key in nodes if key not in _SHORTHANDS]
        for key in given:
            if key not in infos:
                nodes[key].fail(with_suggestion(f"{cls.__name__} has no field {key!r}", key, [*_SHORTHANDS, *infos]))
            values[key] = self._read(nodes[key], _points if key == "points" else partial(read_field, infos[key]))
            self._check(nodes[key], key, values[key])
        for key in _DEPTHS:
            if key in given and f"{key}_units" not in given:
                values[f"{key}_units"] = int(imc.ZUnits.DEPTH)
        for key in target:
            if key not in infos:
                named = [name for name in Z_UNITS if name in nodes] if key == "z" else ["position"]
                where.fail(f"{cls.__name__} has no {key if key == 'speed' else named[0]}")
        try:
            made = imc.from_dict(values)
            imc.encode(made)
        except (imc.DecodeError, imc.EncodeError) as error:
            where.fail(f"{cls.__name__}: {error}")
        if {"lat", "lon"} <= set(infos) and not {"lat", "lon"} <= set(values) and not _is_where_it_begins(made):
            where.fail(f"{cls.__name__} needs a position: at, or north and east of the plan's origin")
        return values

    def _check(self, node: Node, key: str, value: object) -> None:
        """Reject a number that no maneuver can have."""
        if not isinstance(value, int | float):
            return
        if not math.isfinite(value):
            node.fail(f"{key}: {value} is not a number")
        if key in _SIZES and value < 0:
            node.fail(f"{key} must not be below 0")
        if abs(value) > _ANGLES.get(key, math.inf):
            node.fail(f"{key}: {math.degrees(value):g}° is not a place on Earth; plain numbers are in rad")

    def _target(self, nodes: Nodes) -> PlanValues:
        """Position, depth and speed of the plan or of a maneuver."""
        found: PlanValues = {}
        ways = [next((key for key in way if key in nodes), "") for way in _PLACES]
        if len(given := [key for key in ways if key]) > 1:
            nodes[given[1]].fail(f"{' and '.join(given)} exclude each other")
        if len(pair := [key for key in ("lat", "lon") if key in nodes]) == 1:
            nodes[pair[0]].fail("lat and lon belong together")
        if "at" in nodes:
            found["lat"], found["lon"] = self._read(nodes["at"], parse_position)
        if "north" in nodes or "east" in nodes:
            if self._origin is None:
                nodes["north" if "north" in nodes else "east"].fail("north and east need an origin in the plan")
            north, east = (self._read(nodes[k], _offset) if k in nodes else 0.0 for k in ("north", "east"))
            found["lat"], found["lon"] = displace(self._origin[0], self._origin[1], 0.0, north, east)[:2]
        heights = [key for key in nodes if key in (*Z_UNITS, "z")]
        if len(heights) > 1:
            nodes[heights[1]].fail(f"{' and '.join(heights)} exclude each other")
        for key, unit in Z_UNITS.items():
            if key in nodes:
                found["z"], found["z_units"] = self._read(nodes[key], _meters), int(unit)
        if "speed" in nodes:
            found |= self._read(nodes["speed"], parse_speed)
        return found

    def _arrows(
        self, source: str, then: Node | None, following: str | None, names: list[str], where: Node
    ) -> list[PlanValues]:
        value = _written(then) if then is not None else following or END
        wishes: list[Any] = cast(list[Any], value) if isinstance(value, list) else []
        wishes = wishes or ([] if value == END else [value])
        arrows: list[PlanValues] = []
        for wish in wishes:
            text: Any = {"to": wish} if isinstance(wish, str) else wish
            if not isinstance(text, dict) or "to" not in text or len(set(cast(PlanValues, text)) - {"to", "when"}):
                (then or where).fail("expected then: NAME, then: end, or a list of {to: NAME, when: CONDITION}")
            text = cast(PlanValues, text)
            to = FINISH if text["to"] == END else str(text["to"])
            if to not in (*names, FINISH):
                (then or where).fail(with_suggestion(f"there is no maneuver {to!r}", to, names))
            condition = str(text.get("when", DONE))
            try:
                parse_condition(condition)
            except ValueError as error:
                (then or where).fail(f"when: {condition}: {error}")
            arrows.append({"abbrev": "PlanTransition", "source_man": source, "dest_man": to, "conditions": condition})
        return arrows

    def _actions(self, node: Node | None) -> list[PlanValues]:
        """{Entity: {Parameter: value}} as SetEntityParameters."""
        if node is None:
            return []
        made: list[PlanValues] = []
        for label, parameters in self._mapping(node, "actions").items():
            values = self._mapping(parameters, f"the parameters of {label}")
            entries = [
                {"abbrev": "EntityParameter", "name": key, "value": _word(value.written())}
                for key, value in values.items()
            ]
            made.append({"abbrev": "SetEntityParameters", "name": label, "params": entries})
        return made

    def _kind(self, key: str, node: Node) -> type[imc.Message]:
        wanted = ALIASES.get(key.lower(), key).replace("_", "").lower()
        known = sorted(imc.builtin().allowed_messages("Maneuver"))
        for name in known:
            if name.lower() == wanted:
                return imc.builtin()[name]
        node.fail(with_suggestion(f"there is no maneuver {key!r}", wanted, known))

    def _mapping(self, node: Node, what: str, *, optional: bool = False) -> Nodes:
        if optional and node.value() is None:
            return {}
        if not isinstance(node.content, dict):
            node.fail(f"{what} must be a mapping of names to values")
        return node.content

    def _known(self, nodes: Nodes, names: tuple[str, ...]) -> None:
        for key, node in nodes.items():
            if key not in names:
                node.fail(f"unknown key {key!r} (known: {', '.join(names)})")

    def _text(self, nodes: Nodes, key: str, default: str, *, empty: bool = True) -> str:
        if key not in nodes:
            return default
        value = nodes[key].written()
        if not isinstance(value, str):
            nodes[key].fail(f"{key}: expected a text, not {value!r}")
        if not empty and not value.strip():
            nodes[key].fail(f"{key} must not be empty")
        return value

    def _read(self, node: Node, function: Callable[[Any], Any]) -> Any:
        try:
            return function(node.value())
        except self._root.error:
            raise
        except ValueError as error:
            node.fail(str(error))


def _is_where_it_begins(maneuver: imc.Message) -> bool:
    """Whether a maneuver takes place at the vehicle's position when it begins."""
    if isinstance(maneuver, imc.Takeoff | imc.Land):
        return True
    return isinstance(maneuver, imc.Elevator | imc.PopUp) and bool(maneuver.flags & imc.Elevator.Flags.CURR_POS)


def _points(value: object) -> list[PlanValues]:
    """[[x, y, z], ...] as PathPoint."""
    rows: list[Any] = cast(list[Any], value) if isinstance(value, list) else []
    if not rows or not all(isinstance(row, list) and len(cast(list[Any], row)) in (2, 3) for row in rows):
        raise ValueError("expected points as a list of [x, y] or [x, y, z] in m")
    return [{"abbrev": "PathPoint", **{k: _meters(v) for k, v in zip("xyz", row, strict=False)}} for row in rows]


def _written(node: Node) -> object:
    """The value of a node with the names in it as they are written."""
    if isinstance(node.content, dict):
        return {key: item.written() for key, item in node.content.items()}
    return [_written(item) for item in node.content] if isinstance(node.content, list) else node.written()


def _meters(value: object) -> float:
    return parse_quantity(value, "m")


def _offset(value: object) -> float:
    if abs(meters := _meters(value)) > FARTHEST:
        raise ValueError(f"{meters:g} m are more than {FARTHEST:.0f} m from the origin")
    return meters


def _word(value: object) -> str:
    return ("true" if value else "false") if isinstance(value, bool) else str(value)
