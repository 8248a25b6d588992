"""The profiles of the vehicles of a scenario, each read once for all scenarios of a file."""

from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import imc
from runtime.profile import Profile, dune_section_names, load_profile, resolve_root_copy
from runtime.task import Parameter, find_parameter
from runtime.vehicle import TaskImportError, all_tasks, check_profile, find_task
from shoal.missions import parse_modes_or_default
from shoal.scenarios.option_shorthands import setting_with_unit
from shoal.scenarios.scenario import ScenarioSetting
from shoal.scenarios.value_reader import convert_to_unit_of, read_option_text
from support.diagnostics import COMMAND_LINE, Problem, ProfileError
from support.located_yaml import Node
from support.terminal_text import with_suggestion
from support.wgs84 import offset
from world import SECTIONS, WorldError, read_world

OF_WORLD = ("World", "Bathymetry")
MOST_FINE = 1000


class ScenarioProfiles:
    """Unchanged profiles, shared read-only, and the checks of the settings of scenarios in them."""

    def __init__(self, folder: Path):
        self.folder = folder
        self._read: dict[tuple[str, str], Profile] = {}
        self._fine: set[tuple[object, ...]] = set()

    def get(self, node: Node, vehicle: str = "") -> Profile:
        """The profile that a node names, of a vehicle with this name. Raises the error of the file."""
        name = self.resolve_profile_name(node.text())
        key = name, vehicle
        if key not in self._read:
            try:
                self._read[key] = load_profile(name, (self.folder,), vehicle=vehicle)
            except ProfileError as error:
                node.fail("; ".join(format_profile_problem(problem, ()) for problem in error.problems))
        return self._read[key]

    def resolve_profile_name(self, text: str) -> str:
        """The name of a profile; a path is that from the folder of the scenario."""
        beside = resolve_root_copy(self.folder / text)
        return str(beside) if text.endswith(".ini") and beside.exists() else text

    def read_modes(self, node: Node, profile: Profile) -> frozenset[str]:
        """The modes that a node selects, or the usual ones. Raises the error of the file."""
        chosen = [item.text() for item in node.content] if isinstance(node.content, list) else []
        if isinstance(node.content, str):
            chosen = [node.text()]
        try:
            return parse_modes_or_default(profile, chosen)
        except ProfileError as error:
            node.fail(error.problems[0].text + (f" ({hint})" if (hint := error.problems[0].hint) else ""))

    def schema(self, node: Node, profile: Profile) -> imc.Schema:
        """The messages of a vehicle. Raises the error of the file."""
        try:
            return profile.message_schema or imc.builtin()
        except ProfileError as error:
            node.fail("; ".join(format_profile_problem(problem, ()) for problem in error.problems))

    def dump(self, name: str, vehicle: str) -> str:
        """The effective configuration of a profile."""
        return self._known(name, vehicle).dump()

    def effective_value(self, name: str, vehicle: str, section: str, option: str) -> str | None:
        """The text of an option of a profile that was read, else the default of the task; None if there is none."""
        text = self._known(name, vehicle).value(section, option)
        cls = find_task(section)
        parameter = find_parameter(cls.parameters(), option) if cls is not None else None
        if text or parameter is None:
            return text or None
        default = parameter.default
        return str(default).lower() if isinstance(default, bool) else str(default)

    def start_ns(self, node: Node, profile: Profile, settings: Sequence[ScenarioSetting]) -> int:
        """Time at which virtual time starts (ns since 1970 UTC). Raises the error of the file."""
        own = [setting for setting in settings if (setting.section, setting.option) == ("General", "Start Time")]
        try:
            if own:
                profile = load_profile(profile.path, overrides=[own[-1].override_text])
            return profile.start_time_ns
        except ProfileError as error:
            _fail(node, own, error.problems[0])

    def check_settings(
        self, node: Node, profile: Profile, modes: frozenset[str], settings: Sequence[ScenarioSetting]
    ) -> None:
        """Raise the error of the file for settings that the profile does not have, or with a wrong value."""
        for setting in settings:
            _check_value(node, setting)
            _check_general(node, setting, profile)
        names = frozenset((setting.section, setting.option) for setting in settings)
        world = frozenset(setting for setting in settings if setting.section.partition("/")[0] in OF_WORLD)
        key = (str(profile.path), profile.vehicle, modes, names, world)
        if key in self._fine:
            return
        try:
            overrides = [setting.override_text for setting in settings]
            changed = load_profile(profile.path, (self.folder,), vehicle=profile.vehicle, overrides=overrides)
        except ProfileError as error:
            _fail(node, settings, error.problems[0])
        for problem in check_profile(changed, all_tasks([]), modes, find_task):
            if problem.file == COMMAND_LINE.file and problem.severity != "note":
                _fail(node, settings, problem)
        try:
            if world:
                read_world(changed.value, offset, changed.find_file)
        except WorldError as error:
            _fail(node, sorted(world, key=_order), Problem("error", *COMMAND_LINE, str(error)))
        if len(self._fine) >= MOST_FINE:
            self._fine.clear()
        self._fine.add(key)

    def _known(self, name: str, vehicle: str) -> Profile:
        return self._read.get((name, vehicle), self._read.get((name, "")) or self._read[name, vehicle])


def parameter_setting(section: str, option: str, node: Node) -> ScenarioSetting:
    """An option as a file sets it, with its numbers in the unit of the parameter. Raises the error of the file."""
    text, parameter = read_option_text(node), _parameter(node, section, option, node.where)
    shared = SECTIONS.get("World/" if section.startswith("World/") else section, {}).get(option)
    if shared is not None:
        return setting_with_unit(section, option, shared.unit, node)
    try:
        text = text if parameter is None else convert_to_unit_of(parameter, text)
    except ValueError as error:
        node.fail(f"[{section}] {option}: {error}")
    return ScenarioSetting(section, option, text, node.where)


def format_profile_problem(problem: Problem, settings: Sequence[ScenarioSetting]) -> str:
    """A problem of a profile, with the place in the scenario of the setting that it is about."""
    if problem.file != COMMAND_LINE.file:
        return str(problem)
    text = problem.text + (f" ({problem.hint})" if problem.hint else "")
    about = [s for s in settings if s.section in problem.text]
    named = [s for s in about if s.option in problem.text] or about
    return f"{named[0].where}: {text}" if named else text


def _fail(node: Node, settings: Sequence[ScenarioSetting], problem: Problem) -> NoReturn:
    text = format_profile_problem(problem, settings)
    raise node.error(text if any(text.startswith(s.where) for s in settings) else f"{node.where}: {text}")


def _order(setting: ScenarioSetting) -> tuple[str, str]:
    return setting.section, setting.option


def _check_general(node: Node, setting: ScenarioSetting, profile: Profile) -> None:
    """Reject an option of [General] that neither Shoal nor the profile has: a profile may have any for its own use."""
    if setting.section != "General":
        return
    options = {*dune_section_names.GENERAL, *(option.name for option in profile.config.options("General"))}
    if setting.option not in options:
        reason = with_suggestion(f"[General] has no option {setting.option!r}", setting.option, sorted(options))
        raise node.error(f"{setting.where}: {reason}")


def _check_value(node: Node, setting: ScenarioSetting) -> None:
    parameter = _parameter(node, setting.section, setting.option, setting.where)
    if parameter is None:
        return
    try:
        parameter.parse_strict(setting.value)
    except ValueError as error:
        raise node.error(f"{setting.where}: [{setting.section}] {setting.option}: {error}") from None


def _parameter(node: Node, section: str, option: str, where: str) -> Parameter | None:
    """The parameter that an option sets; None for what no task declares. Raises the error of the file."""
    try:
        cls = find_task(section)
    except TaskImportError as error:
        raise node.error(f"{where}: {error}") from None
    return find_parameter(cls.parameters(), option) if cls is not None else None
