"""Duration of a command that reaches a running vehicle, beside an empty one: python bench/hand.py

Wall clock and CPU of the whole process, median of REPEATS, over zenoh and over UDP.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
REPEATS = 7
COMMANDS = (["--help"], ["ls"], ["plan", NAME, "status"], ["spy", NAME, "Heartbeat", "--count", "1"])


def measure(words: list[str]) -> tuple[float, float]:
    """Seconds of wall clock and of CPU."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    subprocess.run([sys.executable, "-m", "shoal.cli", *words], check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.monotonic() - began, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    os.environ["PYTHONPATH"] = str(Path(__file__).parents[1])
    print(f"load {os.getloadavg()[0]:.1f}, median of {REPEATS}: wall clock, CPU")
    for network in ("zenoh", "udp"):
        with tempfile.TemporaryDirectory() as folder, running(Path(folder), network=network):
            time.sleep(3.0)
            for words in COMMANDS:
                walls, cpus = zip(*(measure(words) for _ in range(REPEATS)), strict=True)
                print(f"{network:6} shoal {' '.join(words):40} {median(walls):.2f} s  {median(cpus):.2f} s", flush=True)


main()
