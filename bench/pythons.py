"""Hashes of the logs of missions of all shipped vehicles in virtual time, to compare interpreters, NumPys and machines.

Prints a line for each vehicle: its name and the SHA-256 of the logs of its mission. `.ci/pythons` runs it with each
Python that it finds and compares.
"""

import gzip
import hashlib
import sys
import tempfile
from pathlib import Path

from shoal import fly
from shoal.missions import parse_plan

AUV = """
plan: auv
origin: 41.185°, -8.7062°
speed: 1.2 m/s
depth: 2
maneuvers:
  - goto: {north: 40}
  - loiter: {north: 60, east: 20, radius: 15, duration: 60s}
  - rows: {north: 60, east: 60, width: 40, length: 40, hstep: 20, bearing: 20°, coff: 10}
  - yo_yo: {north: 20, east: 80, depth: 3, amplitude: 1, pitch: 10°}
  - follow_path: {north: 0, east: 60, points: [[0, 0, 0], [20, 20, 0], [0, 40, 0]]}
  - pop_up: {north: 0, east: 0, duration: 20}
  - station_keeping: {north: 0, east: 0, depth: 0, radius: 15, duration: 30}
"""
BOAT = """
plan: boat
origin: 41.185°, -8.7062°
speed: 1.2 m/s
maneuvers:
  - goto: {north: 40}
  - goto: {north: 40, east: 30}
  - loiter: {north: 60, east: 20, radius: 15, duration: 60s}
  - station_keeping: {north: 20, east: 20, radius: 15, duration: 30}
"""
MULTIROTOR = """
plan: multirotor
origin: 41.185°, -8.7062°
speed: 5 m/s
altitude: 20
maneuvers:
  - takeoff: {altitude: 10, speed: 2 m/s}
  - goto: {north: 40}
  - loiter: {north: 0, radius: 15, duration: 30}
  - land: {}
"""
MISSIONS = {"lauv-noptilus-1": AUV, "otter": BOAT, "caravel": BOAT, "hexa-00": MULTIROTOR}


def digest(vehicle: str, keep: Path | None) -> str:
    """The hash of the logs of a vehicle's mission; raises if it is not completed."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = keep / vehicle if keep else Path(temporary)
        report = fly(parse_plan(MISSIONS[vehicle]), vehicle, seed=1, limit=1800, log_root=folder)
        if not report.completed:
            raise SystemExit(f"{vehicle}: {report.reason}")
        logs = sorted(folder.rglob("Data.lsf.gz"))
        return hashlib.sha256(b"".join(gzip.decompress(log.read_bytes()) for log in logs)).hexdigest()


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    for name in MISSIONS:
        print(name, digest(name, folder), flush=True)
