"""Costs of computations of the page beside its vehicle: `python bench/console_beside.py [--seconds N] [--first]`.

A shipped vehicle carries out a plan in real time, first alone, then while a user tries a plan of ten minutes in
simulation, then while a forecast of 5 min is made. Prints the processor time of the flight (at most 8 s), the share of
a core of the forecast (at most 0.55) and its runs (at least 5), and by how much the longest gap between two positions
of the vehicle grows over that of the time alone (at most 20 ms); exits with 1 beyond a limit. `--first` runs the
vehicle before all other programs of a busy computer (SCHED_FIFO, for root), and what the page starts as usual. Gaps
of more than 0.1 s in the time alone show that the computer is too busy for a measurement of gaps.
"""

import argparse
import os
import re
import sys
import tempfile
import time
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from console_jobs import MOST_FLIGHT, PLAN
from console_viewers import longest_gap

from tests.outside import until
from tests.shoal.console.operator_page import OperatorPage, frame_of, vehicle_page

PROFILE = "lauv-noptilus-1"
MOST_SHARE, LEAST_RUNS, MOST_GAP = 0.55, 5, 0.02
BUSY = 0.1  # s
LONG_PLAN = 'plan: "long"\nmaneuvers:\n- goto: {lat: 41.20°, lon: -8.7090°, depth: 3, speed: 1.2 m/s}\n'
FORECAST = "shoal.console.plans.forecast_worker"
START = 3.0  # s in which a worker imports its modules, before it keeps to its share
TICK = os.sysconf("SC_CLK_TCK")


def run_first(process: int) -> None:
    """Run all threads of a process before other programs, but none that it starts."""
    for thread in Path(f"/proc/{process}/task").iterdir():
        os.sched_setscheduler(int(thread.name), os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(10))


def time_of_children(process: int) -> float:
    """Processor time (s) of the programs that a process has started and that have ended."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[13]) + int(words[14])) / TICK


def worker(process: int, module: str) -> int | None:
    """The program that runs a module for a process."""
    for thread in Path(f"/proc/{process}/task").iterdir():
        for child in (thread / "children").read_text().split():
            if module in Path(f"/proc/{child}/cmdline").read_text():
                return int(child)
    return None


def used(process: int) -> float:
    """Processor time (s) of a program."""
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / TICK


def fly(page: OperatorPage) -> float:
    """Processor time (s) of a flight."""
    before = time_of_children(page.process.pid)
    with suppress(TimeoutError):  # on a busy computer, it takes longer than a request waits
        page.request("POST", "/api/flight", {"text": PLAN, "profile": PROFILE, "vehicle": PROFILE})
    until(lambda: "percent" not in page.get("/api/flight"), 900.0, every=0.5)
    return time_of_children(page.process.pid) - before


def forecast(page: OperatorPage) -> tuple[float, int]:
    """The share of a core of a forecast, and its runs."""
    assert page.request("POST", "/api/forecast", {"vehicle": PROFILE, "horizon": 300.0})[0] == 200
    process = until(lambda: worker(page.process.pid, FORECAST), 60.0)
    time.sleep(START)
    began, before, share = time.monotonic(), used(process), 0.0
    while True:
        found = page.get(f"/api/forecast?vehicle={PROFILE}")  # while somebody asks, it goes on
        if not Path(f"/proc/{process}").exists():
            break
        share = (used(process) - before) / (time.monotonic() - began)
        assert time.monotonic() - began < 900.0, found
        time.sleep(1.0)
    print(f"forecast: {found.get('summary', found['text'])}")
    runs = re.match(r"(\d+) runs", found.get("summary", ""))
    return share, int(runs[1]) if runs else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="of the time alone")
    parser.add_argument("--first", action="store_true", help="run the vehicle before other programs")
    words = parser.parse_args()
    failed = list[str]()

    def check(name: str, value: float, least: float, most: float, unit: str) -> None:
        print(f"{name}: {value:.4g} {unit} ({least:g} to {most:g})", flush=True)
        if not least <= value <= most:
            failed.append(name)

    with tempfile.TemporaryDirectory() as name:
        options = ("--clock", "real", "--set", "Transports.Console:Forecast=true")
        with vehicle_page(Path(name), *options, profile=PROFILE) as page:
            page.log_in()
            until(lambda: frame_of(page)["vehicles"].get(PROFILE, {}).get("plan", {}).get("mode") == "service", 120.0)
            if words.first:
                run_first(page.process.pid)
            assert page.order(PROFILE, "put", text=LONG_PLAN)["ok"]
            assert page.order(PROFILE, "start", plan="long")["ok"]
            time.sleep(10.0)
            times = [time.time()]
            time.sleep(words.seconds)
            times.append(time.time())
            check("flight beside the vehicle", fly(page), 0.0, MOST_FLIGHT, "s of processor time")
            times.append(time.time())
            share, runs = forecast(page)
            times.append(time.time())
            check("share of a core of the forecast", share, 0.0, MOST_SHARE, "")
            check("runs of the forecast", runs, LEAST_RUNS, 20, "")
            time.sleep(2.0)  # the log is written
        gaps = [longest_gap(Path(name), *span) for span in pairwise(times)]
    print(f"longest gap alone: {1000.0 * gaps[0]:.0f} ms{'; THE COMPUTER IS TOO BUSY' if gaps[0] > BUSY else ''}")
    for what, gap in zip(("flight", "forecast"), gaps[1:], strict=True):
        check(f"longest gap beside the {what}", 1000.0 * (gap - gaps[0]), -1000.0, 1000.0 * MOST_GAP, "ms more")
    print("beyond its limit: " + ", ".join(failed) if failed else "all within their limits")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
