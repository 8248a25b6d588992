"""File names from texts of others."""

import re

from support.text_length import clip_utf8

LONGEST = 100  # bytes


def file_name_part(text: str) -> str:
    """A text as part of the name of a file: no separators; at most 100 bytes."""
    return clip_utf8(_without_separators(text), LONGEST)


def file_name_of(text: str) -> str:
    """A text as the name of one file or folder: no separators, no dots in front; never empty."""
    return clip_utf8(_without_separators(text).lstrip("."), LONGEST) or "_"


def _without_separators(text: str) -> str:
    return re.sub(r"[^\w.+=@-]", "_", text.strip())
