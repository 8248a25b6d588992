"""CPU time of this version beside another one: `python bench/against_version.py PYTHON [--pairs N] [--seconds S]`.

`PYTHON` is the interpreter of an environment where the other version of Shoal is installed. Each pair flies a shipped
profile in virtual time with both versions at once on one core, so that both meet the same caches, clock rate and
neighbors, and gives a ratio of their CPU times; which one starts first alternates. Prints the median ratio of each
profile with its 95 % interval by resampling; exits with 1 where the upper end is above 1.03.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path
from subprocess import DEVNULL, Popen

import numpy as np

PROFILES = ("lauv-noptilus-1", "otter", "caravel", "hexa-00")
MOST = 1.03
REPEATS = 4000


def start(python: str, profile: str, seconds: float, folder: Path) -> Popen[bytes]:
    run = ["run", profile, "-p", "Simulation", "--clock", "virtual", "--for", f"{seconds:g}s", "--seed", "1"]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment["OPENBLAS_NUM_THREADS"] = "1"
    folder.mkdir()
    command = [python, "-m", "shoal.cli", *run]
    return Popen(command, cwd=folder, env=environment, stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL)


def cpu_time(process: Popen[bytes]) -> float:
    """Wait for the end; processor time (s) of user and system."""
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{process.args} has ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime


def ratio(profile: str, pythons: tuple[str, str], seconds: float, *, is_first: bool) -> float:
    """CPU time of the first version by that of the second."""
    with tempfile.TemporaryDirectory() as name:
        order = pythons if is_first else pythons[::-1]
        started = {each: start(each, profile, seconds, Path(name, str(order.index(each)))) for each in order}
        mine, other = (cpu_time(started[each]) for each in pythons)
    return mine / other


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("python", help="interpreter of the other version's environment")
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=300.0, help="of the vehicle, for each run")
    parser.add_argument("--profiles", nargs="+", default=PROFILES)
    words = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    pythons, slower = (sys.executable, words.python), list[str]()
    for profile in words.profiles:
        ratio(profile, pythons, 10.0, is_first=True)  # compiles
        ratios = [ratio(profile, pythons, words.seconds, is_first=number % 2 == 0) for number in range(words.pairs)]
        drawn = np.random.default_rng(1).choice(ratios, (REPEATS, len(ratios)))
        low, high = np.quantile(np.median(drawn, axis=1), [0.025, 0.975])
        print(f"{profile}: {np.median(ratios):.3f} [{low:.3f}, {high:.3f}] of {len(ratios)} pairs", flush=True)
        if high > MOST:
            slower.append(profile)
    print(f"slower: {', '.join(slower)}" if slower else "none is slower")
    return bool(slower)


if __name__ == "__main__":
    sys.exit(main())
