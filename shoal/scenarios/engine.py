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
from shoal.scenarios.expectations import Expectation, ExpectationMonitor, vacuous_warnings
from shoal.scenarios.metrics import MetricRecorder
from shoal.scenarios.result import ExpectationVerdict, ScenarioResult
from shoal.scenarios.run_context import RunContext
from shoal.scenarios.scenario import Scenario, ScenarioFileError, VehicleSpec
from shoal.scenarios.scenario_profiles import format_profile_problem
from shoal.scenarios.start_depth_check import check_start_depth
from shoal.scenarios.true_track import TrueTrack
from support.diagnostics import ProfileError

BELOW_TASKS = tuple(f"{package.__path__[0]}{os.sep}" for package in (imc, runtime))  # a mistake is seldom there
WITHOUT_MONITOR = ("outcome", "metric")
TRACKED = (imc.SimulatedState, imc.EstimatedState, imc.PlanControlState)


def run(scenario: Scenario, *, seed: int | None = None, log_root: Path | None = None) -> ScenarioResult:
    """Run a scenario once in virtual time, in this process, and judge it.

    `seed` replaces that of the scenario. Logs are kept only with a `log_root`, in a folder for each vehicle. What goes
    wrong in the run, such as an exception of a task, is the `error` of the result. Nothing else is left behind. Raises
    ScenarioFileError before the run if a vehicle lacks what the file names, as `dry_run` does.
    """
    with _prepared_run(scenario, scenario.seed if seed is None else seed, log_root) as scenario_run:
        if not scenario_run.error:
            try:
                scenario_run.run()
            except Exception as error:
                scenario_run.record_error(error)
        scenario_run.close()
        return scenario_run.result(keep_logs=log_root is not None)


def dry_run(scenario: Scenario) -> None:
    """Build the vehicles of a scenario, and prepare all that happens to them, without a run.

    Raises ScenarioFileError for what only a vehicle can check: labels of entities, leak sensors, what may change.
    """
    with _prepared_run(scenario, scenario.seed, None):
        pass


@contextmanager
def _prepared_run(scenario: Scenario, seed: int, log_root: Path | None) -> "Generator[_ScenarioRun]":
    """A run that can begin; it is closed at the end."""
    with tempfile.TemporaryDirectory(prefix="shoal-") as folder:
        scenario_run = _ScenarioRun(scenario, seed)
        try:
            try:
                scenario_run.build(log_root, Path(folder))
            except ProfileError as error:
                raise ScenarioFileError(scenario_run.error_text(error)) from None
            except ScenarioFileError:
                raise
            except Exception as error:
                scenario_run.record_error(error)
            yield scenario_run
        finally:
            scenario_run.close()


class _ScenarioRun:
    """One run of a scenario."""

    def __init__(self, scenario: Scenario, seed: int):
        self.error = ""
        self._scenario = scenario
        self._seed = seed
        self._fleet: Fleet | None = None
        self._context: RunContext | None = None
        self._vehicles: dict[str, Vehicle] = {}
        self._missions: dict[str, Mission] = {}
        self._unfinished: set[str] = set()
        self._monitors: list[tuple[Expectation, ExpectationMonitor | None]] = []
        self._recorders: list[MetricRecorder] = []
        self._last: dict[tuple[str, str], Callable[[], imc.Message | None]] = {}
        self._logs: dict[str, Path] = {}
        self._tracks: dict[str, TrueTrack] = {}
        self._seconds = 0.0
        self._has_begun = self._is_closed = False
        self._verdicts: list[ExpectationVerdict] = []
        self._metrics: dict[str, float] = {}
        self._final: list[tuple[tuple[str, str], dict[str, object]]] = []

    def build(self, log_root: Path | None, folder: Path) -> None:
        """Make the vehicles and what watches them; they are not started."""
        for spec in self._scenario.vehicles:
            self._add(spec, log_root, folder)
        assert self._fleet is not None
        self._context = context = RunContext(self._fleet, self._vehicles, self._seed)
        for spec in self._scenario.vehicles:
            vehicle = self._vehicles[spec.name]
            if spec.plan is not None:
                over, watch = partial(self._on_plan_over, spec.name), partial(self._find_log, vehicle)
                self._missions[spec.name] = Mission(vehicle, spec.plan, over=over, watch=watch)
                self._unfinished.add(spec.name)
            track = self._tracks[spec.name] = TrueTrack(vehicle.system)
            vehicle.observe(imc.SimulatedState, track.record_position)
            for kind in TRACKED:
                self._last[spec.name, kind.__name__] = context.monitor.latest_message_getter(spec.name, kind)
        for link in self._scenario.links:
            context.channels[link.name] = link.open_channel(context)
        for happening in (*self._scenario.captures, *self._scenario.events):
            happening.schedule(context)
        for metric in self._scenario.metrics:
            with _named(metric.origin):
                self._recorders.append(metric.make_recorder(context))
        for expected in self._scenario.expectations:
            with _named(expected.origin):
                self._monitors.append(
                    (expected, expected.make_monitor(context) if expected.kind not in WITHOUT_MONITOR else None)
                )
        if self._scenario.stop_when is not None:
            with _named(f"{self._scenario.path}: stop when"):
                context.call_when(self._scenario.stop_when, context.stop)

    def _add(self, spec: VehicleSpec, log_root: Path | None, folder: Path) -> None:
        if self._fleet is None:
            self._fleet = Fleet(VirtualClock(spec.start_ns))
        made = prepare(
            spec.profile,
            spec.modes,
            config_dir=(spec.folder,),
            overrides=[setting.override_text for setting in spec.settings],
            vehicle=spec.name,
            fleet=self._fleet,
            seed=self._seed if spec.seed is None else spec.seed,
            log_root=log_root,
            state_folder=folder / "db" / spec.name,
        )
        check_start_depth(made.vehicle, spec.settings)
        self._vehicles[spec.name] = made.vehicle

    def run(self) -> None:
        """Start all vehicles and run to the end of the scenario."""
        assert self._fleet is not None
        self._has_begun = True
        for name, vehicle in self._vehicles.items():
            if name in self._missions:
                self._missions[name].begin()
            else:
                vehicle.start()
        self._fleet.run(self._scenario.limit)

    def _on_plan_over(self, name: str) -> None:
        """A plan is over: the run ends with the last one."""
        self._unfinished.discard(name)
        if not self._unfinished and self._context is not None:
            self._context.call_at(self._context.time + self._scenario.settle, self._context.stop)

    def _find_log(self, vehicle: Vehicle, state: imc.PlanControlState) -> None:
        """Remember the log that the plan is in: another one begins with it, and one more when it is over."""
        if vehicle.log_folder is not None and state.state == imc.PlanControlState.State.EXECUTING:
            self._logs[vehicle.name] = vehicle.log_folder

    def record_error(self, error: Exception) -> None:
        """Keep the first error of the run, for people."""
        self.error = self.error or self.error_text(error)

    def error_text(self, error: Exception) -> str:
        """An error in one line, with what is known of where it was."""
        if isinstance(error, ProfileError):
            settings = [setting for spec in self._scenario.vehicles for setting in spec.settings]
            return "; ".join(format_profile_problem(problem, settings) for problem in error.problems)
        if isinstance(error, ScenarioFileError):
            return str(error)
        text, notes = f"{type(error).__name__}: {error}", "; ".join(getattr(error, "__notes__", ()))
        if not notes:
            return text
        frames = traceback.extract_tb(error.__traceback__)
        frame = next((f for f in reversed(frames) if not f.filename.startswith(BELOW_TASKS)), frames[-1])
        return f"{text} ({notes}, {Path(frame.filename).name}:{frame.lineno})"

    def close(self) -> None:
        """End all vehicles, once; what is judged is the state before."""
        if self._is_closed:
            return
        self._is_closed = True
        self._seconds = self._context.time if self._context is not None else 0.0
        try:
            self._collect_results()
        except Exception as error:
            self.record_error(error)
        if self._fleet is not None:
            try:
                self._fleet.close()
            except Exception as error:
                self.record_error(error)

    def _collect_results(self) -> None:
        if not self._has_begun:
            return
        for watcher in (*self._recorders, *(monitor for _, monitor in self._monitors if monitor is not None)):
            watcher.finish()
        channels = self._context.channels.values() if self._context is not None else ()
        self._metrics = {name: count for channel in channels for name, count in channel.metrics().items()}
        self._metrics |= {recorder.metric.name: recorder.value() for recorder in self._recorders}
        self._final = [(key, last.to_dict()) for key, read in self._last.items() if (last := read()) is not None]
        self._verdicts = list(self._evaluate())

    def _evaluate(self) -> Iterator[ExpectationVerdict]:
        for expected, monitor in self._monitors:
            if monitor is not None:
                yield monitor.verdict()
            elif expected.kind == "metric":
                yield expected.judge_metric(self._metrics[expected.metric], self._seconds)
            else:
                yield self._evaluate_outcome(expected)
        for spec, report in self._failures():
            if not report.legs and not self.error:
                name, where = f"the plan of {spec.name} begins", spec.plan_origin
                yield ExpectationVerdict(name, False, -math.inf, report.reason, time=self._seconds, origin=where)

    def _failures(self) -> Iterator[tuple[VehicleSpec, Report]]:
        """The plans that have failed, and whose outcome no expectation judges."""
        asked = {expected.vehicle for expected, _ in self._monitors if expected.kind == "outcome"}
        for spec in self._scenario.vehicles:
            mission = self._missions.get(spec.name)
            if mission is not None and spec.name not in asked and mission.report.outcome == FAILED:
                yield spec, mission.report

    def _evaluate_outcome(self, expected: Expectation) -> ExpectationVerdict:
        report = self._missions[expected.vehicle].report
        passed = report.outcome == expected.wanted
        reason = report.outcome if report.outcome == COMPLETED else f"{report.outcome}, {report.reason}"
        margin = math.inf if passed else -math.inf
        return ExpectationVerdict(expected.name, passed, margin, reason, time=self._seconds, origin=expected.origin)

    def _first_log(self, name: str, first: Path) -> Path:
        """The first log of a vehicle, relative to the current folder if its last one is."""
        last = self._vehicles[name].log_folder
        assert last is not None
        root = last.parents[1]  # <day>/<log>
        return root / first.relative_to(root.absolute())

    def result(self, *, keep_logs: bool) -> ScenarioResult:
        """Result of the run, after it was closed."""
        warnings = [*self._scenario.warnings, *(self._context.warnings if self._context is not None else ())]
        if not self.error:
            warnings += vacuous_warnings(self._verdicts)
            warnings += [
                f"the plan of {spec.name} has failed, and no outcome is expected: {report.reason}"
                for spec, report in self._failures()
                if report.legs
            ]
            warnings += self._context.pending_events.values() if self._context is not None else ()
            warnings += [words for recorder in self._recorders if (words := recorder.warning())]
        all_logs = {n: logs_of_run(v.log_folder) for n, v in self._vehicles.items() if keep_logs and v.log_folder}
        whole = dict(all_logs)
        for name, vehicle in self._vehicles.items():
            lost = [words for task in vehicle.tasks if (words := getattr(task, "lost", ""))]
            if keep_logs and vehicle.keeps_log and vehicle.log_folder is None and not lost:
                lost = ["nothing of it was written"]
            warnings += [f"the log of {name} is not complete: {words}" for words in lost]
            if lost:
                whole.pop(name, None)
        if self._context is not None and not self.error:
            warnings += [f"{words}: this changed nothing" for words in self._context.ineffective_faults()]
        found = ScenarioResult(
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
        raise ScenarioFileError(str(error), origin) from None


def _hash(folders: Sequence[Path]) -> str:
    """SHA-256 of the unpacked data of logs."""
    made = hashlib.sha256()
    for folder in folders:
        for piece in unpacked_chunks(find_log(folder), _ignore_damage):
            made.update(piece)
    return made.hexdigest()


def _ignore_damage(at: int, size: int, reason: str) -> None:
    """Ignore damage in a log that was just written, which is not part of its data."""


def _fingerprint(result: ScenarioResult, final: object) -> str:
    """Hash of the results that do not depend on logs, files and computers."""
    verdicts = [(v.name, v.passed, v.margin, v.applied, v.time) for v in result.verdicts]
    known = verdicts, sorted(result.metrics.items()), sorted(result.outcomes.items()), result.seconds, final
    return hashlib.sha256(repr(known).encode()).hexdigest()
