"""Costs of the page in the browser beside looking: `python bench/console_jobs.py [LOG]`.

Prints the processor seconds of the flight of a plan of ten minutes (at most 8), and of a log (without LOG: an hour of
those that `make_log.py` writes, and more) those to open it, and to jump in it (at most 0.5), each with the time that it
took; exits with 1 above a limit.
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
    """The longest processor time (s) of a jump in a log."""
    began, before = time.monotonic(), time.process_time()
    states = LogStates(path)
    print(f"log: {states.duration:.0f} s, {states.path.stat().st_size / 1e6:.0f} MB")
    print(f"open: {time.process_time() - before:.2f} s of processor time, {time.monotonic() - began:.2f} s", flush=True)
    places, spent, times = random.Random(1), list[float](), list[float]()
    for _ in range(JUMPS):
        begin, before = time.monotonic(), time.process_time()
        states.state_at(places.uniform(0.0, states.duration))
        spent.append(time.process_time() - before)
        times.append(time.monotonic() - begin)
    for name, each in (("jump, processor time", spent), ("jump", times)):
        each.sort()
        print(f"{name}: median {each[JUMPS // 2]:.3f} s, longest {each[-1]:.3f} s")
    states.close()
    return spent[-1]


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
