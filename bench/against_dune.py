"""Compares a plan flown by Shoal with the same plan flown by DUNE: sequence of states, track, times and depth.

`python bench/against_dune.py` flies it and prints the comparison; `--picture FILE.svg` draws it. `--reduce LOG` makes
the file of DUNE's flight, which the comparison uses, from DUNE's log.
"""

import argparse
import json
import math
import tempfile
from pathlib import Path

import numpy as np

import imc
from shoal import fly
from shoal.missions import load_plan
from support.wgs84 import displacement

PLANS = Path(__file__).parents[1] / "tests/data/plans"
PLAN, KEPT = PLANS / "three_gotos.json", PLANS / "three_gotos_dune.json"
STEP = 0.5  # s between two rows of a track
SETTLED = 25.0  # s after a leg began, from when depths are compared
PANELS = (("over ground: east (m), north (m)", 0, 380), ("depth (m) over time (s)", 440, 500))
LINES = {"DUNE": "#d97706", "Shoal": "#2563eb"}


def reduce(log: Path) -> dict:
    """The flight in a log: `plan` states, `vehicle` modes, `legs` (name, seconds) and `track`.

    Rows of the track: time (s) since the first maneuver began, leg, true position (m north and east of the end of the
    first leg), true depth (m), and the measured depth of the bottom (m).
    """
    begin, end, due, bottom = None, 0.0, 0.0, 0.0
    goal = load_plan(PLAN).maneuvers[0].data
    flight: dict = {"plan": [], "vehicle": [], "legs": [], "track": []}
    for m in imc.Log(log):
        time = m.timestamp - (begin or 0.0)
        if isinstance(m, imc.PlanControlState):
            if m.state != m.State.EXECUTING:
                if begin is not None:
                    end = time
                    break
                continue
            begin = m.timestamp if begin is None else begin
            end = m.timestamp - begin
            if [m.man_id, m.man_type] not in flight["plan"]:
                flight["plan"].append([m.man_id, m.man_type])
                flight["legs"].append([m.man_id, end])
        elif begin is None:
            continue
        elif isinstance(m, imc.VehicleState):
            mode = [imc.VehicleState.OpMode(m.op_mode).name, m.maneuver_type, m.flags]
            if flight["vehicle"][-1:] != [mode]:
                flight["vehicle"].append(mode)
        elif isinstance(m, imc.EstimatedState):
            bottom = m.depth + m.alt
        elif isinstance(m, imc.SimulatedState) and time >= due:
            due += STEP
            north, east, _ = displacement(goal.lat, goal.lon, 0.0, m.lat, m.lon, 0.0)
            place = (north + m.x, east + m.y, m.z, bottom)
            flight["track"].append([round(time, 2), len(flight["legs"]) - 1, *(round(value, 2) for value in place)])
    begins = [time for _, time in flight["legs"]] + [end]
    flight["legs"] = [[name, round(begins[i + 1] - begins[i], 2)] for i, (name, _) in enumerate(flight["legs"])]
    return flight


def recorded() -> dict:
    return json.loads(KEPT.read_text())


def flown(plan: imc.PlanSpecification) -> dict:
    """The same for a flight of Shoal's simulated vehicle."""
    with tempfile.TemporaryDirectory() as folder:
        report = fly(plan, limit=900, log_root=Path(folder) / "log")
        if not report.completed:
            raise RuntimeError(report.reason)
        return reduce(next((Path(folder) / "log").glob(f"*/*/*_{plan.plan_id}")))


def of_leg(flight: dict, leg: int) -> np.ndarray:
    """Rows of a leg: s since it began, north, east, depth (m)."""
    rows = np.array([[time, *rest[:3]] for time, number, *rest in flight["track"] if number == leg])
    rows[:, 0] -= sum(seconds for _, seconds in flight["legs"][:leg])
    return rows


def across(ours: dict, other: dict, leg: int) -> float:
    """RMS distance (m) of the points of a leg from the track of the other flight."""
    points, line = of_leg(ours, leg)[:, 1:3], of_leg(other, leg)[:, 1:3]
    start, way = line[:-1], np.diff(line, axis=0)
    length = np.maximum((way**2).sum(axis=1), 1e-12)
    part = np.clip(((points[:, None] - start) * way).sum(axis=2) / length, 0.0, 1.0)
    nearest = start + part[..., None] * way
    return math.sqrt((((points[:, None] - nearest) ** 2).sum(axis=2).min(axis=1)).mean())


def depths_apart(ours: dict, other: dict, leg: int) -> np.ndarray:
    """Differences in depth (m) at the same times of a leg, from SETTLED on."""
    mine, theirs = of_leg(ours, leg), of_leg(other, leg)
    times = np.arange(SETTLED, min(mine[-1, 0], theirs[-1, 0]), STEP)
    depths = (np.interp(times, rows[:, 0], rows[:, 3]) for rows in (mine, theirs))
    return np.subtract(*depths)


def compare(ours: dict, dune: dict) -> None:
    same = {key: ours[key] == dune[key] for key in ("plan", "vehicle")}
    print(f"same maneuvers {same['plan']}, same modes of the vehicle {same['vehicle']}")
    for leg, ((name, mine), (_, theirs)) in enumerate(zip(ours["legs"], dune["legs"], strict=True)):
        apart = depths_apart(ours, dune, leg)
        print(
            f"{name}: {theirs:.1f} s DUNE, {mine:.1f} s Shoal ({100 * (mine / theirs - 1):+.1f} %); "
            f"{across(ours, dune, leg):.2f} m RMS across; depth {math.sqrt((apart**2).mean()):.2f} m RMS, "
            f"{np.abs(apart).max():.2f} m at most, within 0.5 m {100 * (np.abs(apart) < 0.5).mean():.0f} % of the time"
        )


def axes(left: int, width: int, title: str, x: tuple[float, float], y: tuple[float, float], step: tuple[int, int]):
    """Frame of a panel as SVG, and the functions from its units to pixels."""
    top, height = 40, 300

    def across_page(value: float) -> float:
        return left + 40 + (value - x[0]) / (x[1] - x[0]) * (width - 50)

    def down(value: float) -> float:
        return top + (value - y[0]) / (y[1] - y[0]) * height

    parts = [f'<text x="{left + 40}" y="24" class="title">{title}</text>']
    for tick in range(math.ceil(x[0] / step[0]) * step[0], math.floor(x[1]) + 1, step[0]):
        at = f"{across_page(tick):.1f}"
        parts.append(f'<path d="M{at} {top}V{top + height}" class="grid"/>')
        parts.append(f'<text x="{at}" y="{top + height + 16}" text-anchor="middle">{tick}</text>')
    low, high = sorted(y)
    for tick in range(math.ceil(low / step[1]) * step[1], math.floor(high) + 1, step[1]):
        at = f"{down(tick):.1f}"
        parts.append(f'<path d="M{left + 40} {at}H{left + width - 10}" class="grid"/>')
        parts.append(f'<text x="{left + 34}" y="{float(at) + 4:.1f}" text-anchor="end">{tick}</text>')
    return parts, across_page, down


def picture(flights: dict[str, dict]) -> str:
    """Tracks over ground and depths over time, as SVG."""
    ground, right, up = axes(*PANELS[0][1:], PANELS[0][0], (-25, 85), (15, -85), (20, 20))
    dive, later, down = axes(*PANELS[1][1:], PANELS[1][0], (0, 240), (-0.5, 5.5), (40, 1))
    seen = flights["DUNE"]["track"][1:]
    bottom = " ".join(f"{later(time):.1f},{down(depth):.1f}" for time, *_, depth in seen[::4])
    parts = [*ground, *dive, f'<polyline points="{bottom}" fill="none" stroke="#78716c" stroke-dasharray="4 3"/>']
    parts.append(f'<text x="{later(205):.1f}" y="{down(4.4):.1f}">bottom</text>')
    for index, (name, flight) in enumerate(flights.items()):
        style = f'fill="none" stroke="{LINES[name]}" stroke-width="{1.5 if index else 4}"'
        over = " ".join(f"{right(east):.1f},{up(north):.1f}" for _, _, north, east, *_ in flight["track"])
        deep = " ".join(f"{later(time):.1f},{down(depth):.1f}" for time, *_, depth, _ in flight["track"])
        parts += [f'<polyline points="{line}" {style}/>' for line in (over, deep)]
        parts.append(f'<path d="M{later(135):.1f} {down(1.7 + 0.4 * index):.1f}h20" {style}/>')
        parts.append(f'<text x="{later(150):.1f}" y="{down(1.77 + 0.4 * index):.1f}">{name}</text>')
    look = "text{font:12px sans-serif;fill:#374151}.title{font-weight:bold}.grid{stroke:#e5e7eb;fill:none}"
    box = 'viewBox="0 0 950 370" width="950" height="370"'
    body = "\n".join(['<rect width="950" height="370" fill="#fff"/>', *parts])
    return f'<svg xmlns="http://www.w3.org/2000/svg" {box}>\n<style>{look}</style>\n{body}\n</svg>\n'


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reduce", type=Path, help="a log of DUNE with this plan, to make the file of its flight from")
    parser.add_argument("--picture", type=Path, help="where to draw the comparison")
    arguments = parser.parse_args()
    if arguments.reduce:
        text = json.dumps(reduce(arguments.reduce), separators=(",", ":"))
        KEPT.write_text(text.replace('"track":[[', '"track":[\n[').replace("],[", "],\n[") + "\n")
    dune, ours = recorded(), flown(load_plan(PLAN))
    compare(ours, dune)
    if arguments.picture:
        arguments.picture.write_text(picture(dict(zip(LINES, (dune, ours), strict=True))))
