"""DUNE's ini grammar: the lines of one file, as sections, directives, assignments and their continuations."""

import re
from collections.abc import Callable

from runtime.profile.config import BLANKS, Config, Option, Section, has_undecodable_bytes, split_list
from support.diagnostics import Origin, Problem, Severity
from support.terminal_text import quoted, suggestion

MOST_ASSIGNMENTS = 1000  # of one option
LONGEST_VALUE = 65536  # characters
MOST_WARNINGS = 100  # in one file
ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "scope": ("global", "idle", "plan", "maneuver"),
    "visibility": ("user", "developer"),
    "editable": (),
}

_COMMENT = re.compile(r"[;|#]")
_ATTRIBUTES_ONLY = re.compile(r"([^{;|#]+)\{([^}]*)\}[ \t\n\v\f\r]*(?:[;|#].*)?")
_REFERENCE = re.compile(r"\$\(([^,]+),[ \t\n\v\f\r]*([^)]+)(\)?)")
_NEARLY_DIRECTIVE = re.compile(r"\s*(include|require)\b", re.IGNORECASE)


class LineReader:
    """Reads the lines of one file, in order, into a Config.

    `include(name, required)` is called for a directive. A line that DUNE reads differently than it looks is read as in
    DUNE, with a warning; a line with an error is skipped. `raw` lists the lines with bytes that are not UTF-8.
    """

    def __init__(
        self,
        config: Config,
        path: str,
        report: Callable[[Problem], None],
        include: Callable[[str, bool], None],
    ):
        self.origin: Origin = Origin(path)
        self.errors: int = 0
        self._warnings = 0
        self.raw: list[int] = []
        self._config = config
        self._report = report
        self._include = include
        self._section: Section | None = None
        self._behind_directive = False
        self._option: Option | None = None
        self._reduced = False

    def read_line(self, number: int, line: str) -> None:
        """Read one line, without blanks around it; neither empty nor a comment."""
        self.origin = Origin(self.origin.file, number)
        left, equals, right = line.partition("=")
        if line[0] == "[":
            self._open(line)
        elif equals and left:
            self._assign(left, right)
        elif only := _ATTRIBUTES_ONLY.fullmatch(line):
            self._attribute(only[1].rstrip(BLANKS), only[2])
        elif line[0] == "|":
            self.report_error("a line that begins with | is neither a comment nor text", "a comment begins with # or ;")
        else:
            self._continue(line)

    def report_error(self, text: str, hint: str = "") -> None:
        self.errors += 1
        self._add_problem("error", text, hint)

    def report_warning(self, text: str, hint: str = "") -> None:
        self._warnings += 1
        if self._warnings < MOST_WARNINGS:
            self._add_problem("warning", text, hint)
        elif self._warnings == MOST_WARNINGS:
            self._add_problem("warning", f"{MOST_WARNINGS} warnings in this file; further ones are not listed", "")

    def _open(self, line: str) -> None:
        name, bracket, rest = line[1:].partition("]")
        name = name.rstrip(BLANKS)
        self._note_raw(name)
        if not name:
            self.report_error("a section without a name", "write [Section]")
            return
        if not bracket:
            self.report_warning(f"[{name} has no closing bracket", f"write [{name}]")
        elif rest.strip(BLANKS) and not _COMMENT.match(rest.strip(BLANKS)):
            self.report_warning(
                f"{quoted(rest.strip(BLANKS))} after the section's name is ignored", "put it on a line of its own"
            )
        self._behind_directive = name.startswith(("Include ", "Require "))
        if self._behind_directive:
            self._section = Section(name)
            self._include(name[8:].strip(BLANKS), name.startswith("Require "))
            return
        if near := _NEARLY_DIRECTIVE.match(name):
            self.report_warning(
                f"[{name}] opens a section and includes nothing", f"write [{near[1].capitalize()} FILE.ini]"
            )
        elif name[0] in BLANKS:
            self.report_warning(f"the name of section [{name}] begins with a blank", f"write [{name.strip(BLANKS)}]")
        self._section = self._config.ensure_section(name, self.origin)

    def _assign(self, left: str, right: str) -> None:
        name, brace, attributes = left.partition("{")
        name, value = name.rstrip(BLANKS), _COMMENT.split(right, maxsplit=1)[0].strip(BLANKS)
        self._note_raw(left, value)
        if self._section is None:
            self.report_error(f"{quoted(name)} is set before any section", "put a [Section] line above")
            return
        mark = name[-1:] if name.endswith(("+", "-")) else ""
        name = name.removesuffix(mark)
        if not name:
            self.report_warning("an assignment without a name is ignored", "write NAME = VALUE")
            return
        if name[-1] in BLANKS:
            good = name.rstrip(BLANKS)
            self.report_warning(f"this sets {quoted(name)} with the blank, not {quoted(good)}", f"write {good}{mark} =")
        if _COMMENT.search(name):
            self.report_warning(
                f"this line sets the option {quoted(name)}", "a comment after continued text must not have a ="
            )
        self._note_cut(right)
        option = self._target(self._section, name)
        if brace:
            self._describe(option, attributes)
        self._option, self._reduced = option, mark == "-"
        if len(option.history) >= MOST_ASSIGNMENTS:
            self.report_error(f"{name} is set more than {MOST_ASSIGNMENTS} times", "continue a list on the next line")
            return
        if mark == "+" and self._too_long(option, value):
            return
        if reference := _REFERENCE.match(value):
            self._refer(option, value, reference)
        elif mark == "+":
            self._extend(option, value)
        elif mark == "-" and option.history:
            self._reduce(option, value)
        else:
            if mark == "-":
                self.report_warning(
                    f"{name} was not set before, so -= sets it to {quoted(value)}", f"write {name} = to set it"
                )
            option.set(value, self.origin)

    def _extend(self, option: Option, text: str) -> None:
        if option.history and not (option.size and text):
            self.report_warning(f"{option.name} gets an empty item, since one side of += is empty", "remove this line")
        option.extend(text, self.origin)

    def _reduce(self, option: Option, text: str) -> None:
        present = split_list(option.value)
        for item in split_list(text):
            if item not in option.value:
                self.report_warning(f"{quoted(item)} is not in {option.name}", suggestion(item, present))
            elif part := next((other for other in present if item in other and item != other), None):
                self.report_warning(
                    f"removing {quoted(item)} from {option.name} also removes it from within {quoted(part)}",
                    f"set the whole list with {option.name} =",
                )
        option.remove_items(text, self.origin)

    def _refer(self, option: Option, text: str, reference: re.Match[str]) -> None:
        section, name = reference[1], reference[2]
        source = self._config.option(section, name)
        if source is None or not source.history:
            known = self._config.sections.get(section)
            hint = suggestion(name, known.options) if known else suggestion(section, self._config.sections)
            self.report_error(f"invalid reference: {text} is not set above", hint)
            return
        if not reference[3] or text[reference.end() :].strip(BLANKS):
            self.report_warning(f"{quoted(text)} is read as a reference", f"write $({section}, {name})")
        option.set(source.value, self.origin)

    def _attribute(self, name: str, text: str) -> None:
        self._note_raw(name, text)
        if self._section is None:
            self.report_error(f"{quoted(name)} has attributes before any section", "put a [Section] line above")
            return
        self._describe(self._target(self._section, name), text + "}")

    def _describe(self, option: Option, text: str) -> None:
        inside, closed, rest = text.partition("}")
        if not closed:
            self.report_warning(
                f"the attributes of {option.name} have no closing brace", f"write {option.name} {{scope: idle}} ="
            )
        elif rest.strip(BLANKS):
            self.report_warning(
                f"{quoted(rest.strip(BLANKS))} after the attributes of {option.name} is ignored",
                "put + or - before the {",
            )
        for item in split_list(inside):
            label, colon, value = item.partition(":")
            label, value = label.strip(BLANKS).lower(), value.strip(BLANKS)
            option.attributes[label] = value
            if not colon or label not in ATTRIBUTES:
                self.report_warning(
                    f"{quoted(item)} is not an attribute", f"valid: {', '.join(ATTRIBUTES)}, each with a value"
                )
            elif ATTRIBUTES[label] and value not in ATTRIBUTES[label]:
                self.report_warning(f"{label} cannot be {quoted(value)}", f"it can be {', '.join(ATTRIBUTES[label])}")

    def _continue(self, line: str) -> None:
        text = _COMMENT.split(line, maxsplit=1)[0].rstrip(BLANKS)
        self._note_raw(text)
        if self._section is None:
            self.report_error(f"{quoted(text)} is neither a section nor an assignment", "a comment begins with # or ;")
            return
        if self._option is None:
            self.report_warning(f"{quoted(text)} has no '=' and is ignored", "write NAME = VALUE")
            return
        name = self._option.name
        if self._reduced:
            self.report_warning(
                f"{quoted(text)} is added to {name}, although it continues a -=", "write -= on each line"
            )
        self._note_cut(line)
        option = self._target(self._section, name)
        if option is not self._option:
            self.report_warning(
                f"{quoted(text)} continues {name} into [{self._section.name}]", f"write {name} = in this section"
            )
            self._option = option
        if self._too_long(option, text):
            return
        if not option.history:
            option.set("", self.origin)
        option.continue_with(text)

    def _target(self, section: Section, name: str) -> Option:
        if self._behind_directive:
            self.report_warning(
                f"{quoted(name)} is set after [{section.name}], outside any section", "put a [Section] line above"
            )
        return section.ensure_option(name)

    def _too_long(self, option: Option, text: str) -> bool:
        long = option.size + len(text) > LONGEST_VALUE
        if long:
            self.report_error(f"{option.name} gets longer than {LONGEST_VALUE} characters")
        return long

    def _note_cut(self, text: str) -> None:
        """Warn of a # or | that may have been meant as part of the value."""
        cut = _COMMENT.search(text)
        if cut is None or cut[0] == ";":
            return
        kept, behind = text[: cut.start()].rstrip(BLANKS), text[cut.end() : cut.end() + 1]
        meant = len(kept) == cut.start() if kept else behind.isalnum()
        if meant:
            self.report_warning(
                f"the value ends before {quoted(cut[0])}: {quoted(kept.strip(BLANKS))}",
                "a value cannot have ; | #; put blanks around the comment sign",
            )

    def _note_raw(self, *texts: str) -> None:
        if any(map(has_undecodable_bytes, texts)):
            self.raw.append(self.origin.line)

    def _add_problem(self, severity: Severity, text: str, hint: str) -> None:
        self._report(Problem(severity, *self.origin, text, hint))
