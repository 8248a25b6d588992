"""Costs of the page in the browser beside looking: `python bench/console_jobs.py [LOG]`.

Prints the processor seconds of the flight of a plan of ten minutes (at most 8), and of a log (without LOG: an hour of
those that `make_log.py` writes) the seconds to open it, and to jump in it (at most 0.5); exits with 1 above a limit.
"""

import asyncio
import random
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from shoal.console.page_job import PageJob
from shoal.logs.log_states import LogStates

MOST_FLIGHT, MOST_JUMP = 8.0, 0.5  # s
JUMPS = 100
HOUR = 120  # MB of `make_log.py`, which are an hour and more
PLAN = """plan: "ten minutes"
maneuvers:
- goto: {lat: 41.1850°, lon: -8.7090°, depth: 2, speed: 1.2 m/s}
- goto: {lat: 41.1870°, lon: -8.7090°, depth: 3, speed: 1.2 m/s}
- goto: {lat: 41.1870°, lon: -8.7058°, depth: 2, speed: 1.2 m/s}
"""


def fly() -> float:
    """Processor seconds of the job, with the start of its process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    job = {"text": PLAN, "profile": "lauv-noptilus-1"}
    found = asyncio.run(PageJob("shoal.console.plans.plan_flight").run(job))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"flight: {spent:.2f} s of processor time; {found['text']}", flush=True)
    return spent


def jump(path: Path) -> float:
    """The longest time (s) of a jump in a log."""
    began = time.monotonic()
    states = LogStates(path)
    print(f"log: {states.duration:.0f} s, {states.path.stat().st_size / 1e6:.0f} MB")
    print(f"open: {time.monotonic() - began:.2f} s", flush=True)
    places, times = random.Random(1), list[float]()
    for _ in range(JUMPS):
        begin = time.monotonic()
        states.state_at(places.uniform(0.0, states.duration))
        times.append(time.monotonic() - begin)
    times.sort()
    print(f"jump: median {times[JUMPS // 2]:.3f} s, longest {times[-1]:.3f} s")
    states.close()
    return times[-1]


def main() -> int:
    spent = fly()
    if len(sys.argv) > 1:
        longest = jump(Path(sys.argv[1]))
    else:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "Data.lsf"
            make = [sys.executable, str(Path(__file__).with_name("make_log.py")), str(path), "--mb", str(HOUR)]
            subprocess.run([*make, "--seed", "1"], check=True)
            longest = jump(path)
    return int(spent > MOST_FLIGHT or longest > MOST_JUMP)


if __name__ == "__main__":
    sys.exit(main())
