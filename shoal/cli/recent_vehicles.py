"""The names of vehicles that commands have found, for the completion of the shell: to look for them takes too long."""

import time
from collections.abc import Iterable
from contextlib import suppress

from support.atomic_files import write_file
from support.user_folders import cache_folder

KEPT = 7 * 86400.0  # s
MOST = 200
FILE = "vehicles.txt"
LARGEST = 1 << 16  # bytes


def recent_vehicles() -> list[str]:
    """The names, the newest first; none if there is no such file, or it cannot be read."""
    return list(_read())


def remember_vehicles(names: Iterable[str]) -> None:
    """Note that these vehicles are there now. A file that cannot be written is no reason to fail."""
    now = time.time()
    known = {name: now for name in names if name and name.isprintable()}
    if not known:
        return
    merged = {**known, **{name: seen for name, seen in _read().items() if name not in known}}
    lines = [f"{seen:.0f} {name}\n" for name, seen in list(merged.items())[:MOST]]
    with suppress(OSError, RuntimeError):  # no home
        write_file(cache_folder() / FILE, "".join(lines).encode())


def _read() -> dict[str, float]:
    try:
        with (cache_folder() / FILE).open("rb") as file:
            lines = file.read(LARGEST).decode(errors="replace").splitlines()
    except (OSError, RuntimeError):  # no home
        return {}
    found: dict[str, float] = {}
    for line in lines:
        seen, _, name = line.partition(" ")
        if seen.isdecimal() and name and name.isprintable() and time.time() - float(seen) < KEPT:
            found[name] = float(seen)
    return dict(sorted(found.items(), key=lambda item: -item[1]))
