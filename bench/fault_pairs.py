"""Random missions with pairs of faults that come and go, drift, lag, use wrong units, or change the vehicle's weight.

`python bench/fault_pairs.py --missions 100 --seed 1` flies missions of `random_missions` with other faults, prints
each failure with its seed, and exits with 1 if there is one. Beside the criteria of `campaign`: none above the fence,
and no touchdown of a multirotor faster than 2.5 m/s. Missions with jammed fins may end on the bottom, and a vehicle
with more weight than buoyancy may be kept at the surface by its motor: it sinks until the motor turns, and comes up
again.
"""

import math
import random
import re
import sys
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import random_missions
from campaign import READY, Flight, fly_all, fly_mission
from random_missions import AUV

import imc
from runtime.fault_injection import Biased, Fault, FaultInjector, PublishInterceptor

FENCE, TOUCHDOWN = 120.0, 2.5  # m, m/s
IMPACT = re.compile(r"touchdown at ([0-9.]+) m/s")  # of Simulators.UAV
KEPT_UP = "ascending with motor and fins"  # of Supervisors.Failsafe
AFLOAT, BOBBING, MINUTE = 0.3, 1.6, 6000  # m, m, steps: one that is kept up is as deep in between
FEET, DEGREES = 3.2808, 57.2958
# task: message, field, drift per second
DRIFTS = {
    "Simulators.DepthSensor": ("Depth", "value", (-0.06, -0.03, 0.06)),
    "Simulators.GPS": ("GpsFix", "lat", (-1e-7, 1e-7)),
    "Simulators.DVL": ("GroundVelocity", "x", (-0.01, 0.03)),
    "Simulators.IMU/AHRS": ("EulerAngles", "theta", (-0.004, 0.01)),
    "Simulators.Barometer": ("Pressure", "value", (-0.05, 0.1)),
}
SCALES = {
    "Simulators.DepthSensor": ("Depth", "value", (FEET, 0.001)),
    "Simulators.GPS": ("GpsFix", "height", (FEET, 0.3048)),
    "Simulators.IMU/AHRS": ("EulerAngles", "theta", (DEGREES, -1.0)),
    "Simulators.Barometer": ("Pressure", "value", (100.0, 0.01)),
}
KINDS = ("intermittent", "drift", "delay", "units", "weight", "gps jump", "jam")


@dataclass(frozen=True)
class Changed(Fault):
    """Each message of a type has a field changed by a function of its value and the time (s) since the fault began."""

    of: str
    field: str
    change: Callable[[float, float], float]
    text: str

    def __str__(self) -> str:
        return self.text

    def begin(self, source: PublishInterceptor, number: int) -> Callable[[imc.Message], imc.Message]:
        task, began = source.task, source.task.now

        def spoil(message: imc.Message) -> imc.Message:
            if type(message).__name__ != self.of:
                return message
            return message.replace(**{self.field: self.change(getattr(message, self.field), task.now - began)})

        return spoil


@dataclass(frozen=True)
class Intermittent(Fault):
    """The task is silent in a share of each period (s)."""

    period: float
    share: float
    about_itself: ClassVar[tuple[type[imc.Message], ...]] = (imc.EntityState, imc.EntityInfo, imc.LogBookEntry)

    def __str__(self) -> str:
        return f"intermittent, {self.share:.0%} of {self.period:g} s"

    def begin(self, source: PublishInterceptor, number: int) -> Callable[[imc.Message], imc.Message | None]:
        task, began = source.task, source.task.now

        def drop(message: imc.Message) -> imc.Message | None:
            silent = (task.now - began) % self.period < self.share * self.period
            return None if silent and not isinstance(message, self.about_itself) else message

        return drop


@dataclass(frozen=True)
class Delayed(Fault):
    """Delay of the messages of the task by a time (s)."""

    delay: float

    def __str__(self) -> str:
        return f"late by {self.delay:g} s"

    def begin(self, source: PublishInterceptor, number: int) -> Callable[[imc.Message], None]:
        task = source.task
        return lambda message: task.vehicle.kernel.after(self.delay, type(task).publish, task, message) and None


def make_fault(pick: random.Random, kind: str, names: list[str]) -> tuple[str, Fault | float]:
    """A task and its fault; for a weight or a jam, no task and kg or rad."""
    sensors = [name for name in names if name in DRIFTS]
    task = pick.choice(sensors)
    match kind:
        case "intermittent":
            return pick.choice(names), Intermittent(pick.choice((1.0, 4.0, 20.0)), pick.choice((0.3, 0.6, 0.9)))
        case "drift":
            of, field, rates = DRIFTS[task]
            rate = pick.choice(rates)
            return task, Changed(of, field, lambda value, time: value + rate * time, f"{of}.{field} {rate:+g}/s")
        case "units":
            task = pick.choice([name for name in sensors if name in SCALES])
            of, field, factors = SCALES[task]
            factor = pick.choice(factors)
            return task, Changed(of, field, lambda value, time: value * factor, f"{of}.{field} times {factor:g}")
        case "delay":
            return task, Delayed(pick.choice((0.2, 0.7, 1.5)))
        case "gps jump":
            return "Simulators.GPS", Biased("GpsFix", "lat", pick.choice((30.0, 200.0, 5000.0)) / 6.371e6)
        case "jam":
            return "", math.radians(pick.choice((-20.0, -8.0, 8.0, 20.0)))
        case _:
            return "", pick.choice((-1.0, 0.18, 0.3, 0.6))


def fly(seed: int) -> Flight:
    """Fly the mission of a seed."""
    pick = random.Random(f"pairs {seed}")
    flight = Flight(seed, random_missions.draw(seed))
    mission = flight.mission
    kinds = [kind for kind in KINDS if mission.profile == AUV or kind not in ("weight", "jam")]
    kinds += ["weight"] if mission.profile == "hexa-00" else []
    drawn = pick.sample(kinds, 2)
    highest = 0.0
    depths = deque[float](maxlen=MINUTE)

    def measure(truth: imc.SimulatedState) -> None:
        nonlocal highest
        highest = max(highest, -truth.z)
        depths.append(truth.z)

    def inject(vehicle: "object") -> None:
        names = [task.name for task in vehicle.tasks if task.name not in ("Simulators.VSIM", "Simulators.UAV")]
        simulator = vehicle.task("Simulators.UAV" if mission.profile == "hexa-00" else "Simulators.VSIM")
        injector = FaultInjector(vehicle)
        mission.faults.clear()
        for kind in drawn:
            task, fault = make_fault(pick, kind, names)
            at, lasting = pick.uniform(5.0, 70.0), pick.choice((math.inf, math.inf, 8.0, 30.0, 60.0))
            mission.faults.append((at, f"{kind} {fault}", task))
            if isinstance(fault, Fault):
                vehicle.kernel.after(READY + at, injector.begin, task, fault, lasting)
            else:
                vehicle.kernel.after(READY + at, jam if kind == "jam" else load, simulator, fault)
        vehicle.observe(imc.SimulatedState, measure)

    fly_mission(flight, inject)
    flight.violations += [f"{highest:.0f} m high"] if highest > FENCE else []
    impacts = [float(found[1]) for line in flight.log if (found := IMPACT.search(line))]
    flight.violations += [f"touchdown at {hard:.1f} m/s" for hard in impacts if hard > TOUCHDOWN]
    if "weight" in drawn and any(KEPT_UP in line for line in flight.log):
        bobs = min(depths) < AFLOAT and max(depths) < BOBBING
        allowed = ("drives without a plan", *(("still 1 m deep", "still 2 m deep") if bobs else ()))
        if found := [each for each in allowed if each in flight.violations]:
            flight.violations = [each for each in flight.violations if each not in found]
            flight.outcome = "kept at the surface by its motor"
    if "jam" in drawn and "below the bottom" in flight.violations:
        flight.violations.remove("below the bottom")
    return flight


def load(simulator: "object", kilograms: float) -> None:
    """Change the weight of the simulated vehicle."""
    craft = simulator.craft
    if hasattr(craft, "airframe"):
        craft.airframe = replace(craft.airframe, mass=craft.airframe.mass + max(-0.5, kilograms))
    else:
        craft.model = replace(craft.model, mass=craft.model.mass + kilograms)


def jam(simulator: "object", angle: float) -> None:
    """Jam the horizontal fins at an angle (rad)."""
    craft, deflect = simulator.craft, simulator.craft.set_deflection
    craft.set_deflection = lambda fin, wanted: deflect(fin, angle if fin in (1, 2) else wanted)


if __name__ == "__main__":
    sys.exit(fly_all(fly, str(__doc__), 500))
