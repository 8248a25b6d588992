"""Reads an ini file and its includes as DUNE does, but reports what DUNE accepts silently; writes ini files."""

import os
import stat
from collections.abc import Iterable, Mapping
from pathlib import Path

from runtime.profile.config import BLANKS, LONGEST_LINE, Config, format_sections
from runtime.profile.ini_line_reader import LineReader
from support.atomic_files import write_file
from support.diagnostics import Origin, Problem

DUNE_LINE = 1023  # bytes; DUNE takes the rest of a longer line as the next one
LARGEST_FILE = 2 << 20  # bytes
DEEPEST = 64
MOST_FILES = 1000
MOST_ERRORS = 20  # in one file


def read_config(path: str | Path, config: Config | None = None, shared: Iterable[Path] = ()) -> Config:
    """Read a file and what it includes, on top of `config` if given. Never raises: see `Config.problems`.

    An included file that is not found at its path is taken from the first of the folders `shared` that has it.
    A line with an error is skipped. A file that cannot be read is an error.
    """
    config = Config() if config is None else config
    reader = _Reader(config, shared)
    path = str(path)
    try:
        reader.read(path, Origin(path), included=False)
    except (OSError, ValueError) as error:
        reader.report(Problem("error", path, 0, f"the file cannot be read: {_reason(error)}"))
    return config


def write_sections(path: Path, sections: Mapping[str, Mapping[str, str]]) -> None:
    """Replace a file with these texts: a crash, even of the computer, leaves the complete old or new file.

    Raises OSError, and ValueError if the grammar cannot hold a name or a text.
    """
    data = format_sections(sections).encode("utf-8", errors="surrogateescape")
    write_file(path, data)


def read_sections(path: str | Path) -> dict[str, dict[str, str]]:
    """The values of a file as plain texts by section and option; empty if there is no such file."""
    if not Path(path).exists():
        return {}
    return {
        name: {option.name: option.value for option in section.options.values() if option.history}
        for name, section in read_config(path).sections.items()
    }


class _Abandoned(Exception):
    """A file that an included file requires is missing: the rest of the included file is skipped."""


class _Reader:
    """Reads files depth first, each as often as it is included, with limits on number and depth."""

    def __init__(self, config: Config, shared: Iterable[Path]):
        self._config = config
        self._shared = tuple(dict.fromkeys(shared))
        self._reported = set(config.problems)
        self._chain: dict[str, str] = {}
        self._count = 0

    def report(self, problem: Problem) -> None:
        """Keep a problem; a file that is read twice reports its problems once."""
        if problem not in self._reported:
            self._reported.add(problem)
            self._config.problems.append(problem)

    def read(self, path: str, asked: Origin, *, included: bool) -> None:
        """Read one file; `asked` is the place of its directive. Raises OSError if it cannot be read."""
        real = os.path.realpath(path)
        if real in self._chain:
            chain = " → ".join([*self._chain.values(), path])
            self.report(
                Problem("error", *asked, f"the files include each other in a circle: {chain}", "remove this line")
            )
            return
        if len(self._chain) >= DEEPEST:
            self.report(
                Problem("error", *asked, f"files include each other more than {DEEPEST} deep; {path} is not read")
            )
            return
        self._count += 1
        if self._count > MOST_FILES:
            if self._count == MOST_FILES + 1:
                self.report(Problem("error", *asked, f"more than {MOST_FILES} files are included; {path} is not read"))
            return
        data = _contents(path)
        self._config.files.append(path)
        self._chain[real] = path
        lines = LineReader(
            self._config, path, self.report, lambda name, required: self._include(lines, name, required, included)
        )
        try:
            self._read_lines(lines, data)
        finally:
            del self._chain[real]
            if lines.raw:
                more = f" (and on {len(lines.raw) - 1} more lines)" if len(lines.raw) > 1 else ""
                text = f"bytes that are not UTF-8{more} are kept as they are"
                self.report(Problem("warning", path, lines.raw[0], text, "save the file as UTF-8"))

    def _read_lines(self, lines: LineReader, data: bytes) -> None:
        path = lines.origin.file
        if data.startswith((b"\xff\xfe", b"\xfe\xff")):
            self.report(Problem("error", path, 1, "the file is UTF-16", "save it as UTF-8"))
            return
        if data.startswith(b"\xef\xbb\xbf"):
            data = data[3:]
            self.report(Problem("warning", path, 1, "a byte-order mark, which DUNE takes as text", "save it without"))
        for number, line in enumerate(data.split(b"\n"), 1):
            text = line.strip(BLANKS.encode())
            if not text or text[0] in b";#":
                continue
            if reason := _unfit(text):
                lines.errors += 1
                self.report(Problem("error", path, number, *reason))
            else:
                if len(text) > DUNE_LINE:
                    warning = (
                        f"the line has {len(text)} bytes; DUNE reads {DUNE_LINE} and takes the rest as the next line"
                    )
                    self.report(Problem("warning", path, number, warning, "continue the text on the next line"))
                lines.read_line(number, text.decode(errors="surrogateescape"))
            if lines.errors >= MOST_ERRORS:
                self.report(Problem("error", path, number, f"{MOST_ERRORS} errors in this file; the rest is not read"))
                return

    def _include(self, lines: LineReader, name: str, required: bool, included: bool) -> None:
        """A missing file is a warning for [Include], an error for [Require] unless an [Include] led here."""
        path = _tidy(f"{os.path.dirname(lines.origin.file) or '.'}/{name}")
        if not os.path.exists(path):
            path = next((_tidy(str(each / name)) for each in self._shared if os.path.exists(each / name)), path)
        hint = "the path is relative to the folder of this file" if name[:1] in ("/", "~") or "$" in name else ""
        try:
            self.read(path, lines.origin, included=included or not required)
        except OSError as error:
            text = f"{path} cannot be read: {_reason(error)}"
            if self._shared and isinstance(error, FileNotFoundError):
                text += f"; searched also in {', '.join(map(str, self._shared))}"
            if not required:
                lines.report_warning(f"{text}; nothing is included", hint)
            elif not included:
                lines.report_error(f"{text}, and it is required", hint)
            else:
                lines.report_warning(f"{text}; the rest of this included file is skipped, as in DUNE", hint)
                raise _Abandoned from None
        except _Abandoned:
            if required:
                raise


def _unfit(line: bytes) -> tuple[str, str] | None:
    if b"\0" in line:
        return "a NUL byte", "is this a text file?"
    if len(line) > LONGEST_LINE:
        return f"the line has {len(line)} bytes; {LONGEST_LINE} are allowed", "continue the text on the next line"
    return None


def _contents(path: str) -> bytes:
    """The bytes of a file. Raises OSError if it is not a regular file or larger than `LARGEST_FILE`."""
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode):
        raise OSError("it is a folder" if stat.S_ISDIR(status.st_mode) else "it is not a regular file")
    if status.st_size > LARGEST_FILE:
        raise OSError(f"it has {status.st_size} bytes; {LARGEST_FILE} are allowed")
    with open(path, "rb") as file:
        return file.read(LARGEST_FILE)


def _tidy(path: str) -> str:
    """The path without a/../, if that is the same file: a may be a symbolic link."""
    tidy = os.path.normpath(path)
    return tidy if os.path.realpath(tidy) == os.path.realpath(path) else path


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
