"""Runs a scenario in virtual time."""

import hashlib
import math
import os
import tempfile
import traceback
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import imc
import runtime
from imc.lsf import find_log, unpacked_chunks
from runtime.kernel import VirtualClock
from runtime.logs import logs_of_run
from runtime.vehicle import Fleet, Vehicle
from shoal.missions import COMPLETED, FAILED, Mission, Report, prepare
from shoal.scenarios.expectations import Expectation, Judge, unproved
from shoal.scenarios.metrics import Meter
from shoal.scenarios.profiles import placed
from shoal.scenarios.result import Result, Verdict
from shoal.scenarios.scenario import Actor, Scenario, ScenarioFileError
from shoal.scenarios.stage import Stage
from shoal.scenarios.starts import check_start
from shoal.scenarios.tracks import Track
from support.diagnostics import ProfileError

BELOW_TASKS = tuple(f"{package.__path__[0]}{os.sep}" for package in (imc, runtime))  # a mistake is seldom there
TRACKED = (imc.SimulatedState, imc.EstimatedState, imc.PlanControlState)


def run(scenario: Scenario, *, seed: int | None = None, log_root: Path | None = None) -> Result:
    """Run a scenario once in virtual time, in this process, and judge it.

    `seed` replaces that of the scenario. Logs are kept only with a `log_root`, in a folder for each vehicle. What goes
    wrong in the run, such as an exception of a task, is the `error` of the result. Nothing else is left behind. Raises
    ScenarioFileError before the run if a vehicle has not got what the file names, as `rehearse` does.
    """
    with _performance(scenario, scenario.seed if seed is None else seed, log_root) as performance:
        if not performance.error:
            try:
                performance.play()
            except Exception as error:
                performance.note(error)
        performance.close()
        return performance.result(keep_logs=log_root is not None)


def rehearse(scenario: Scenario) -> None:
    """Build the vehicles of a scenario, and prepare all that happens to them, without a run.

    Raises ScenarioFileError for what only a vehicle knows: labels of entities, leak sensors, what may change.
    """
    with _performance(scenario, scenario.seed, None):
        pass


@contextmanager
def _performance(scenario: Scenario, seed: int, log_root: Path | None) -> "Generator[_Performance]":
    """A run that can begin; it is closed at the end."""
    with tempfile.TemporaryDirectory(prefix="shoal-") as folder:
        performance = _Performance(scenario, seed)
        try:
            try:
                performance.build(log_root, Path(folder))
            except ProfileError as error:
                raise ScenarioFileError(performance.told(error)) from None
            except ScenarioFileError:
                raise
            except Exception as error:
                performance.note(error)
            yield performance
        finally:
            performance.close()


class _Performance:
    """One run of a scenario."""

    def __init__(self, scenario: Scenario, seed: int):
        self.error = ""
        self._scenario = scenario
        self._seed = seed
        self._fleet: Fleet | None = None
        self._stage: Stage | None = None
        self._vehicles: dict[str, Vehicle] = {}
        self._missions: dict[str, Mission] = {}
        self._flying: set[str] = set()
        self._judges: list[tuple[Expectation, Judge | None]] = []
        self._meters: list[Meter] = []
        self._last: dict[tuple[str, str], Callable[[], imc.Message | None]] = {}
        self._logs: dict[str, Path] = {}
        self._tracks: dict[str, Track] = {}
        self._seconds = 0.0
        self._has_begun = self._is_closed = False
        self._verdicts: list[Verdict] = []
        self._metrics: dict[str, float] = {}
        self._final: list[tuple[tuple[str, str], dict[str, object]]] = []

    def build(self, log_root: Path | None, folder: Path) -> None:
        """Make the vehicles and what watches them; they are not started."""
        for actor in self._scenario.actors:
            self._add(actor, log_root, folder)
        assert self._fleet is not None
        self._stage = stage = Stage(self._fleet, self._vehicles, self._seed)
        for actor in self._scenario.actors:
            vehicle = self._vehicles[actor.name]
            if actor.plan is not None:
                over, watch = partial(self._land, actor.name), partial(self._find_log, vehicle)
                self._missions[actor.name] = Mission(vehicle, actor.plan, over=over, watch=watch)
                self._flying.add(actor.name)
            track = self._tracks[actor.name] = Track(vehicle.system)
            vehicle.tap(imc.SimulatedState, track.keep)
            for kind in TRACKED:
                self._last[actor.name, kind.__name__] = stage.lookout.keep(actor.name, kind)
        for link in self._scenario.links:
            stage.channels[link.name] = link.arm(stage)
        for event in self._scenario.events:
            event.arm(stage)
        for metric in self._scenario.metrics:
            with _named(metric.origin):
                self._meters.append(metric.measure(stage))
        for expected in self._scenario.expectations:
            with _named(expected.origin):
                self._judges.append((expected, expected.judge(stage) if expected.kind != "outcome" else None))
        if self._scenario.stop_when is not None:
            with _named(f"{self._scenario.path}: stop when"):
                stage.when(self._scenario.stop_when, stage.stop)

    def _add(self, actor: Actor, log_root: Path | None, folder: Path) -> None:
        if self._fleet is None:
            self._fleet = Fleet(VirtualClock(actor.start_ns))
        made = prepare(
            actor.profile,
            actor.modes,
            config_dir=(actor.folder,),
            overrides=[setting.override for setting in actor.settings],
            vehicle=actor.name,
            fleet=self._fleet,
            seed=self._seed if actor.seed is None else actor.seed,
            log_root=log_root,
            state_folder=folder / "db" / actor.name,
        )
        check_start(made.vehicle, actor.settings)
        self._vehicles[actor.name] = made.vehicle

    def play(self) -> None:
        """Start all vehicles and run to the end of the scenario."""
        assert self._fleet is not None
        self._has_begun = True
        for name, vehicle in self._vehicles.items():
            if name in self._missions:
                self._missions[name].begin()
            else:
                vehicle.start()
        self._fleet.run(self._scenario.limit)

    def _land(self, name: str) -> None:
        """A plan is over: the run ends with the last one."""
        self._flying.discard(name)
        if not self._flying and self._stage is not None:
            self._stage.at(self._stage.time + self._scenario.settle, self._stage.stop)

    def _find_log(self, vehicle: Vehicle, state: imc.PlanControlState) -> None:
        """Remember the log that the plan is in: another one begins with it, and one more when it is over."""
        if vehicle.log_folder is not None and state.state == imc.PlanControlState.State.EXECUTING:
            self._logs[vehicle.name] = vehicle.log_folder

    def note(self, error: Exception) -> None:
        """Keep the first error of the run, for people."""
        self.error = self.error or self.told(error)

    def told(self, error: Exception) -> str:
        """An error in one line, with what is known of where it was."""
        if isinstance(error, ProfileError):
            settings = [setting for actor in self._scenario.actors for setting in actor.settings]
            return "; ".join(placed(problem, settings) for problem in error.problems)
        if isinstance(error, ScenarioFileError):
            return str(error)
        told, notes = f"{type(error).__name__}: {error}", "; ".join(getattr(error, "__notes__", ()))
        if not notes:
            return told
        frames = traceback.extract_tb(error.__traceback__)
        frame = next((f for f in reversed(frames) if not f.filename.startswith(BELOW_TASKS)), frames[-1])
        return f"{told} ({notes}, {Path(frame.filename).name}:{frame.lineno})"

    def close(self) -> None:
        """End all vehicles, once; what is judged is the state before."""
        if self._is_closed:
            return
        self._is_closed = True
        self._seconds = self._stage.time if self._stage is not None else 0.0
        try:
            self._look_back()
        except Exception as error:
            self.note(error)
        if self._fleet is not None:
            try:
                self._fleet.close()
            except Exception as error:
                self.note(error)

    def _look_back(self) -> None:
        if not self._has_begun:
            return
        channels = self._stage.channels.values() if self._stage is not None else ()
        self._metrics = {name: count for channel in channels for name, count in channel.figures().items()}
        self._metrics |= {meter.metric.name: meter.value() for meter in self._meters}
        self._final = [(key, last.to_dict()) for key, tell in self._last.items() if (last := tell()) is not None]
        self._verdicts = list(self._judge())

    def _judge(self) -> Iterator[Verdict]:
        for expected, judge in self._judges:
            yield judge.verdict() if judge is not None else self._judge_outcome(expected)
        for actor, report in self._failures():
            if not report.legs and not self.error:
                name, where = f"the plan of {actor.name} begins", actor.plan_origin
                yield Verdict(name, False, -math.inf, report.reason, time=self._seconds, origin=where)

    def _failures(self) -> Iterator[tuple[Actor, Report]]:
        """The plans that have failed, and whose outcome no expectation judges."""
        asked = {expected.vehicle for expected, _ in self._judges if expected.kind == "outcome"}
        for actor in self._scenario.actors:
            mission = self._missions.get(actor.name)
            if mission is not None and actor.name not in asked and mission.report.outcome == FAILED:
                yield actor, mission.report

    def _judge_outcome(self, expected: Expectation) -> Verdict:
        report = self._missions[expected.vehicle].report
        passed = report.outcome == expected.wanted
        reason = report.outcome if report.outcome == COMPLETED else f"{report.outcome}, {report.reason}"
        margin = math.inf if passed else -math.inf
        return Verdict(expected.name, passed, margin, reason, time=self._seconds, origin=expected.origin)

    def _first_log(self, name: str, first: Path) -> Path:
        """The first log of a vehicle, relative to the current folder if its last one is."""
        last = self._vehicles[name].log_folder
        assert last is not None
        root = last.parents[1]  # <day>/<log>
        return root / first.relative_to(root.absolute())

    def result(self, *, keep_logs: bool) -> Result:
        """What the run has shown, after it was closed."""
        warnings = [*self._scenario.warnings, *(self._stage.warnings if self._stage is not None else ())]
        if not self.error:
            warnings += unproved(self._verdicts)
            warnings += [
                f"the plan of {actor.name} has failed, and no outcome is expected: {report.reason}"
                for actor, report in self._failures()
                if report.legs
            ]
            warnings += self._stage.unhappened.values() if self._stage is not None else ()
            warnings += [words for meter in self._meters if (words := meter.complaint())]
        all_logs = {n: logs_of_run(v.log_folder) for n, v in self._vehicles.items() if keep_logs and v.log_folder}
        whole = dict(all_logs)
        for name, vehicle in self._vehicles.items():
            lost = [words for task in vehicle.tasks if (words := getattr(task, "lost", ""))]
            if keep_logs and vehicle.keeps_log and vehicle.log_folder is None and not lost:
                lost = ["nothing of it was written"]
            warnings += [f"the log of {name} is not complete: {words}" for words in lost]
            if lost:
                whole.pop(name, None)
        if self._stage is not None and not self.error:
            warnings += [f"{words}: this changed nothing" for words in self._stage.idle_faults()]
        found = Result(
            self._scenario.name,
            self._seed,
            tuple(self._verdicts),
            self._metrics,
            {name: mission.report.outcome for name, mission in self._missions.items() if self._has_begun},
            self._seconds,
            self.error,
            tuple(warnings),
            {name: self._logs.get(name) or self._first_log(name, folders[0]) for name, folders in all_logs.items()},
            {name: _hash(folders) for name, folders in whole.items()},
            tracks={name: track.points for name, track in self._tracks.items() if track.points},
        )
        return replace(found, fingerprint=_fingerprint(found, self._final))


@contextmanager
def _named(origin: str) -> Generator[None]:
    """Adds the place in the file to what shows only when the vehicle is there, such as labels that it lacks."""
    try:
        yield
    except ValueError as error:
        raise ScenarioFileError(f"{origin}: {error}") from None


def _hash(folders: Sequence[Path]) -> str:
    """SHA-256 of the unpacked data of logs."""
    made = hashlib.sha256()
    for folder in folders:
        for piece in unpacked_chunks(find_log(folder), _lose):
            made.update(piece)
    return made.hexdigest()


def _lose(at: int, size: int, reason: str) -> None:
    """What is damaged in a log that was just written is not part of its data."""


def _fingerprint(result: Result, final: object) -> str:
    """Of what does not depend on logs, files and computers."""
    verdicts = [(v.name, v.passed, v.margin, v.applied, v.time) for v in result.verdicts]
    known = verdicts, sorted(result.metrics.items()), sorted(result.outcomes.items()), result.seconds, final
    return hashlib.sha256(repr(known).encode()).hexdigest()
