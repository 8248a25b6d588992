"""Names from elsewhere as names of files."""

import re

from support.text_length import clip_utf8

LONGEST = 100  # bytes


def file_name_part(text: str) -> str:
    """A text as part of the name of a file: no separators; at most 100 bytes."""
    return clip_utf8(re.sub(r"[^\w.+=@-]", "_", text.strip()), LONGEST)


def file_name_of(text: str) -> str:
    """A text as the name of one file or folder: no separators, no dots in front; never empty."""
    return file_name_part(text.strip().lstrip(".")) or "_"
