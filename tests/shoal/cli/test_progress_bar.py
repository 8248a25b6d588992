"""Progress is shown on a terminal only."""

import io

from rich.console import Console
from rich.progress import MofNCompleteColumn

from shoal.cli.progress_bar import ProgressBar


def shown(*, terminal: bool) -> str:
    text = io.StringIO()
    console = Console(file=text, force_terminal=terminal, width=100)
    with ProgressBar("reading [a]", 4, amount=MofNCompleteColumn(), console=console) as bar:
        assert bar.is_live == terminal
        bar.show(1)
        bar.print("note: a [line]")
        bar.show(3, "again", 5)
    return text.getvalue()


def test_a_terminal_shows_what_is_done_and_lines_above_it() -> None:
    text = shown(terminal=True)
    assert "reading [a]" in text
    assert "note: a [line]" in text
    assert "again" in text.rpartition("note")[2]
    assert "3/5" in text


def test_a_pipe_gets_the_lines_alone() -> None:
    assert shown(terminal=False) == "note: a [line]\n"
