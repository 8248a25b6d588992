"""A stand-in for the engine of scenarios, so that a thousand runs take no time; and the studies that the tests use."""

import hashlib
import math
import os
from pathlib import Path

from shoal.scenarios import ExpectationVerdict, ScenarioDependencies, ScenarioResult

SCENARIO = """\
scenario: dive
world:
  current: {north: 0.1, east: 0}
vehicle:
  profile: lauv-noptilus-1
  parameters:
    Simulators.GPS: {HACC: 3}
"""
STUDY = """\
scenario: dive.scenario.yaml
vary:
  world/current/north: {normal: [0, 0.5]}
  world/current/east: {uniform: [-1, 1]}
runs: 40
seed: 5
"""


class StandInDraft:
    """The places of a scenario's file. The only ones that may be added are parameters."""

    def __init__(self, path, root):
        self._root = root
        self.digest = hashlib.sha256(repr(root.value()).encode()).hexdigest()

    def scalars_by_path(self):
        found = {}

        def walk(node, path):
            if isinstance(node.content, dict):
                for key, below in node.content.items():
                    walk(below, [*path, key])
            else:
                found["/".join(path)] = node

        walk(self._root, [])
        return found

    def scenario(self, values=None):
        known = self.scalars_by_path()
        for name in values or {}:
            if name not in known and not name.startswith("vehicle/parameters/"):
                raise ValueError(f"unknown {name}")
        return values

    def dependencies(self, values=None):
        return ScenarioDependencies()

    def dry_run(self, values=None):
        self.scenario(values)


class StandInRuns:
    """Runs that drift by the current; a run fails if it drifts by more than 0.8 m. Counts those done in a file."""

    def __init__(self, counter=None, deadly=None):
        self._counter, self._deadly = counter, deadly

    def __call__(self, job):
        if self._counter is not None:
            with Path(self._counter).open("a") as file:
                file.write(f"{job.key}\n")
        north = float(str(job.values.get("world/current/north", 0.1)).split()[0])
        east = float(str(job.values.get("world/current/east", 0.0)).split()[0])
        noise = int(hashlib.sha256(str(job.seed).encode()).hexdigest()[:8], 16) / 2**32 - 0.5
        drift = math.hypot(north, 0.3 * east) + 0.05 * noise
        if job.key == self._deadly:
            return ScenarioResult("dive", job.seed, error="Navigation.AUV: ZeroDivisionError")
        kept = ExpectationVerdict(
            "stays_near", drift < 0.8, 0.8 - drift, "" if drift < 0.8 else f"drift of {drift:.2f} m"
        )
        logs, hashes = {}, {}
        if job.log_root is not None:
            folder = job.log_root / "lauv" / "20240101" / "000000"
            folder.mkdir(parents=True)
            (folder / "Data.lsf").write_bytes(os.fsencode(repr(drift)))
            logs, hashes = {"lauv": folder}, {"lauv": hashlib.sha256(repr(drift).encode()).hexdigest()}
        return ScenarioResult(
            "dive",
            job.seed,
            (kept, ExpectationVerdict("ends_well", True)),
            {"drift": drift, "never": math.nan},
            {"lauv": "SUCCESS"},
            600.0,
            logs=logs,
            hashes=hashes,
            fingerprint=hashlib.sha256(repr((drift, job.seed)).encode()).hexdigest(),
        )


def write_study(folder, text=STUDY, scenario=SCENARIO):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "dive.scenario.yaml").write_text(scenario)
    path = folder / "dive.study.yaml"
    path.write_text(text)
    return path


def comparable(data):
    """What must be the same of two campaigns."""
    return repr([{key: value for key, value in row.items() if key != "cpu"} for row in data.counted_rows])
