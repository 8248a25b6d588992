"""Problems of files: where, how bad, and how to fix them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from support.terminal_text import printable

Severity = Literal["error", "warning", "note"]


class Origin(NamedTuple):
    """A place in a file: the file and its line, or "command line" and line 0."""

    file: str
    line: int = 0

    def __str__(self) -> str:
        return f"{printable(self.file)}:{self.line}" if self.line else printable(self.file)


@dataclass(frozen=True, slots=True)
class Finding:
    """A problem of a log or a connection: where, its meaning and its remedy; `about` is the system that has it."""

    severity: Severity
    text: str
    places: tuple[str, ...] = ()
    meaning: str = ""
    remedy: str = ""
    about: str = ""


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
class ConfigWarning:
    """An oddity that a task finds in its profile: the option, why, and the fix; no `section` means its own."""

    option: str
    text: str
    hint: str = ""
    section: str = ""


class LocatedError(ValueError):
    """A file cannot be used: `reason`, and `where` ("file:line" or the file); a subclass is for one kind of file."""

    def __init__(self, reason: str, where: object = "") -> None:
        super().__init__(f"{where}: {reason}" if where != "" else reason)
        self.reason = reason
        self.where: str = str(where)


class ProfileError(ValueError):
    """The profile cannot be used; `problems` lists why."""

    def __init__(self, problems: Sequence[Problem]):
        super().__init__("\n".join(map(str, problems)))
        self.problems: list[Problem] = list(problems)
