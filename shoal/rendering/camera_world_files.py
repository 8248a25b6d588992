"""The cameras and the world of a logged run, with what is in files beside it."""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from runtime.profile import EVERY_TASK, NEVER, Config, Profile, Section, own_etc, read_config, split_list
from runtime.task import find_parameter, section_reference_options
from runtime.vehicle import TaskImportError, find_task
from support.diagnostics import Problem, ProfileError
from support.terminal_text import quoted, suggestion
from tasks.vision.cameras.rendered_camera import RenderedCameraTask
from world import SECTIONS

PROFILES = "Profiles"  # a section that declares modes, as the ini files of profiles have


def apply_camera_file(profile: Profile, file: Path | None) -> list[str]:
    """Add the cameras of an ini file to a profile, and return their sections; without a file those that are enabled.

    A section of the file replaces that of the profile. Raises ProfileError naming file and line of each mistake.
    """
    if file is None:
        selected = split_list(profile.value("General", "Selected"))
        return sorted(
            name for name in profile.config.sections if profile.is_task_enabled(name, selected) and _camera(name)
        )
    given = _read(file, profile)
    problems, found = list[Problem](), list[str]()
    for section in given.sections.values():
        if section.name == PROFILES or section.value("Enabled") == NEVER:
            continue
        cls = _camera(section.name)
        if cls is None:
            hint = suggestion(section.name, ("Vision.Camera", "Vision.FisheyeCamera"))
            problems.append(Problem("error", *section.origin, f"[{section.name}] is not a camera that renders", hint))
            continue
        parameters = cls.parameters()
        problems += _unknown(
            section, parameters, lambda name, known=parameters: find_parameter(known, name) is not None
        )
        profile.config.sections[section.name] = section
        found.append(section.name)
    if not found and not problems:
        problems.append(Problem("error", str(file), 0, "there is no camera in this file"))
    if problems:
        raise ProfileError(problems)
    return sorted(found)


def apply_world_file(profile: Profile, file: Path | None) -> None:
    """Lay the world of an ini file over that of a profile, option by option. Raises ProfileError."""
    given = Config() if file is None else _read(file, profile)
    problems = list[Problem]()
    for section in given.sections.values():
        base, slash, _ = section.name.partition("/")
        known = SECTIONS.get(base + slash)
        if known is None:
            hint = suggestion(section.name, dict.fromkeys(name.removesuffix("/") for name in SECTIONS))
            problems.append(Problem("error", *section.origin, f"[{section.name}] is not of the world", hint))
            continue
        problems += _unknown(section, known, known.__contains__)
        target = profile.config.ensure_section(section.name, section.origin)
        for option in section.options.values():
            target.options[option.name] = option
            for place, name in known[option.name].older if option.name in known else ():
                if (older := profile.config.sections.get(place)) is not None:
                    older.options.pop(name, None)
    for section in given.sections.values():
        for place, name in section_reference_options([RenderedCameraTask], section.name):
            own = section.name.partition("/")[2]
            if own not in split_list(profile.value(place, name)):
                text, hint = f"nothing reads [{section.name}]", f"write {quoted(own)} in {name} of [{place}]"
                problems.append(Problem("error", *section.origin, text, hint))
    if problems:
        raise ProfileError(problems)


def _read(file: Path, profile: Profile) -> Config:
    """The content of a file, whose warnings become those of the profile."""
    config = read_config(file, shared=[own_etc()])
    profile.file_problems.extend(config.problems)
    if config.errors:
        raise ProfileError(config.errors)
    return config


def _camera(section: str) -> type[RenderedCameraTask] | None:
    try:
        cls = find_task(section)
    except TaskImportError:
        return None
    return cls if cls is not None and issubclass(cls, RenderedCameraTask) else None


def _unknown(section: Section, known: Iterable[str], is_known: Callable[[str], bool]) -> Iterator[Problem]:
    """The options that nothing reads: a misspelled one would silently change nothing."""
    for option in section.options.values():
        if option.history and option.name not in ("Enabled", *EVERY_TASK) and not is_known(option.name):
            text = f"[{section.name}] has no option {quoted(option.name)}"
            yield Problem("error", *option.origin, text, suggestion(option.name, known))
