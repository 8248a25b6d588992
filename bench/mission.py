"""A whole mission in virtual time: cost of the full task graph, of many vehicles in one process, and equal logs.

`python bench/mission.py` prints figures for this machine; it does not pass or fail.
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
from statistics import median

import imc
from runtime.kernel import VirtualClock
from runtime.vehicle import Fleet, Vehicle
from shoal.missions import load_plan, prepare

PROFILE = "lauv-noptilus-1"
PLAN = Path(__file__).parents[1] / "tests/data/plans/three_gotos.json"
SEARCHED = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
READY = 10.0  # s until the vehicle takes a plan
START = 1_767_225_600_000_000_000  # ns, 2026-01-01T00:00:00Z


def flying(folder: Path, name: str, seed: int, fleet: Fleet) -> Vehicle:
    """A vehicle that starts the plan READY s after its own start and logs everything."""
    made = prepare(PROFILE, vehicle=name, fleet=fleet, seed=seed, log_root=folder / "log", state_folder=folder / "db")
    plan = load_plan(PLAN)
    request = imc.PlanControl(plan_id=plan.plan_id, arg=plan, request_id=1, dst=made.vehicle.system)
    fleet.kernel.after(READY, made.vehicle.daemon.publish, request)
    return made.vehicle


def together(count: int, seconds: float) -> tuple[float, float]:
    """CPU seconds and messages, each per simulated second and vehicle, of `count` vehicles together."""
    with tempfile.TemporaryDirectory() as name, Fleet(VirtualClock(START)) as fleet:
        vehicles = [flying(Path(name), f"lauv-{seed}", seed, fleet) for seed in range(count)]
        fleet.start()
        fleet.run(READY + 5.0)
        heard = sum(vehicle.bus.delivered for vehicle in vehicles)
        began = time.process_time()
        fleet.run(seconds)
        used = time.process_time() - began
        heard = sum(vehicle.bus.delivered for vehicle in vehicles) - heard
    return used / (seconds * count), heard / (seconds * count)


def leave_logs(count: int, seconds: float) -> None:
    """Run many vehicles together, and leave their logs in the current folder."""
    with Fleet(VirtualClock(START)) as fleet:
        for seed in range(count):
            flying(Path(), f"lauv-{seed}", seed, fleet)
        fleet.start()
        fleet.run(seconds)


def share(count: int, seconds: float, repeats: int) -> None:
    """Compare one vehicle with many, alternately and in new processes, so that both see the same load."""
    figures: dict[int, list[float]] = {1: [], count: []}
    for _ in range(repeats):
        for number in figures:
            with multiprocessing.get_context("spawn").Pool(1) as pool:
                figures[number].append(pool.apply(together, (number, seconds))[0])
    single, each = min(figures[1]), min(figures[count])
    print(
        f"{count} vehicles on one kernel: {each:.4f} CPU s each per simulated second, {single:.4f} for one alone, "
        f"ratio {each / single:.2f} (medians {median(figures[count]) / median(figures[1]):.2f})"
    )


def gaps() -> float:
    """Longest time (s) between two true states of a flight."""
    with tempfile.TemporaryDirectory() as name:
        times: list[float] = []
        with Fleet(VirtualClock(START)) as fleet:
            vehicle = flying(Path(name), PROFILE, 0, fleet)
            vehicle.observe(imc.SimulatedState, lambda state: times.append(state.timestamp))
            fleet.start()
            fleet.run(60.0)
    return max(later - before for before, later in itertools.pairwise(times))


def burn() -> None:
    while True:
        math.factorial(500)


def sameness(what: str, runs: int, command: list[str]) -> None:
    """Run a command several times in new processes, every second time with all cores busy, and compare its logs."""
    hashes: set[str] = set()
    for run in range(runs):
        busy = [multiprocessing.Process(target=burn, daemon=True) for _ in range((run % 2) * (os.cpu_count() or 1))]
        for process in busy:
            process.start()
        with tempfile.TemporaryDirectory() as name:
            environment = {**os.environ, "PYTHONHASHSEED": str(run), "PYTHONPATH": SEARCHED}
            subprocess.run([sys.executable, *command], check=True, cwd=name, env=environment, capture_output=True)
            logs = sorted(Path(name).glob("log/*/*/*/Data.lsf.gz"))
            hashes.add(hashlib.sha256(b"".join(gzip.decompress(log.read_bytes()) for log in logs)).hexdigest())
        for process in busy:
            process.terminate()
            process.join()
    print(f"logs of {runs} {what}, each with its own hash seed, every second under load: {len(hashes)} different")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=200.0)
    parser.add_argument("--vehicles", type=int, default=24)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--runs", type=int, default=20)
    arguments = parser.parse_args()
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    alone, rate = together(1, arguments.seconds)
    print(
        f"full task graph, all logged: {alone:.4f} CPU s per simulated second ({1 / alone:.0f}x) "
        f"at {rate:.0f} messages/s"
    )
    share(arguments.vehicles, arguments.seconds / 5.0, arguments.repeats)
    print(f"longest gap of the true state: {gaps() * 1e3:.0f} ms")
    sameness("flights", arguments.runs, ["-m", "shoal.cli", "mission", PROFILE, str(PLAN), "--seed", "1"])
    program = f"from mission import leave_logs; leave_logs({arguments.vehicles}, {READY + 30.0})"
    sameness(f"fleets of {arguments.vehicles}", arguments.runs, ["-c", program])
