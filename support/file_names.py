"""Names from elsewhere as names of files."""

import re

LONGEST = 100  # bytes


def file_name_of(text: str) -> str:
    """A text as the name of one file or folder: no separators, no dots in front; never empty."""
    name = re.sub(r"[^\w.+=@-]", "_", text.strip()).lstrip(".")
    return name.encode(errors="ignore")[:LONGEST].decode(errors="ignore") or "_"
