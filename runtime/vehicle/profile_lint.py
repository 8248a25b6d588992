"""Finds mistakes in a profile: unknown names, invalid values, labels that are taken."""

import re
from collections.abc import Callable, Iterable, Mapping

from runtime.profile import (
    ALWAYS,
    NEVER,
    Option,
    Profile,
    Section,
    default_label,
    dune_section_names,
    split_list,
)
from runtime.task import Parameter, SharedOption, Task, find_parameter, section_reference_options, shared_options
from runtime.vehicle.general_lint import general_problems
from runtime.vehicle.task_registry import missing_task_reason, nearest_task, section_name, suggest_task_name
from support.diagnostics import Origin, Problem, ProfileError, Severity
from support.terminal_text import corrected_spelling, nearest_word, quoted, suggestion

DAEMON = "Daemon"

_OCTAL = re.compile(r"[+-]?0[0-7]+")


def check_profile(
    profile: Profile,
    tasks: Mapping[str, type[Task]],
    selected: Iterable[str] | None = None,
    find_task: Callable[[str], type[Task] | None] | None = None,
) -> list[Problem]:
    """All problems of a profile's files and values, in the order of files and lines.

    `tasks` are the known classes by section name; `find_task` gives the class of a section, also of a user's module.
    Values and labels are checked for the tasks that run in the modes `selected`, by default for those of any mode.
    """
    checker = _Checker(profile, tasks, None if selected is None else frozenset(selected), find_task or _lookup(tasks))
    checker.run()
    order = {file: index for index, file in reversed(list(enumerate(profile.config.files)))}
    found = dict.fromkeys([*profile.file_problems, *checker.problems])
    return sorted(found, key=lambda problem: (order.get(problem.file, len(order)), problem.file, problem.line))


class _Checker:
    def __init__(
        self,
        profile: Profile,
        tasks: Mapping[str, type[Task]],
        selected: frozenset[str] | None,
        find_task: Callable[[str], type[Task] | None],
    ):
        self.problems: list[Problem] = []
        self._profile = profile
        self._config = profile.config
        self._tasks = tasks
        self._selected = selected
        self._find_task = find_task
        self._found: dict[str, type[Task]] = {}

    def run(self) -> None:
        if not self._config.sections and not self._config.errors:
            self._report("error", Origin(str(self._profile.path)), "the file has no section, so nothing runs")
        self.problems += general_problems(self._profile)
        for section in self._config.sections.values():
            self._check_section(section)
        self._check_labels()

    def _report(self, severity: Severity, origin: Origin, text: str, hint: str = "") -> None:
        self.problems.append(Problem(severity, *origin, text, hint))

    def _check_section(self, section: Section) -> None:
        self._check_repetitions(section)
        runs = not {ALWAYS, *self._profile.selectable_modes}.isdisjoint(split_list(section.value("Enabled")))
        meant = runs or "Enabled" not in section.options
        find = self._find_task if meant else _lookup(self._tasks)  # what is switched off is not imported
        try:
            cls = find(section.name)
        except ImportError as error:
            self._report("error" if runs else "warning", section.origin, f"[{section.name}]: {error}")
            return
        if cls is None:
            self._check_unknown_section(section, runs)
            return
        self._found[section.name] = cls
        self._check_case(section, [section_name(cls), *self._tasks])
        self._check_enabled(section)
        label = section.options.get("Entity Label")
        if label and label.history and not label.value:
            text = f"[{section.name}] Entity Label is empty, so it is {quoted(default_label(section.name))}"
            self._report("warning", label.origin, text, "DUNE rejects the task")
        parameters = cls.parameters()
        unknown: list[Option] = []
        for option in section.options.values():
            parameter = find_parameter(parameters, option.name)
            if parameter is not None:
                if self._runs(section.name):
                    self._check_value(section, option, parameter)
            elif option.name == dune_section_names.PROCESS:
                self._check_process(section)
            elif option.name in dune_section_names.EVERY_TASK:
                self._report("note", option.origin, f"[{section.name}] {option.name} has no effect in Shoal")
            elif option.name != "Enabled" and option.history:
                unknown.append(option)
        self._report_unknown(section, unknown, parameters)

    def _check_process(self, section: Section) -> None:
        try:
            self._profile.task_process(section.name)
        except ProfileError as error:
            self.problems += error.problems

    def _check_repetitions(self, section: Section) -> None:
        for option in section.options.values():
            plain = list(dict.fromkeys(a.origin for a in option.history if a.operator == "="))
            before = [origin for origin in plain[:-1] if origin.line and origin.file == plain[-1].file]
            if before:
                text = f"[{section.name}] {option.name} is already set in line {before[-1].line}"
                self._report("note", plain[-1], text, "this line wins")

    def _check_unknown_section(self, section: Section, runs: bool) -> None:
        name, base = section.name, section.name.partition("/")[0]
        dot = "." in base
        known = shared_options(self._tasks.values(), name)
        if known or name in dune_section_names.DATA_SECTIONS or name.startswith(dune_section_names.DATA_PREFIXES):
            self._check_shared(section, known)
            self._check_listed(section)
            return
        if name == dune_section_names.MULTIPLEXER:
            self._check_multiplexer(section)
            return
        if self._check_case(section, [*self._tasks, *dune_section_names.DATA_SECTIONS]):
            return
        near = nearest_task(base, [*self._tasks, *dune_section_names.TASKS]) or suggest_task_name(base)
        meant = runs or (dot and "Enabled" not in section.options)
        hint = f"did you mean [{near}]?" if near else missing_task_reason(base) if meant else ""
        if base in dune_section_names.TASKS:
            self._report("note", section.origin, f"[{name}] is a task of DUNE that is not available in Shoal")
        elif "Enabled" not in section.options and (":" in name or not dot):
            if near := nearest_word(name, () if dot else dune_section_names.DATA_SECTIONS):
                self._report("warning", section.origin, f"nothing reads [{name}]", f"did you mean [{near}]?")
        elif runs or near or "Enabled" not in section.options or not dot:
            self._report("error" if runs else "warning", section.origin, f"[{name}] is not a task", hint)

    def _check_shared(self, section: Section, known: Mapping[str, SharedOption]) -> None:
        for option in section.options.values() if known else ():
            if option.name not in known and option.history:
                near = corrected_spelling(option.name, known)
                text = f"[{section.name}] nothing reads {quoted(option.name)}"
                hint = f"did you mean {quoted(near)}?" if near else f"shoal explain lists those of {section.name}"
                self._report("warning", option.origin, text, hint)

    def _check_listed(self, section: Section) -> None:
        own = section.name.partition("/")[2]
        for place, name in section_reference_options(self._tasks.values(), section.name):
            if own not in split_list(self._config.value(place, name)):
                hint = f"write {quoted(own)} in {name} of [{place}]"
                self._report("warning", section.origin, f"nothing reads [{section.name}]", hint)

    def _check_multiplexer(self, section: Section) -> None:
        tasks = ", ".join(dict.fromkeys(name for name, _ in dune_section_names.multiplexer_option_targets("Enabled")))
        self._report("note", section.origin, f"[{section.name}] stands for a section of each of its maneuvers: {tasks}")
        enabled = section.options.get("Enabled")
        for option in section.options.values():
            for name, _ in dune_section_names.multiplexer_option_targets(option.name):
                own = self._config.option(name, "Enabled")
                if own and enabled and enabled is not option and own.origin != enabled.origin:
                    text = f"[{section.name}] {quoted(option.name)} has no effect: [{name}] has its own Enabled"
                    self._report("warning", option.origin, text, f"set it in [{name}]")
            kind = option.name.removeprefix(f"{dune_section_names.LABEL} -- ").partition(" -- ")[0]
            if " -- " in option.name and kind not in (
                *dune_section_names.MULTIPLEXED,
                *dune_section_names.FOR_AIRCRAFT,
            ):
                near = corrected_spelling(kind, dune_section_names.MULTIPLEXED)
                text = f"[{section.name}] {quoted(option.name)}: {quoted(kind)} is not one of its maneuvers"
                self._report("warning", option.origin, text, f"did you mean {quoted(near)}?" if near else "")

    def _check_case(self, section: Section, names: Iterable[str]) -> bool:
        base, slash, instance = section.name.partition("/")
        written = next((n for n in names if n.casefold() == base.casefold() and n != base), None)
        if written is not None:
            text = f"[{section.name}] differs in letter case"
            self._report("warning", section.origin, text, f"write [{written}{slash}{instance}]")
        return written is not None

    def _check_enabled(self, section: Section) -> None:
        option = section.options.get("Enabled")
        if option is None or not option.value:
            text = f"[{section.name}] has no Enabled, so it never runs"
            self._report("warning", option.origin if option else section.origin, text, "write Enabled = Always")
            return
        names = [ALWAYS, NEVER, *self._profile.selectable_modes]
        for name in [word.strip() for word in option.value.split(",")]:
            if name not in names:
                text = f"[{section.name}] Enabled: unknown mode {quoted(name)}"
                self._report("warning", option.origin, text, suggestion(name, names))

    def _runs(self, section: str) -> bool:
        return self._profile.is_task_enabled(
            section, self._profile.selectable_modes if self._selected is None else self._selected
        )

    def _report_unknown(self, section: Section, options: list[Option], parameters: Mapping[str, Parameter]) -> None:
        """A warning for each misspelled parameter, and one for the others: DUNE's tasks have many that are not here."""
        task = section.name.partition("/")[0]
        names = ["Enabled", *parameters, *(alias for p in parameters.values() for alias in p.aliases)]
        others: list[Option] = []
        for option in options:
            near = corrected_spelling(option.name, names)
            text = f"[{section.name}] {quoted(option.name)} is not a parameter of {task}"
            if near.casefold() == option.name.casefold():
                text += ": the letter case differs"
            if near:
                self._report("warning", option.origin, text, f"did you mean {quoted(near)}?")
            else:
                others.append(option)
        if others:
            words = ", ".join(quoted(option.name) for option in others)
            is_, parameters_ = ("is", "a parameter") if len(others) == 1 else ("are", "parameters")
            here = " in Shoal" if task in dune_section_names.TASKS else ""
            text = f"[{section.name}] {words} {is_} not {parameters_} of {task}{here}, and {is_} ignored"
            self._report("warning", others[0].origin, text, f"shoal explain lists those of {task}")

    def _check_value(self, section: Section, option: Option, parameter: Parameter) -> None:
        where, text = f"[{section.name}] {option.name}", option.value
        try:
            parameter.parse(text)
        except ValueError as error:
            self._report("error", option.origin, f"{where}: {error}", _correction(parameter, text))
            return
        if surplus := parameter.ignored_suffix(text).strip():
            unit = parameter.unit if parameter.unit not in ("", "1") else ""
            hint = f"write the number alone; it is in {unit}" if unit else "write the number alone"
            if surplus.startswith(","):
                hint = "write the decimal point as ."
            self._report("warning", option.origin, f"{where}: {quoted(surplus)} after the number is ignored", hint)
        words = [word.strip() for word in text.split(",")] if parameter.is_list else [text]
        for octal in filter(_OCTAL.fullmatch, words if parameter.type is int else []):
            text = f"{where}: {octal} begins with 0 and is read as octal: {int(octal, 8)}"
            self._report("warning", option.origin, text, "write it without the 0")
        for doubt in parameter.warnings(text):
            self._report("warning", option.origin, f"{where}: {doubt}")
        if parameter.is_list and parameter.type is str and option.value and "" in words:
            self._report("warning", option.origin, f"{where}: an item of the list is empty", "remove the extra comma")

    def _check_labels(self) -> None:
        modes = [*self._profile.selectable_modes, ""] if self._selected is None else [None]
        said: set[tuple[str, str]] = set()
        for mode in modes:
            chosen = self._selected if mode is None else {mode}
            taken: dict[str, str] = {}
            for section in sorted(self._found, key=lambda name: name.encode(errors="surrogateescape")):
                if not self._profile.is_task_enabled(section, chosen or ()):
                    continue
                label, origin = self._label(section)
                other = taken.setdefault(label, section)
                if label == DAEMON or (other != section and (other, section) not in said):
                    said.add((other, section))
                    holder = "the vehicle itself" if label == DAEMON else f"[{other}] ({self._label(other)[1]})"
                    text = f"[{section}] Entity Label: {quoted(label)} is taken by {holder}"
                    self._report("error", origin, text, "give each task a label of its own")

    def _label(self, section: str) -> tuple[str, Origin]:
        option = self._config.option(section, "Entity Label")
        label = option.value if option else ""
        return label or default_label(section), option.origin if option else self._config.sections[section].origin


def _lookup(tasks: Mapping[str, type[Task]]) -> Callable[[str], type[Task] | None]:
    return lambda section: tasks.get(section.partition("/")[0])


def _correction(parameter: Parameter, text: str) -> str:
    if parameter.type is bool:
        return "write true or false"
    if parameter.choices and (near := nearest_word(text, map(str, parameter.choices))):
        return f"did you mean {quoted(near)}?"
    return f"the default is {parameter.format(parameter.default)}" if parameter.default not in ("", []) else ""
