"""A bar that shows the progress of a command."""

from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn


class ProgressBar:
    """A bar within its `with` block, on stderr or another `console`, if that is a terminal (`is_live`).

    `what` it shows, and how much of `total` is done: as a share, or as `amount` shows it.
    """

    def __init__(
        self,
        what: str,
        total: float = 1.0,
        *,
        amount: ProgressColumn | None = None,
        console: Console | None = None,
    ):
        console = Console(stderr=True) if console is None else console
        self.is_live: bool = console.is_terminal
        columns = (TextColumn("{task.description}", markup=False), BarColumn(), amount or TaskProgressColumn())
        self._progress = Progress(
            *columns, TimeRemainingColumn(), console=console, transient=True, disable=not self.is_live
        )
        self._task = self._progress.add_task(what, total=total)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def show(self, done: float, what: str | None = None, total: float | None = None) -> None:
        """Show how much is done; and from now on another `what` and `total`."""
        self._progress.update(self._task, completed=done, description=what, total=total)

    def print(self, text: str) -> None:
        """Print a line above the bar, also without a terminal."""
        self._progress.console.print(text, markup=False, highlight=False, soft_wrap=True)
