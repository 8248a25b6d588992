"""Files with the parameters of a vehicle: an ini that a profile may include, or YAML."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import yaml

from runtime.profile import format_option, format_sections, read_config
from support.diagnostics import LocatedError
from support.located_yaml import parse_yaml_tree, read_text
from support.terminal_text import printable

PARAMETER_SUFFIXES = (".ini", ".yaml", ".yml")
LABEL = "Entity Label"  # of a section, as in a profile
WIDTH = 110


class ParameterFileError(LocatedError):
    """A file of parameters that cannot be read or written; the text names the file, and the lines if it was read."""


@dataclass(frozen=True)
class VehicleParameters:
    """The parameters of a vehicle as they were received: texts by entity label and name.

    `received` is in s since 1970 UTC. components: the task of each entity. unknown: the entities that did not answer.
    """

    vehicle: str
    id: int
    received: float
    values: Mapping[str, Mapping[str, str]]
    components: Mapping[str, str] = field(default_factory=dict[str, str])
    unknown: tuple[str, ...] = ()


class FileValue(NamedTuple):
    """The text of a parameter in a file, and where it is: FILE:LINE."""

    text: str
    where: str


class FileSection(NamedTuple):
    """Parameters of one entity in a file. `name` is the label of the entity or, without `is_label`, maybe its task."""

    name: str
    is_label: bool
    where: str
    values: Mapping[str, FileValue]


def parameter_file_text(found: VehicleParameters, suffix: str) -> str:
    """The file with the parameters of a vehicle. Raises ParameterFileError for what the form cannot hold.

    The sections of an ini are those of a profile; an entity whose task is unknown, or has several, has its label as
    section.
    """
    time = datetime.fromtimestamp(found.received, UTC)
    if suffix.lower() in (".yaml", ".yml"):
        tree = {
            "vehicle": found.vehicle,
            "id": found.id,
            "received": time.isoformat(timespec="seconds"),
            "unknown": list(found.unknown),
            "parameters": {entity: dict(values) for entity, values in found.values.items()},
        }
        return yaml.safe_dump(tree, sort_keys=False, allow_unicode=True, width=WIDTH)
    head = f"# Parameters of {printable(found.vehicle)} (0x{found.id:04X}), received {time:%Y-%m-%d %H:%M:%S} UTC.\n"
    for entity in found.unknown:
        head += f"# unknown: {printable(entity)} did not answer\n"
    sections: dict[str, dict[str, str]] = {}
    try:
        for entity, values in found.values.items():
            section = found.components.get(entity, "")
            options = {LABEL: entity, **values}
            if not section or section in sections or section in found.values:  # a task without a label has its name
                section, options = entity, dict(values)
            for name, text in options.items():
                format_option(name, text)
            sections[section] = options
        return f"{head}\n{format_sections(sections)}"
    except ValueError as error:
        raise ParameterFileError(f"{error}; an ini file cannot hold that, write to a .yaml") from None


def read_parameter_file(path: Path) -> list[FileSection]:
    """The parameters in a file. Raises ParameterFileError that names file and line, OSError."""
    suffix = path.suffix.lower()
    if suffix not in PARAMETER_SUFFIXES:
        raise ParameterFileError(f"a file of parameters ends with {', '.join(PARAMETER_SUFFIXES)}", path)
    text = read_text(path, ParameterFileError)
    sections = _read_ini(path) if suffix == ".ini" else _read_yaml(path, text)
    if not any(section.values for section in sections):
        raise ParameterFileError("no parameters are in it", path)
    return sections


def _read_ini(path: Path) -> list[FileSection]:
    config = read_config(path)
    if config.errors:
        raise ParameterFileError("\n".join(f"{e.file}:{e.line}: {e.text}" for e in config.errors))
    if twice := [
        f"{again.origin}: [{section.name}] {option.name} is already in line {first.origin.line}"
        for section in config.sections.values()
        for option in section.options.values()
        for first, again in pairwise(option.history)
    ]:
        raise ParameterFileError("\n".join(twice))
    found: list[FileSection] = []
    for section in config.sections.values():
        label = section.value(LABEL)
        values = {
            option.name: FileValue(option.value, f"{option.origin.file}:{option.origin.line}")
            for option in section.options.values()
            if option.history and option.name != LABEL
        }
        where = f"{section.origin.file}:{section.origin.line}"
        found.append(FileSection(label or section.name, bool(label), where, values))
    return found


def _read_yaml(path: Path, text: str) -> list[FileSection]:
    root = parse_yaml_tree(text, str(path), ParameterFileError)
    keys = root.mapping("vehicle", "id", "received", "unknown", "parameters", required=("parameters",))
    return [
        FileSection(
            entity,
            True,
            node.where,
            {name: FileValue(value.text(), value.where) for name, value in node.mapping().items()},
        )
        for entity, node in keys["parameters"].mapping().items()
    ]
