"""Snapshots: a run continued from one publishes the same bytes as an uninterrupted run."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import imc
from runtime import Task
from runtime.kernel import SECOND, VirtualClock
from runtime.profile import load_profile, read_sections
from runtime.snapshot import SnapshotError, load, restore, take_snapshot
from runtime.snapshot.serializer import StateReader
from runtime.vehicle import Vehicle, build
from shoal.rerun import resume_snapshot
from tests.runtime.snapshot.keeper import keeper, through

LENGTH = 6.0
MIXER = "tests.shoal.rerun.interplay.Mixer"


def vehicle_of(profile: str | Path, root: Path, time: int | None = None, modes: str = "Kinematic") -> Vehicle:
    loaded = load_profile(profile)
    clock = VirtualClock(loaded.start_time_ns if time is None else time)
    return build(loaded, set(modes.split(",")), clock=clock, seed=1, log_root=root).vehicle


class Packets(list[bytes]):
    """The packets of a log, with a short repr for failing tests."""

    def __repr__(self) -> str:
        return f"<{len(self)} packets>"


def packets(root: Path) -> Packets:
    (path,) = root.glob("*/*/*")
    return Packets(packet for _, packet in imc.Log(path).packets())


def run_to(vehicle: Vehicle, seconds: float) -> None:
    """Run to a time on the vehicle's clock, exact to the nanosecond."""
    vehicle.kernel.run(until=round(vehicle.start_time) * 1_000_000_000 + round(seconds * 1e9))


def whole(
    profile: str | Path, root: Path, *times: float, modes: str = "Kinematic", length: float = LENGTH
) -> list[bytes]:
    """Run with snapshots at these times; returns the snapshots."""
    vehicle = vehicle_of(profile, root, modes=modes)
    vehicle.start()
    saved: list[bytes] = []
    for time in times:
        run_to(vehicle, time)
        saved.append(take_snapshot(vehicle))
    run_to(vehicle, length)
    vehicle.close()
    return saved


def go_on(
    profile: str | Path, root: Path, snapshot: bytes, modes: str = "Kinematic", length: float = LENGTH
) -> list[bytes]:
    """The packets from the snapshot on, without the first ones of every log."""
    state = load(snapshot)
    vehicle = vehicle_of(profile, root, state.time, modes)
    restore(vehicle, state)
    run_to(vehicle, length)
    vehicle.close()
    found = packets(root)
    heading = 2 + sum(imc.header(packet).id == imc.EntityInfo.ID for packet in found[:20])
    return Packets(found[heading:])


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    root = tmp_path_factory.mktemp("whole")
    assert whole("lauv-noptilus-1", root) == []
    return packets(root)


@pytest.mark.heavy
@given(time=st.one_of(st.floats(0.001, LENGTH - 0.1), st.sampled_from([0.75, 1.0, 1.01, 3.01, 5.0])))
@settings(max_examples=8, suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture])
def test_the_stock_vehicle_goes_on_with_the_same_bytes(
    uninterrupted: list[bytes], tmp_path_factory: pytest.TempPathFactory, time: float
) -> None:
    folder = tmp_path_factory.mktemp("parts")
    (snapshot,) = whole("lauv-noptilus-1", folder / "a", time)
    assert packets(folder / "a") == uninterrupted
    after = go_on("lauv-noptilus-1", folder / "b", snapshot)
    assert after == uninterrupted[-len(after) :]
    time_ns = load(snapshot).time
    states = [imc.header(p).timestamp for p in uninterrupted if imc.header(p).id == imc.SimulatedState.ID]
    resumed = next(imc.header(p).timestamp for p in after if imc.header(p).id == imc.SimulatedState.ID)
    assert resumed == next(time for time in states if time >= time_ns / SECOND)


@pytest.mark.heavy
def test_a_camera_that_is_about_to_deliver_goes_on(tmp_path: Path) -> None:
    modes = "Kinematic,Camera"
    overrides = "[Require lauv-noptilus-1.ini]\n[Vision.FisheyeCamera]\nSize = 64\nFace Size = 32\n"
    (tmp_path / "small.ini").write_text(overrides)
    (snapshot,) = whole(tmp_path / "small.ini", tmp_path / "a", 3.03, modes=modes)
    after = go_on(tmp_path / "small.ini", tmp_path / "b", snapshot, modes)
    before = packets(tmp_path / "a")[-len(after) :]
    assert [p for p in after if not is_picture(p)] == [p for p in before if not is_picture(p)]
    assert len(after) > 1000
    pictures = told(after)
    assert pictures, "each is told, in the folder of its own log"
    assert all(a.split(";")[1:] == b.split(";")[1:] for a, b in zip(pictures, told(before), strict=True))


def is_picture(packet: bytes) -> bool:
    return imc.packet_id(packet) == imc.Event.ID


def told(found: Sequence[bytes]) -> list[str]:
    return [imc.decode(packet).data for packet in found if is_picture(packet)]


@given(st.lists(st.floats(0.0, 1.4), min_size=2, max_size=4), st.integers(0, 2**32))
@settings(max_examples=5)
def test_delays_heavy_work_and_random_numbers_go_on(
    tmp_path_factory: pytest.TempPathFactory, times: list[float], numbers: int
) -> None:
    folder = tmp_path_factory.mktemp("mixed")
    lines = ["[General]", "Vehicle = mixed", "[Transports.Logging]", "Enabled = Always"]
    for letter, rate in zip("ABC", (7.0, 10.0, 30.0), strict=True):
        delay, latency, numbers = numbers % 7 / 50, numbers // 7 % 5 / 30, numbers // 35
        lines += [
            f"[{MIXER}/{letter}]",
            "Enabled = Always",
            f"Rate = {rate}",
            f"Delay = {delay}",
            f"Latency = {latency}",
        ]
    (folder / "mixed.ini").write_text("\n".join(lines) + "\n")
    for number, snapshot in enumerate(whole(folder / "mixed.ini", folder / "a", *sorted(times), length=1.5)):
        after = go_on(folder / "mixed.ini", folder / str(number), snapshot, length=1.5)
        assert after == packets(folder / "a")[-len(after) :]


@pytest.mark.parametrize(
    ("value", "what"),
    [
        (iter([1]), "list_iterator"),
        (lambda: 1, "the function"),
        ((n for n in [1]), "generator"),
        (open, "the function open"),
        (np.array([object()]), "array of objects"),
    ],
)
def test_what_cannot_be_saved_is_named(value: object, what: str) -> None:
    with pytest.raises(SnapshotError, match=rf"Keeper: items\[\.\.\.\] is (a|an|the) .*{what.split()[-1]}"):
        through([value])


def test_a_script_cannot_be_saved() -> None:
    async def wait(script: Any) -> None:
        await script.sleep(5)

    vehicle = keeper()
    vehicle.start()
    vehicle.task("Keeper").start_script(wait)
    vehicle.run(1.0)
    with pytest.raises(SnapshotError, match="Keeper runs a script"):
        take_snapshot(vehicle)
    vehicle.close()


@pytest.mark.parametrize("data", [b"", b"\x80", b"garbage", msgspec.msgpack.encode({"format": 1})])
def test_what_is_no_snapshot_is_refused(data: bytes) -> None:
    with pytest.raises(SnapshotError, match="not a valid snapshot"):
        load(data)


@pytest.mark.parametrize(
    "plain",
    [
        ["object", "os:system", []],
        ["new", 0, "object", "subprocess:Popen", []],
        ["enum", "runtime.vehicle.vehicle:Vehicle", 1],
        ["struct", "runtime.kernel.kernel:Kernel", []],
        ["method", ["new", 0, "list", []], "clear"],
        ["type", "os:path"],
        ["function", "os:system"],
    ],
)
def test_a_snapshot_cannot_make_or_call_what_it_wants(plain: Any) -> None:
    def nothing(words: list[Any]) -> object:
        raise SnapshotError(f"{words[0]} is unknown")

    with pytest.raises(SnapshotError):
        StateReader(nothing).from_plain_value(plain)


GPS, HACC = "Simulators.GPS/Kinematic", "HACC"


def accurate(vehicle: Vehicle, text: str) -> Task:
    """The GPS with a changed parameter."""
    task = vehicle.task(GPS)
    parameter = task.parameter_set.find(HACC)
    assert parameter is not None
    task.parameter_set.set(parameter, parameter.parse(text))
    vehicle.update_effective_config(task)
    return task


def saved_parameters(vehicle: Vehicle, folder: Path) -> dict[str, str]:
    vehicle.state_folder = folder
    return read_sections(vehicle.save_parameters(vehicle.task(GPS)))[GPS]


def test_parameters_that_were_changed_are_still_saved_after_a_snapshot(tmp_path: Path) -> None:
    vehicle = vehicle_of("lauv-noptilus-1", tmp_path / "a")
    vehicle.start()
    of_profile = vehicle.task(GPS).parameter_set.text(vehicle.task(GPS).parameters()[HACC])
    accurate(vehicle, "7.5")
    run_to(vehicle, 1.0)
    state = take_snapshot(vehicle)
    vehicle.close()
    assert load(state).profile == {GPS: {HACC: of_profile.encode()}}
    again = resume_snapshot(load(state), tmp_path / "b")
    second = take_snapshot(again)
    assert saved_parameters(again, tmp_path / "c") == {HACC: "7.5"}
    again.close()
    assert load(second).profile == load(state).profile
    third = resume_snapshot(load(second), tmp_path / "d")
    accurate(third, of_profile)
    assert saved_parameters(third, tmp_path / "e") == {}
    third.close()


@pytest.mark.parametrize("profile", [{"Simulators.GPX": {HACC: b"1"}}, {GPS: {"HACK": b"1"}}])
def test_parameters_that_a_vehicle_does_not_have_are_refused(tmp_path: Path, profile: Any) -> None:
    vehicle = vehicle_of("lauv-noptilus-1", tmp_path / "a")
    vehicle.start()
    run_to(vehicle, 1.0)
    state = load(take_snapshot(vehicle))
    vehicle.close()
    state.profile = profile
    with pytest.raises(SnapshotError, match=r"not a valid snapshot: .*(GPX|HACK)"):
        resume_snapshot(state, tmp_path / "b")


def test_a_vehicle_whose_task_refuses_an_override_is_closed(tmp_path: Path) -> None:
    vehicle = vehicle_of("lauv-noptilus-1", tmp_path / "a")
    vehicle.start()
    run_to(vehicle, 1.0)
    state = load(take_snapshot(vehicle))
    vehicle.close()
    seen: list[Vehicle] = []
    override = f"{GPS}:Initial Position=100, 0"
    with pytest.raises(SnapshotError, match=r"Initial Position=100, 0: .* is not a latitude and a longitude"):
        resume_snapshot(state, tmp_path / "b", overrides=[override], before_start=seen.append)
    (again,) = seen
    assert again.closing
    assert again.running == set()


def test_another_vehicle_is_refused(tmp_path: Path) -> None:
    vehicle = keeper()
    vehicle.start()
    vehicle.run(1.0)
    state = load(take_snapshot(vehicle))
    vehicle.close()
    other = vehicle_of("lauv-noptilus-1", tmp_path, state.time)
    with pytest.raises(SnapshotError, match="other tasks than the snapshot"):
        restore(other, state)
    other.close()
