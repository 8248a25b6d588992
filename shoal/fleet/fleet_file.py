"""The text of a fleet file, and what is wrong with it."""

import re
from pathlib import Path
from typing import Annotated, Any, NoReturn

import msgspec

from support.diagnostics import LocatedError
from support.located_yaml import Node, parse_yaml_tree, read_text
from support.terminal_text import corrected_spelling, quoted

Count = Annotated[int, msgspec.Meta(ge=1, le=1000)]
Position = tuple[Annotated[float, msgspec.Meta(ge=-90, le=90)], Annotated[float, msgspec.Meta(ge=-180, le=180)]]  # °
RECEIVED = ("Abort", "Announce")  # each vehicle receives it from each other one: twice as many send four times as much

_WORDS = {
    " | null`": "`",
    "`object`": "a mapping",
    "`array`": "a list",
    "`str`": "text",
    "`int`": "a whole number",
    "`float`": "a number",
    " of length >= 1": " that is not empty",
    " of length ": " of ",
    " >= ": " not below ",
    " > ": " above ",
    " <= ": " not above ",
    ", got ": ", not ",
}
_KEY = re.compile(r"Object (?:contains unknown|missing required) field `(.*)`")
_STEP = re.compile(r"\w+|\[\d+\]")


class FleetFileError(LocatedError):
    """A fleet file that cannot be used; the text names file, line and reason."""


class VehicleGroup(msgspec.Struct, forbid_unknown_fields=True):
    """Vehicles of one profile. `{number}` in `name` counts them from 1."""

    name: str
    count: Count = 1
    profile: str | None = None
    modes: str | None = None
    start: Position | None = None
    set: list[str] = []


class FleetFile(msgspec.Struct, forbid_unknown_fields=True):
    """A fleet file, as it is written; `FleetConfig` is its meaning."""

    vehicles: Annotated[list[VehicleGroup], msgspec.Meta(min_length=1)]
    name: str = "fleet"
    profile: str = "lauv-noptilus-1"
    modes: str = "Simulation"
    per_process: Count = 1
    start: Position | None = None
    spacing: Annotated[float, msgspec.Meta(gt=0, le=1e5)] = 20.0  # m
    seed: Annotated[int, msgspec.Meta(ge=0, le=2**62)] = 1
    stagger: str = "0.2 s"
    restart: str = "on-failure"
    hear: list[str] = msgspec.field(default_factory=lambda: list(RECEIVED))
    set: list[str] = []
    zenoh: dict[str, str] = {}
    log_dir: str = "log"


class FleetFileSource:
    """Raises errors with their place in a fleet file."""

    def __init__(self, root: Node) -> None:
        self._root = root

    def fail(self, place: str, reason: str) -> NoReturn:
        """Raise FleetFileError with the line of a place such as `vehicles[0].count`, or of what it is missing from."""
        nodes = [self._root]
        for step in _STEP.findall(place):
            content: Any = nodes[-1].content
            try:
                nodes.append(content[int(step[1:-1]) if step[0] == "[" else step])
            except (LookupError, TypeError):
                break
        nodes[-1].fail(reason)


def read_fleet_file(path: Path) -> tuple[FleetFile, FleetFileSource]:
    """The content of a fleet file. Raises FleetFileError, OSError if it cannot be read."""
    root = parse_yaml_tree(read_text(path, FleetFileError), str(path), FleetFileError)
    source = FleetFileSource(root)
    try:
        return msgspec.convert(root.raw(), FleetFile, strict=False), source
    except msgspec.ValidationError as error:
        text, _, place = str(error).partition(" - at `$")
        place = place.strip(".`")
        source.fail(place, f"{place}: {_plain(text)}" if place else _plain(text))


def _plain(text: str) -> str:
    """An error of msgspec in plain words."""
    if key := _KEY.fullmatch(text):
        if "missing" in text:
            return f"{quoted(key[1])} is missing"
        near = corrected_spelling(key[1], [*FleetFile.__struct_fields__, *VehicleGroup.__struct_fields__])
        return f"unknown key {quoted(key[1])}{f' (did you mean {quoted(near)}?)' if near else ''}"
    for theirs, ours in _WORDS.items():
        text = text.replace(theirs, ours)
    return text[:1].lower() + text[1:]
