"""The values of parameters: as the profile gives them, as they change in a running vehicle, and as they are saved."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

from runtime.profile import read_sections, write_sections
from runtime.task import ParameterError, Task
from support.number_parsing import leading_number

T = TypeVar("T")


class ProfileValues(Protocol):
    """The part of a profile that a running vehicle needs."""

    @property
    def base_folder(self) -> Path:
        """The folder in which relative paths of its values begin."""
        ...

    def find_file(self, section: str, option: str) -> Path:
        """The file that an option names; the path as it is written if there is none."""
        ...

    def value(self, section: str, option: str, default: str = "") -> str:
        """The text of an option of any section, `default` if it is missing or empty."""
        ...

    def options(self, section: str) -> Mapping[str, str]:
        """The texts that a section sets, by option, without Enabled."""
        ...

    def dump(self) -> str:
        """The effective configuration, as an ini file."""
        ...

    def override(self, assignment: str) -> object:
        """Apply "Section:Option=value" to the effective configuration."""
        ...


def general_number(profile: ProfileValues, option: str, default: float) -> float:
    """A number in section General, `default` if it is missing or empty. Raises ParameterError."""
    text = profile.value("General", option)
    try:
        number = leading_number(text) if text else default
    except ValueError:
        number = math.nan
    if math.isnan(number):
        raise ParameterError(option, f"[General] has {text!r}, which is not a number")
    return number


class EffectiveConfig:
    """The differences of the parameters of tasks from the profile."""

    def __init__(self, settings: ProfileValues):
        self._settings = settings
        self._original: dict[str, dict[str, str]] = {}
        self._effective: dict[str, dict[str, str]] = {}
        self._shared: dict[object, Any] = {}

    def shared_object(self, make: Callable[[ProfileValues], T]) -> T:
        """A value that tasks derive from the effective configuration, such as a world; renewed after a change."""
        if make not in self._shared:
            self._shared[make] = make(self._settings)
        return self._shared[make]

    def set_baseline(self, task: Task) -> None:
        """Take the present values as the profile's."""
        self._original[task.name] = {p.name: task.parameter_set.text(p) for p in task.parameters().values()}

    def text_before(self, task: Task, name: str) -> str | None:
        """The text that a parameter had when the task was configured last; None when it is the first time."""
        return (self._effective.get(task.name) or self._original.get(task.name, {})).get(name)

    def original_values(self) -> dict[str, dict[str, str]]:
        """The profile's values of all parameters that have changed: texts by task and ini name."""
        pairs = {name: (known, self._original[name]) for name, known in self._effective.items()}
        return {
            name: {option: text for option, text in original.items() if text != known[option]}
            for name, (known, original) in pairs.items()
            if known != original
        }

    def set_original_values(self, changed: Mapping[str, Mapping[str, str]]) -> None:
        """Restore the profile's values from earlier `original_values`. Raises KeyError for an unknown parameter."""
        for name, texts in changed.items():
            original = self._original[name]
            if unknown := texts.keys() - original.keys():
                raise KeyError(f"{name}: {min(unknown)}")
            self._effective[name] = dict(original)
            original.update(texts)

    def update_from_task(self, task: Task) -> None:
        """Apply the task's changed parameters to the effective configuration."""
        known = self._effective.setdefault(task.name, dict(self._original[task.name]))
        for parameter in task.parameters().values():
            text = task.parameter_set.text(parameter)
            if text != known[parameter.name]:
                self._settings.override(f"{task.name}:{parameter.name}={text}")
                known[parameter.name] = text
                self._shared.clear()

    def adopt(self, task: Task, name: str) -> None:
        """Take over a value that a task has from elsewhere in the configuration, so that it is no change of its own.

        An option that the task's section sets follows, since it would contradict the value.
        """
        text = task.parameter_set.text(task.parameters()[name])
        self._original[task.name][name] = text
        if task.name in self._effective:
            self._effective[task.name][name] = text
        if self._settings.value(task.name, name):
            self._settings.override(f"{task.name}:{name}={text}")

    def save_changed_parameters(self, task: Task, path: Path) -> None:
        """Add the parameters of a task that differ from the profile to a file of saved parameters.

        Raises OSError, and ValueError for a text that an ini file cannot hold.
        """
        saved = read_sections(path)
        section = saved.setdefault(task.name, {})
        for parameter in task.parameters().values():
            text = task.parameter_set.text(parameter)
            # A parameter saved before is written even with the profile's value: its old text must not stay.
            if parameter.name in section or text != self._original[task.name][parameter.name]:
                section[parameter.name] = text
        write_sections(path, saved)


def set_parameter_texts(task: Task, options: Mapping[str, str]) -> None:
    """Set parameters from ini texts, by ini name; unknown names are ignored. Raises ParameterError."""
    for name, text in options.items():
        parameter = task.parameter_set.find(name)
        if parameter is None:
            continue
        try:
            task.parameter_set.set(parameter, parameter.parse(text))
        except ValueError as error:
            raise ParameterError(name, str(error)) from None


def set_parameter_values(task: Task, values: Mapping[str, Any]) -> None:
    """Set parameters by attribute. Raises ParameterError."""
    for attribute, value in values.items():
        parameter = next((p for p in task.parameters().values() if p.attribute == attribute), None)
        if parameter is None:
            raise ParameterError(attribute, f"{task.name} has no such parameter")
        try:
            task.parameter_set.set(parameter, parameter.check(value))
        except ValueError as error:
            raise ParameterError(parameter.name, str(error)) from None
