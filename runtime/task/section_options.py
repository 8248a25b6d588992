"""The options that tasks read in the sections of others."""

from collections.abc import Iterable

from runtime.task.parameters import SharedOption
from runtime.task.task import Task


def section_reference_options(tasks: Iterable[type[Task]], section: str) -> set[tuple[str, str]]:
    """The options, by section and name, one of which must name a section for tasks to read it; none if they do so."""
    return {
        (place, name)
        for task in tasks
        for place, options in task.reads.items()
        for name, option in options.items()
        if option.section_prefix and section.startswith(option.section_prefix)
    }


def shared_options(tasks: Iterable[type[Task]], section: str) -> dict[str, SharedOption]:
    """The options that tasks read in a section of none of them, by name."""
    found: dict[str, SharedOption] = {}
    for task in tasks:
        for name, options in task.reads.items():
            if section == name or (name.endswith("/") and section.startswith(name)):
                found |= options
    return found
