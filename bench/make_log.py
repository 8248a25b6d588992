"""Writes a log with a vehicle's mix of messages: `python bench/make_log.py Data.lsf --mb 200 --seed 1`.

The same arguments give the same bytes. All numbers except the times are noise; texts, lists and plans repeat a few
examples. Messages are in the order of their times with some jitter, as if tasks in several threads had logged them.
"""

import argparse
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from fastcrc.crc16 import arc
from numpy.typing import NDArray

import imc

START = 1_767_225_600.0  # s since 1970: 2026-01-01
SYSTEM = 0x001C
LABELS = ("CPU", "AHRS", "Depth Sensor", "GPS", "Batteries", "Fin 0", "Fin 1", "Fin 2", "Motor", "Navigation", "Path")
PIECE = 200_000  # messages made at a time

NUMBERS = {  # messages per 10 s of types without text or lists
    "EstimatedState": 200,
    "Acceleration": 100,
    "AngularVelocity": 100,
    "EulerAngles": 100,
    "MagneticField": 40,
    "ServoPosition": 120,
    "SetServoPosition": 80,
    "Rpm": 60,
    "SetThrusterActuation": 40,
    "Temperature": 40,
    "Pressure": 40,
    "Depth": 40,
    "Voltage": 20,
    "Current": 20,
    "GpsFix": 10,
    "Heartbeat": 10,
    "CpuUsage": 10,
    "PathControlState": 10,
}


def others() -> dict[str, tuple[float, list[imc.Message]]]:
    """Types with text, lists or messages inside: how many per 10 s, and examples."""
    beam = imc.BeamConfig(beam_width=0.02, beam_height=0.05)
    plan = imc.PlanSpecification(
        plan_id="survey",
        start_man_id="0",
        maneuvers=[
            imc.PlanManeuver(maneuver_id=str(i), data=imc.Goto(lat=0.7, lon=-0.15, z=i, speed=1.5)) for i in range(12)
        ],
        transitions=[
            imc.PlanTransition(source_man=str(i), dest_man=str(i + 1), conditions="ManeuverIsDone") for i in range(11)
        ],
    )
    return {
        "EntityState": (30, [imc.EntityState(state=1, description=f"active {'x' * n}") for n in range(9)]),
        "Distance": (20, [imc.Distance(validity=1, beam_config=[beam], value=n) for n in range(3)]),
        "VehicleState": (10, [imc.VehicleState(op_mode=n, last_error="none" * n) for n in range(4)]),
        "PlanControlState": (10, [imc.PlanControlState(plan_id="survey", man_id=str(n)) for n in range(12)]),
        "LogBookEntry": (5, [imc.LogBookEntry(context="Navigation", text="GPS lost. " * n) for n in range(8)]),
        "SonarData": (2, [imc.SonarData(bits_per_point=8, data=bytes(range(250)) * n) for n in range(1, 4)]),
        "EntityInfo": (0.1, [imc.EntityInfo(id=n, label=label) for n, label in enumerate(LABELS)]),
        "PlanControl": (0.05, [imc.PlanControl(plan_id="survey", arg=plan), imc.PlanControl(plan_id="survey")]),
        "PlanSpecification": (0.02, [plan]),
    }


def make(path: Path, megabytes: float, seed: int) -> int:
    """Write the log, and return the number of messages."""
    random = np.random.default_rng(seed)
    mix = [(rate, [imc.builtin()[name]()]) for name, rate in NUMBERS.items()] + list(others().values())
    share = np.array([rate for rate, _ in mix])
    count, left = 0, int(megabytes * 1e6)
    with path.open("wb") as file:
        opening = imc.LoggingControl(op=1, name="20260101/000000", timestamp=START, src=SYSTEM, src_ent=1)
        left -= file.write(imc.encode(opening))
        for number, label in enumerate(LABELS):
            left -= file.write(imc.encode(imc.EntityInfo(id=number, label=label, timestamp=START, src=SYSTEM)))
            count += 1
        while left > 0:
            kinds = random.choice(len(mix), PIECE, p=share / share.sum())
            begin = START + count * 10 / share.sum()
            times = np.sort(begin + random.random(PIECE) * PIECE * 10 / share.sum())
            times += random.exponential(0.002, PIECE)
            packets = np.empty(PIECE, object)
            for number, (_, examples) in enumerate(mix):
                which = np.flatnonzero(kinds == number)
                for part, example in zip(np.array_split(which, len(examples)), examples, strict=True):
                    packets[part] = list(_packets(example, times[part], random))
            lengths = np.cumsum([len(packet) for packet in packets])
            packets = packets[: int(np.searchsorted(lengths, left)) + 1]
            left -= file.write(b"".join(packets))
            count += len(packets)
    return count + 1


def _packets(example: imc.Message, times: NDArray[np.float64], random: np.random.Generator) -> Iterator[bytes]:
    """Packets like `example` at these times; if it has only numbers, they are replaced by noise."""
    packet = imc.encode(example)
    rows = np.tile(np.frombuffer(packet, np.uint8), (times.size, 1))
    rows[:, 6:14] = times.view(np.uint8).reshape(-1, 8)
    rows[:, 14:17] = np.frombuffer(struct.pack("<HB", SYSTEM, example.ID % len(LABELS)), np.uint8)
    place = 20
    if not set(example.WIRE) & set("TRML"):
        for code in example.WIRE:
            width = struct.calcsize("<" + code)
            noise = random.standard_normal(times.size) if code in "fd" else random.integers(0, 100, times.size)
            rows[:, place : place + width] = noise.astype("<" + code).view(np.uint8).reshape(-1, width)
            place += width
    data, size = rows.tobytes(), len(packet)
    for begin in range(0, len(data), size):
        body = data[begin : begin + size - 2]
        yield body + arc(body).to_bytes(2, "little")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("path", type=Path)
    parser.add_argument("--mb", type=float, default=200.0)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    print(f"{make(arguments.path, arguments.mb, arguments.seed)} messages")


if __name__ == "__main__":
    main()
