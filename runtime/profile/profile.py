"""A profile: the ini file of a vehicle with its includes; its settings of vehicle, tasks and systems."""

import re
from collections.abc import Iterable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Literal

from fastcrc import crc16

import imc
from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime.profile import dune_section_names
from runtime.profile.config import BLANKS, Config, Option, format_header, format_option, split_list
from runtime.profile.ini import read_config
from runtime.profile.profile_search import find_profile, is_file, own_etc, resolve_root_copy
from runtime.task import Parameter
from support.diagnostics import COMMAND_LINE, Origin, Problem, ProfileError
from support.file_errors import describe_os_error
from support.terminal_text import quoted, suggestion

ALWAYS, NEVER = "Always", "Never"
BUILT_IN = {
    "Hardware": "On the vehicle's hardware.",
    "Simulation": "With simulated sensors and actuators.",
    "Hardware/Simulation": "On the vehicle's hardware, with simulated parts.",
}
BUSES = ("inprocess", "zenoh")
START_TIME = "2026-01-01T00:00:00Z"
ENTITY_IDS = "Entity Ids"
MAIN = "main"

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def load_profile(
    name: str | Path,
    config_dirs: Iterable[str | Path] = (),
    *,
    vehicle: str = "",
    saved: Path | None = None,
    overrides: Iterable[str] = (),
    strict: bool = True,
) -> "Profile":
    """Read a profile by its name or path, then `<vehicle>-saved.ini` next to it and in `saved`, then overrides.

    `vehicle` replaces `[General] Vehicle`. Raises ProfileError if there is no such profile, an override is malformed or
    for a section without a task, or the files have errors and `strict` is set. Errors in saved parameters are only
    warnings.
    """
    config_dirs = [Path(folder) for folder in config_dirs]
    path = find_profile(name, config_dirs)
    profile = Profile(path, read_config(path, shared=[*config_dirs, own_etc()]), config_dirs)
    if vehicle:
        profile.override(f"General:Vehicle={vehicle}")
    folders = [path.parent, *([saved] if saved else [])]
    for folder in folders if profile.vehicle_name_problem() is None else []:
        profile.add_saved(folder / f"{profile.vehicle}-saved.ini")
    dune_section_names.expand_multiplexer(profile.config)
    for assignment in overrides:
        profile.override(assignment)
    profile.raise_unused_overrides()
    if strict:
        profile.raise_errors()
    return profile


class Profile:
    """The merged configuration of one vehicle. Each value has the place where it was set; see `Config`."""

    def __init__(self, path: Path, config: Config, config_dirs: Iterable[Path] = ()):
        self.path = path
        self.config = config
        self._config_dirs = tuple(config_dirs)

    @property
    def name(self) -> str:
        return self.path.stem

    @property
    def base_folder(self) -> Path:
        """The folder in which relative paths of its values begin."""
        return self.path.parent

    @property
    def config_dirs(self) -> tuple[Path, ...]:
        """The folders of --config-dir."""
        return self._config_dirs

    def file_folders(self, option: Option) -> tuple[Path, ...]:
        """The folders in which a file is searched for that an option names.

        They are that of the profile, that of the ini file that sets the option, those of --config-dir, and the working
        folder.
        """
        return self.base_folder, Path(option.origin.file).parent, *self._config_dirs, Path()

    def find_file(self, section: str, option: str) -> Path:
        """The file that an option names; the path as it is written if there is none."""
        found = self.config.option(section, option)
        name = found.value if found is not None else ""
        folders = self.file_folders(found) if found is not None else ()
        places = (resolve_root_copy(folder / name) for folder in folders)
        return next((place for place in places if is_file(place)), Path(name))

    @property
    def file_problems(self) -> list[Problem]:
        """The problems of the files; `check_profile` finds those of the values."""
        return self.config.problems

    @property
    def vehicle(self) -> str:
        """The system's name, by default the profile's."""
        return self.config.value("General", "Vehicle", self.name)

    @property
    def system_id(self) -> int:
        """The IMC id of the vehicle."""
        return self.systems[self.vehicle]

    @property
    def systems(self) -> dict[str, int]:
        """The IMC ids of the vehicle and of all systems in [IMC Addresses], by name."""
        found: dict[str, int] = {}
        for option in self.config.options("IMC Addresses"):
            try:
                found[option.name] = parse_imc_id(option.value)
            except ValueError:
                continue
        found.setdefault(self.vehicle, derived_id(self.vehicle))
        return found

    @property
    def bus_transport(self) -> Literal["inprocess", "zenoh"]:
        """The transport between processes. Raises ProfileError."""
        text = self.config.value("General", "Bus", BUSES[0])
        if text == "zenoh" or text == "inprocess":
            return text
        raise self._error("General", "Bus", f"unknown bus {quoted(text)}", suggestion(text, BUSES))

    @property
    def message_schema(self) -> imc.Schema | None:
        """The built-in messages with those of the files in `[General] Messages`; None without any.

        The files are searched for beside the ini file that names them, and in the working folder; the profile of a log
        takes the definitions in the log. Raises ProfileError.
        """
        option = self.config.option("General", "Messages")
        if option is None or not option.value:
            return None
        schema = imc.builtin()
        for name in split_list(option.value):
            source = Path(option.origin.file)
            places = [source.parent / name, Path(name)]
            if source.name == "Config.ini":  # of a log
                places.insert(0, source.with_name("IMC.xml.gz"))
            path = resolve_root_copy(next((place for place in places if is_file(place)), Path(name)))
            try:
                schema = imc.load(path, over=schema)
            except FileNotFoundError:
                raise self._error("General", "Messages", f"there is no file {quoted(name)}", "") from None
            except OSError as error:
                raise self._error("General", "Messages", describe_os_error(error, name), "") from None
            except imc.SchemaError as error:
                raise self._error("General", "Messages", str(error), "") from None
        return schema

    @property
    def start_time_ns(self) -> int:
        """The start of virtual time, in nanoseconds since 1970 UTC. Raises ProfileError."""
        text = self.config.value("General", "Start Time", START_TIME)
        try:
            time = datetime.fromisoformat(text)
            since = (time if time.tzinfo else time.replace(tzinfo=UTC)) - _EPOCH
        except (ValueError, OverflowError):
            since = timedelta(-1)
        if since < timedelta(0):
            text = f"{quoted(text)} is not a date and time from 1970 on"
            raise self._error("General", "Start Time", text, f"write it as {START_TIME}")
        return since // timedelta(microseconds=1) * 1000

    @property
    def start_time(self) -> float:
        """The start of virtual time, in seconds since 1970 UTC. Raises ProfileError."""
        return self.start_time_ns / 10**9

    def set_start_time(self, time_ns: int) -> None:
        """Set the start of virtual time (ns since 1970 UTC), cut to microseconds."""
        time = _EPOCH + timedelta(microseconds=time_ns // 1000)
        self.override(f"General:Start Time={time.isoformat()}")

    @property
    def seed(self) -> int:
        """Seed of all random numbers. Raises ProfileError."""
        text = self.config.value("General", "Seed", "0")
        if not text.isdecimal():
            raise self._error("General", "Seed", f"{quoted(text)} is not a seed", "write a whole number, 0 or more")
        return int(text)

    @property
    def entity_ids(self) -> dict[str, int]:
        """The entity ids in [Entity Ids], a section that a log's Config.ini has. Raises ProfileError."""
        found: dict[str, int] = {}
        for option in self.config.options(ENTITY_IDS):
            if not option.value.isdecimal() or not 1 <= int(option.value) <= 254 or int(option.value) in found.values():
                text = f"{quoted(option.value)} cannot be the id of {quoted(option.name)}"
                raise self._error(ENTITY_IDS, option.name, text, "use a number from 1 to 254 that no other entity has")
            found[option.name] = int(option.value)
        return found

    @property
    def selectable_modes(self) -> dict[str, str]:
        """The modes that -p can select and their meaning: DUNE's own, and those declared in [Profiles]."""
        return BUILT_IN | {option.name: option.value for option in self.config.options("Profiles")}

    def parse_modes(self, names: str | Iterable[str]) -> frozenset[str]:
        """The selected modes, from a list or separated by commas. Raises ProfileError for an unknown one."""
        chosen = split_list(names) if isinstance(names, str) else [name for text in names for name in split_list(text)]
        for name in chosen:
            if name not in self.selectable_modes:
                hint = suggestion(name, self.selectable_modes)
                raise ProfileError([Problem("error", str(self.path), 0, f"unknown mode {quoted(name)}", hint)])
        return frozenset(chosen)

    def is_task_enabled(self, section: str, selected: Iterable[str] = ()) -> bool:
        """Whether the task of a section runs when these modes are selected."""
        return not {ALWAYS, *selected}.isdisjoint(split_list(self.config.value(section, "Enabled")))

    def task_process(self, section: str) -> str:
        """The process that runs the task of a section, "" for the main one. Raises ProfileError."""
        name = self.config.value(section, dune_section_names.PROCESS)
        if not re.fullmatch(r"[A-Za-z0-9_-]*", name) or name == MAIN:
            text = f"{quoted(name)} is not the name of a process"
            raise self._error(section, dune_section_names.PROCESS, text, f"letters, digits, - and _, and not {MAIN}")
        return name

    def processes(self, selected: Iterable[str] = ()) -> list[str]:
        """The processes besides the main one that enabled sections name, in order."""
        modes = tuple(selected)
        named = (self.task_process(name) for name in self.config.sections if self.is_task_enabled(name, modes))
        return list(dict.fromkeys(filter(None, named)))

    def value(self, section: str, option: str, default: str = "") -> str:
        """The text of an option of any section, `default` if it is missing or empty."""
        return self.config.value(section, option, default)

    def options(self, section: str) -> dict[str, str]:
        """The parameters that a section sets, as texts."""
        return {o.name: o.value for o in self.config.options(section) if o.history and o.name != "Enabled"}

    def override(self, assignment: str) -> tuple[str, str]:
        """Apply "Section:Option=value", the form of --set; returns section and option.

        Raises ProfileError if it is malformed.
        """
        left, equals, value = assignment.partition("=")
        colons = [index for index, character in enumerate(left) if character == ":"]
        # A section's name may contain colons, so an existing section decides where the name ends.
        known = [index for index in colons if left[:index].strip(BLANKS) in self.config.sections]
        at = (known or colons or [0])[0]
        section, option, value = left[:at].strip(BLANKS), left[at + 1 :].strip(BLANKS), value.strip(BLANKS)
        try:
            if not equals or not colons:
                raise ValueError("it must be Section:Option=value, such as 'General:Seed=7'")
            format_header(section)
            format_option(option, value)
        except ValueError as error:
            raise ProfileError([Problem("error", COMMAND_LINE.file, 0, f"{quoted(assignment)}: {error}")]) from None
        self.config.ensure_section(section, COMMAND_LINE).ensure_option(option).set(value, COMMAND_LINE)
        if section == dune_section_names.MULTIPLEXER:
            dune_section_names.expand_multiplexer(self.config)
            for name, target in dune_section_names.multiplexer_option_targets(option):
                self.config.ensure_section(name, COMMAND_LINE).ensure_option(target).set(value, COMMAND_LINE)
        return section, option

    def add_saved(self, path: Path) -> None:
        """Read saved parameters on top, if the file exists; errors in it become warnings."""
        if not path.exists():
            return
        before = len(self.config.problems)
        read_config(path, self.config)
        found = self.config.problems[before:]
        self.config.problems[before:] = [replace(p, severity="warning") if p.severity == "error" else p for p in found]

    def vehicle_name_problem(self) -> Problem | None:
        """Reason why the vehicle's name cannot name folders and files; None if it can."""
        name = self.vehicle
        if name.isprintable() and len(name) <= 100 and name[0] != "." and not any(c in name for c in '/\\:*?"<>'):
            return None
        text = f"{quoted(name)} cannot be the name of a vehicle, since folders are named after it"
        return self._error("General", "Vehicle", text, "use letters, digits, - and _").problems[0]

    def raise_errors(self) -> None:
        """Raise ProfileError if the files or the vehicle's name have errors."""
        problem = self.vehicle_name_problem()
        if errors := [*self.config.errors, *([problem] if problem else [])]:
            raise ProfileError(errors)

    def raise_unused_overrides(self) -> None:
        """Raise ProfileError if an override is for a section that nothing reads and that does not enable a task."""
        model = dune_section_names.MODEL_PREFIX + self.config.value("General", "Vehicle Type")
        problems: list[Problem] = []
        for section in self.config.sections.values():
            enables = section.value("Enabled", NEVER) != NEVER
            if (
                set(section.origins) != {COMMAND_LINE}
                or enables
                or section.name in (*dune_section_names.DATA_SECTIONS, model)
            ):
                continue
            others = [name for name in self.config.sections if name != section.name]
            same = [name for name in others if name.startswith(f"{section.name}/")]
            hint = suggestion(section.name, same or [*others, *dune_section_names.DATA_SECTIONS])
            problems.append(Problem("error", *COMMAND_LINE, f"there is no section [{section.name}]", hint))
        if problems:
            raise ProfileError(problems)

    def dump(self) -> str:
        """The effective configuration as an ini file; non-UTF-8 bytes are surrogate escapes."""
        return f"# The effective configuration of {quoted(self.vehicle)}.\n\n{self.config.dump()}"

    def _error(self, section: str, option: str, text: str, hint: str) -> ProfileError:
        found = self.config.option(section, option)
        origin = found.origin if found else Origin(str(self.path))
        return ProfileError([Problem("error", *origin, f"[{section}] {option}: {text}", hint)])


def default_label(section: str) -> str:
    """The default entity label of a task: the last part of its section, "GPS" or "IMU/AHRS"."""
    name, slash, instance = section.partition("/")
    return name.rpartition(".")[2] + slash + instance


def parse_imc_id(text: str) -> int:
    """The id in a line of [IMC Addresses]. Raises ValueError."""
    return Parameter(None, "", "", type=int, minimum=0, maximum=0xFFFF).parse(text or "none")


def derived_id(name: str) -> int:
    """DUNE's id of a system without an address: from the CRC-16 of its name, with bits 15 and 13 set."""
    if name in ("", "unknown"):
        return UNKNOWN_SYSTEM
    return 0xA000 | (crc16.arc(name.encode(errors="surrogateescape")) & 0x1FFF)
