"""Problems of files and names: where, how bad, and how to fix them."""

import os
from collections.abc import Generator, Iterable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal, NamedTuple

Severity = Literal["error", "warning", "note"]


class Origin(NamedTuple):
    """A place in a file: the file and its line, or "command line" and line 0."""

    file: str
    line: int = 0

    def __str__(self) -> str:
        return f"{printable(self.file)}:{self.line}" if self.line else printable(self.file)


COMMAND_LINE = Origin("command line")


@dataclass(frozen=True, slots=True)
class Problem:
    """A problem of a file: how bad, where, what, and the fix.

    An error stops a profile or a task from working; a warning loads, but probably not as intended; a note informs.
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
    """Something odd that a task finds in its profile: the option, why, and the fix; no `section` means its own."""

    option: str
    text: str
    hint: str = ""
    section: str = ""


class ProfileError(ValueError):
    """The profile cannot be used; `problems` lists why."""

    def __init__(self, problems: Sequence[Problem]):
        super().__init__("\n".join(map(str, problems)))
        self.problems = list(problems)


def printable(text: str) -> str:
    """`text` with control characters and non-UTF-8 bytes escaped, safe for a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else _escape(c) for c in text)


def of_file(error: OSError, place: object = "") -> str:
    """A file and what is wrong with it, without the error number; `place` if the error names no file."""
    return ": ".join(str(part) for part in (error.filename or place, error.strerror or error) if part != "")


@contextmanager
def naming(path: object) -> Generator[None]:
    """Adds the path that is being written to an error of the operating system without one, as that of a full disk.

    An error with two paths, of a copy, names the one that is read.
    """
    try:
        yield
    except OSError as error:
        if error.filename is not None and error.filename2 is None:
            raise
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise OSError(error.errno, reason, str(path)) from error


def nearest(word: str, words: Iterable[str]) -> str:
    """The most similar of `words`, ignoring case; empty if none is close.

    Of names with a group, such as Simulators.IMU/AHRS, those of the same group are compared by what follows it.
    """
    candidates: dict[str, str] = {}
    for candidate in words:
        candidates.setdefault(candidate.casefold(), candidate)
    group, dot, rest = word.strip().casefold().partition(".")
    inside = {name.partition(".")[2]: name for name in candidates if dot and name.startswith(f"{group}.")}
    for short, name in list(inside.items()):
        inside.setdefault(short.partition("/")[0], name)
    if inside:
        found = [inside[name] for name in get_close_matches(rest, inside, 1)]
    else:
        found = get_close_matches(f"{group}{dot}{rest}", candidates, 1)
    return candidates[found[0]] if found else ""


def misspelled(word: str, words: Iterable[str]) -> str:
    """The one of `words` that `word` is with at most two typing errors, one if it is short; else empty.

    A typing error is a letter that is missing, added, wrong or swapped with the next. Case does not count.
    """
    near = nearest(word, words)
    allowed = 2 if len(word) > 5 else 1
    return near if near and _typing_errors(word.strip().casefold(), near.casefold()) <= allowed else ""


def _typing_errors(a: str, b: str) -> int:
    """The distance of Damerau and Levenshtein between two words, with swaps of neighbors only."""
    before: list[int] = []
    row = list(range(len(b) + 1))
    for i, letter in enumerate(a, 1):
        above, row = row, [i]
        for j, other in enumerate(b, 1):
            least = min(above[j] + 1, row[j - 1] + 1, above[j - 1] + (letter != other))
            if i > 1 and j > 1 and letter == b[j - 2] and a[i - 2] == other:
                least = min(least, before[j - 2] + 1)
            row.append(least)
        before = above
    return row[-1]


def suggestion(word: str, words: Iterable[str]) -> str:
    """A hint with the nearest of `words`, or all of them if there are at most 12."""
    words = list(words)
    if near := nearest(word, words):
        return f"did you mean {quoted(near)}?"
    return f"known: {', '.join(map(printable, words))}" if 0 < len(words) <= 12 else ""


def hinted(reason: str, word: str, words: Iterable[str]) -> str:
    """A reason, with the hint of `suggestion` in brackets if there is one."""
    hint = suggestion(word, words)
    return f"{reason} ({hint})" if hint else reason


def quoted(text: str) -> str:
    """`text` in quotes, safe for a terminal and cut to 80 characters."""
    return f"'{printable(text if len(text) <= 80 else text[:79] + '…')}'"


def _escape(character: str) -> str:
    if "\udc80" <= character <= "\udcff":
        return f"\\x{ord(character) - 0xDC00:02x}"
    return ascii(character)[1:-1]
