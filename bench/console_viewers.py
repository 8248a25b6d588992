"""Costs of the page in the browser beside a vehicle: `python bench/console_viewers.py [--rounds N] [--ten MINUTES]`.

In each round twelve shipped vehicles run in real time at once on one core, six with and six without
`[Transports.Console]`; each four give a ratio of processor times. Then one page looks at one vehicle, then ten. Prints
the sizes of the first load, the ratio without a viewer (upper end of the 95 % interval of the median at most 1.02), the
cost of one viewer (at most 1.5 % of a core), and of ten (5 % and 20 MB more, no gap of the kernel that is 20 ms
longer); exits with 1 above a limit.
"""

import argparse
import gzip
import os
import re
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from subprocess import DEVNULL, Popen
from threading import Thread

import numpy as np
from websockets.sync.client import ClientConnection

sys.path.insert(0, str(Path(__file__).parents[1]))

import imc
from tests.outside import ALONE
from tests.shoal.console.operator_page import OperatorPage, vehicle_page

WINDOW, IDLE_WINDOW, SETTLING, STARTS = 60.0, 40.0, 10.0, 30.0  # s
FOURS = 3
PROFILE = "lauv-noptilus-1"
UNUSED = ("Simulators.MUGDetectionCamera", "Plan.Autostart", "Monitors.HostResources")  # as `vehicle_page`
MOST_LOAD, MOST_JAVASCRIPT = 300_000, 80_000  # bytes
MOST_IDLE, MOST_ONE, MOST_TEN, MOST_MEMORY, MOST_GAP = 1.02, 0.015, 0.05, 20.0, 0.02
REPEATS = 2000


def cpu_time(process: int) -> float:
    """Processor time (s) of a process, all threads, to a nanosecond."""
    return sum(int(path.read_text().split()[0]) / 1e9 for path in Path(f"/proc/{process}/task").glob("*/schedstat"))


def share_core(processes: list[int]) -> None:
    """Let all threads of the processes run on one core: on two, one of them may be a third slower."""
    core = min(os.sched_getaffinity(0))
    for process in processes:
        for thread in Path(f"/proc/{process}/task").iterdir():
            os.sched_setaffinity(int(thread.name), {core})


def idle_ratios(folder: Path) -> list[float]:
    """Ratios of processor times with and without a page that nobody looks at.

    Of vehicles that begin to work at one moment the first ones wait for memory, which the others find in the cache:
    of each four, the first and the last have the page.
    """
    with ExitStack() as stack:
        with_page, without = list[int](), list[int]()
        for number in range(4 * FOURS):
            has_page = number % 4 in (0, 3)
            vehicle = stack.enter_context(unwatched_vehicle(folder / str(number), has_page=has_page))
            (with_page if has_page else without).append(vehicle)
        share_core([*with_page, *without])
        time.sleep(STARTS)
        found = np.array(rates([*with_page, *without], IDLE_WINDOW)).reshape(2, FOURS, 2).sum(axis=2)
    return list(found[0] / found[1])


def memory(process: int) -> float:
    """Resident memory (MB)."""
    found = re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{process}/status").read_text())
    assert found is not None
    return int(found[1]) / 1000.0


@contextmanager
def unwatched_vehicle(folder: Path, *, has_page: bool) -> Iterator[int]:
    """A vehicle at which nobody looks, in a process of its own; its id."""
    folder.mkdir()
    off = [*ALONE, *(f"{name}:Enabled=Never" for name in UNUSED)]
    page = next(each for each in off if "Console" in each)
    off[off.index(page)] = "Transports.Console:Port=0" if has_page else page
    command = [sys.executable, "-m", "shoal.cli", "run", PROFILE, "-p", "Simulation", "--clock", "real"]
    command += [word for setting in off for word in ("--set", setting)]
    with (
        (folder / "output").open("w") as output,
        Popen(command, cwd=folder, stdin=DEVNULL, stdout=output, stderr=output) as process,
    ):
        try:
            yield process.pid
        finally:
            process.terminate()


def rates(processes: list[int], seconds: float) -> list[float]:
    """Processor time of each process per second."""
    before, began = [cpu_time(each) for each in processes], time.monotonic()
    time.sleep(seconds)
    took = time.monotonic() - began
    return [(cpu_time(each) - old) / took for each, old in zip(processes, before, strict=True)]


@contextmanager
def viewers(page: OperatorPage, count: int) -> Iterator[list[int]]:
    """Pages that look and take each frame; the numbers of frames that they have taken."""
    taken = [0] * count
    with ExitStack() as stack:
        for number in range(count):
            frames = page.frames(max_size=None)
            stack.callback(frames.close)

            def take(number: int = number, frames: ClientConnection = frames) -> None:
                for _ in frames:
                    taken[number] += 1

            Thread(target=take, daemon=True).start()
        yield taken


def interval(ratios: list[float]) -> tuple[float, float]:
    """The 95 % interval of the median, by resampling."""
    drawn = np.random.default_rng(1).choice(ratios, (REPEATS, len(ratios)))
    low, high = np.quantile(np.median(drawn, axis=1), [0.025, 0.975])
    return float(low), float(high)


def first_load(page: OperatorPage) -> tuple[int, int]:
    """Bytes that are sent for the page with all its files, and those of our own JavaScript."""
    index = page.request("GET", "/")[1]
    sent = len(gzip.compress(index))
    waiting, sizes = re.findall(r'(?:href|src)="/files/([^"]+)"', index.decode()), dict[str, int]()
    own = 0
    while waiting:
        name = waiting.pop()
        if name in sizes:
            continue
        status, data, _ = page.request("GET", f"/files/{name}")
        assert status == 200, name
        sizes[name] = len(page.request("GET", f"/files/{name}", **{"Accept-Encoding": "gzip"})[1])
        if name.endswith(".js") and name not in ("leaflet.js", "uplot.js"):
            own += len(data)
            waiting += re.findall(r'from "\./([^"]+)"', data.decode())
    return sent + sum(sizes.values()), own


def longest_gap(folder: Path, begin: float, end: float) -> float:
    """The longest time (s) between two positions of the vehicle in its logs, between two times."""
    logs = [imc.Log(each.parent) for each in folder.rglob("Data.lsf*")]
    times = [message.timestamp for log in logs for message in log.messages("EstimatedState")]
    inside = np.sort([each for each in times if begin <= each <= end])
    return float(np.diff(inside).max())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7, help="rounds of three ratios without a viewer")
    parser.add_argument("--ten", type=float, default=10.0, help="minutes with ten viewers")
    words = parser.parse_args()
    failed = list[str]()

    def check(name: str, value: float, most: float, unit: str) -> None:
        print(f"{name}: {value:.4g} {unit} (at most {most:g})", flush=True)
        if value > most:
            failed.append(name)

    with tempfile.TemporaryDirectory() as name:
        ratios = list[float]()
        for number in range(words.rounds):
            place = Path(name, f"idle-{number}")
            place.mkdir()
            ratios += idle_ratios(place)
        low, high = interval(ratios)
        print(f"no viewer: {statistics.median(ratios):.4f} of the time without the page [{low:.4f}, {high:.4f}]")
        check("no viewer, upper end", high, MOST_IDLE, "")
        folder = Path(name, "watched")
        folder.mkdir()
        with vehicle_page(folder, "--clock", "real", profile=PROFILE) as page:
            page.log_in()
            time.sleep(SETTLING)
            load, own = first_load(page)
            check("first load", load, MOST_LOAD, "bytes")
            check("own JavaScript", own, MOST_JAVASCRIPT, "bytes")
            vehicle = page.process.pid
            share_core([vehicle])
            time.sleep(SETTLING)
            quiet = rates([vehicle], WINDOW)[0]
            before = time.time()
            with viewers(page, 1) as taken:
                time.sleep(2.0)
                begin, frames = time.monotonic(), taken[0]
                one = rates([vehicle], WINDOW)[0]
                rate = (taken[0] - frames) / (time.monotonic() - begin)
                size = memory(vehicle)
            print(f"one viewer gets {rate:.1f} frames/s; the vehicle alone takes {100 * quiet:.2f} % of a core")
            check("one viewer", one - quiet, MOST_ONE, "of a core")
            middle = time.time()
            with viewers(page, 10) as taken:
                ten = rates([vehicle], 60.0 * words.ten)[0]
                check("ten viewers' memory", memory(vehicle) - size, MOST_MEMORY, "MB more")
                print(f"each of ten viewers got {min(taken)} to {max(taken)} frames")
            check("ten viewers", ten - one, MOST_TEN, "of a core more")
            end = time.time()
        gaps = [longest_gap(folder, *times) for times in ((before - 60.0, before), (middle, end))]
        check("ten viewers' longest gap of the kernel", gaps[1] - gaps[0], MOST_GAP, "s more than without")
    print("above its limit: " + ", ".join(failed) if failed else "all within their limits")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
