"""Measures what campaigns endure: a thousand runs in one process, and a process that is killed every 20 s.

`python bench/endurance.py` does both; `many` or `kills` after it only one of them. Needs /proc.
"""

import json
import multiprocessing
import os
import random
import signal
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

from shoal.campaigns import Job, ProcessPool, StudyRunner, is_finished, load_study, run_study

RUNS, MOST_GROWTH = 1000, 1.05  # of the memory, from the 100th run to the last
KILL_PERIOD, KILLED_RUNS = 20.0, 120  # s
SCENARIO = """\
scenario: out
vehicle:
  profile: lauv-noptilus-1
  plan:
    origin: 41.185°, -8.7062°
    speed: 1.2 m/s
    depth: 3 m
    maneuvers:
      - goto: {north: 60}
world: {current: {north: 0, east: 0}}
events:
  - {at: 10 s, silent: Simulators.DVL, for: 5 s}
expect:
  - {outcome: SUCCESS}
metrics:
  drift: {last: "distance(SimulatedState, EstimatedState)"}
"""
STUDY = f"""\
scenario: out.scenario.yaml
vary:
  world/current/north: {{uniform: [-0.3 m/s, 0.3 m/s]}}
runs: {KILLED_RUNS}
"""


def main() -> int:
    chosen = sys.argv[1:]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "out.scenario.yaml").write_text(SCENARIO)
        (folder / "out.study.yaml").write_text(STUDY)
        good = chosen == ["kills"] or many(folder)
        good &= chosen == ["many"] or kills(folder)
    return 0 if good else 1


def many(folder: Path) -> bool:
    """Runs of 15 simulated seconds, which begin a plan and have a fault, in one process: its memory, its files."""
    seen: dict[int, tuple[int, int]] = {}
    path = folder / "out.scenario.yaml"
    started = time.perf_counter()
    with ProcessPool(1, make_runner=StudyRunner) as pool:
        jobs = (Job(number, path, {"limit": "15 s"}, seed=number) for number in range(1, RUNS + 1))
        for job, result in pool.run(jobs):
            assert not result.error.startswith("not done"), result.error
            if job.key in (1, 10, 100, RUNS // 2, RUNS):
                [process] = multiprocessing.active_children()
                seen[int(job.key)] = _look(int(process.pid or 0))
    for number, (memory, files) in seen.items():
        print(f"after {number} runs: {memory / 1024:.0f} MiB, {files} descriptors")
    print(f"{RUNS} runs in one process: {time.perf_counter() - started:.0f} s")
    return seen[RUNS][0] <= MOST_GROWTH * seen[100][0] and seen[RUNS][1] == seen[10][1]


def _look(pid: int) -> tuple[int, int]:
    """Memory (KiB) and open descriptors of a process."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    memory = next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))
    return memory, len(os.listdir(f"/proc/{pid}/fd"))


def kills(folder: Path) -> bool:
    """The same campaign undisturbed, and with one of two processes killed every 20 s: equal rows, none twice."""
    study = load_study(folder / "out.study.yaml")
    quiet = run_study(study, folder / "quiet", workers=2)
    over, count = threading.Event(), [0]
    killer = threading.Thread(target=_kill, args=(over, count))
    killer.start()
    try:
        disturbed = run_study(study, folder / "disturbed", workers=2)
    finally:
        over.set()
        killer.join()
    cut_short = [row["run"] for row in disturbed.counted_rows if not is_finished(row)]
    if cut_short:  # hit twice: the next start does them
        print(f"{len(cut_short)} runs were hit twice, and are done when the campaign is started again: {cut_short}")
        disturbed = run_study(study, folder / "disturbed", workers=2)
    lines = (folder / "disturbed" / "runs.journal").read_text().splitlines()[1:]
    times = Counter(record["run"] for line in lines if (record := json.loads(line[9:])).get("finished"))
    bare = [
        [{key: row[key] for key in row if key != "cpu"} for row in data.counted_rows] for data in (quiet, disturbed)
    ]
    same = repr(bare[0]) == repr(bare[1])
    for one, other in zip(*bare, strict=True):
        for name in [name for name in one if repr(one[name]) != repr(other.get(name))]:
            print(f"run {one['run']}: {name} is {one[name]!r:.60} and {other.get(name)!r:.60}")
    once = set(times) == set(range(KILLED_RUNS)) and max(times.values()) == 1
    print(f"{count[0]} processes killed, one every {KILL_PERIOD:.0f} s: {len(times)} of {KILLED_RUNS} rows, "
          f"{'none' if once else 'some'} twice, {'equal' if same else 'NOT equal'}")  # fmt: skip
    return same and once and count[0] > 0


def _kill(over: threading.Event, count: list[int]) -> None:
    chance = random.Random(1)
    while not over.wait(KILL_PERIOD):
        if running := multiprocessing.active_children():
            os.kill(int(chance.choice(running).pid or 0), signal.SIGKILL)
            count[0] += 1


if __name__ == "__main__":
    sys.exit(main())
