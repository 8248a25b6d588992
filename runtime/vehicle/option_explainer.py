"""The options of a section: their values, what they mean, and where they were set."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from runtime.profile import Option, Profile, dune_section_names
from runtime.task import Parameter, SharedOption, Task, find_parameter
from support.diagnostics import Origin, Problem, ProfileError
from support.terminal_text import corrected_spelling, quoted, suggestion


@dataclass(frozen=True, slots=True)
class OptionRow:
    """One option: its value as text, and the places that set it, latest first; none for the default.

    `overwritten` are the places whose value was replaced. `parameter` is the declaration, if any.
    """

    option: str
    value: str
    unit: str
    meaning: str
    origins: tuple[Origin, ...]
    overwritten: tuple[Origin, ...]
    parameter: Parameter | None = None

    @property
    def origin(self) -> str:
        """The place where the value was last set: "etc/auv/basic.ini:12", "command line" or "default"."""
        return str(self.origins[0]) if self.origins else "default"


def explain_section(
    profile: Profile,
    section: str,
    task: type[Task] | None = None,
    shared: Mapping[str, SharedOption] = MappingProxyType({}),
) -> list[OptionRow]:
    """The options of a section: those of its task in the order of declaration, then the unknown ones.

    An unknown option is marked, with the nearest valid name; data sections may have any option. `shared` are those
    that several tasks read in this section.

    Raises ProfileError if the profile has no such section and neither a task nor shared options are given.
    """
    found = profile.config.sections.get(section)
    if found is None and task is None and not shared:
        text = f"there is no section [{section}]"
        raise ProfileError([Problem("error", str(profile.path), 0, text, suggestion(section, profile.config.sections))])
    parameters = task.parameters() if task else {}
    options = dict(found.options) if found else {}
    rows: list[OptionRow] = []
    if task:
        rows.append(_row("Enabled", options.pop("Enabled", None), "", "Modes in which the task runs.", "Never"))
    for name, parameter in parameters.items():
        set_as = next((n for n in (name, *parameter.aliases) if n in options), name)
        rows.append(_parameter_row(set_as, options.pop(set_as, None), parameter))
    for name, known in shared.items():
        rows.append(_row(name, options.pop(name, None), known.unit, known.meaning, known.default))
    for name, option in options.items():
        unit, meaning = dune_section_names.GENERAL.get(name, ("", "")) if section == "General" else ("", "")
        if task:
            meaning = _unknown(name, parameters)
        elif shared or (section == "General" and name not in dune_section_names.GENERAL):
            near = corrected_spelling(name, shared or dune_section_names.GENERAL)
            meaning = "unknown" + (f"; did you mean {quoted(near)}?" if near else " to Shoal")
        rows.append(_row(name, option, unit, meaning, ""))
    return rows


def _unknown(name: str, parameters: Mapping[str, Parameter]) -> str:
    """The meaning of an option that is not shown with a parameter."""
    parameter = find_parameter(parameters, name)
    if parameter is not None:
        return f"another name of {quoted(parameter.name)}, which is already set"
    if name == dune_section_names.PROCESS:
        return "the process of the vehicle that runs this task"
    if name in dune_section_names.EVERY_TASK:
        return "no effect in Shoal"
    near = corrected_spelling(
        name, ["Enabled", *parameters, *(alias for p in parameters.values() for alias in p.aliases)]
    )
    return "unknown: not a parameter of this task" + (f"; did you mean {quoted(near)}?" if near else "")


def _parameter_row(name: str, option: Option | None, parameter: Parameter) -> OptionRow:
    default = parameter.format(parameter.default)
    return _row(name, option, parameter.unit, parameter.description, default, parameter)


def _row(
    name: str, option: Option | None, unit: str, meaning: str, default: str, parameter: Parameter | None = None
) -> OptionRow:
    if option is None or not option.history:
        return OptionRow(name, default, unit, meaning, (), (), parameter)
    origins = tuple(reversed(option.contributors))
    return OptionRow(
        name, option.value or default, unit, meaning, origins, tuple(option.overwritten_origins), parameter
    )
