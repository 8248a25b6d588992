"""Runs a vehicle in real time on a computer that is overloaded or halted, and counts what that costs.

`python bench/overload.py [--duration 1h] [--load 40] [--halt 30] [--profile lauv-noptilus-1]`: so many busy loops at
normal priority; with `--halt`, the vehicle is also stopped for 2 to 5 s (SIGSTOP) every so many seconds. Exit status 1
if a plan is lost, or an entity other than the computer's own is in error.
"""

import argparse
import contextlib
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import imc
from runtime.logs import logs_of_run
from support.durations import parse_duration

State = imc.EntityState.State
BROKEN = (State.FAULT, State.ERROR, State.FAILURE)
COMPUTER = ("Daemon", "Host Resources")  # they report the load, and should
ALONE = ("Transports.Discovery", "Transports.Announce", "Transports.UDP", "Transports.MAVLink")
PATIENCE = 300.0  # s after the end of the run


def run(profile: str, seconds: float, halt: float, folder: Path) -> int:
    """Run a vehicle that flies its own plan, and halt it now and then; returns its exit status."""
    command = [sys.executable, "-m", "shoal.cli", "run", profile, "-p", "Simulation", "--bus", "inprocess"]
    for section in ALONE:
        command += ["--set", f"{section}:Enabled=Never"]
    options = ["--for", f"{seconds:g}s", "--log-dir", str(folder / "log"), "--keep-going"]
    with (folder / "stderr").open("w") as errors:
        child = subprocess.Popen([*command, *options], cwd=folder, stdout=subprocess.DEVNULL, stderr=errors)
        end, generator = time.monotonic() + seconds + PATIENCE, random.Random(1)
        try:
            while child.poll() is None and time.monotonic() < end:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    child.wait(halt or 10.0)
                if halt and child.poll() is None:
                    child.send_signal(signal.SIGSTOP)
                    time.sleep(generator.uniform(2.0, 5.0))
                    child.send_signal(signal.SIGCONT)
        finally:
            child.kill()
    return child.wait()


def count_faults(folder: Path) -> tuple[Counter[str], Counter[str], float]:
    """Faults of entities, and lost plans, in all logs; and the recorded time (s)."""
    blamed, lost, recorded, braked = Counter[str](), Counter[str](), 0.0, 0
    labels = dict[int, str]()  # a later log of the run may have a state before its EntityInfo
    for log in (imc.Log(part, keep_index=False) for part in logs_of_run(next(iter(sorted(folder.glob("log/*/*/*")))))):
        times, states = list[float](), dict[int, int]()
        for message in log.messages():
            times.append(message.timestamp)
            match message:
                case imc.EntityInfo():
                    labels[message.id] = message.label
                case imc.EntityState():
                    label, before = labels.get(message.src_ent, ""), states.get(message.src_ent)
                    states[message.src_ent] = message.state
                    new = message.state in BROKEN and before not in BROKEN
                    if new and label not in COMPUTER:
                        print(f"{message.timestamp - times[0]:8.1f} s  {label}: {message.description}")
                        blamed[f"{label}: {message.description}"] += 1
                case imc.VehicleState(op_mode=imc.VehicleState.OpMode.ERROR):
                    lost["vehicle in ERROR"] += 1
                case imc.PlanControlState(last_outcome=imc.PlanControlState.LastOutcome.FAILURE):
                    lost["plan failed"] += 1
                case imc.Brake(op=imc.Brake.Op.START):
                    braked += 1
                case imc.LogBookEntry(context="Daemon"):
                    print(f"{message.timestamp - times[0]:8.1f} s  {message.text}")
                case _:
                    pass
        recorded += max(times, default=0.0) - min(times, default=0.0)
    print(f"braked {braked} times")
    return blamed, lost, recorded


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--duration", default="1h")
    parser.add_argument("--load", type=int, default=40)
    parser.add_argument("--halt", type=float, default=0.0)
    parser.add_argument("--profile", default="lauv-noptilus-1")
    parser.add_argument("--folder", type=Path, help="keep the logs there")
    arguments = parser.parse_args()
    seconds, began = parse_duration(arguments.duration), time.monotonic()
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(arguments.load)]
    try:
        with tempfile.TemporaryDirectory() as name:
            folder = arguments.folder or Path(name)
            folder.mkdir(parents=True, exist_ok=True)
            status = run(arguments.profile, seconds, arguments.halt, folder)
            blamed, lost, recorded = count_faults(folder)
            print((folder / "stderr").read_text()[-2000:])
    finally:
        passed, used = time.monotonic() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
        before = used.ru_utime + used.ru_stime
        for loop in loops:
            loop.kill()
            loop.wait()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    share = (used.ru_utime + used.ru_stime - before) / passed / max(1, len(loops))
    print(f"{arguments.profile}, {arguments.load} busy loops, each with {100.0 * share:.1f} % of a core")
    print(f"{recorded:.0f} s recorded, exit status {status}")
    print(f"blamed: {dict(blamed)}\nlost: {dict(lost)}")
    return int(bool(blamed or lost or status))


if __name__ == "__main__":
    sys.exit(main())
