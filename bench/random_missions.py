"""Random missions with random faults, each drawn by its seed."""

import math
import random
import tempfile
from dataclasses import dataclass
from pathlib import Path

import imc
from shoal.missions import prepare
from support.wgs84 import displace

FAULTS = 90.0  # s after the start of the plan in which the faults come
LIGHT = ["Transports.MAVLink:Enabled=Never"]
AUV = "lauv-noptilus-1"
PROFILES = (AUV,) * 7 + ("otter", "caravel", "hexa-00")
SENSORS = ("Simulators.DepthSensor", "Simulators.GPS", "Simulators.IMU", "Simulators.DVL", "Simulators.Environment",
           "Simulators.Motor", "Simulators.Servos", "Simulators.Barometer")  # fmt: skip
START = math.radians(41.185), math.radians(-8.7062)


@dataclass
class Mission:
    """A profile with overrides, its plan, and the faults: s after the start of the plan, what, and to which task."""

    profile: str
    overrides: list[str]
    plan: imc.PlanSpecification
    faults: list[tuple[float, str, str]]


def draw_profile(pick: random.Random) -> str:
    """The profile of a mission, the first that is drawn."""
    return pick.choice(PROFILES)


def draw(seed: int) -> Mission:
    """The mission of a seed."""
    pick = random.Random(seed)
    profile = draw_profile(pick)
    overrides = list(LIGHT)
    if profile == AUV:
        overrides.append("Simulators.MUGDetectionCamera:Enabled=Never")
    if profile != "hexa-00":
        for name in ("North", "East"):
            overrides.append(f"Simulators.StreamVelocity:Default Speed {name}={pick.choice((-0.4, 0.0, 0.0, 0.3))}")
    water = pick.choice((4.0, 8.0, 15.0, 30.0, 120.0)) if profile == AUV else 4.0
    if water != 4.0:
        overrides += ["Bathymetry:Data=", f"World:Out Of Bounds Depth={water}"]
    maneuvers = [_maneuver(pick, profile, water) for _ in range(pick.choice((1, 2, 3)))]
    if profile == "hexa-00":
        maneuvers.insert(0, imc.Takeoff(lat=START[0], lon=START[1], z=15.0, z_units=imc.ZUnits.ALTITUDE, speed=3.0))
    faults: list[tuple[float, str, str]] = []
    names = tasks_of(profile)
    for _ in range(pick.choice((1, 1, 2))):
        kind = pick.choice(("mute", "mute", "disconnect", "fail", "stuck", "spike", "nan", "jump", "abort", "flat"))
        lies = kind in ("stuck", "spike", "nan", "jump")
        near = [name for name in names if not lies or name.split("/")[0] in SENSORS]
        faults.append((pick.uniform(5.0, FAULTS), kind, "Simulators.GPS" if kind == "jump" else pick.choice(near)))
    return Mission(profile, overrides, _plan(maneuvers), sorted(faults))


def tasks_of(profile: str) -> list[str]:
    """The tasks of a profile's simulation."""
    with tempfile.TemporaryDirectory() as folder:
        vehicle = prepare(profile, overrides=LIGHT, state_folder=Path(folder), log_root=Path(folder)).vehicle
        names = [task.name for task in vehicle.tasks]
        vehicle.close()
    return [name for name in names if name not in ("Simulators.VSIM", "Simulators.UAV")]


def _maneuver(pick: random.Random, profile: str, water: float) -> imc.Message:
    lat, lon, _ = displace(*START, 0.0, pick.uniform(-60.0, 60.0), pick.uniform(-60.0, 60.0))
    z, units, speed = 0.0, imc.ZUnits.DEPTH, 1.2
    if profile == AUV:
        z = pick.choice((0.0, 2.0, 0.5 * water, min(water + 5.0, 20.0), 10.0))
        if pick.random() < 0.2:
            z, units = pick.choice((2.0, 3.0, 6.0)), imc.ZUnits.ALTITUDE
    elif profile == "hexa-00":
        z, units, speed = pick.choice((5.0, 15.0, 30.0)), imc.ZUnits.ALTITUDE, pick.choice((3.0, 8.0))
    at = {"lat": lat, "lon": lon, "z": z, "z_units": units, "speed": speed}
    kinds = ["goto", "goto", "keep", "loiter"]
    if profile == AUV:
        kinds += ["yoyo", "yoyo", "popup", "rows", "path"]
    match pick.choice(kinds):
        case "keep":
            return imc.StationKeeping(**at, radius=15.0, duration=pick.choice((30, 60)))
        case "loiter":
            return imc.Loiter(**at, type=imc.Loiter.Type.CIRCULAR, radius=15.0, duration=40)
        case "yoyo":
            steep = math.radians(pick.choice((10.0, 15.0, 25.0)))
            return imc.YoYo(**{**at, "z": max(z, 2.0)}, amplitude=pick.choice((1.0, 2.0, 0.8 * z)), pitch=steep)
        case "popup":
            return imc.PopUp(**at, radius=15.0, duration=10, flags=imc.PopUp.Flags.CURR_POS)
        case "rows":
            return imc.Rows(**at, width=60.0, length=60.0, hstep=20.0, coff=10, alternation=100)
        case "path":
            points = tuple(imc.PathPoint(x=pick.uniform(-40, 40), y=pick.uniform(-40, 40)) for _ in range(3))
            return imc.FollowPath(**at, points=points)
        case _:
            return imc.Goto(**at)


def _plan(maneuvers: list[imc.Message]) -> imc.PlanSpecification:
    steps = tuple(imc.PlanManeuver(maneuver_id=f"m{i}", data=item) for i, item in enumerate(maneuvers))
    arrows = tuple(
        imc.PlanTransition(source_man=f"m{i}", dest_man=f"m{i + 1}", conditions="ManeuverIsDone")
        for i in range(len(maneuvers) - 1)
    )
    return imc.PlanSpecification(plan_id="random", start_man_id="m0", maneuvers=steps, transitions=arrows)
