"""Texts and lists that are cut to a length."""

from collections.abc import Collection
from itertools import islice

CUT = "…"


def clip(text: str, longest: int) -> str:
    """`text`, or its beginning and … if it has more than `longest` characters."""
    return text if len(text) <= longest else text[: longest - len(CUT)] + CUT


def clip_utf8(text: str, longest: int, mark: str = "") -> str:
    """`text` cut to at most `longest` bytes of UTF-8, `mark` included, with ? for what UTF-8 cannot encode."""
    if len(text) <= longest and text.isascii():
        return text
    data = text.encode(errors="replace")
    if len(data) <= longest:
        return data.decode()
    return data[: longest - len(mark.encode())].decode(errors="ignore") + mark


def list_first(names: Collection[str], most: int, separator: str = ", ") -> str:
    """The first `most` of some names, and how many more there are: a, b and 3 more."""
    more = len(names) - most
    return separator.join(islice(names, most)) + (f" and {more} more" if more > 0 else "")
