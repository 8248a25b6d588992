"""Measures `shoal log render` on one processor and on two: `python bench/render.py [rounds]`, on a quiet machine."""

import math
import shutil
import sys
import tempfile
import time
from pathlib import Path

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.rendering import render

LEAST_RATIO = 1.8
SECONDS = 120.0  # of the vehicle
CAMERA = "[Vision.FisheyeCamera]\nFrame Rate = 5\nSize = 512\nFace Size = 256\n"


def sailed(folder: Path) -> imc.Log:
    """The longest log of a virtual run of the AUV, which has no camera."""
    profile = load_profile("lauv-noptilus-1")
    start = VirtualClock(profile.start_time_ns)
    vehicle = build(profile, profile.select("Simulation"), clock=start, log_root=folder / "log").vehicle
    vehicle.start()
    vehicle.run(SECONDS)
    vehicle.close()
    return imc.Log(max(folder.rglob("Data.lsf.gz"), key=lambda path: path.stat().st_size).parent)


def main() -> int:
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    best = {1: math.inf, 2: math.inf}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log, cameras = sailed(folder), folder / "cameras.ini"
        cameras.write_text(CAMERA)
        for _ in range(rounds):
            for processes in best:
                begin = time.perf_counter()
                done = render(log, folder / "out", cameras=cameras, processes=processes)
                best[processes] = min(best[processes], time.perf_counter() - begin)
                shutil.rmtree(folder / "out")
    count, ratio = sum(done.pictures.values()), best[1] / best[2]
    for processes, seconds in best.items():
        print(
            f"{count} pictures of 512 px with labels, {processes} at once: {seconds:6.1f} s, {count / seconds:5.1f} fps"
        )
    print(f"ratio {ratio:.2f} (at least {LEAST_RATIO})")
    return 0 if ratio >= LEAST_RATIO else 1


if __name__ == "__main__":
    sys.exit(main())
