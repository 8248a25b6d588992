"""A whole mission in virtual time: cost of the full task graph, of many vehicles in one process, and equal logs.

`python bench/mission.py` prints figures of this machine; nothing here passes or fails.
"""

import argparse
import gzip
import hashlib
import itertools
import math
import multiprocessing
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import imc
from runtime.mission import prepare
from runtime.plans import load_plan
from runtime.script import Script
from runtime.vehicle import Vehicle

PROFILE = "lauv-noptilus-1"
PLAN = Path(__file__).parents[1] / "tests/data/plans/three_gotos.json"
READY = 10.0  # s until the vehicle takes a plan
SLICE = 1.0  # s of one vehicle before it is the next one's turn


def flying(folder: Path, seed: int) -> Vehicle:
    """A started vehicle that begins the plan after READY seconds, everything logged."""
    vehicle = prepare(PROFILE, seed=seed, log_root=folder / f"log{seed}", state_folder=folder / f"db{seed}").vehicle
    plan = load_plan(PLAN)

    async def command(script: Script) -> None:
        await script.sleep(READY)
        script.publish(imc.PlanControl(plan_id=plan.plan_id, arg=plan, request_id=1, dst=vehicle.system))

    vehicle.start()
    vehicle.kernel.soon(vehicle.daemon.run, command)
    return vehicle


def together(count: int, seconds: float) -> tuple[float, float]:
    """CPU seconds per simulated second and vehicle, and messages per simulated second of one, of `count` in turn."""
    with tempfile.TemporaryDirectory() as name:
        vehicles = [flying(Path(name), seed) for seed in range(count)]
        for vehicle in vehicles:
            vehicle.run(READY + 5.0)
        heard = sum(vehicle.bus.delivered for vehicle in vehicles)
        began = time.process_time()
        for _ in range(math.ceil(seconds / SLICE)):
            for vehicle in vehicles:
                vehicle.run(SLICE)
        used = time.process_time() - began
        heard = sum(vehicle.bus.delivered for vehicle in vehicles) - heard
        for vehicle in vehicles:
            vehicle.close()
    return used / (seconds * count), heard / (seconds * count)


def gaps() -> float:
    """Longest time (s) between two true states of a flight."""
    with tempfile.TemporaryDirectory() as name:
        vehicle, times = flying(Path(name), 0), list[float]()
        vehicle.tap(imc.SimulatedState, lambda state: times.append(state.timestamp))
        vehicle.run(60.0)
        vehicle.close()
    return max(later - before for before, later in itertools.pairwise(times))


def burn() -> None:
    while True:
        math.factorial(500)


def sameness(runs: int) -> None:
    """Fly the plan in processes of their own, half of them beside others that keep all cores busy."""
    hashes: set[str] = set()
    for run in range(runs):
        busy = [multiprocessing.Process(target=burn, daemon=True) for _ in range((run % 2) * (os.cpu_count() or 1))]
        for process in busy:
            process.start()
        with tempfile.TemporaryDirectory() as name:
            command = [sys.executable, "-m", "runtime.cli", "mission", PROFILE, str(PLAN), "--seed", "1"]
            environment = {**os.environ, "PYTHONHASHSEED": str(run)}
            subprocess.run(command, check=True, cwd=name, env=environment, capture_output=True)
            logs = sorted(Path(name).glob("log/*/*/*/Data.lsf.gz"))
            hashes.add(hashlib.sha256(b"".join(gzip.decompress(log.read_bytes()) for log in logs)).hexdigest())
        for process in busy:
            process.terminate()
            process.join()
    print(f"logs of {runs} flights, each with its hash seed, every second under load: {len(hashes)} different")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=200.0)
    parser.add_argument("--vehicles", type=int, default=24)
    parser.add_argument("--runs", type=int, default=20)
    arguments = parser.parse_args()
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    alone, rate = together(1, arguments.seconds)
    print(
        f"full task graph, all logged: {alone:.4f} CPU s per simulated second ({1 / alone:.0f}x) "
        f"at {rate:.0f} messages/s"
    )
    each, _ = together(arguments.vehicles, arguments.seconds / 10.0)
    single, _ = together(1, arguments.seconds / 10.0)
    print(
        f"{arguments.vehicles} vehicles in one process, in turn: {each:.4f} CPU s each, "
        f"{each / single:.2f} of a single one"
    )
    print(f"longest gap of the true state: {gaps() * 1e3:.0f} ms")
    sameness(arguments.runs)
