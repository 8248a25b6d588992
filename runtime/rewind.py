"""Goes back in the log of a virtual run: from the nearest snapshot, or from its start, and on from there."""

import contextlib
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import imc
from runtime.build import build
from runtime.clock import SECOND, VirtualClock, nanoseconds
from runtime.config import items
from runtime.parameters import ParameterError
from runtime.profile import Profile, load_profile
from runtime.resim.outline import outline
from runtime.snapshot import Snapshot, load, restore, save
from runtime.snapshot_values import SnapshotError
from runtime.vehicle import Vehicle

PATTERN = "State-*.msgpack"


def run_with_snapshots(vehicle: Vehicle, seconds: float | None, every: float, keep: Callable[[bytes], object]) -> None:
    """Run a vehicle, and hand its state to `keep` every so many seconds of its time. Raises SnapshotError."""
    begin = vehicle.kernel.now_ns
    end = None if seconds is None else begin + round(seconds * SECOND)
    count = 1
    while True:
        pause = begin + round(count * every * SECOND)
        if end is not None and pause >= end:
            vehicle.kernel.run(until=end)
            return
        vehicle.kernel.run(until=pause)
        if vehicle.kernel.now_ns < pause or not vehicle.kernel.idle:
            return
        keep(save(vehicle))
        count += 1


def state_name(vehicle: Vehicle) -> str:
    """The file for a snapshot of this moment: State-<seconds of the run>.msgpack."""
    return f"State-{(vehicle.kernel.now_ns - nanoseconds(vehicle.start_time)) / SECOND:g}.msgpack"


def continued(snapshot: Snapshot, log_root: Path) -> Vehicle:
    """A vehicle in the state of a snapshot, with the configuration that is in it; it is started already.

    Raises SnapshotError, ProfileError.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "Config.ini"
        path.write_bytes(snapshot.configuration)
        vehicle = _vehicle(
            load_profile(path), log_root, snapshot.time, {label: number for label, number, *_ in snapshot.entities}
        )
    try:
        restore(vehicle, snapshot)
    except BaseException:
        vehicle.running.clear()
        vehicle.close()
        raise
    return vehicle


def state_at(log: imc.Log, seconds: float) -> Snapshot:
    """The state of the log's vehicle at a time of its run (s): found in the log's folder, or computed from there.

    Raises SnapshotError where the log is not one of a virtual run, ProfileError.
    """
    folder = log.path.parent
    if not (folder / "Config.ini").is_file():
        raise SnapshotError(f"{folder} has no Config.ini: only runs of Shoal can be repeated")
    profile = load_profile(folder / "Config.ini")
    wanted = profile.start_time_ns + round(seconds * SECOND)
    known = [snapshot for snapshot in _snapshots(folder) if snapshot.time <= wanted]
    with tempfile.TemporaryDirectory() as scratch:
        if known:
            vehicle = continued(max(known, key=lambda snapshot: snapshot.time), Path(scratch))
        else:
            _, first = next(log.packets(), (0, b""))
            if not first or imc.header(first).timestamp != profile.start_time:
                raise SnapshotError(
                    f"{log.path} does not begin with its vehicle on a virtual clock, and has no snapshot before "
                    f"{seconds:g} s: rewind the log that it came from"
                )
            about = outline(log)
            labels = about.labels if about is not None else {}
            vehicle = _vehicle(profile, Path(scratch), profile.start_time_ns, labels)
            vehicle.start()
        try:
            vehicle.kernel.run(until=wanted)
            return load(save(vehicle))
        finally:
            vehicle.close()


def change(vehicle: Vehicle, overrides: Sequence[str]) -> None:
    """Give parameters of a running vehicle other values, "Section:Option=value". Raises SnapshotError."""
    for assignment in overrides:
        left, _, text = assignment.partition("=")
        section, _, option = left.rpartition(":")
        with contextlib.suppress(KeyError):
            task = vehicle.task(section.strip())
            parameter = task.parameter_set.find(option.strip())
            if parameter is None:
                raise SnapshotError(f"{assignment}: {task.name} has no such parameter")
            try:
                task.parameter_set.set(parameter, parameter.parse(text.strip()))
                task.configure()
            except (ParameterError, ValueError) as error:
                raise SnapshotError(f"{assignment}: {error}") from None
            task.reconfigured()
            vehicle.remember(task)
            continue
        raise SnapshotError(f"{assignment}: the vehicle has no task {section.strip()!r}")


def _snapshots(folder: Path) -> Iterator[Snapshot]:
    for path in sorted(folder.glob(PATTERN)):
        try:
            yield load(path.read_bytes())
        except SnapshotError as error:
            raise SnapshotError(f"{path}: {error}") from None


def _vehicle(profile: Profile, log_root: Path, time: int, entity_ids: Mapping[str, int]) -> Vehicle:
    selected = frozenset(items(profile.config.value("General", "Selected")))
    clock = VirtualClock(time)
    return build(profile, selected, clock=clock, keep_going=False, log_root=log_root, entity_ids=entity_ids).vehicle
