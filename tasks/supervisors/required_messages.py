"""Reads which messages a vehicle must not miss, and counts since when they are silent."""

import imc
from runtime import ParameterError
from support.terminal_text import suggestion, with_suggestion

Loops = imc.CLoopsMask


def parse_requirement(text: str) -> tuple[str, int]:
    """Name and loops (CLoopsMask) of "Name" or "Name: LOOP LOOP". Raises ParameterError."""
    name, _, words = text.partition(":")
    name, mask = name.strip(), 0
    if name not in imc.builtin():
        reason = with_suggestion(f"there is no message {name!r}", name, imc.builtin().types)
        raise ParameterError("Required Messages", reason)
    for word in words.split():
        if word not in Loops.__members__:
            hint = suggestion(word, Loops.__members__) or "see CLoopsMask"
            raise ParameterError("Required Messages", f"there is no control loop {word!r} ({hint})")
        mask |= Loops[word].value
    return name, mask


def count_silence(required: dict[str, int], missed: dict[str, int], enabled: int, most: float) -> list[str]:
    """Count one check more without each required message; names of those that are silent for more than `most`.

    `missed` are the checks since the latest message; `enabled` are the loops (CLoopsMask), which some depend on.
    """
    for name, loops in required.items():
        if loops and not enabled & loops:
            missed[name] = 0
        elif loops or name in missed:
            missed[name] = missed.get(name, 0) + 1
    return [name for name in required if missed.get(name, 0) > most]
