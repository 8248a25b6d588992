"""Measures `shoal log render` on one processor and on two: `python bench/render.py [rounds]`, on a quiet machine.

The ratio of processor times is that of the one process to the busier one of two: what is left on a busy machine.
"""

import resource
import shutil
import sys
import tempfile
import time
from pathlib import Path

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.rendering import render_log

LEAST_RATIO = 1.8
SECONDS = 120.0  # of the vehicle
CAMERA = "[Vision.FisheyeCamera]\nFrame Rate = 5\nSize = 512\nFace Size = 256\n"


def sailed(folder: Path) -> imc.Log:
    """The longest log of a virtual run of the AUV, which has no camera."""
    profile = load_profile("lauv-noptilus-1")
    start = VirtualClock(profile.start_time_ns)
    vehicle = build(profile, profile.parse_modes("Simulation"), clock=start, log_root=folder / "log").vehicle
    vehicle.start()
    vehicle.run(SECONDS)
    vehicle.close()
    return imc.Log(max(folder.rglob("Data.lsf.gz"), key=lambda path: path.stat().st_size).parent)


def measured(log: imc.Log, folder: Path, cameras: Path, processes: int) -> tuple[int, float, float]:
    """The number of pictures, and the seconds they took: by the clock, and of the busiest processor."""
    who = resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN
    before, begin = [resource.getrusage(each) for each in who], time.perf_counter()
    done = render_log(log, folder / "out", cameras=cameras, processes=processes)
    seconds, after = time.perf_counter() - begin, [resource.getrusage(each) for each in who]
    shutil.rmtree(folder / "out")
    used = [b.ru_utime - a.ru_utime + b.ru_stime - a.ru_stime for a, b in zip(before, after, strict=True)]
    return sum(done.pictures.values()), seconds, max(used)


def main() -> int:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 2
    found: dict[int, list[tuple[int, float, float]]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log, cameras = sailed(folder), folder / "cameras.ini"
        cameras.write_text(CAMERA)
        for _ in range(rounds):
            for processes in found:
                found[processes].append(measured(log, folder, cameras, processes))
    for processes, runs in found.items():
        count, seconds, used = (min(column) for column in zip(*runs, strict=True))
        what = f"{count} pictures of 512 px with labels, {processes} at once"
        print(f"{what}: {seconds:6.1f} s, {count / seconds:5.1f} fps, {used:6.1f} s of a processor")
    ratio, of_work = (min(run[n] for run in found[1]) / min(run[n] for run in found[2]) for n in (1, 2))
    print(f"ratio {ratio:.2f} (at least {LEAST_RATIO}), of processor times {of_work:.2f}")
    return 0 if ratio >= LEAST_RATIO else 1


if __name__ == "__main__":
    sys.exit(main())
