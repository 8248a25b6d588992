"""The parameters that the profile of a vehicle in this process sets: text, file and line."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from runtime.profile import Profile, read_sections
from runtime.vehicle import Vehicle, explain_section
from support.diagnostics import ProfileError


class ParameterSetting(NamedTuple):
    """A parameter at the start: its text, its default, the place that set it (FILE:LINE, "command line" or "default"),
    and the places whose value it has replaced."""

    text: str
    default: str
    where: str
    replaced: tuple[str, ...]


class PresentOptions(NamedTuple):
    """The path of a profile, the folders of --config-dir, and "Section:Option=value" for what its files have not."""

    profile: str
    folders: tuple[str, ...]
    overrides: tuple[str, ...]


class ProfileSettings:
    """The settings of all tasks of a vehicle that has not started yet, by label of the entity and name."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._file: Path = vehicle.state_folder / f"{vehicle.name}-saved.ini"
        self._sections: dict[str, str] = {}
        self._settings: dict[str, dict[str, ParameterSetting]] = {}
        profile = vehicle.profile
        self._profile: Profile | None = profile if isinstance(profile, Profile) else None
        if not isinstance(profile, Profile):
            return
        for task in vehicle.tasks:
            label = task.entity.label
            self._sections[label] = task.name
            with suppress(ProfileError):  # a task that the program has added has no section
                rows = explain_section(profile, task.name, type(task))
                self._settings[label] = {
                    row.parameter.name: ParameterSetting(
                        task.parameter_set.text(row.parameter),
                        row.parameter.format(row.parameter.default),
                        row.origin,
                        tuple(map(str, row.overwritten)),
                    )
                    for row in rows
                    if row.parameter is not None
                }

    def of_entity(self, label: str) -> Mapping[str, ParameterSetting]:
        """The settings of the task of an entity, by name; empty if it has none."""
        return self._settings.get(label, {})

    def section(self, label: str) -> str:
        """The section of the profile whose task has an entity; empty if there is none."""
        return self._sections.get(label, "")

    def present_options(self) -> PresentOptions | None:
        """The profile of the vehicle, with what it has now of the command line, saved values and orders."""
        profile = self._profile
        if profile is None:
            return None
        overrides = [
            f"{section.name}:{option.name}={option.value}"
            for section in list(profile.config.sections.values())
            for option in list(section.options.values())  # the kernel's thread may add one
            if option.history and (not option.origin.line or Path(option.origin.file).name == self._file.name)
        ]
        return PresentOptions(str(profile.path.absolute()), tuple(map(str, profile.config_dirs)), tuple(overrides))

    def saved(self, label: str) -> Mapping[str, str]:
        """Texts that are saved for the next start, by name; empty if the file cannot be read."""
        section = self._sections.get(label)
        if section is None:
            return {}
        with suppress(OSError, ProfileError, ValueError):
            return read_sections(self._file).get(section, {})
        return {}
