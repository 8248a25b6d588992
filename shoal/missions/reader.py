"""Reads a plan that people have written in YAML."""

from functools import partial
from pathlib import Path
from typing import Any, NoReturn, cast

import yaml

import imc
from imc.coordinates import displace
from runtime.problem import suggestion
from shoal.missions.values import Z_UNITS, position, quantity, read_field, speed

DONE = "ManeuverIsDone"
FINISH = "_done_"
ALIASES = {"idle": "IdleManeuver"}
MOST = 4096  # maneuvers; a message has room for 65535 bytes
_SHORTHANDS = ("at", "north", "east", "speed", *Z_UNITS)
_TARGET_KEYS = ("origin", "speed", *Z_UNITS)
_PLAN_KEYS = ("plan", "description", "namespace", *_TARGET_KEYS, "start", "maneuvers", "on_start", "on_end")
_ITEM_KEYS = ("id", "then", "on_start", "on_end")
Node = dict[str, Any]


class PlanFileError(ValueError):
    """A file is no plan; the text names file, line and reason."""


class PlanReader:
    """Reads one YAML document; knows the line of each of its nodes."""

    def __init__(self, text: str, name: str):
        self._name = name
        self._loader: Any = yaml.SafeLoader(text)
        self._root = self._loader.get_single_node()

    def plan(self) -> imc.Message:
        root = self._mapping(self._root, "a plan")
        if "abbrev" in root:
            return imc.from_dict(self._value(self._root))
        self._known(root, _PLAN_KEYS)
        if not isinstance(root.get("maneuvers"), yaml.SequenceNode) or not root["maneuvers"].value:
            self._fail(self._root, "maneuvers are missing: a list of them")
        if (count := len(root["maneuvers"].value)) > MOST:
            self._fail(root["maneuvers"], f"{count} maneuvers do not fit into the 65535 bytes of a message")
        self._origin = self._read(root["origin"], position) if "origin" in root else None
        self._defaults = self._target(root)
        items = [self._maneuver(node, number) for number, node in enumerate(root["maneuvers"].value, 1)]
        names = [item["maneuver_id"] for item, *_ in items]
        arrows: list[Node] = []
        for (item, node, then), following in zip(items, [*names[1:], None], strict=True):
            arrows += self._arrows(item["maneuver_id"], then, following, names, node)
        return imc.from_dict(
            {
                "abbrev": "PlanSpecification",
                "plan_id": self._text(root, "plan", Path(self._name).stem),
                "description": self._text(root, "description", ""),
                "vnamespace": self._text(root, "namespace", ""),
                "start_man_id": self._text(root, "start", names[0] if names else ""),
                "maneuvers": [item for item, *_ in items],
                "transitions": arrows,
                "start_actions": self._actions(root.get("on_start")),
                "end_actions": self._actions(root.get("on_end")),
            }
        )

    def _maneuver(self, node: Any, number: int) -> tuple[Node, Any, Any]:
        item = self._mapping(node, "a maneuver")
        kinds = [key for key in item if key not in _ITEM_KEYS]
        if len(kinds) != 1:
            self._fail(node, "write one maneuver, such as goto: {...}, and id, then, on_start, on_end")
        cls = self._kind(kinds[0], item[kinds[0]])
        fields = self._mapping(item[kinds[0]], "the fields of a maneuver", optional=True)
        name = self._text(item, "id", f"{cls.__name__}{number}")
        made = {
            "abbrev": "PlanManeuver",
            "maneuver_id": name,
            "data": self._fields(cls, fields, item[kinds[0]]),
            "start_actions": self._actions(item.get("on_start")),
            "end_actions": self._actions(item.get("on_end")),
        }
        return made, node, item.get("then")

    def _fields(self, cls: type[imc.Message], nodes: Node, where: Any) -> Node:
        infos = {info.name: info for info in imc.fields(cls)}
        values: Node = {"abbrev": cls.__name__}
        values |= {key: value for key, value in self._defaults.items() if key in infos}
        target = self._target(nodes)
        values |= {key: value for key, value in target.items() if key in infos}
        given = [key for key in nodes if key not in _SHORTHANDS]
        for key in given:
            if key not in infos:
                self._fail(nodes[key], _hinted(f"{cls.__name__} has no field {key!r}", key, [*_SHORTHANDS, *infos]))
            values[key] = self._read(nodes[key], _points if key == "points" else partial(read_field, infos[key]))
        for key in target:
            if key not in infos:
                named = [name for name in Z_UNITS if name in nodes] if key == "z" else ["position"]
                self._fail(where, f"{cls.__name__} has no {key if key == 'speed' else named[0]}")
        try:
            made = imc.from_dict(values)
            imc.encode(made)
        except (imc.DecodeError, imc.EncodeError) as error:
            self._fail(where, f"{cls.__name__}: {error}")
        if {"lat", "lon"} <= set(infos) and not {"lat", "lon"} <= set(values) and not _is_where_it_begins(made):
            self._fail(where, f"{cls.__name__} needs a position: at, or north and east of the plan's origin")
        return values

    def _target(self, nodes: Node) -> Node:
        """Position, depth and speed, as the plan or a maneuver has them."""
        found: Node = {}
        if "at" in nodes:
            found["lat"], found["lon"] = self._read(nodes["at"], position)
        if "north" in nodes or "east" in nodes:
            if self._origin is None:
                self._fail(nodes.get("north") or nodes.get("east"), "north and east need an origin of the plan")
            north, east = (self._read(nodes[k], _metres) if k in nodes else 0.0 for k in ("north", "east"))
            found["lat"], found["lon"] = displace(self._origin[0], self._origin[1], 0.0, north, east)[:2]
        heights = [key for key in nodes if key in Z_UNITS]
        if len(heights) > 1:
            self._fail(nodes[heights[1]], f"{' and '.join(heights)} exclude each other")
        for key, unit in Z_UNITS.items():
            if key in nodes:
                found["z"], found["z_units"] = self._read(nodes[key], _metres), int(unit)
        if "speed" in nodes:
            found |= self._read(nodes["speed"], speed)
        return found

    def _arrows(self, source: str, then: Any, following: str | None, names: list[str], where: Any) -> list[Node]:
        value = self._value(then) if then is not None else following
        wishes: list[Any] = cast(list[Any], value) if isinstance(value, list) else []
        wishes = wishes or ([] if value in (None, "end") else [value])
        arrows: list[Node] = []
        for wish in wishes:
            text: Any = {"to": wish} if isinstance(wish, str) else wish
            if not isinstance(text, dict) or "to" not in text or len(set(cast(Node, text)) - {"to", "when"}):
                self._fail(then or where, "write then: NAME, then: end, or a list of {to: NAME, when: CONDITION}")
            text = cast(Node, text)
            to = str(text["to"])
            if to not in (*names, FINISH):
                self._fail(then or where, _hinted(f"there is no maneuver {to!r}", to, names))
            condition = str(text.get("when", DONE))
            arrows.append({"abbrev": "PlanTransition", "source_man": source, "dest_man": to, "conditions": condition})
        return arrows

    def _actions(self, node: Any) -> list[Node]:
        """{Entity: {Parameter: value}} as SetEntityParameters."""
        if node is None:
            return []
        made: list[Node] = []
        for label, parameters in self._mapping(node, "actions").items():
            values = self._mapping(parameters, f"the parameters of {label}")
            entries = [
                {"abbrev": "EntityParameter", "name": key, "value": _word(self._value(value))}
                for key, value in values.items()
            ]
            made.append({"abbrev": "SetEntityParameters", "name": label, "params": entries})
        return made

    def _kind(self, key: str, node: Any) -> type[imc.Message]:
        wanted = ALIASES.get(key.lower(), key).replace("_", "").lower()
        known = sorted(imc.builtin().members("Maneuver"))
        for name in known:
            if name.lower() == wanted:
                return imc.builtin()[name]
        self._fail(node, _hinted(f"there is no maneuver {key!r}", wanted, known))

    def _mapping(self, node: Any, what: str, *, optional: bool = False) -> Node:
        if optional and isinstance(node, yaml.ScalarNode) and node.tag.endswith(":null"):
            return {}
        if not isinstance(node, yaml.MappingNode):
            self._fail(node, f"{what} has to be written as names and values")
        found: Node = {}
        for key, value in node.value:
            if not isinstance(key, yaml.ScalarNode) or key.value in found:
                self._fail(key, "a name is missing, or there twice")
            found[key.value] = value
        return found

    def _known(self, nodes: Node, names: tuple[str, ...]) -> None:
        for key, node in nodes.items():
            if key not in names:
                self._fail(node, f"{key!r} is none of {', '.join(names)}")

    def _text(self, nodes: Node, key: str, default: str) -> str:
        return str(self._value(nodes[key])) if key in nodes else default

    def _value(self, node: Any) -> Any:
        return self._loader.construct_object(node, deep=True)

    def _read(self, node: Any, function: Any) -> Any:
        try:
            return function(self._value(node))
        except ValueError as error:
            self._fail(node, str(error))

    def _fail(self, node: Any, reason: str) -> NoReturn:
        line = node.start_mark.line + 1 if node is not None else 1
        raise PlanFileError(f"{self._name}:{line}: {reason}")


def _hinted(reason: str, word: str, words: list[str]) -> str:
    hint = suggestion(word, words)
    return f"{reason} ({hint})" if hint else reason


def _is_where_it_begins(maneuver: imc.Message) -> bool:
    """Whether a maneuver is to be done where the vehicle is then."""
    if isinstance(maneuver, imc.Takeoff | imc.Land):
        return True
    return isinstance(maneuver, imc.Elevator | imc.PopUp) and bool(maneuver.flags & imc.Elevator.Flags.CURR_POS)


def _points(value: object) -> list[Node]:
    """[[x, y, z], ...] as PathPoint."""
    rows: list[Any] = cast(list[Any], value) if isinstance(value, list) else []
    if not rows or not all(isinstance(row, list) and len(cast(list[Any], row)) in (2, 3) for row in rows):
        raise ValueError("points are a list of [x, y] or [x, y, z] in m")
    return [{"abbrev": "PathPoint", **{k: _metres(v) for k, v in zip("xyz", row, strict=False)}} for row in rows]


def _metres(value: object) -> float:
    return quantity(value, "m")


def _word(value: object) -> str:
    return ("true" if value else "false") if isinstance(value, bool) else str(value)
