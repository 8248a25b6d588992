"""Text that is safe for a terminal, and the nearest of known words."""

from collections.abc import Iterable
from difflib import get_close_matches

from support.text_length import clip


def printable(text: str) -> str:
    """`text` with control characters and non-UTF-8 bytes escaped, safe for a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else _escape(c) for c in text)


def nearest_word(word: str, words: Iterable[str]) -> str:
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


def corrected_spelling(word: str, words: Iterable[str]) -> str:
    """The one of `words` that `word` is with at most two typing errors, one if it is short; else empty.

    A typing error is a letter that is missing, added, wrong or swapped with the next. Case does not count.
    """
    near = nearest_word(word, words)
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
    if near := nearest_word(word, words):
        return f"did you mean {quoted(near)}?"
    return f"known: {', '.join(map(printable, words))}" if 0 < len(words) <= 12 else ""


def with_suggestion(reason: str, word: str, words: Iterable[str]) -> str:
    """A reason, with the hint of `suggestion` in brackets if there is one."""
    hint = suggestion(word, words)
    return f"{reason} ({hint})" if hint else reason


def quoted(text: str) -> str:
    """`text` in quotes, safe for a terminal and cut to 80 characters."""
    return f"'{printable(clip(text, 80))}'"


def _escape(character: str) -> str:
    if "\udc80" <= character <= "\udcff":
        return f"\\x{ord(character) - 0xDC00:02x}"
    return ascii(character)[1:-1]
