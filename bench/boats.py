"""Accuracy of boats along their plans, by true position: legs, corners, stations, current and wind.

`python bench/boats.py` flies the boats and prints a table; `--picture FILE.svg` draws the tracks.
"""

import argparse
import hashlib
import math
import tempfile
import time
from pathlib import Path

import numpy as np
from against_dune import axes

import imc
from shoal.missions import Mission, load_plan, parse_plan, prepare

HARBOR = Path(__file__).parents[1] / "tests/data/plans/harbor.yaml"
BOATS = {"otter": "#2563eb", "caravel": "#d97706"}
HEAD = "plan: bench\norigin: 41.185°, -8.7062°\nspeed: 1.5 m/s\nmaneuvers:\n"
STATION = HEAD + "  - station_keeping: {north: 30, east: 20, speed: 1.2 m/s, radius: 15, duration: 900}\n"
CIRCLE = HEAD + "  - loiter: {north: 20, east: 30, radius: 15, duration: 150}\n"
ACROSS = HEAD + "  - goto: {north: 20}\n  - goto: {north: 220}\n"
FLOW = ("Simulators.StreamVelocity:Default Speed East=0.3",)
WAVES = ("World:Wave Height=0.5",)
WIND = ("Simulators.Wind:Speed=6", "Simulators.Wind:Direction=45", "Simulators.Wind:Gusts=1")


def sail(boat: str, plan: imc.PlanSpecification, *overrides: str) -> dict:
    """Rows of the true state (s, m north, m east, m/s ahead), times of the legs (s), CPU seconds per second, a hash."""
    rows, digest = [], hashlib.sha256()
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        vehicle = prepare(boat, overrides=overrides, log_root=root / "log", state_folder=root / "db").vehicle
        vehicle.observe(imc.SimulatedState, lambda m: rows.append((m.timestamp - vehicle.start_time, m.x, m.y, m.u)))
        vehicle.observe(imc.Message, lambda _, packet: digest.update(packet), packets=True)
        began = time.process_time()
        report = Mission(vehicle, plan).fly(3600.0)
        used = time.process_time() - began
    if not report.completed:
        raise RuntimeError(f"{boat}: {report.reason}")
    legs = [(leg.began - vehicle.start_time, leg.seconds) for leg in report.legs]
    return {"rows": np.array(rows), "legs": legs, "cost": used / rows[-1][0], "hash": digest.hexdigest()}


def of_leg(voyage: dict, leg: int) -> np.ndarray:
    """Rows of a leg."""
    begin, seconds = voyage["legs"][leg]
    rows = voyage["rows"]
    return rows[(rows[:, 0] >= begin) & (rows[:, 0] < begin + seconds)]


def settled(across: np.ndarray, along: np.ndarray, limit: float = 0.5) -> float:
    """Distance along a leg (m) after which the distance from it begins to stay below a limit."""
    outside = np.flatnonzero(np.abs(across) > limit)
    return float(along[outside[-1]]) if outside.size else 0.0


def table(boat: str) -> None:
    harbor, again = sail(boat, load_plan(HARBOR)), sail(boat, load_plan(HARBOR))
    first, second, third = (of_leg(harbor, leg) for leg in range(3))
    print(f"{boat}: speed on the first leg {first[first[:, 0] > 25.0][:, 3].mean():.2f} m/s of 1.50")
    print(f"  on the first leg {np.abs(first[:, 2]).max():.2f} m off the leg at most")
    print(f"  corners: overshoot {second[:, 1].max() - 60.0:.1f} and {third[:, 2].max() - 60.0:.1f} m")
    print(f"  within 0.5 m {settled(second[:, 1] - 60.0, second[:, 2]):.0f} m after the corner")
    for name, overrides in (("still water", ()), ("0.3 m/s", FLOW)):
        voyage = sail(boat, parse_plan(STATION), *overrides)
        kept = voyage["rows"][voyage["rows"][:, 0] > voyage["rows"][-1, 0] - 900.0]
        distances = np.hypot(kept[:, 1] - 30.0, kept[:, 2] - 20.0)
        inside = 100 * (distances < 15.0).mean()
        print(f"  station of 15 m, {name}: {distances.max():.1f} m at most, inside {inside:.0f} % of the time")
    circle = sail(boat, parse_plan(CIRCLE))["rows"][-4000:]
    off = np.abs(np.hypot(circle[:, 1] - 20.0, circle[:, 2] - 30.0) - 15.0)
    print(f"  circle of 15 m: {off.max():.1f} m off at most")
    for name, overrides in (("current", FLOW), ("current and wind", FLOW + WIND)):
        leg = of_leg(sail(boat, parse_plan(ACROSS), *overrides), 1)
        aside = leg[leg[:, 1] > 60.0][:, 2]
        print(f"  leg across {name}: {math.sqrt((aside**2).mean()):.2f} m RMS, {np.abs(aside).max():.2f} m at most")
    rough = sail(boat, load_plan(HARBOR), *WAVES)
    aside = np.abs(of_leg(rough, 0)[:, 2]).max()
    print(f"  in waves of 0.5 m: {aside:.2f} m off the first leg at most, {1000 * rough['cost']:.1f} ms CPU")
    print(f"  {1000 * harbor['cost']:.1f} ms CPU per simulated second; equal runs {harbor['hash'] == again['hash']}")


def picture() -> str:
    """Tracks over ground, in still water and in a current, as SVG."""
    parts = []
    for left, title, overrides in ((0, "still water", ()), (400, "0.3 m/s to the east", FLOW)):
        panel = f"{title}: east (m), north (m)"
        frame, right, up = axes(left, 390, panel, (-20.0, 80.0), (75.0, -10.0), (20, 20))
        parts += frame
        corners = " ".join(f"{right(e):.1f},{up(n):.1f}" for n, e in ((0, 0), (60, 0), (60, 60), (0, 60), (20, 20)))
        circle = f'cx="{right(20):.1f}" cy="{up(20):.1f}" rx="{right(15) - right(0):.1f}" ry="{up(0) - up(15):.1f}"'
        parts.append(f'<polyline points="{corners}" fill="none" stroke="#9ca3af" stroke-dasharray="4 3"/>')
        parts.append(f'<ellipse {circle} fill="none" stroke="#9ca3af" stroke-dasharray="4 3"/>')
        for index, (boat, color) in enumerate(BOATS.items()):
            rows = sail(boat, load_plan(HARBOR), *overrides)["rows"][::50]
            line = " ".join(f"{right(east):.1f},{up(north):.1f}" for _, north, east, _ in rows)
            parts.append(f'<polyline points="{line}" fill="none" stroke="{color}" stroke-width="1.5"/>')
            parts.append(f'<text x="{right(-18):.1f}" y="{up(70 - 5 * index):.1f}" fill="{color}">{boat}</text>')
    look = "text{font:12px sans-serif}.title{font-weight:bold}.grid{stroke:#e5e7eb;fill:none}"
    body = "\n".join(['<rect width="800" height="370" fill="#fff"/>', *parts])
    box = 'viewBox="0 0 800 370" width="800" height="370"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {box}>\n<style>{look}</style>\n{body}\n</svg>\n'


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--picture", type=Path, help="where to draw the tracks")
    arguments = parser.parse_args()
    for name in BOATS:
        table(name)
    if arguments.picture:
        arguments.picture.write_text(picture())
