"""What is wrong with a file or a name: where, how bad, and what would be right."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal, NamedTuple

Severity = Literal["error", "warning", "note"]


class Origin(NamedTuple):
    """Where something was said: a file and its line, or "command line" and line 0."""

    file: str
    line: int = 0

    def __str__(self) -> str:
        return f"{printable(self.file)}:{self.line}" if self.line else printable(self.file)


COMMAND_LINE = Origin("command line")


@dataclass(frozen=True, slots=True)
class Problem:
    """Something to know about a file: how bad, where, what, and the fix.

    An error keeps a profile or a task from working, a warning loads but hardly as meant, a note is for information.
    """

    severity: Severity
    file: str
    line: int
    text: str
    hint: str = ""

    def __str__(self) -> str:
        hint = f" ({self.hint})" if self.hint else ""
        return printable(f"{Origin(self.file, self.line)}: {self.severity}: {self.text}{hint}")


@dataclass(frozen=True, slots=True)
class Doubt:
    """What a task finds odd in its profile: an option, in its own section where none is named, why, and the fix."""

    option: str
    text: str
    hint: str = ""
    section: str = ""


class ProfileError(ValueError):
    """A profile that cannot be used; `problems` says why."""

    def __init__(self, problems: Sequence[Problem]):
        super().__init__("\n".join(map(str, problems)))
        self.problems = list(problems)


def printable(text: str) -> str:
    """`text` with control characters and bytes that are no UTF-8 as escapes, fit for a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else _escape(c) for c in text)


def nearest(word: str, words: Iterable[str]) -> str:
    """The most similar of `words`, whatever the letter case; empty where none is near."""
    candidates: dict[str, str] = {}
    for candidate in words:
        candidates.setdefault(candidate.casefold(), candidate)
    found = get_close_matches(word.strip().casefold(), candidates, 1)
    return candidates[found[0]] if found else ""


def suggestion(word: str, words: Iterable[str]) -> str:
    """A hint that names the nearest of `words`, or where there are few, all of them."""
    words = list(words)
    if near := nearest(word, words):
        return f"did you mean {quoted(near)}?"
    return f"there are {', '.join(words)}" if 0 < len(words) <= 12 else ""


def quoted(text: str) -> str:
    """`text` in quotes, fit for a terminal and for a line."""
    return f"'{printable(text if len(text) <= 80 else text[:79] + '…')}'"


def _escape(character: str) -> str:
    if "\udc80" <= character <= "\udcff":
        return f"\\x{ord(character) - 0xDC00:02x}"
    return ascii(character)[1:-1]
