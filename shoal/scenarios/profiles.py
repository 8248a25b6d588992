"""The profiles of the vehicles of a scenario, each read once for all scenarios of a file."""

from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import imc
from imc.schema.yamltree import Node
from runtime.problem import COMMAND_LINE, ProfileError, printable
from runtime.profile import Profile, load_profile
from runtime.task import find_parameter
from runtime.vehicle import TaskImportError, all_tasks, check, find_task
from shoal.missions import usual_modes
from shoal.scenarios.scenario import Setting


class Profiles:
    """Profiles as they are, which nobody may change, and the checks of what scenarios set in them."""

    def __init__(self, folder: Path):
        self.folder = folder
        self._read: dict[tuple[str, str], Profile] = {}
        self._fine: set[tuple[object, ...]] = set()

    def get(self, node: Node, vehicle: str = "") -> Profile:
        """The profile that a node names, of a vehicle with this name. Raises the error of the file."""
        name = self.name(node.text())
        key = name, vehicle
        if key not in self._read:
            try:
                self._read[key] = load_profile(name, (self.folder,), vehicle=vehicle)
            except ProfileError as error:
                node.fail("; ".join(map(str, error.problems)))
        return self._read[key]

    def name(self, text: str) -> str:
        """The name of a profile; a path is that from the folder of the scenario."""
        beside = self.folder / text
        return str(beside) if text.endswith(".ini") and beside.exists() else text

    def modes(self, node: Node, profile: Profile) -> frozenset[str]:
        """The modes that a node selects, or the usual ones. Raises the error of the file."""
        chosen = [item.text() for item in node.content] if isinstance(node.content, list) else []
        if isinstance(node.content, str):
            chosen = [node.text()]
        try:
            return usual_modes(profile, chosen)
        except ProfileError as error:
            node.fail(error.problems[0].text + (f" ({hint})" if (hint := error.problems[0].hint) else ""))

    def schema(self, profile: Profile) -> imc.Schema:
        """The messages of a vehicle."""
        return profile.messages or imc.builtin()

    def dump(self, name: str, vehicle: str) -> str:
        """The effective configuration of a profile."""
        return self._read.get((name, vehicle), self._read.get((name, "")) or self._read[name, vehicle]).dump()

    def start_ns(self, node: Node, profile: Profile, settings: Sequence[Setting]) -> int:
        """When virtual time starts (ns since 1970 UTC). Raises the error of the file."""
        own = [setting for setting in settings if (setting.section, setting.option) == ("General", "Start Time")]
        try:
            if own:
                profile = load_profile(profile.path, overrides=[own[-1].override])
            return profile.start_time_ns
        except ProfileError as error:
            self._fail(node, own, error.problems[0].text, error.problems[0].hint)

    def check(self, node: Node, profile: Profile, modes: frozenset[str], settings: Sequence[Setting]) -> None:
        """Raise the error of the file for settings that the profile does not know, or with a wrong value."""
        for setting in settings:
            _check_value(node, setting)
        names = frozenset((setting.section, setting.option) for setting in settings)
        key = (str(profile.path), profile.vehicle, modes, names)
        if key in self._fine:
            return
        try:
            overrides = [setting.override for setting in settings]
            changed = load_profile(profile.path, (self.folder,), vehicle=profile.vehicle, overrides=overrides)
        except ProfileError as error:
            self._fail(node, settings, error.problems[0].text, error.problems[0].hint)
        for problem in check(changed, all_tasks(), modes, find_task):
            if problem.file == COMMAND_LINE.file and problem.severity != "note":
                self._fail(node, settings, problem.text, problem.hint)
        self._fine.add(key)

    def _fail(self, node: Node, settings: Sequence[Setting], text: str, hint: str) -> NoReturn:
        """Raise the error with the line of the setting that a text is about."""
        named = [s for s in settings if s.section in text and s.option in text] or [
            s for s in settings if s.section in text
        ]
        where = named[0].where if named else node.where
        raise node.error(f"{where}: {printable(text)}" + (f" ({hint})" if hint else ""))


def _check_value(node: Node, setting: Setting) -> None:
    try:
        cls = find_task(setting.section)
    except TaskImportError as error:
        raise node.error(f"{setting.where}: {error}") from None
    parameter = find_parameter(cls.parameters(), setting.option) if cls is not None else None
    if parameter is None:
        return
    try:
        parameter.parse_alone(setting.value)
    except ValueError as error:
        raise node.error(f"{setting.where}: [{setting.section}] {setting.option}: {error}") from None
