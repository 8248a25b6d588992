"""A task's texts for people, as LogBookEntry messages."""

import traceback
from pathlib import Path
from typing import TYPE_CHECKING

from imc import LogBookEntry
from support.text_length import clip_utf8

if TYPE_CHECKING:
    from runtime.task.task import Task

Kind = LogBookEntry.Type
LONGEST = 1023


class Logbook:
    """Publishes LogBookEntry messages of a task; texts are cut to 1023 bytes, as in DUNE."""

    def __init__(self, task: "Task"):
        self._task = task

    def info(self, text: str) -> None:
        self._write(Kind.INFO, text)

    def warning(self, text: str) -> None:
        self._write(Kind.WARNING, text)

    def error(self, text: str) -> None:
        self._write(Kind.ERROR, text)

    def critical(self, text: str) -> None:
        self._write(Kind.CRITICAL, text)

    def debug(self, text: str) -> None:
        """Published only if the task's parameter Debug Level is Debug or more."""
        if self._task.debug_level != "None":
            self._write(Kind.DEBUG, text)

    def _write(self, kind: Kind, text: str) -> None:
        self._task.publish(
            LogBookEntry(type=kind, htime=self._task.now, context=self._task.name, text=truncate_utf8(text))
        )


def truncate_utf8(text: str) -> str:
    """`text` cut to the 1023 bytes that a text in IMC has at most."""
    return clip_utf8(text, LONGEST)


def format_exception_line(error: Exception) -> str:
    """The exception in one line."""
    return traceback.format_exception_only(error)[0].strip()


def with_location(error: Exception) -> str:
    """The exception and the innermost place in the code that raised it."""
    frames = traceback.extract_tb(error.__traceback__, limit=-1)
    where = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno} in {frames[-1].name})" if frames else ""
    return f"{format_exception_line(error)}{where}"
