"""STATUSTEXT: splits long texts into chunks."""

from collections.abc import Mapping

import imc
from mavlink.dialect import Fields

CHUNK = 50
LONGEST = 200
EMERGENCY, CRITICAL, ERROR, WARNING, NOTICE, INFO, DEBUG = 0, 2, 3, 4, 5, 6, 7

Type = imc.LogBookEntry.Type
SEVERITY: Mapping[int, int] = {
    Type.INFO: INFO,
    Type.WARNING: WARNING,
    Type.ERROR: ERROR,
    Type.CRITICAL: CRITICAL,
    Type.DEBUG: DEBUG,
}


def chunks(severity: int, text: str, number: int) -> list[Fields]:
    """The STATUSTEXTs that carry `text`, cut to 200 bytes; `number` (1..65535) identifies the chunks of one text.

    A NUL ends a text at the receiver, so all chunks but the last must be full: if a character does not fit whole,
    spaces fill the chunk.
    """
    parts = _cut(text.replace("\0", " "))
    if len(parts) == 1 and len(parts[0]) <= CHUNK:
        return [{"severity": severity, "text": parts[0]}]
    return [
        {"severity": severity, "text": part, "id": number, "chunk_seq": sequence} for sequence, part in enumerate(parts)
    ]


def _cut(text: str) -> list[bytes]:
    parts = [b""]
    total = 0
    for character in text:
        piece = character.encode(errors="replace")
        total += len(piece)
        if total > LONGEST:
            break
        if len(parts[-1]) + len(piece) > CHUNK:
            parts[-1] = parts[-1].ljust(CHUNK)
            parts.append(b"")
        parts[-1] += piece
    if len(parts) > 1 and len(parts[-1]) == CHUNK:
        parts.append(b"")
    return parts
