"""The contents of an ini file: sections of options, each with file and line; also writes them back."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal, NamedTuple

from support.diagnostics import Origin, Problem
from support.terminal_text import quoted

BLANKS = " \t\n\v\f\r"
COMMENTS = ";|#"
WIDTH = 100
LONGEST_LINE = 65536  # bytes


class Assignment(NamedTuple):
    """One line that set, extended (+=) or reduced (-=) an option."""

    origin: Origin
    operator: Literal["=", "+=", "-="]


@dataclass(slots=True, eq=False)
class Option:
    """An option of a section; `history` has the assignments that were applied, oldest first.

    If only its attributes (scope, visibility, editable) are given, it has no history and an empty value.
    """

    name: str
    attributes: dict[str, str] = field(default_factory=dict[str, str])
    history: list[Assignment] = field(default_factory=list[Assignment])
    size: int = 0  # characters of the value, including blanks around it
    _parts: list[str] = field(default_factory=list[str])

    @property
    def value(self) -> str:
        """The text, without blanks around it."""
        if len(self._parts) > 1:
            self._parts = ["".join(self._parts)]
        return self._parts[0].strip(BLANKS) if self._parts else ""

    @property
    def origin(self) -> Origin:
        """The place of the last assignment."""
        return self.history[-1].origin if self.history else Origin("")

    @property
    def contributors(self) -> list[Origin]:
        """The places of the assignments that make up the value: the last plain one, and what extended or reduced it."""
        return list(dict.fromkeys(assignment.origin for assignment in self.history[self._start() :]))

    @property
    def overwritten_origins(self) -> list[Origin]:
        """The places of the assignments that a later one replaced, oldest first."""
        kept = self.contributors
        return [o for o in dict.fromkeys(a.origin for a in self.history[: self._start()]) if o not in kept]

    def set(self, text: str, origin: Origin) -> None:
        self._parts, self.size = [text], len(text)
        self.history.append(Assignment(origin, "="))

    def extend(self, text: str, origin: Origin) -> None:
        """Add to the list, or set the value if there is none yet."""
        if not self.history:
            self.set(text, origin)
            return
        self._parts += [", ", text]
        self.size += 2 + len(text)
        self.history.append(Assignment(origin, "+="))

    def remove_items(self, text: str, origin: Origin) -> None:
        """Remove every occurrence of each item of `text`, with the comma that follows it."""
        value = self.value
        for item in split_list(text):
            value = re.sub(re.escape(item) + ",?", "", value)
        self._parts, self.size = [value], len(value)
        self.history.append(Assignment(origin, "-="))

    def continue_with(self, text: str) -> None:
        self._parts += [" ", text]
        self.size += 1 + len(text)

    def renamed(self, name: str) -> "Option":
        """A copy of another name, with the same history."""
        return Option(name, dict(self.attributes), list(self.history), self.size, list(self._parts))

    def _start(self) -> int:
        plain = [index for index, assignment in enumerate(self.history) if assignment.operator == "="]
        return plain[-1] if plain else 0


@dataclass(slots=True, eq=False)
class Section:
    """The options of all headers of one name; `origins` are the places of these headers."""

    name: str
    options: dict[str, Option] = field(default_factory=dict[str, Option])
    origins: dict[Origin, None] = field(default_factory=dict[Origin, None])

    @property
    def origin(self) -> Origin:
        return next(iter(self.origins), Origin(""))

    def value(self, option: str, default: str = "") -> str:
        """The text of an option, `default` if it is missing or empty."""
        found = self.options.get(option)
        return (found.value if found else "") or default

    def ensure_option(self, option: str) -> Option:
        """The option of this name, created if missing."""
        return self.options.setdefault(option, Option(option))


@dataclass(slots=True, eq=False)
class Config:
    """The merged contents of a file and its includes, in the order of first mention."""

    sections: dict[str, Section] = field(default_factory=dict[str, Section])
    problems: list[Problem] = field(default_factory=list[Problem])
    files: list[str] = field(default_factory=list[str])

    @property
    def errors(self) -> list[Problem]:
        return [problem for problem in self.problems if problem.severity == "error"]

    def sorted_sections(self) -> list[Section]:
        """The sections sorted by the bytes of their names: DUNE's order of tasks."""
        return sorted(self.sections.values(), key=lambda section: byte_sort_key(section.name))

    def option(self, section: str, name: str) -> Option | None:
        found = self.sections.get(section)
        return found.options.get(name) if found else None

    def value(self, section: str, name: str, default: str = "") -> str:
        """The text of an option, `default` if it is missing or empty."""
        found = self.sections.get(section)
        return found.value(name, default) if found else default

    def ensure_section(self, section: str, origin: Origin) -> Section:
        """The section of this name, created if missing."""
        found = self.sections.setdefault(section, Section(section))
        found.origins.setdefault(origin)
        return found

    def options(self, section: str) -> list[Option]:
        """The options of a section, empty if there is no such section."""
        found = self.sections.get(section)
        return list(found.options.values()) if found else []

    def dump(self) -> str:
        """The values as an ini file that reads the same, sections and options in byte order."""
        return "\n".join("".join(_section_lines(section)) for section in self.sorted_sections())


def format_sections(sections: Mapping[str, Mapping[str, str]]) -> str:
    """An ini file with these texts, in byte order. Raises ValueError if the grammar cannot hold a name or a text."""
    blocks: list[str] = []
    for name in sorted(sections, key=byte_sort_key):
        options = sections[name]
        lines = [format_option(option, options[option]) for option in sorted(options, key=byte_sort_key)]
        blocks.append(format_header(name) + "".join(lines))
    return "\n".join(blocks)


def format_header(section: str) -> str:
    """The line that opens a section. Raises ValueError if the grammar cannot hold the name."""
    if not section or section != section.rstrip(BLANKS) or any(c in section for c in "]\n\0"):
        raise ValueError(f"{quoted(section)} cannot be the name of a section: it is empty, or has a ] or a line break")
    if section.startswith(("Include ", "Require ")):
        raise ValueError(f"{quoted(section)} cannot be the name of a section: it is a directive")
    return f"[{section}]\n"


def format_option(name: str, value: str, attributes: Mapping[str, str] | None = None) -> str:
    """The lines that set an option, wrapped if possible. Raises ValueError if the grammar cannot hold it."""
    if not name or any(c in name for c in "={\n\0") or name[0] in BLANKS + "[;#":
        raise ValueError(f"{quoted(name)} cannot be the name of an option")
    if any(c in value for c in COMMENTS + "\n\0"):
        raise ValueError(f"{quoted(value)} cannot be a value: it has one of ; | # or a line break")
    # DUNE strips one final + or - from the name, but no blanks before it: an added + protects such a name.
    left = name + "+" if name[-1] in BLANKS + "+-" else name
    left += f" {{{format_attributes(attributes)}}}" if attributes else ""
    pieces = _pieces(value.strip(BLANKS), WIDTH - len(left) - 3)
    lines = [f"{left} = {pieces[0]}".rstrip(BLANKS), *(f"    {piece}" for piece in pieces[1:])]
    if any(len(line.encode(errors="surrogateescape")) > LONGEST_LINE for line in lines):
        raise ValueError(f"{quoted(name)} has a value that is too long for a line of {LONGEST_LINE} bytes")
    return "\n".join(lines) + "\n"


def format_attributes(attributes: Mapping[str, str]) -> str:
    return ", ".join(f"{label}: {attributes[label]}" for label in sorted(attributes))


def split_list(text: str) -> list[str]:
    """The items of a comma-separated list that are not empty."""
    return [item for word in text.split(",") if (item := word.strip(BLANKS))]


def byte_sort_key(name: str) -> bytes:
    return name.encode(errors="surrogateescape")


def has_undecodable_bytes(text: str) -> bool:
    """Whether the text has bytes that are not UTF-8."""
    return not text.isascii() and any("\udc80" <= c <= "\udcff" for c in text)


def _section_lines(section: Section) -> Iterator[str]:
    yield format_header(section.name)
    for option in sorted(section.options.values(), key=lambda option: byte_sort_key(option.name)):
        try:
            if option.history:
                yield format_option(option.name, option.value, option.attributes)
            else:
                yield f"{option.name} {{{format_attributes(option.attributes)}}}\n"
        except ValueError as error:
            yield f"# {error}\n"


def _pieces(value: str, width: int) -> list[str]:
    """The value cut at single blanks, near `width`, only where the rest reads as a continuation."""
    if value.startswith("$("):
        if "{" in value or "=" in value:
            raise ValueError(f"{quoted(value)} would be read as a reference")
        return ["", value]
    words = value.split(" ")
    unsafe = max((index for index, word in enumerate(words) if "=" in word or "{" in word), default=0)
    pieces = [words[0]]
    for index, (before, word) in enumerate(pairwise(words), 1):
        single = before and word and before[-1] not in BLANKS and word[0] not in BLANKS + "["
        if single and index > unsafe and len(pieces[-1]) + len(word) >= max(width, 40):
            pieces.append(word)
        else:
            pieces[-1] += " " + word
    return pieces
