"""MAVLink beside pymavlink: making frames, and reading a mixed stream. The two sides of a ratio are measured in turn.

`python bench/mavlink_codec.py [--repeats 9]`
"""

import argparse
import itertools
import os
import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as upstream

from mavlink import encode, load_dialect, split

DIALECT = load_dialect()
FRAMES = 20_000
DATAGRAM = 4096

ATTITUDE = dict(time_boot_ms=123456, roll=0.1, pitch=-0.2, yaw=1.5, rollspeed=0.01, pitchspeed=0.02, yawspeed=-0.03)
POSITION = dict(
    time_boot_ms=123456, lat=411850000, lon=-87060000, alt=-5000, relative_alt=-5000, vx=100, vy=-20, vz=3, hdg=35000
)
STATUS = dict(
    onboard_control_sensors_present=0x1F, onboard_control_sensors_enabled=0x1F, onboard_control_sensors_health=0x1F,
    load=120, voltage_battery=24500, current_battery=325, battery_remaining=61, drop_rate_comm=0, errors_comm=0,
    errors_count1=0, errors_count2=0, errors_count3=0, errors_count4=0,
)  # fmt: skip
MIXED = {"ATTITUDE": ATTITUDE, "GLOBAL_POSITION_INT": POSITION, "SYS_STATUS": STATUS}


def ours(name: str, fields: dict[str, Any]) -> Callable[[], object]:
    sequence = itertools.cycle(range(256))

    def run() -> None:
        definition = DIALECT.by_name[name]
        for _ in range(FRAMES):
            encode(definition, definition.pack(dict(fields)), next(sequence), 26, 1)

    return run


def theirs(name: str, fields: dict[str, Any]) -> Callable[[], object]:
    mav = upstream.MAVLink(None, srcSystem=26, srcComponent=1)
    message = getattr(upstream, f"MAVLink_{name.lower()}_message")

    def run() -> None:
        for _ in range(FRAMES):
            message(**fields).pack(mav)

    return run


def stream() -> bytes:
    mav = upstream.MAVLink(None, srcSystem=26, srcComponent=1)
    kinds = [getattr(upstream, f"MAVLink_{name.lower()}_message")(**fields) for name, fields in MIXED.items()]
    return b"".join(itertools.islice((message.pack(mav) for message in itertools.cycle(kinds)), FRAMES))


def read_ours(data: bytes) -> None:
    count = 0
    for piece in _pieces(data):
        messages, _ = split(piece, DIALECT)
        count += len(messages)
        for message in messages:
            message.values["time_boot_ms" if message.name != "SYS_STATUS" else "load"]
    assert count == FRAMES, count


def read_theirs(data: bytes) -> None:
    mav = upstream.MAVLink(None)
    assert sum(len(mav.parse_buffer(piece) or ()) for piece in _pieces(data)) == FRAMES


def _pieces(data: bytes) -> Iterator[bytes]:
    """Datagrams of whole frames."""
    begin = 0
    while begin < len(data):
        end = begin
        while end < len(data) and end - begin < DATAGRAM:
            end += 12 + data[end + 1]
        yield data[begin:end]
        begin = end


def seconds(run: Callable[[], object]) -> float:
    began = time.process_time()
    run()
    return time.process_time() - began


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=9)
    repeats = parser.parse_args().repeats
    data = stream()
    pairs: dict[str, tuple[Callable[[], object], Callable[[], object]]] = {
        f"encode {name}": (ours(name, fields), theirs(name, fields)) for name, fields in MIXED.items()
    }
    pairs["read a mixed stream"] = (lambda: read_ours(data), lambda: read_theirs(data))
    for what, (mine, other) in pairs.items():
        turns = [(seconds(mine), seconds(other)) for _ in range(repeats)]
        ratio = statistics.median(their / our for our, their in turns)
        cost = min(our for our, _ in turns) / FRAMES * 1e6
        print(f"{what}: {ratio:.1f} x pymavlink, {cost:.2f} µs per message")
    print("load", *os.getloadavg())


if __name__ == "__main__":
    main()
