"""Compares imc with imcpy (DUNE's C++ codec): making, encoding and decoding messages, and importing the package.

Run it on a quiet machine: `python bench/imc_codec.py`. Each pair runs alternately in one process, and the best time
counts; a ratio above 1 means that imc is faster. Imports run in new processes, both with compiled bytecode.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from time import perf_counter

import imcpy

import imc

ROUNDS = 25
HEADER = {"timestamp": 1.7e9, "src": 30, "src_ent": 7, "dst": 31, "dst_ent": 8}
FIELDS = [info.name for info in imc.fields(imc.EstimatedState)]
GOTO = {"timeout": 300, "lat": 0.7, "lon": -0.15, "z": 3.0, "z_units": 1, "speed": 1.5, "speed_units": 0, "custom": ""}


def function(name: str, body: str) -> Callable[..., object]:
    """A function with unrolled code, so that neither side pays for a loop over fields."""
    space: dict[str, object] = {"imc": imc, "imcpy": imcpy}
    exec(f"def {name}(m=None):\n    {body}", space)
    return space[name]


VALUES = {**HEADER, **{name: 0.25 + index for index, name in enumerate(FIELDS)}}
READ = "; ".join(f"m.{name}" for name in VALUES)
OURS = function("ours", f"return imc.EstimatedState({', '.join(f'{name}={value}' for name, value in VALUES.items())})")
THEIRS = function(
    "theirs",
    "m = imcpy.EstimatedState(); " + "; ".join(f"m.{name} = {value}" for name, value in VALUES.items()) + "; return m",
)
OUR_READ, THEIR_READ = function("ours", READ), function("theirs", READ)


def our_plan() -> imc.Message:
    """Ten Gotos and nine transitions."""
    return imc.PlanSpecification(
        **HEADER,
        plan_id="plan",
        start_man_id="0",
        maneuvers=[imc.PlanManeuver(maneuver_id=str(i), data=imc.Goto(**GOTO)) for i in range(10)],
        transitions=[
            imc.PlanTransition(source_man=str(i), dest_man=str(i + 1), conditions="ManeuverIsDone") for i in range(9)
        ],
    )


def their_plan() -> object:
    """The same plan."""
    plan = imcpy.PlanSpecification()
    for name, value in HEADER.items():
        setattr(plan, name, value)
    plan.plan_id, plan.start_man_id = "plan", "0"
    for i in range(10):
        goto = imcpy.Goto()
        goto.timeout, goto.lat, goto.lon, goto.z = GOTO["timeout"], GOTO["lat"], GOTO["lon"], GOTO["z"]
        goto.z_units, goto.speed, goto.speed_units = imcpy.ZUnits.DEPTH, GOTO["speed"], imcpy.SpeedUnits.METERS_PS
        goto.custom = ""
        maneuver = imcpy.PlanManeuver()
        maneuver.maneuver_id, maneuver.data = str(i), goto
        plan.maneuvers.append(maneuver)
    for i in range(9):
        transition = imcpy.PlanTransition()
        transition.source_man, transition.dest_man = str(i), str(i + 1)
        transition.conditions = "ManeuverIsDone"
        plan.transitions.append(transition)
    return plan


def read_plan(plan: object) -> object:
    """Reads every field of a plan of either package."""
    read = [plan.plan_id, plan.start_man_id, plan.description, plan.vnamespace, *plan.variables]
    for maneuver in plan.maneuvers:
        goto = maneuver.data
        read += [maneuver.maneuver_id, *maneuver.start_actions, *maneuver.end_actions]
        read += [goto.timeout, goto.lat, goto.lon, goto.z, goto.z_units, goto.speed, goto.speed_units]
        read += [goto.roll, goto.pitch, goto.yaw, goto.custom]
    for transition in plan.transitions:
        read += [transition.source_man, transition.dest_man, transition.conditions, *transition.actions]
    return [*read, *plan.start_actions, *plan.end_actions]


def cycle(make: Callable, write: Callable, parse: Callable, read: Callable) -> Callable[[], object]:
    return lambda: read(parse(write(make())))


def pair(name: str, ours: Callable[[], object], theirs: Callable[[], object], number: int, wanted: float) -> None:
    """Times both alternately; prints the best of each."""
    best = [float("inf"), float("inf")]
    for _ in range(ROUNDS):
        for side, run in enumerate((ours, theirs)):
            begin = perf_counter()
            for _ in range(number):
                run()
            best[side] = min(best[side], (perf_counter() - begin) / number)
    report(name, best[0], best[1], wanted)


def report(name: str, ours: float, theirs: float, wanted: float) -> None:
    print(f"{name:46} imc {ours * 1e6:10.2f} µs   imcpy {theirs * 1e6:10.2f} µs   × {theirs / ours:5.2f} (≥ {wanted})")


def imports(rounds: int = 12) -> None:
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": folder, "PYTHONDONTWRITEBYTECODE": ""}
        best = {"imc": float("inf"), "imcpy": float("inf")}
        for _ in range(rounds):
            for name in best:
                begin = perf_counter()
                subprocess.run([sys.executable, "-c", f"import {name}"], env=environment, check=True)
                best[name] = min(best[name], perf_counter() - begin)
    report("import in a new process", best["imc"], best["imcpy"], 1.0)


def main() -> None:
    ours, theirs = OURS(), THEIRS()
    packet = imc.encode(ours)
    assert packet == imcpy.Packet.serialize(theirs)
    assert imc.encode(our_plan()) == imcpy.Packet.serialize(their_plan())
    write, parse = imcpy.Packet.serialize, imcpy.Packet.deserialize
    pair("EstimatedState: create, set all", OURS, THEIRS, 2000, 5.0)
    pair("EstimatedState: encode", lambda: imc.encode(ours), lambda: imcpy.Packet.serialize(theirs), 5000, 0.8)
    pair(
        "EstimatedState: encode with another header",
        lambda: imc.encode_with_header(ours, 1.0, 1, 2, 3, 4),
        lambda: imcpy.Packet.serialize(theirs),
        5000,
        0.8,
    )
    pair(
        "EstimatedState: decode, read all",
        lambda: OUR_READ(imc.decode(packet)),
        lambda: THEIR_READ(imcpy.Packet.deserialize(packet)),
        2000,
        3.0,
    )
    pair(
        "EstimatedState: create, encode, decode, read",
        cycle(OURS, imc.encode, imc.decode, OUR_READ),
        cycle(THEIRS, write, parse, THEIR_READ),
        1000,
        3.0,
    )
    pair(
        "PlanSpecification: create, encode, decode, read",
        cycle(our_plan, imc.encode, imc.decode, read_plan),
        cycle(their_plan, write, parse, read_plan),
        100,
        2.0,
    )
    imports()


if __name__ == "__main__":
    main()
