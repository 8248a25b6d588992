"""Files of a scenario besides its own."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from runtime.profile import Profile, is_file, resolve_root_copy, split_list
from runtime.vehicle import TaskImportError, find_task


@dataclass(frozen=True)
class ScenarioDependencies:
    """Absolute paths of what was read: `files` are plans, profiles and what these include.

    `data` are files that values of profiles name, by section, option and text; `modules` have the tasks of sections.
    """

    files: frozenset[Path] = frozenset()
    data: Mapping[str, Path] = field(default_factory=dict[str, Path])
    modules: frozenset[str] = frozenset()

    def __or__(self, other: "ScenarioDependencies") -> "ScenarioDependencies":
        return ScenarioDependencies(self.files | other.files, {**self.data, **other.data}, self.modules | other.modules)


def profile_dependencies(profile: Profile, modes: Iterable[str]) -> ScenarioDependencies:
    """The sources of a profile with these modes; tasks that are not enabled count, too, but not the files they name."""
    modes = tuple(modes)
    files = frozenset(normalized_absolute_path(Path(name)) for name in profile.config.files)
    data: dict[str, Path] = {}
    modules: set[str] = set()
    for section in profile.config.sections.values():
        try:
            found = find_task(section.name)
        except TaskImportError:  # the run reports it
            found = None
        name, dot, _ = section.name.partition("/")[0].rpartition(".")
        modules |= {found.__module__, name} if found is not None and dot else set()
        if found is not None and not profile.is_task_enabled(section.name, modes):
            continue
        for option in section.options.values():
            folders = profile.file_folders(option)
            for text in split_list(option.value):
                place = next((path for folder in folders if is_file(path := resolve_root_copy(folder / text))), None)
                if place is not None:
                    data[f"{section.name}: {option.name} = {text}"] = normalized_absolute_path(place)
    return ScenarioDependencies(files, data, frozenset(modules))


def normalized_absolute_path(path: Path) -> Path:
    """The path from the root, without links followed and without a/../."""
    return Path(os.path.abspath(path))
