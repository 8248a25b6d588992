"""Number of vehicles of a fleet over zenoh that hold real time on this computer, with telemetry at its default rates.

`python bench/fleet.py [--vehicles 10 20] [--per-process 1 10] [--seconds 10] [--profile lauv-noptilus-1]` prints, for
each number, the share of the EstimatedState messages of a vehicle alone that arrive, the share of real time that the
processes use, and their memory. A vehicle holds real time if its share is 0.98 or more.
"""

import argparse
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import zenoh

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.runtime.zenoh.processes import Network

ENOUGH = 0.98
STARTING = 90.0  # s
SETTLING = 5.0  # s after all run
TICK = os.sysconf("SC_CLK_TCK")
PAGE = os.sysconf("SC_PAGE_SIZE")
FLEET = """
name: bench-{port}
profile: {profile}
per_process: {per_process}
stagger: {stagger}s
spacing: 50
zenoh: {{Local Port: "{port}"}}
set: ["Transports.MAVLink:Enabled=Never", {own_udp}]
vehicles: [{{name: "v-{{number}}", count: {count}}}]
"""


def family(process: int) -> list[int]:
    """A process and those that it has started."""
    found = [process]
    with contextlib.suppress(OSError):
        for word in Path(f"/proc/{process}/task/{process}/children").read_text().split():
            found += family(int(word))
    return found


def used(processes: list[int]) -> float:
    """CPU time of processes so far, in s."""
    total = 0
    for process in processes:
        with contextlib.suppress(OSError):
            words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
            total += int(words[11]) + int(words[12])
    return total / TICK


def memory(processes: list[int]) -> float:
    """Resident memory of processes, in MB."""
    total = 0
    for process in processes:
        with contextlib.suppress(OSError):
            total += int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return total * PAGE / 1e6


def connected(port: int, deadline: float) -> Any:
    config: Any = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.2)


def measure(profile: str, count: int, per_process: int, seconds: float) -> tuple[list[float], float, float]:
    """EstimatedState per second of each vehicle, CPU seconds per second, and memory (MB)."""
    network = Network()
    port = network.local_port
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "fleet.yaml"
        values = {"port": port, "profile": profile, "per_process": per_process, "count": count}
        own_udp = json.dumps(network.own_udp)[1:-1]
        file.write_text(FLEET.format(**values, own_udp=own_udp, stagger=0.5 if per_process == 1 else 2.0))
        command = [sys.executable, "-m", "shoal.cli", "fleet", str(file), "--log-dir", f"{folder}/log"]
        run = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        deadline = time.monotonic() + STARTING + count * 2.0
        try:
            with connected(port, deadline) as session:
                while len(list(session.liveliness().get("imc/*/@alive/*/main"))) < count:
                    if time.monotonic() > deadline:
                        raise TimeoutError(f"of {count} vehicles not all have started")
                    time.sleep(0.5)
                time.sleep(SETTLING)
                heard: Counter[str] = Counter()

                def take(sample: zenoh.Sample) -> None:
                    heard[str(sample.key_expr).split("/")[1]] += 1

                subscriber: Any = session.declare_subscriber("imc/*/EstimatedState/*", take)
                processes = family(run.pid)
                before, began = used(processes), time.monotonic()
                time.sleep(seconds)
                passed = time.monotonic() - began
                subscriber.undeclare()
                rates = [heard[f"v-{number}"] / passed for number in range(1, count + 1)]
                return rates, (used(processes) - before) / passed, memory(processes)
        finally:
            run.send_signal(signal.SIGTERM)
            run.wait()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicles", type=int, nargs="+", default=[5, 10])
    parser.add_argument("--per-process", type=int, nargs="+", default=[1, 10])
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--profile", default="lauv-noptilus-1")
    options = parser.parse_args()
    (alone,), cpu, size = measure(options.profile, 1, 1, options.seconds)
    print(f"1 vehicle: {alone:.1f} EstimatedState/s, {100 * cpu:.0f} % of a core, {size:.0f} MB", flush=True)
    for per_process in options.per_process:
        for count in options.vehicles:
            rates, cpu, size = measure(options.profile, count, per_process, options.seconds)
            shares = [rate / alone for rate in rates]
            hold = sum(share >= ENOUGH for share in shares)
            print(
                f"{count} vehicles, {per_process} per process: {hold} hold real time, shares {min(shares):.2f} to "
                f"{max(shares):.2f}, {100 * cpu:.0f} % of a core, {100 * cpu / count:.1f} % each, {size:.0f} MB, "
                f"load {os.getloadavg()[0]:.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
