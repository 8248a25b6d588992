"""Runs vehicles and snapshots; forges these: changes parts of a real one, and gives it a correct checksum."""

import random
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.snapshot import InputJournals, SnapshotError, load
from runtime.snapshot.snapshot import FORMAT
from runtime.vehicle import Vehicle, build
from shoal.rerun import resume_snapshot

Plain = dict[str, Any]
Place = tuple[list[Any] | dict[Any, Any], Any]

OTHERS: list[Any] = [
    None,
    True,
    -1,
    0,
    2**62,
    -(2**63),
    float("nan"),
    1e300,
    "",
    "../../../escaped",
    "/tmp/escaped",
    b"",
    b"/tmp/escaped",
    [],
    [[]],
    {},
    ["again", 0],
    ["path", "../../../escaped"],
    ["path", "/tmp/escaped"],
    ["array", "|O", [1], b"12345678", True],
    ["array", "<f8", [2**40], b"", True],
    ["array", "|V0", [2**40], b"", True],
    ["int", "9" * 5000],
    ["deque", -5, []],
    ["object", "subprocess:Popen", [["args", "touch /tmp/escaped"]]],
    ["new", 10**6, "object", "tasks.transports.log_series:LogSeries", [["_root", ["path", "/tmp"]]]],
    ["new", 10**6, "object", "tasks.transports.logging:Logging", [["system_name", "../../escaped"]]],
    ["new", 10**6, "object", "runtime.kernel.kernel:Kernel", []],
    ["new", 10**6, "object", "world.sensors.imu_noise:NoiseDensity", [["__class__", ["type", "imc.messages:Goto"]]]],
    ["type", "pathlib:Path"],
    ["type", "tasks.plan.store:PlanStore"],
    ["partial", ["type", "imc.messages:Goto"], [], {}],
    ["method", ["task", "Daemon"], "offload"],
    ["method", ["task", "Daemon"], "__init__"],
    ["method", ["bus"], "attach_transport"],
    ["method", ["kernel"], "close"],
    ["method", ["task", "Transports.Logging"], "_restart"],
    ["enum", "imc.messages:CLoopsMask", "x"],
    ["struct", "imc.messages:GpsFix", [["lat", "north"]]],
    ["task", "Nobody"],
    ["timer", 10**6],
    ["ticker", "Daemon", 99],
]


def opened(state: bytes) -> Plain:
    """The content of a snapshot, as plain values that can be changed."""
    return msgspec.msgpack.decode(msgspec.msgpack.decode(state)[2])


def sealed(content: Any) -> bytes:
    """A snapshot with this content, or these bytes, and the checksum that fits."""
    data = content if isinstance(content, bytes) else msgspec.msgpack.encode(content)
    return msgspec.msgpack.encode([FORMAT, zlib.crc32(data), data])


def places(content: Any) -> Iterator[Place]:
    """Where the values of a snapshot are: container and key."""
    waiting = [content]
    while waiting:
        here = waiting.pop()
        for key in list(here) if isinstance(here, dict) else range(len(here)):
            yield here, key
            if isinstance(here[key], (list, dict)):
                waiting.append(here[key])


def forgeries(state: bytes, count: int, seed: int) -> Iterator[tuple[str, bytes]]:
    """Forged snapshots, each with a description: one value replaced, dropped, doubled or moved, or a byte changed."""
    dice = random.Random(seed)
    content = opened(state)
    found = list(places(content))
    for _ in range(count):
        here, key = dice.choice(found)
        before = here[key]
        way = dice.randrange(8)
        if way == 7:
            data = bytearray(msgspec.msgpack.encode(content))
            data[dice.randrange(len(data))] = dice.randrange(256)
            yield "a byte", sealed(bytes(data))
            continue
        if way == 6:
            other, place = dice.choice(found)
            here[key] = other[place]
        elif way == 5 and isinstance(before, list):
            here[key] = [*before, *before] if dice.random() < 0.5 else before[1:]
        else:
            here[key] = dice.choice(OTHERS)
        try:
            yield f"{key!r}: {str(before)[:60]} -> {str(here[key])[:60]}", sealed(content)
        except (msgspec.EncodeError, RecursionError, ValueError):
            continue  # it contains itself
        finally:
            here[key] = before


def texts(content: Any) -> list[Place]:
    """Where the texts are."""
    return [(here, key) for here, key in places(content) if isinstance(here[key], str)]


def running(profile: str, root: Path, seconds: float = 1.03) -> Vehicle:
    """A simulated vehicle that has run for a while, and can be saved."""
    loaded = load_profile(profile)
    clock = VirtualClock(loaded.start_time_ns)
    vehicle = build(loaded, {"Simulation"}, clock=clock, seed=1, log_root=root).vehicle
    InputJournals(vehicle)
    vehicle.start()
    vehicle.run(seconds)
    return vehicle


def outcome(state: bytes, jail: Path, seconds: float = 0.25) -> str:
    """Why a snapshot is refused; empty if its run goes on. Any other exception is raised."""
    try:
        vehicle = resume_snapshot(load(state), jail / "log")
        try:
            vehicle.run(seconds)
        finally:
            vehicle.close()
    except SnapshotError as error:
        return str(error)
    return ""
