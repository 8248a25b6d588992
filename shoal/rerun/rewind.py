"""Resumes a virtual run from a moment of its log, with the nearest snapshot or from its start."""

import math
import re
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from itertools import takewhile
from pathlib import Path
from typing import Any

import imc
from runtime.kernel import SECOND, VirtualClock
from runtime.logs import read_log_run_position
from runtime.profile import Profile, load_profile, split_list
from runtime.snapshot import (
    STATE,
    SUFFIX,
    InputJournals,
    Snapshot,
    SnapshotError,
    load,
    load_file,
    restore,
    take_snapshot,
)
from runtime.task import Parameter, Task, shared_options
from runtime.vehicle import Vehicle, build
from shoal.missions import PlanStartRequest, find_start_request
from shoal.rerun.log_summary import summarize_log
from shoal.rerun.run_log_sequence import LoggedRun, find_run_of_log
from support.diagnostics import ProfileError
from tasks.transports.logging import Logging

_INCLUDES = re.compile(rb"^[ \t\v\f\r]*\[[ \t\v\f\r]*(Include|Require)\s", re.MULTILINE)
"""Options that a saved configuration never has: they would read files of this machine."""


def resume_snapshot(
    snapshot: Snapshot,
    log_root: Path,
    *,
    overrides: Sequence[str] = (),
    journals: bool = False,
    before_start: Callable[[Vehicle], object] = lambda _: None,
    definitions: Path | None = None,
) -> Vehicle:
    """A started vehicle in the state of a snapshot, with the configuration in that snapshot.

    `definitions` is the IMC.xml.gz of its log, if it has messages of its own.
    `overrides` ("Section:Option=value") change parameters from then on. With `journals` it can be saved again while
    scripts run. `before_start` is called before the tasks have their state, so that observers receive messages before
    them.
    Raises SnapshotError; if a parameter or value is invalid, before a log is written.
    """
    if _INCLUDES.search(snapshot.configuration):
        raise SnapshotError("not a valid snapshot: its configuration includes files")
    path = Path()
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "Config.ini"
            path.write_bytes(snapshot.configuration)
            if definitions is not None and definitions.is_file():
                shutil.copy(definitions, folder)
            profile = load_profile(path)
            labels = {label: number for label, number, *_ in snapshot.entities}
            vehicle = _vehicle(profile, log_root, snapshot.time, labels)
    except ProfileError as error:
        raise SnapshotError(str(error).replace(str(path), "its Config.ini")) from error
    except OSError:
        raise
    except Exception as error:
        raise SnapshotError("not a valid snapshot: its configuration fits no vehicle") from error
    try:
        if journals:
            InputJournals(vehicle)
        before_start(vehicle)
        for assignment in overrides:
            _value(vehicle, assignment)
        restore(vehicle, snapshot)
    except BaseException:
        vehicle.running.clear()
        vehicle.kernel.clear()  # no call reaches a task that is half restored
        with suppress(SnapshotError):  # of a task that cannot stop; the first error is raised
            vehicle.close()
        raise
    try:
        for assignment in overrides:
            _change(vehicle, assignment)
    except BaseException:
        vehicle.close()
        raise
    return vehicle


class RewoundRun:
    """The run of a log: its state at a time, and the vehicle that continues from there.

    Raises SnapshotError if the log is not of a virtual run of Shoal, ProfileError.
    """

    def __init__(self, log: imc.Log):
        folder = log.path.parent
        if summarize_log(log) is None:
            raise SnapshotError(f"{log.path}: there is no message in this log")
        if not (folder / "Config.ini").is_file():
            raise SnapshotError(f"{folder} has no Config.ini: only runs of Shoal can be repeated")
        self._log = log
        self._run = find_run_of_log(log)
        first = self._run.logs[0].path.parent / "Config.ini"
        self._profile = load_profile(first if first.is_file() else folder / "Config.ini")

    @property
    def end(self) -> float:
        """The end of the log, in s of the run."""
        about = summarize_log(self._log)
        return about.end - self._profile.start_time if about is not None else 0.0

    def state_at(self, seconds: float) -> Snapshot:
        """The state at a time of the run (s): its snapshot, or computed from an earlier one or from the start.

        Raises SnapshotError if the run cannot be repeated, ProfileError.
        """
        wanted = self._profile.start_time_ns + round(seconds * SECOND)
        nearest = _nearest(self._run, seconds)
        if nearest is not None and nearest.time == wanted:
            return nearest
        with tempfile.TemporaryDirectory() as scratch:
            if nearest is not None:
                vehicle = self.vehicle(nearest, Path(scratch), journals=True)
            else:
                vehicle = self._from_start(Path(scratch))
            try:
                vehicle.kernel.run(until=wanted)
                state = take_snapshot(vehicle)
            finally:
                vehicle.close()
            for task in vehicle.tasks:
                if isinstance(task, Logging) and task.lost:
                    raise SnapshotError(f"the log of the repeated run is not complete: {task.lost}")
            if nearest is None:
                self._compare(Path(scratch), wanted)
        return load(state)

    def vehicle(
        self, snapshot: Snapshot, log_root: Path, *, overrides: Sequence[str] = (), journals: bool = False
    ) -> Vehicle:
        """The vehicle in a state of the run; it requests the plan if the run had not yet done so.

        `overrides` and `journals` are those of `resume_snapshot`. Raises SnapshotError, ProfileError.
        """

        def look_on(vehicle: Vehicle) -> None:
            self._request(vehicle, snapshot.time)

        xml = self._run.logs[0].path.parent / "IMC.xml.gz"
        return resume_snapshot(
            snapshot, log_root, overrides=overrides, journals=journals, before_start=look_on, definitions=xml
        )

    def _from_start(self, scratch: Path) -> Vehicle:
        profile, first = self._profile, self._run.logs[0]
        _, packet = next(first.packets(), (0, b""))
        if not packet or imc.header(packet).timestamp != profile.start_time:
            why = "does not begin with the start of a run in virtual time: a run in real time cannot be resumed, "
            why += "and a part of a log only from the log that it was made from"
            place, start = read_log_run_position(first.path.parent), datetime.fromtimestamp(profile.start_time, UTC)
            if self._run.gap and place is not None and place.first.startswith(f"{start:%Y%m%d/%H%M%S}"):
                why = f"cannot be repeated from the start of its run; {self._run.gap}"
            raise SnapshotError(f"{first.path} has no snapshot before this time, and {why}")
        about = summarize_log(self._run)
        vehicle = _vehicle(profile, scratch, profile.start_time_ns, about.entity_ids if about is not None else {})
        InputJournals(vehicle)
        self._request(vehicle, profile.start_time_ns)
        vehicle.start()
        return vehicle

    def _request(self, vehicle: Vehicle, time: int) -> None:
        """Request the plan of this run, unless the run had done so before a time (ns)."""
        found = find_start_request(self._run.packets(), self._run.schema, vehicle, time / SECOND)
        if found is not None and not found.is_sent:
            PlanStartRequest(vehicle, found.request, is_vehicle_ready=found.is_vehicle_ready)

    def _compare(self, scratch: Path, wanted: int) -> None:
        """Compare the log with the repeated run. Raises SnapshotError if they differ before a time (ns)."""
        _, first = next(self._log.packets(), (0, b""))
        begin, end = imc.header(first).timestamp, wanted / SECOND
        for path in sorted(scratch.glob("*/*/*")):
            again = imc.Log(path)
            _, packet = next(again.packets(), (0, b""))
            if not packet or imc.header(packet).timestamp != begin:
                continue
            pairs = zip(self._log.packets(), again.packets(), strict=False)
            for (_, old), (_, new) in takewhile(lambda pair: imc.header(pair[1][1]).timestamp < end, pairs):
                if old != new:
                    at = imc.header(new).timestamp - self._profile.start_time
                    raise SnapshotError(
                        f"{self._log.path} cannot be repeated from the start of its run, which differs at {at:.3f} s: "
                        "the run was changed on the way, or the log was written by another version"
                    )
            return
        if begin < end:
            raise SnapshotError(f"{self._log.path} cannot be repeated from the start of its run: it writes no such log")


def _value(vehicle: Vehicle, assignment: str) -> tuple[Task, Parameter, Any]:
    """Task, parameter and value of "Section:Option=value". Raises SnapshotError."""
    left, equals, text = assignment.partition("=")
    section, colon, option = left.rpartition(":")
    if not equals or not colon:
        raise SnapshotError(f"{assignment!r}: it must be Section:Option=value, such as 'Simulators.GPS:HDOP=2'")
    try:
        task = vehicle.task(section.strip())
    except KeyError:
        if shared_options((type(task) for task in vehicle.tasks), section.strip()):
            reason = f"[{section.strip()}] is read when a run begins: give it to `shoal run`"
        else:
            reason = f"the vehicle has no task {section.strip()!r}"
        raise SnapshotError(f"{assignment}: {reason}") from None
    parameter = task.parameter_set.find(option.strip())
    if parameter is None:
        raise SnapshotError(f"{assignment}: {task.name} has no such parameter")
    try:
        return task, parameter, parameter.parse(text.strip())
    except ValueError as error:
        raise SnapshotError(f"{assignment}: {error}") from None


def _change(vehicle: Vehicle, assignment: str) -> None:
    """Give a parameter of a running vehicle another value. Raises SnapshotError."""
    task, parameter, value = _value(vehicle, assignment)
    task.parameter_set.set(parameter, value)
    try:
        task.configure()
    except ValueError as error:
        raise SnapshotError(f"{assignment}: {error}") from None
    task.update_rates()
    vehicle.update_effective_config(task)


def _nearest(run: LoggedRun, seconds: float) -> Snapshot | None:
    """The latest snapshot beside the logs of a run that is not after a time of the run (s)."""
    paths = {_seconds(path): path for log in run.logs for path in log.path.parent.glob(f"{STATE}*{SUFFIX}")}
    latest = max((time for time in paths if time <= seconds), default=None)
    if latest is None:
        return None
    try:
        return load_file(paths[latest])
    except SnapshotError as error:
        raise SnapshotError(f"{paths[latest]}: {error}") from None


def _seconds(path: Path) -> float:
    """The time of the run (s) in the file name of a snapshot, NaN if there is none."""
    try:
        return float(path.name.removeprefix(STATE).removesuffix(SUFFIX))
    except ValueError:
        return math.nan


def _vehicle(profile: Profile, log_root: Path, time: int, entity_ids: Mapping[str, int]) -> Vehicle:
    selected = frozenset(split_list(profile.config.value("General", "Selected")))
    clock = VirtualClock(time)
    return build(
        profile,
        selected,
        clock=clock,
        keep_going=False,
        log_root=log_root,
        state_folder=log_root.parent / "db",
        entity_ids=entity_ids,
    ).vehicle
