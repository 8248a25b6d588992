"""Kills a vehicle at random moments, and counts what its log lacks beyond the flush interval.

`python bench/kills.py [--count 40] [--seed 1]`: each run is ended by SIGKILL within seconds after it has begun to
record. Exit status 1 if a message that was published before the last flush is missing, or a log does not open.
"""

import argparse
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import imc
from runtime.logs import logs_of_run, missing_logs

COMMAND = [sys.executable, "-m", "shoal.cli", "run", "otter", "-p", "Simulation", "--for", "60s", "--bus", "inprocess"]
FLUSH = 1.0  # s
PATIENCE = 60.0  # s until the log begins
SLACK = 0.5  # s, for a flush that comes late


def killed(folder: Path, after: float) -> float:
    """Start a vehicle, kill it `after` seconds after its log has begun; returns when (s since 1970)."""
    options = ["--set", f"Transports.Logging:Flush Interval={FLUSH:g}", "--log-dir", str(folder / "log")]
    child = subprocess.Popen([*COMMAND, *options], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        deadline = time.monotonic() + PATIENCE
        while not list(folder.glob("log/*/*/*/Data.lsf.gz")) and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(after)
    finally:
        moment = time.time()
        child.send_signal(signal.SIGKILL)
        child.wait()
    return moment


def lacks(folder: Path, moment: float) -> tuple[str, float]:
    """Errors in the log of a run that was killed at `moment`, empty without any; and the s that it lacks."""
    first = next(iter(sorted(folder.glob("log/*/*/*"))), None)
    if first is None:
        return "no log", 0.0
    run = logs_of_run(first)
    if missing_logs(run) or len(run) != len(list(folder.glob("log/*/*/*"))):
        return "a log of the run is missing", 0.0
    logs = [imc.Log(log, keep_index=False) for log in run]
    times = [state.timestamp for log in logs for state in log.messages(imc.SimulatedState)]
    began = next((message.timestamp for message in logs[0].messages()), moment)
    if moment - began < FLUSH + SLACK and not times:
        return "", moment - began
    missing = moment - max(times, default=began)
    if missing > FLUSH + SLACK:
        return f"the last {missing:.2f} s are missing", missing
    # A late tick on a wall clock is no loss: what counts is that no stretch of a flush interval is missing.
    gap = float(np.diff(times).max(initial=0.0))
    return f"a gap of {gap:.2f} s" if gap > 0.9 * FLUSH else "", missing


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    dice, bad, longest = random.Random(options.seed), 0, 0.0
    for number in range(options.count):
        after = dice.uniform(0.0, 3.5)
        with tempfile.TemporaryDirectory() as place:
            moment = killed(Path(place), after)
            trouble, missing = lacks(Path(place), moment)
        longest = max(longest, missing)
        if trouble:
            bad += 1
            print(f"kill {number}, {after:.3f} s after the log began: {trouble}")
    print(f"{options.count} kills, {bad} logs with losses beyond the flush interval; at most {longest:.2f} s missing")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
