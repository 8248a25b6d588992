"""Elements of an HTML page: sections, tables, tiles, escaped text."""

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from support.terminal_text import printable
from support.text_length import clip

LONGEST_TEXT = 400  # characters


def html_section(title: str, content: str, words: str = "") -> str:
    """A part of the page with a title and some words, nothing without content."""
    note = f'<p class="none">{escape_text(words)}</p>' if words else ""
    return f"<section><h2>{escape_text(title)}</h2>{note}{content}</section>" if content else ""


def html_table(
    heads: Sequence[str], lines: Iterable[Sequence[str]], *, numbers: Iterable[int] = (), as_is: bool = False
) -> str:
    """A table of texts, with the columns `numbers` to the right; with `as_is` the cells are HTML already."""
    right = set(numbers)

    def cells(words: Sequence[str], tag: str, is_safe: bool) -> str:
        kinds = (' class="n"' if place in right else "" for place in range(len(words)))
        return "".join(
            f"<{tag}{kind}>{word if is_safe else escape_text(word)}</{tag}>"
            for kind, word in zip(kinds, words, strict=True)
        )

    body = "".join(f"<tr>{cells(line, 'td', as_is)}</tr>" for line in lines)
    return f'<div class="scroll"><table><tr>{cells(heads, "th", False)}</tr>{body}</table></div>'


def html_tiles(tiles: Iterable[tuple[str, str, str]]) -> str:
    """Figures, each with its meaning below: value, words, and "bad", "fair" or nothing."""
    drawn = (
        f'<div class="tile {kind}"><b>{escape_text(value)}</b><span>{escape_text(words)}</span></div>'
        for value, words, kind in tiles
    )
    return f'<div class="tiles">{"".join(drawn)}</div>'


def short_number(value: Any) -> str:
    """A value with a readable number of digits."""
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def escape_text(value: Any) -> str:
    """A text that can stand in HTML, with visible control characters, cut if it is long."""
    return escape(printable(cut_text(str(value))))


def cut_text(text: str) -> str:
    """A text, cut to at most LONGEST_TEXT characters."""
    return clip(text, LONGEST_TEXT)
