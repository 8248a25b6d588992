"""Measures a campaign on a Dask cluster of two workers on this computer: missions of ten simulated minutes with faults.

`python bench/cluster.py [RUNS]` does it there and in two processes, one after the other, in two rounds, and compares
times and rows. Times are wall time from reading the study to the data set, so that the start of all processes counts;
run it on a quiet computer. `python bench/cluster.py kills [RUNS]` kills a worker again and again meanwhile.
"""

import json
import random
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import psutil

from shoal.campaigns import CampaignResults, is_finished, load_study, run_study

MOST, ROUNDS = 1.1, 2  # ratio
SURVEY = Path(__file__).with_name("survey.study.yaml")
KILL_PERIOD = 7  # finished runs between two kills: about 20 s of two cores
Cluster = tuple[str, psutil.Process]


def main() -> int:
    kills = sys.argv[1:2] == ["kills"]
    given = sys.argv[2:] if kills else sys.argv[1:]
    runs = int(given[0]) if given else 32
    with tempfile.TemporaryDirectory() as place, cluster(Path(place)) as there:
        return disturbed(runs, Path(place), there) if kills else compared(runs, Path(place), there)


def compared(runs: int, place: Path, there: Cluster) -> int:
    took: dict[str, list[float]] = {"": [], "cluster": []}
    for number in range(ROUNDS):
        rows = {}
        for engine in took:
            started = time.perf_counter()
            study = load_study(SURVEY, runs=runs)
            folder = place / f"{engine}{number}"
            rows[engine] = comparable(run_study(study, folder, workers=2, on=there[0] if engine else ""))
            took[engine].append(time.perf_counter() - started)
        assert rows["cluster"] == rows[""], "rows differ"
        print(f"{runs} runs: {took[''][-1]:.1f} s in two processes, {took['cluster'][-1]:.1f} s on two Dask workers")
    ratio = statistics.median(there / here for here, there in zip(*took.values(), strict=True))
    print(f"the cluster takes {ratio:.2f} times as long (at most {MOST}); all rows are equal")
    return 0 if ratio <= MOST else 1


def comparable(data: CampaignResults) -> str:
    return repr([{name: value for name, value in row.items() if name != "cpu"} for row in data.counted_rows])


def disturbed(runs: int, place: Path, there: Cluster) -> int:
    """All rows have to be there, finished, and none twice."""
    journal, over, count = place / "survey" / "runs.journal", threading.Event(), [0]
    killer = threading.Thread(target=_kill, args=(there[1], journal, over, count))
    started = time.perf_counter()
    killer.start()
    try:
        data = run_study(load_study(SURVEY, runs=runs), place / "survey", on=there[0])
    finally:
        over.set()
        killer.join()
    took = time.perf_counter() - started
    lines = journal.read_text().splitlines()[1:]
    times = Counter(record["run"] for line in lines if (record := json.loads(line[9:])).get("finished"))
    finished = sum(map(is_finished, data.counted_rows))
    once = set(times) == set(range(runs)) and max(times.values()) == 1
    passed = sum(bool(row["passed"]) for row in data.counted_rows)
    print(f"{count[0]} workers killed in {took / 60:.1f} min: {finished} of {runs} rows finished, "
          f"{'none' if once else 'some'} twice or missing, {passed} passed")  # fmt: skip
    return 0 if once and finished == runs and count[0] else 1


def _kill(workers: psutil.Process, journal: Path, over: threading.Event, count: list[int]) -> None:
    chance, due = random.Random(1), KILL_PERIOD
    while not over.wait(1.0):
        if not journal.exists() or len(journal.read_bytes().splitlines()) <= due:
            continue
        if running := [child for child in workers.children() if "spawn_main" in " ".join(child.cmdline())]:
            chance.choice(running).kill()
            count[0] += 1
            due += KILL_PERIOD


@contextmanager
def cluster(folder: Path) -> Generator[Cluster]:
    """A scheduler and two workers with one thread each; gives the address, and what starts the workers."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        place = f"127.0.0.1:{probe.getsockname()[1]}"
    host, port = place.split(":")
    dask = [sys.executable, "-m", "dask"]
    quiet = {"cwd": folder, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    words = ("--nworkers", "2", "--nthreads", "1", "--local-directory", str(folder), "--no-dashboard")
    scheduler = subprocess.Popen([*dask, "scheduler", "--host", host, "--port", port, "--no-dashboard"], **quiet)
    workers = subprocess.Popen([*dask, "worker", f"tcp://{place}", *words], **quiet)
    try:
        time.sleep(8.0)  # else the start of Dask would count
        yield f"dask://{place}", psutil.Process(workers.pid)
    finally:
        for process in (workers, scheduler):
            process.terminate()
            process.wait()


if __name__ == "__main__":
    sys.exit(main())
