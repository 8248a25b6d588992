"""Measures a campaign on a Dask cluster of two workers on this computer, beside the same one in two processes.

`python bench/cluster.py [RUNS]` does both, one after the other, in three rounds, and compares the rows. Times are wall
time from reading the study to the data set, so that the start of all processes counts; run it on a quiet computer.
"""

import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from shoal.campaigns import DataSet, carry_out, load_study

MOST, ROUNDS = 1.1, 3  # ratio
STUDY = """\
scenario:
  scenario: rest
  vehicle: {profile: lauv-noptilus-1}
  expect:
    - {name: stays, always: SimulatedState.z < 20 m}
  limit: 60 s
vary:
  vehicle/parameters/Simulators.GPS/HACC: {uniform: [1, 5]}
"""


def main() -> int:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 48
    took: dict[str, list[float]] = {"": [], "cluster": []}
    with tempfile.TemporaryDirectory() as place, cluster(Path(place)) as address:
        path = Path(place) / "rest.study.yaml"
        path.write_text(STUDY)
        for number in range(ROUNDS):
            rows = {}
            for engine in took:
                started = time.perf_counter()
                study = load_study(path, runs=runs)
                folder = Path(place) / f"{engine}{number}"
                rows[engine] = comparable(carry_out(study, folder, workers=2, on=address if engine else ""))
                took[engine].append(time.perf_counter() - started)
            assert rows["cluster"] == rows[""], "rows differ"
            print(
                f"{runs} runs: {took[''][-1]:.1f} s in two processes, {took['cluster'][-1]:.1f} s on two Dask workers"
            )
    ratio = statistics.median(there / here for here, there in zip(*took.values(), strict=True))
    print(f"the cluster takes {ratio:.2f} times as long (at most {MOST}); all rows are equal")
    return 0 if ratio <= MOST else 1


def comparable(data: DataSet) -> str:
    return repr([{name: value for name, value in row.items() if name != "cpu"} for row in data.counted])


@contextmanager
def cluster(folder: Path) -> Generator[str]:
    """A scheduler and two workers with one thread each; gives the address."""
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
        yield f"dask://{place}"
    finally:
        for process in (workers, scheduler):
            process.terminate()
            process.wait()


if __name__ == "__main__":
    sys.exit(main())
