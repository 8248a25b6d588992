"""Stands in for a scenario that a search may break, and for its runs."""

import math
from pathlib import Path

from shoal.campaigns.studies.study import load_study
from shoal.campaigns.study_execution import run_study
from shoal.scenarios import ExpectationVerdict, ScenarioResult
from tests.shoal.campaigns.standin import write_study

SCENARIO = """\
scenario: dive
seed: 3
vehicle:
  profile: lauv-noptilus-1
  modes: Kinematic
  parameters: {Control.Path.VectorField: {Corridor -- Width: 2.5}}
world: {current: {north: 0.1 m/s, east: 0}}
expect:
  - {name: stays, always: SimulatedState.x < 3 m}
  - {name: dives, eventually: SimulatedState.z > 3 m}
metrics:
  far: {last: SimulatedState.x}
limit: 20 s
"""
NORTH, EAST, GPS = "world/current/north", "world/current/east", "vehicle/parameters/Simulators.GPS/HACC"
STUDY = f"""\
scenario: dive.scenario.yaml
vary:
  {NORTH}: {{uniform: [-1 m/s, 1 m/s]}}
  {EAST}: {{normal: [0, 0.3]}}
  {GPS}: {{integer: [1, 9]}}
search: {{minimize: margin of stays, shrink: 40}}
runs: 30
seed: 5
"""


class Slope:
    """Stands in for runs: the margin falls with the current north, and with east a little; notes each run in a file."""

    def __init__(self, counter=None, dead=False, gain=""):
        self._counter, self._dead, self._gain = counter, dead, gain

    def __call__(self, job):
        if self._counter is not None:
            with Path(self._counter).open("a") as file:
                file.write(f"{job.key}\n")
        if self._dead and job.key == 4:
            return ScenarioResult("dive", job.seed, error="Navigation.AUV: ZeroDivisionError")
        north, east, gps = (float(str(job.values.get(place, usual)).split()[0]) for place, usual in USUAL.items())
        margin = 0.413 - north - 0.01 * abs(east) + 0.0 * gps
        stays = ExpectationVerdict("stays", margin > 0.0, margin, "" if margin > 0.0 else f"failed by {-margin:.3f}")
        depth = ExpectationVerdict("dives", north > -0.9, math.inf if north > -0.9 else -math.inf)
        far = (north + 0.95) ** 2 + (gps - 7.0) ** 2 / 64.0 + abs(job.values.get(self._gain, 9.0) - 2.0)
        digest = f"{job.seed} {north!r} {east!r} {gps!r}"
        return ScenarioResult("dive", job.seed, (stays, depth), {"far": far}, fingerprint=digest)


USUAL = {NORTH: 0.1, EAST: 0.0, GPS: 4.0}


def write(folder, text=STUDY, scenario=SCENARIO):
    return write_study(folder, text, scenario)


class Dead:
    """A runner that must not get a job."""

    def __call__(self, job):
        raise AssertionError(job)


def do(path, folder, workers=0, make=Slope, **options):
    return run_study(load_study(path, **options), folder, make_runner=make, workers=workers)
