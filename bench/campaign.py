"""Random missions with random faults: does the true vehicle stay off the bottom and come home?

`python bench/campaign.py --missions 300` flies them, prints each failure with its seed, and exits with 1 if there is
one; `--seed N --missions 1` flies a single one again, `--profile hexa-00` the next seeds of a profile. Python 3.11 or
newer, no extras.
"""

import argparse
import math
import multiprocessing
import platform
import random
import sys
import tempfile
import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count, islice
from pathlib import Path

from random_missions import AUV, PROFILES, Mission, draw, draw_profile

import imc
from runtime.fault_injection import Biased, Crash, Fault, FaultInjector, PublishInterceptor, Silent, Stuck
from shoal.missions import prepare
from support.wgs84 import displacement
from world import read_world
from world.sea import Bathymetry

CCU = 0x4001
READY, HOME = 15.0, 120.0  # s: start of the plan, and the time to come home after the faults
LIMIT, MARGIN = 50.0, 5.0  # m: maximum depth of the profile, and how far below it the vehicle may get
TOUCH, SURFACE, NEAR = 0.2, 0.5, 2.0  # m
RISING = 0.3  # m in 10 s
DRIFTING = 0.4  # m/s through the water
MEASURED = ("value", "lat", "lon", "height", "x", "y", "z", "phi", "theta", "psi")


@dataclass
class Flight:
    """Result of a flight: `violations` by name, the `outcome`, and the last words of the log book."""

    seed: int
    mission: Mission
    violations: list[str] = field(default_factory=list[str])
    outcome: str = "no plan"
    log: list[str] = field(default_factory=list[str])


class Judge:
    """Watches the true vehicle, and the reports of the vehicle."""

    def __init__(self, flight: Flight, vehicle: "object", sea: Bathymetry | None):
        self._flight, self._sea = flight, sea
        self._truth: imc.SimulatedState | None = None
        self._estimate: imc.EstimatedState | None = None
        self._executing, self._ended = False, -math.inf
        self._depths: deque[float] = deque([math.inf], 1000)
        vehicle.observe(imc.SimulatedState, self._measure)
        vehicle.observe(imc.EstimatedState, self._store_estimate)
        vehicle.observe(imc.PlanControlState, self._follow)
        vehicle.observe(
            imc.LogBookEntry, lambda entry: flight.log.append(f"{entry.htime:.1f} {entry.context}: {entry.text}")
        )

    def _measure(self, truth: imc.SimulatedState) -> None:
        self._truth = truth
        self._depths.append(truth.z)
        if not math.isfinite(truth.x + truth.y + truth.z + truth.u + truth.v + truth.w):
            self._violate("physics is not finite")
        elif self._sea is not None:
            north, east, _ = displacement(*self._sea.reference, 0.0, truth.lat, truth.lon, 0.0)
            if truth.z > self._sea.depth(north + truth.x, east + truth.y) + TOUCH:
                self._violate("below the bottom")
            if truth.z > LIMIT + MARGIN:
                self._violate("below the maximum depth")

    def _store_estimate(self, state: imc.EstimatedState) -> None:
        self._estimate = state

    def _follow(self, state: imc.PlanControlState) -> None:
        executing = state.state == imc.PlanControlState.State.EXECUTING
        if self._executing and not executing:
            self._ended = state.timestamp
        self._executing = executing
        self._flight.outcome = imc.PlanControlState.LastOutcome(state.last_outcome).name

    @property
    def grace(self) -> float:
        """Time (s) that it may still take, because its plan continued after the fault, or does so at a wrong depth."""
        if self._truth is None or (self._executing and self._is_located):
            return 0.0
        return HOME if self._executing else self._ended + HOME - self._truth.timestamp

    @property
    def _is_located(self) -> bool:
        """Whether the estimated depth is near the true one."""
        truth, estimate = self._truth, self._estimate
        return truth is not None and estimate is not None and abs(truth.z - estimate.z) < NEAR

    @property
    def _rises(self) -> bool:
        """Whether the vehicle is on its way up: only its buoyancy lifts it, at 6 cm/s or less."""
        return self._depths[0] - self._depths[-1] > RISING

    def finish(self) -> None:
        """Look where the vehicle is in the end."""
        truth = self._truth
        if truth is None:
            return
        if self._executing and self._is_located:
            self._flight.outcome = "on its plan"
        elif self._flight.mission.profile == AUV and truth.z > SURFACE and not self._rises:
            self._violate(f"still {truth.z:.0f} m deep")
        elif self._flight.mission.profile == "hexa-00" and truth.z < -SURFACE:
            self._violate(f"still {-truth.z:.0f} m up")
        elif self._sea is not None and math.hypot(truth.u, truth.v) > DRIFTING:
            self._violate("drives without a plan")

    def _violate(self, what: str) -> None:
        if what not in self._flight.violations:
            self._flight.violations.append(what)


@dataclass(frozen=True)
class Wrong(Fault):
    """The first measured number of each message is a given one: always, or only in the first such message."""

    value: float
    once: bool = False

    def __str__(self) -> str:
        return f"{self.value:g}"

    def begin(self, source: PublishInterceptor, number: int) -> Callable[[imc.Message], imc.Message]:
        changed: set[object] = set()

        def lie(message: imc.Message) -> imc.Message:
            found = [name for name in MEASURED if isinstance(getattr(message, name, None), float)]
            if not found or (self.once and source.sensor_key(message) in changed):
                return message
            changed.add(source.sensor_key(message))
            return message.replace(**{found[0]: min(self.value, 1.5) if "lat" in found else self.value})

        return lie


def send(vehicle: "object", message: imc.Message) -> None:
    """Deliver a message as if a console sent it."""
    packet = imc.encode_with_header(message, vehicle.kernel.now_ns * 1e-9, CCU, 1, vehicle.system, 0xFF)
    vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)


def fly_mission(flight: Flight, inject: "Callable[[object], None]") -> None:
    """Fly a mission until it had the time to come home; `inject` schedules its faults and observers on the vehicle."""
    mission = flight.mission
    with tempfile.TemporaryDirectory() as folder:
        places = {"log_root": Path(folder), "state_folder": Path(folder)}
        vehicle = prepare(mission.profile, overrides=mission.overrides, seed=flight.seed, **places).vehicle
        vehicle.keep_going = True
        judge = Judge(flight, vehicle, read_world(vehicle.profile.value).seabed)
        inject(vehicle)
        start = imc.PlanControl(plan_id=mission.plan.plan_id, arg=mission.plan, request_id=1)
        vehicle.start()
        vehicle.kernel.after(READY, send, vehicle, start)
        try:
            vehicle.run(READY + max(at for at, _, _ in mission.faults) + HOME)
            for _ in range(2):
                if judge.grace > 0.0:
                    vehicle.run(judge.grace)
        except Exception as error:
            flight.violations.append(f"the run ended: {error!r}")
        finally:
            vehicle.close()
        judge.finish()


def fly(seed: int) -> Flight:
    """Fly the mission of a seed."""
    flight = Flight(seed, draw(seed))

    def inject(vehicle: "object") -> None:
        names = {task.name for task in vehicle.tasks}
        faults = FaultInjector(vehicle)

        def happen(kind: str, name: str) -> None:
            if kind == "abort":
                send(vehicle, imc.Abort())
            elif kind == "flat":
                if "Simulators.Battery" in names:
                    vehicle.task("Simulators.Battery").discharge_to(0.0)
            elif kind == "disconnect":
                vehicle.task(name).cancel_callbacks()
            else:
                for fault in BREAKS[kind]:
                    faults.begin(name, fault)

        for at, kind, name in flight.mission.faults:
            if name in names:
                vehicle.kernel.after(READY + at, happen, kind, name)

    fly_mission(flight, inject)
    return flight


BREAKS: dict[str, tuple[Fault, ...]] = {
    "mute": (Silent(),),
    "stuck": (Stuck(),),
    "fail": (Crash(),),
    "nan": (Wrong(math.nan),),
    "spike": (Wrong(1e6, once=True),),
    "jump": (Biased("GpsFix", "lat", 1e-3), Biased("GpsFix", "lon", 5e-4)),
}


def describe(flight: Flight) -> str:
    """The flight in a few lines."""
    mission = flight.mission
    legs = ", ".join(
        f"{type(step.data).__name__} {imc.ZUnits(step.data.z_units).name.lower()} {step.data.z:g}"
        for step in mission.plan.maneuvers
    )
    faults = ", ".join(f"{kind} {name} at {at:.0f} s" for at, kind, name in mission.faults)
    extra = ", ".join(text for text in mission.overrides if "Enabled" not in text)
    result = "; ".join(flight.violations) or flight.outcome
    return f"seed {flight.seed}, {mission.profile}: {result}\n  {legs}\n  {faults}\n  {extra}"


def fly_all(fly: Callable[[int], Flight], text: str, missions: int) -> int:
    """Fly the missions of the command line, print those that failed and how many; 1 if there is one."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=missions)
    parser.add_argument("--seed", type=int, default=1, help="of the first mission")
    parser.add_argument("--processes", type=int, default=multiprocessing.cpu_count())
    parser.add_argument("--profile", choices=sorted(set(PROFILES)), help="fly only the next seeds that draw this one")
    options = parser.parse_args()
    if options.missions < 1:
        parser.error(f"--missions {options.missions}: at least one mission is needed")
    began, outcomes, flown = time.monotonic(), Counter[str](), Counter[str]()
    drawn = (seed for seed in count(options.seed) if options.profile in (None, draw_profile(random.Random(seed))))
    seeds = list(islice(drawn, options.missions))
    with multiprocessing.get_context("spawn").Pool(options.processes) as pool:
        for flight in pool.imap(fly, seeds):
            outcomes[flight.outcome if not flight.violations else "failed"] += 1
            flown[flight.mission.profile] += 1
            if flight.violations or options.missions == 1:
                print(describe(flight), flush=True)
            if options.missions == 1:
                print(*flight.log, sep="\n")
    failed = outcomes["failed"]
    print(f"{platform.machine()}, Python {platform.python_version()}, {time.monotonic() - began:.0f} s, {dict(flown)}")
    print(f"{options.missions} missions of seeds {options.seed} to {seeds[-1]}, {failed} failed: {dict(outcomes)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(fly_all(fly, str(__doc__), 300))
