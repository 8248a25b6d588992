"""Measures campaigns: what a run costs beyond its simulation, two workers against one, memory, and a report.

`python bench/studies.py` prints all; `python bench/studies.py report` only the report of 10,000 runs. Times are wall
time by default; run it on a quiet computer.
"""

import math
import random
import resource
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

from shoal.campaigns import Job, ProcessPool, StudyRunner, campaign_html, open_results
from shoal.campaigns.jobs.result_row import pack_track
from shoal.campaigns.results.append_log import AppendLog
from shoal.campaigns.results.store import JOURNAL
from shoal.scenarios import load_document, run

MOST_OVERHEAD, LEAST_SPEEDUP = 0.060, 1.9  # s, ratio
MOST_REPORT, LARGEST_PAGE = 10.0, 5e6  # s, bytes
ROWS, POINTS, INPUTS, METRICS = 10_000, 120, 6, 8
SCENARIO = """\
scenario: rest
vehicle: {profile: lauv-noptilus-1}
expect:
  - {name: stays, always: SimulatedState.z < 20 m}
limit: 60 s
"""


def main() -> int:
    only = sys.argv[1:] == ["report"]
    with tempfile.TemporaryDirectory() as place:
        good = only or overhead(Path(place))
        good &= only or workers(Path(place))
        good &= report(Path(place))
    return 0 if good else 1


def scenario(folder: Path) -> Path:
    path = folder / "rest.scenario.yaml"
    path.write_text(SCENARIO)
    return path


def overhead(folder: Path) -> bool:
    """Reading, building and ending a run of no time; and memory over many of them in one process."""
    path, do = scenario(folder), StudyRunner()
    made = load_document(path).scenario({"limit": "0.1 s"})
    run(made)
    times, peaks = [], []
    for key in range(200):
        started = time.process_time()
        do(Job(key, path, {"limit": "0.1 s"}, seed=key))
        times.append(time.process_time() - started)
        peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    middle = sorted(times)[len(times) // 2]
    print(f"a run of 0.1 s: {middle * 1e3:.0f} ms of CPU (at most {MOST_OVERHEAD * 1e3:.0f})")
    print(f"memory after 20 and 200 runs: {peaks[19]:.0f} and {peaks[-1]:.0f} MiB")
    return middle <= MOST_OVERHEAD


def workers(folder: Path) -> bool:
    """The same jobs by one worker and by two."""
    path, took = scenario(folder), {}
    for count in (1, 2):
        with ProcessPool(count, make_runner=partial(StudyRunner)) as pool:
            list(pool.run(Job(-key, path, seed=key) for key in range(1, count + 1)))  # the processes have started
            started = time.perf_counter()
            list(pool.run(Job(key, path, seed=key) for key in range(24)))
            took[count] = time.perf_counter() - started
    print(f"two workers: {took[1] / took[2]:.2f} times one (at least {LEAST_SPEEDUP})")
    return took[1] / took[2] >= LEAST_SPEEDUP


def report(folder: Path) -> bool:
    """The page of 10,000 runs with tracks."""
    write_rows(folder)
    started, cpu = time.perf_counter(), time.process_time()
    page = campaign_html(open_results(folder), folder)
    took, cpu = time.perf_counter() - started, time.process_time() - cpu
    size = len(page.encode())
    print(f"report of {ROWS} runs: {took:.1f} s, {cpu:.1f} s of CPU (at most {MOST_REPORT:.0f}), {size / 1e6:.1f} MB")
    return took <= MOST_REPORT and size <= LARGEST_PAGE


def write_rows(folder: Path) -> None:
    chance = random.Random(1)
    names = [f"world/value{number}" for number in range(INPUTS)]
    about = {"study": "bench", "description": "", "file": "bench.study.yaml", "digest": "", "seed": 1, "runs": 0}
    about |= {
        "sampling": "random",
        "varied": dict.fromkeys(names, "uniform: [0, 1]"),
        "units": dict.fromkeys(names, ""),
    }
    about |= {"fixed": {}, "confidence": 0.95, "versions": ""}
    head = {"error": "", "reason": "", "warnings": "", "seconds": 600.0, "cpu": 1.0, "versions": "", "fingerprint": ""}
    with AppendLog(folder / JOURNAL) as journal:
        journal.append(about)
        for number in range(ROWS):
            values = [chance.random() for _ in names]
            far = 2.0 * values[0] + values[1] ** 2 + chance.gauss(0.0, 0.2)
            lat, lon, heading, track = 41.18, -8.7, 6.0 * values[2], list[float]()
            for _ in range(POINTS):
                heading += chance.gauss(0.0, 0.1)
                lat, lon = lat + 5e-5 * math.cos(heading), lon + 6e-5 * math.sin(heading)
                track += [lat, lon, 3.0]
            row = {"run": number, "seed": number, "passed": far < 2.0, "margin": 2.0 - far, **head}
            row |= {f"values.{name}": value for name, value in zip(names, values, strict=True)}
            row |= {f"metrics.m{place}": far * place + chance.random() for place in range(METRICS)}
            row |= {"margins.near": 2.0 - far, "verdicts.near": far < 2.0, "tracks.a": pack_track(track)}
            journal.append(row)


if __name__ == "__main__":
    sys.exit(main())
