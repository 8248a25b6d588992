"""A whole vehicle in virtual time: simulated seconds per CPU second, equal logs, memory, time to the first state.

`python bench/vehicle.py` prints figures for this machine; it does not pass or fail. `--beside FOLDER` only compares the
vehicle of this checkout with that of another one, and with runs without a log: all take turns, so that other work on
the machine slows all of them down.
"""

import argparse
import gzip
import hashlib
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import imc

PROFILE = "lauv-noptilus-1"
HERE = Path(__file__).resolve().parent.parent
NO_LOG = ("--set", "Transports.Logging:Enabled=Never")
SILENT = '''"""Silent: a task that subscribes and publishes nothing."""

import imc
from runtime import Task, consume


class Silent(Task):
    """Subscribes to states."""

    @consume
    def hear(self, state: imc.EstimatedState) -> None:
        self.last = state
'''


def swim(
    folder: Path, seconds: float, mode: str, *more: str, hash_seed: str = "0", checkout: Path = HERE
) -> tuple[float, list[Path]]:
    """Run the profile on a virtual clock; returns CPU seconds of the whole process, and its logs."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "shoal.cli", "run", PROFILE, "-p", mode, "--clock", "virtual"]
    command += ["--for", f"{seconds}s", "--seed", "1", "--log-dir", str(folder / "log"), *more]
    environment = {**os.environ, "PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(checkout)}
    subprocess.run(command, check=True, cwd=folder, env=environment, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return used, sorted((folder / "log").glob("*/*/*/Data.lsf.gz"))


def speed(seconds: float, repeats: int, mode: str) -> None:
    best, rate = 0.0, 0.0
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as name:
            used, logs = swim(Path(name), seconds, mode)
            best, rate = max(best, seconds / used), sum(len(imc.Log(log)) for log in logs) / seconds
    print(f"{mode}, virtual, everything logged: {best:.0f} simulated seconds per CPU second at {rate:.0f} messages/s")


def sameness(seconds: float, mode: str) -> None:
    hashes: dict[str, str] = {}
    cases = {"run 1": ("0", ()), "run 2": ("0", ()), "hash seed 1": ("1", ()), "hash seed random": ("random", ())}
    cases["with an unrelated task"] = ("0", ("--set", "silent.Silent:Enabled=Always"))
    for label, (hash_seed, more) in cases.items():
        with tempfile.TemporaryDirectory() as name:
            (Path(name) / "silent.py").write_text(SILENT)
            _, logs = swim(Path(name), seconds, mode, *more, hash_seed=hash_seed)
            hashes[label] = hashlib.sha256(b"".join(gzip.decompress(log.read_bytes()) for log in logs)).hexdigest()
    print(f"{mode}: SHA-256 of Data.lsf equal over {', '.join(hashes)}: {len(set(hashes.values())) == 1}")


def compared(seconds: float, repeats: int, mode: str, other: Path | None) -> None:
    """CPU time per simulated second, without what the start takes, of runs that take turns."""
    cases: dict[str, tuple[Path, tuple[str, ...]]] = {"logged": (HERE, ()), "without a log": (HERE, NO_LOG)}
    if other is not None:
        cases["the other, logged"] = (other.resolve(), ())
    costs: dict[str, list[float]] = {label: [] for label in cases}
    for _ in range(repeats):
        for label, (checkout, more) in cases.items():
            used: list[float] = []
            for length in (1.0, 1.0 + seconds):
                with tempfile.TemporaryDirectory() as name:
                    used.append(swim(Path(name), length, mode, *more, checkout=checkout)[0])
            costs[label].append((used[1] - used[0]) / seconds)
    logged = costs.pop("logged")
    print(f"{mode}, logged: {1e3 * statistics.median(logged):.2f} ms of CPU per simulated second")
    for label, found in costs.items():
        ratio = statistics.median(a / b for a, b in zip(logged, found, strict=True))
        print(f"{mode}, {label}: {1e3 * statistics.median(found):.2f} ms; logged here / this: {ratio:.2f}")


def memory(hours: float, mode: str) -> None:
    script = (
        "import resource, sys\n"
        "from pathlib import Path\n"
        "from runtime.vehicle.builder import build\n"
        "from runtime.kernel.clock import VirtualClock\n"
        "from runtime.profile.profile import load_profile\n"
        f"profile = load_profile({PROFILE!r})\n"
        f"made = build(profile, {{{mode!r}}}, clock=VirtualClock(profile.start_time_ns), log_root=Path(sys.argv[1]))\n"
        "made.vehicle.start()\n"
        "def resident():\n"
        "    return int(Path('/proc/self/statm').read_text().split()[1]) * resource.getpagesize() / 2**20\n"
        "made.vehicle.run(60)\nfirst = resident()\n"
        f"made.vehicle.run({hours * 3600 - 60})\nlast = resident()\nmade.vehicle.close()\n"
        "print(f'{first:.1f} MiB after the first minute, {last:.1f} MiB at the end')\n"
    )
    with tempfile.TemporaryDirectory() as name:
        done = subprocess.run([sys.executable, "-c", script, name], check=True, capture_output=True, text=True)
    print(f"{mode}, {hours:g} h of virtual time: resident memory {done.stdout.strip()}")


def start(repeats: int) -> None:
    def fastest(command: list[str], until: str = "") -> float:
        times: list[float] = []
        for _ in range(repeats):
            began = time.perf_counter()
            process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            assert process.stdout is not None
            for line in process.stdout:
                if until and until in line:
                    break
            times.append(time.perf_counter() - began)
            process.terminate()
            process.wait()
        return min(times)

    numpy = fastest([sys.executable, "-c", "import numpy"])
    program = (
        "import sys; from shoal.cli import main; import imc\n"
        "from runtime.vehicle.vehicle import Vehicle\n"
        "start = Vehicle.start\n"
        "def watched(self):\n"
        "    self.observe(imc.EstimatedState, lambda _: print('first state', flush=True))\n"
        "    start(self)\n"
        "Vehicle.start = watched\n"
        f"sys.argv = ['shoal', 'run', {PROFILE!r}, '-p', 'Simulation', '--for', '2s', '--log-dir', sys.argv[1]]\n"
        "main()\n"
    )
    with tempfile.TemporaryDirectory() as name:
        state = fastest([sys.executable, "-c", program, name], "first state")
    print(
        f"shoal run to the first EstimatedState {state:.2f} s; import numpy {numpy:.2f} s; "
        f"limit (2 x numpy + 1 s) {2 * numpy + 1:.2f} s"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--hours", type=float, default=1.0)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--beside", type=Path, help="another checkout, to compare with")
    arguments = parser.parse_args()
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    if arguments.beside is not None:
        compared(arguments.seconds, arguments.repeats, "Simulation", arguments.beside)
        sys.exit()
    compared(arguments.seconds, arguments.repeats, "Simulation", None)
    for mode in ("Kinematic", "Simulation"):
        speed(arguments.seconds, arguments.repeats, mode)
        sameness(60.0, mode)
        memory(arguments.hours, mode)
    start(arguments.repeats)
