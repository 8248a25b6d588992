"""Simulated vehicle: cost of a step, cost of all simulators, and its motion with the commands of a mission of DUNE.

`python bench/dynamics.py` prints figures for this machine; it does not pass or fail.
"""

import argparse
import math
import os
import platform
import tempfile
import time
from pathlib import Path

import numpy as np

from runtime.kernel import VirtualClock
from runtime.profile import load_profile, own_etc, read_sections
from runtime.testing import simulate
from runtime.vehicle import build
from tasks.simulators.gps import GPS
from tasks.simulators.vsim import VSIM
from world.bodies import UnderwaterVehicle, read_underwater_model

MODELS = read_sections(own_etc() / "common/vsim-models.ini")
LAUV = MODELS["VSIM/Model/lauv"]
MISSION = Path(__file__).parents[1] / "tests/data/simulators/dune_mission.npz"
SURFACED = 110
PROFILE = "lauv-noptilus-1"


def craft(state, **changes: str) -> UnderwaterVehicle:
    section = LAUV | {name.replace("_", " "): text for name, text in changes.items()}
    made = UnderwaterVehicle(read_underwater_model(lambda _, option: section.get(option, ""), "lauv"))
    made.x, made.y, made.z = map(float, state[:3])
    made.set_attitude(*map(float, state[3:6]))
    made.u, made.v, made.w, made.p, made.q, made.r = map(float, state[6:])
    return made


def compare(mission, parts: int, **changes: str) -> None:
    """RMS differences of a run with the recorded commands, in `parts` steps per 10 ms."""
    swimmer = craft(mission["states"][0], **changes)
    found: list[tuple[float, ...]] = []
    began = time.process_time()
    for step, commands in enumerate(mission["commands"]):
        if step:
            for fin in range(4):
                swimmer.set_deflection(fin, float(commands[fin]))
            swimmer.set_actuation(0, float(commands[4]))
            for _ in range(parts):
                swimmer.step(0.01 / parts)
        if step % 100 == 0:
            found.append((swimmer.x, swimmer.y, swimmer.z, *swimmer.euler_angles(), swimmer.u, swimmer.v, swimmer.w))
    spent = time.process_time() - began
    difference = (np.array(found) - mission["states"][:, :9])[:SURFACED]
    difference[:, 3:6] = (difference[:, 3:6] + math.pi) % (2.0 * math.pi) - math.pi
    rms = np.sqrt((difference**2).mean(axis=0))
    print(
        f"    RMS of x {rms[0]:.3f} y {rms[1]:.3f} z {rms[2]:.3f} m, phi {math.degrees(rms[3]):.2f} "
        f"theta {math.degrees(rms[4]):.2f} psi {math.degrees(rms[5]):.2f} deg, "
        f"u {rms[6]:.4f} v {rms[7]:.4f} w {rms[8]:.4f} m/s ({spent / len(mission['commands']) * 1e6:.1f} us a step)"
    )


def steps(seconds: float) -> None:
    mission = np.load(MISSION)
    swimmer, count = craft(mission["states"][50]), round(100 * seconds)
    began = time.process_time()
    for _ in range(count):
        swimmer.step(0.01)
    alone = (time.process_time() - began) / count
    began = time.process_time()
    tasks = [VSIM, (GPS, {"initial_position": [41.185, -8.7062]})]
    simulate(tasks, seconds=seconds, settings=MODELS)
    whole = (time.process_time() - began) / count
    print(f"step of the equations {alone * 1e6:.1f} us; with kernel, message, bus and a listener {whole * 1e6:.1f} us")


def simulators(seconds: float) -> None:
    def cost(*silent: str) -> tuple[float, int]:
        silences = [f"{section}:Enabled=Never" for section in silent]
        profile = load_profile(PROFILE, overrides=["Transports.Logging:Enabled=Always", *silences])
        others = [name for name in profile.config.sections if not name.startswith("Simulators.")]
        for section in others:
            if section != "Transports.Logging" and "Enabled" in profile.config.sections[section].options:
                profile.override(f"{section}:Enabled=Never")
        with tempfile.TemporaryDirectory() as folder:
            made = build(profile, {"Simulation"}, clock=VirtualClock(profile.start_time_ns), log_root=Path(folder))
            made.vehicle.start()
            made.vehicle.run(5.0)
            began, delivered = time.process_time(), made.vehicle.bus.delivered
            made.vehicle.run(seconds)
            used, heard = time.process_time() - began, made.vehicle.bus.delivered - delivered
            made.vehicle.close()
        return used / seconds * 1e3, round(heard / seconds)

    whole, rate = cost()
    print(f"all simulators, logged: {whole:.2f} ms CPU per simulated second at {rate} messages/s; without")
    for section in ("Transports.Logging", "Simulators.IMU/AHRS", "Simulators.Environment", "Simulators.VSIM"):
        print(f"    {section}: {cost(section)[0]:.2f} ms")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=300.0)
    arguments = parser.parse_args()
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    steps(arguments.seconds)
    simulators(arguments.seconds)
    print(f"first {SURFACED} s of DUNE's mission (160 m, dives to 2.4 m), with its commands, not corrected:")
    recorded = np.load(MISSION)
    print("  with the rotational inertia that DUNE uses by mistake (19, 34, 34 kg m2)")
    compare(recorded, 1, Rotational_Inertia="19, 34, 34")
    print("  with that of the model (0.04, 2.1, 2.1 kg m2), as in Shoal")
    compare(recorded, 1)
    print("  the same in steps of 1 ms")
    compare(recorded, 10)
