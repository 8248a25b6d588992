"""Logs whose indices are tested."""

from pathlib import Path

import imc
from imc.lsf import Log


def messages(count: int) -> list[imc.Message]:
    """Messages of several types and sizes."""
    return [
        (
            imc.Rpm(timestamp=1e9 + n / 8, value=n),
            imc.EntityState(timestamp=1e9 + n / 8, description="x" * (n % 90)),
            imc.EstimatedState(timestamp=1e9 + n / 8, depth=n),
        )[n % 3]
        for n in range(count)
    ]


def write_log(path: Path, count: int = 600) -> Path:
    """A log with damage and a packet in the other byte order."""
    packets = [imc.encode(message, "big" if n % 50 == 9 else "little") for n, message in enumerate(messages(count))]
    packets[7] = packets[7][:-1] + b"?"
    packets.insert(20, b"garbage")
    path.write_bytes(b"".join(packets))
    return path


def all_of(log: Log) -> object:
    arrays = {name: array.tobytes() for name, array in log.arrays().items()}
    return log.counts(), log.losses, arrays, list(log.objects("EntityState"))
