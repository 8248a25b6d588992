"""Re-simulation: the bytes of the log without changes, and the differences with changes."""

import gzip
import shutil
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

import imc
from imc.lsf import LsfWriter
from runtime.kernel import VirtualClock, nanoseconds
from runtime.profile import load_profile
from runtime.snapshot import SnapshotError
from runtime.vehicle import build, find_task
from shoal import fly
from shoal.rerun import ResimulationError, RewoundRun, TimestampResolver, resimulate
from tests.command import shoal
from tests.outside import NO_FOLDER

LOGS = Path(__file__).parents[2] / "data" / "logs"
MIXER = "tests.shoal.rerun.interplay.Mixer"
CAMERA = "Simulators.MUGDetectionCamera"
OTHERS = ("DepthSensor", "EstimatedState", "GPS/Kinematic", "IMU/AHRS")
STOCK = [*(f"Simulators.{name}" for name in OTHERS), CAMERA]


def run(
    folder: Path, profile: str | Path, seconds: float, *feed: tuple[float, imc.Message], mode: str = "Kinematic"
) -> imc.Log:
    """The log of a virtual run, in which an operator sends the messages of `feed` at their times."""
    loaded = load_profile(profile)
    made = build(loaded, {mode}, clock=VirtualClock(loaded.start_time_ns), seed=1, log_root=folder)
    for time, message in feed:
        said = message.replace(timestamp=loaded.start_time + time, src=0x4001, dst=made.vehicle.system)
        made.vehicle.kernel.after(time, made.vehicle.bus.deliver_and_send, said, imc.encode(said), None)
    made.vehicle.start()
    made.vehicle.run(seconds)
    made.vehicle.close()
    return imc.Log(max(folder.glob("*/*/*")))


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> imc.Log:
    return run(tmp_path_factory.mktemp("log"), "lauv-noptilus-1", 15.0)


def copy(log: imc.Log, folder: Path, count: int) -> imc.Log:
    """The first packets of a log, with its configuration."""
    shutil.copy(log.path.parent / "Config.ini", folder)
    writer = LsfWriter(folder / "Data.lsf", "none")
    for _, (_, packet) in zip(range(count), log.packets(), strict=False):
        writer.write(packet)
    writer.close()
    return imc.Log(folder)


@pytest.mark.parametrize("sections", [*([section] for section in STOCK), STOCK], ids=lambda names: names[-1])
def test_every_task_says_again_what_is_in_the_log(log: imc.Log, sections: list[str]) -> None:
    done = resimulate(log, sections)
    assert done.exact
    assert done.comparison.equal
    assert done.comparison.bytes == 0
    assert done.notes == []
    said = sum(tally.published for tally in done.comparison.counts.values())
    labels = {section: load_profile("lauv-noptilus-1").config.value(section, "Entity Label") for section in sections}
    assert set(done.labels.values()) == set(labels.values())
    owned = [p for _, p in log.packets() if imc.header(p).src_ent in done.labels]
    assert said == len(owned) > 30


@pytest.mark.heavy
def test_late_measurements_and_labels_of_others_are_what_they_were(tmp_path: Path) -> None:
    (tmp_path / "idle.ini").write_text("[Require lauv-noptilus-1.ini]\n[Plan.Autostart]\nEnabled = Never\n")
    log = run(tmp_path / "log", tmp_path / "idle.ini", 11.0, mode="Simulation")
    for section in ("Navigation.AUV.Navigation", "Monitors.FuelLevel", "Monitors.Entities"):
        done = resimulate(log, [section])
        assert done.comparison.first is None
        assert len(done.comparison.counts) > 2


@pytest.mark.heavy
def test_the_log_of_a_plan_begins_with_its_run(tmp_path: Path) -> None:
    log = run(tmp_path, "lauv-noptilus-1", 9.0, mode="Simulation")
    assert log.path.parent.name == "000005_dive"
    profile = load_profile(log.path.parent / "Config.ini")
    enabled = {s: find_task(s) for s in profile.config.sections if profile.is_task_enabled(s, ["Simulation"])}
    every = [s for s, cls in enabled.items() if not cls.external and not s.startswith("Transports.")]
    assert len(every) > 40
    for sections in (["Plan.Engine"], ["Maneuver.Loiter"], ["Simulators.Servos"], [CAMERA], every):
        done = resimulate(log, sections)
        assert done.exact
        assert done.comparison.bytes == 0
        assert done.comparison.first is None
        assert sum(tally.equal for tally in done.comparison.counts.values()) > 15
        assert "starts with the earlier logs of the run: 000000" in done.notes
    first = log.path.parent.parent / "000000"
    (first / "Data.lsf.gz").unlink()
    done = resimulate(log, [CAMERA])
    assert not done.exact
    assert done.notes[0].startswith("the log begins 5.0 s after the vehicle")
    assert f"{first}: no log in the folder" in done.notes[0]
    shutil.rmtree(first)
    missing = (
        "log 1 of its run, which began with 20260101/000000, is missing: put all logs of the run beside each other"
    )
    assert missing in resimulate(log, [CAMERA]).notes[0]
    with pytest.raises(SnapshotError, match=f"cannot be repeated from the start of its run; {missing}"):
        RewoundRun(log).state_at(7.0)


def test_measurements_of_the_moment_in_which_a_mission_ends(tmp_path: Path) -> None:
    maneuvers = [imc.PlanManeuver(maneuver_id="hold", data=imc.StationKeeping(lat=0.7, lon=-0.15, duration=1))]
    plan = imc.PlanSpecification(plan_id="refused", start_man_id="hold", maneuvers=maneuvers)
    assert not fly(plan, "hexa-00", log_root=tmp_path).completed
    log = imc.Log(max(tmp_path.glob("*/*/*")))
    for section in ("Simulators.Barometer", "Simulators.GPS", "Navigation.UAV.Navigation"):
        assert resimulate(log, [section]).comparison.bytes == 0


def test_the_log_of_the_re_simulation_is_the_log(log: imc.Log, tmp_path: Path) -> None:
    resimulate(log, [CAMERA, "Simulators.GPS/Kinematic"], out=tmp_path / "out")
    again = tmp_path / "out"
    assert list(imc.Log(again).packets()) == list(log.packets())
    assert (again / "Config.ini").read_bytes() == (log.path.parent / "Config.ini").read_bytes()
    assert gzip.decompress((again / "IMC.xml.gz").read_bytes()) == imc.dump(imc.builtin())


RATES = st.sampled_from([0.0, 1.0, 3.0, 7.0, 10.0, 20.0, 30.0])
DELAYS = st.sampled_from([0.0, 0.01, 0.05, 0.1, 0.0123, 0.25])
TASKS = st.lists(st.tuples(RATES, DELAYS, DELAYS, st.integers(1, 4)), min_size=2, max_size=4)


def interplay(folder: Path, tasks: list[tuple[float, float, float, int]]) -> tuple[imc.Log, list[str]]:
    """The log of mixers that answer each other, with these rates, delays, latencies and answers; and their sections."""
    names = [f"{MIXER}/{letter}" for letter in "ABCD"[: len(tasks)]]
    lines = ["[General]", "Vehicle = mixed", "[Transports.Logging]", "Enabled = Always"]
    for name, (rate, delay, latency, answers) in zip(names, tasks, strict=True):
        lines += [f"[{name}]", "Enabled = Always", f"Rate = {rate}", f"Delay = {delay}"]
        lines += [f"Latency = {latency}", f"Answers = {answers}"]
    (folder / "mixed.ini").write_text("\n".join(lines) + "\n")
    return run(folder / "log", folder / "mixed.ini", 1.5), names


@given(tasks=TASKS, data=st.data())
@settings(
    max_examples=25,
    deadline=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=[HealthCheck.too_slow],
)
def test_what_comes_in_one_moment_keeps_its_order(
    tmp_path_factory: pytest.TempPathFactory, tasks: list[tuple[float, float, float, int]], data: st.DataObject
) -> None:
    log, names = interplay(tmp_path_factory.mktemp("interplay"), tasks)
    chosen = data.draw(st.lists(st.sampled_from(names), min_size=1, unique=True))
    done = resimulate(log, chosen)
    assert done.comparison.first is None
    assert done.comparison.bytes == 0


def test_answers_that_come_after_many_other_moments_keep_their_nanosecond(tmp_path: Path) -> None:
    """Between a tick of the last and the answers, 0.25 s later, are 40 other moments."""
    log, names = interplay(
        tmp_path, [(30.0, 0.25, 0.0123, 4), (20.0, 0.0, 0.0, 3), (10.0, 0.25, 0.0123, 2), (7.0, 0.01, 0.0123, 1)]
    )
    assert [resimulate(log, [name]).comparison.bytes for name in names] == [0, 0, 0, 0]


def test_parameters_that_were_set_on_the_way_are_set_again(tmp_path: Path) -> None:
    entry = imc.EntityParameter(name="Detection Rate", value="2")
    changes = [(3.0, imc.SetEntityParameters(name="MUG Camera", params=(entry,)))]
    changes += [(4.0, imc.QueryEntityParameters(name="MUG Camera"))]
    done = resimulate(run(tmp_path, "lauv-noptilus-1", 8.0, *changes), [CAMERA])
    assert done.comparison.equal
    assert any(kind == imc.EntityParameters.ID for _, kind in done.comparison.counts)


def test_what_if(log: imc.Log) -> None:
    done = resimulate(log, [CAMERA], overrides=[f"{CAMERA}:MUGs=1.0 0.3, 2.0 1.0"])
    assert not done.exact
    (tally,) = [t for (_, kind), t in done.comparison.counts.items() if kind == imc.EstimatedMugState.ID]
    assert tally.logged > 10
    assert tally.published > tally.logged
    assert tally.only_logged == 0
    first = done.comparison.first
    assert first is not None
    assert imc.header(first.published or b"").id == imc.EstimatedMugState.ID


def test_what_if_tells_the_differences_of_fields(log: imc.Log) -> None:
    done = resimulate(log, ["GPS"], overrides=["Simulators.GPS/Kinematic:HACC=5"])
    (tally,) = [t for (_, kind), t in done.comparison.counts.items() if kind == imc.GpsFix.ID]
    changed = {name: figures for name, figures in tally.fields.items() if figures.changed}
    assert list(changed) == ["hacc"]
    assert (changed["hacc"].mean, changed["hacc"].rms, changed["hacc"].largest) == pytest.approx((3.0, 3.0, 3.0))
    assert (tally.changed, tally.equal, tally.only_logged, tally.only_published) == (tally.logged, 0, 0, 0)


def test_another_seed_is_another_noise(log: imc.Log) -> None:
    done = resimulate(log, ["AHRS"], overrides=["General:Seed=2"])
    assert not done.comparison.equal


def test_a_log_that_was_cut_short_is_the_same_as_far_as_it_goes(log: imc.Log, tmp_path: Path) -> None:
    done = resimulate(copy(log, tmp_path, 1801), ["IMU", "MUG Camera"])
    assert done.comparison.equal
    assert done.notes == ["the log does not end cleanly: its last messages may be missing"]


def test_a_damaged_log_says_what_nobody_can_know(log: imc.Log, tmp_path: Path) -> None:
    part = copy(log, tmp_path, 3000).path
    data = bytearray(part.read_bytes())
    data[50_000] ^= 1
    part.write_bytes(data)
    assert any("damaged places" in note for note in resimulate(imc.Log(part), [CAMERA]).notes)


def test_a_log_of_dune_says_what_cannot_be_reproduced() -> None:
    done = resimulate(imc.Log(LOGS / "dune-idle"), ["Simulators.GPS", CAMERA])
    assert not done.exact
    assert any("has no Config.ini" in note for note in done.notes)
    assert any("wall clock" in note for note in done.notes)
    assert any(tally.published for tally in done.comparison.counts.values())


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("Simulators.MUGDetectionCamara", "did you mean 'Simulators.MUGDetectionCamera'?"),
        ("Transports.MAVLink", "needs the network"),
        ("Simulators.Nothing", "there is no task"),
        ("Xyzzy", "there is no task 'Xyzzy': `shoal tasks` lists them"),
    ],
)
def test_what_cannot_be_simulated_again_is_refused(log: imc.Log, name: str, reason: str) -> None:
    with pytest.raises(ResimulationError) as caught:
        resimulate(log, [name])
    assert reason in str(caught.value)


def test_a_task_that_was_not_there_says_something_new(log: imc.Log) -> None:
    done = resimulate(log, [f"{MIXER}/New"])
    (tally,) = [t for (_, kind), t in done.comparison.counts.items() if kind == imc.Rpm.ID]
    assert tally.logged == 0
    assert tally.published > 100
    assert any("no messages of the entity 'Mixer/New'" in note for note in done.notes)


def test_the_command_tells_and_shows(log: imc.Log, tmp_path: Path) -> None:
    folder = str(log.path.parent)
    same = shoal("resim", folder, "--task", CAMERA)
    assert same.exit_code == 0, same.output
    assert "0 bytes of difference" in same.output
    change = ["--set", f"{CAMERA}:Error Model=None", "--out", str(tmp_path / "out")]
    other = shoal("resim", folder, "--task", "MUG Camera", *change)
    assert other.exit_code == 0, other.output
    for words in ("EstimatedMugState", "x [m]", "first difference: at", "bytes of difference"):
        assert words in other.output
    assert (tmp_path / "out" / "Data.lsf.gz").exists()


@given(st.integers(0, 10**6), st.sampled_from([1.0, 3.0, 7.0, 29.97, 30.0, 100.0, 1000.0]))
def test_instants_of_ticks_are_found_in_times_of_packets(count: int, rate: float) -> None:
    start = 1_767_225_600_000_000_000
    tick = start + round(count * 1e9 / rate)
    assert TimestampResolver(start, [rate]).resolve(tick / 1_000_000_000) == tick


def test_instants_of_a_wall_clock_are_not_rounded() -> None:
    start, time = 1_700_000_000_000_000_000, 1_700_000_003.1200001
    assert TimestampResolver(start).resolve(time) == start + 3_120_000_100
    assert TimestampResolver(start, virtual=False).resolve(time) == nanoseconds(time)


def cut(log: imc.Log, folder: Path, without: type[imc.Message]) -> imc.Log:
    """The log without one type of message."""
    folder.mkdir()
    for name in ("Config.ini", "IMC.xml.gz"):
        (folder / name).write_bytes((log.path.parent / name).read_bytes())
    left = (packet for _, packet in log.packets() if imc.header(packet).id != without.ID)
    (folder / "Data.lsf").write_bytes(b"".join(left))
    return imc.Log(folder)


def test_task_without_its_input_is_not_compared(log: imc.Log, tmp_path: Path) -> None:
    part = cut(log, tmp_path / "part", imc.SimulatedState)
    done = resimulate(part, ["GPS"])
    assert list(done.missing.values()) == [["SimulatedState"]]
    said = shoal("resim", str(part.path.parent), "--task", "GPS")
    assert said.exit_code == 1
    assert "GPS: not comparable: the log lacks what it subscribes to: SimulatedState" in said.output
    assert "SimulatedState can come from Simulators.EstimatedState: add -t Simulators.EstimatedState\n" in said.output
    assert "GpsFix" not in said.output
    both = resimulate(part, ["GPS", "Simulators.EstimatedState"])
    assert not both.missing
    gps = next(entity for entity, label in both.labels.items() if label == "GPS")
    counted = [tally for (entity, _), tally in both.comparison.counts.items() if entity == gps]
    assert counted
    assert all(tally.logged == tally.equal for tally in counted)
    assert "bytes of difference" not in said.output
    assert resimulate(log, ["GPS"]).missing == {}


def test_an_input_that_ends_in_the_middle_is_named(log: imc.Log, tmp_path: Path) -> None:
    half = imc.header(next(log.packets())[1]).timestamp + 7.0
    kept = (p for _, p in log.packets() if imc.header(p).id != imc.SimulatedState.ID or imc.header(p).timestamp < half)
    part = cut(log, tmp_path / "part", imc.Unknown).path
    part.write_bytes(b"".join(kept))
    done = resimulate(imc.Log(part), ["IMU", "GPS"])
    ends = "subscribes to SimulatedState, which ends 8.0 s before the log"
    assert len(done.notes) == 2
    for task in ("Simulators.IMU/AHRS", "Simulators.GPS/Kinematic"):
        assert any(note.startswith(f"{task} {ends}") for note in done.notes)


def test_the_part_of_a_log_begins_so_long_after_the_vehicle(log: imc.Log, tmp_path: Path) -> None:
    for number, (source, words, begin, end) in enumerate(
        [(log.path.parent, ["--from", "5s"], 5.0, 15.0), (tmp_path / "0", ["--from", "3s", "--to", "8s"], 8.0, 13.0)]
    ):
        part = tmp_path / str(number)
        said = shoal("log", "cut", str(source), str(part), *words)
        assert said.exit_code == 0, said.output
        done = resimulate(imc.Log(part), ["IMU"])
        assert not done.exact
        assert done.notes[0].startswith(f"the log begins {begin:.1f} s after the vehicle: the state of the tasks")
        (tally,) = [t for (_, kind), t in done.comparison.counts.items() if kind == imc.EulerAngles.ID]
        assert tally.published == pytest.approx(100 * (end - begin), abs=2)
        assert tally.only_published == 0


def test_misspelled_option_is_an_error(log: imc.Log) -> None:
    for colon in (":", " : "):
        with pytest.raises(ResimulationError, match="no option 'HAC': did you mean 'HACC'"):
            resimulate(log, ["GPS"], overrides=[f"Simulators.GPS/Kinematic{colon}HAC=5"])


def test_option_may_have_the_name_that_dune_gives_it(log: imc.Log) -> None:
    assert not resimulate(log, [CAMERA], overrides=[f"{CAMERA}:Camera - Horizontal FOV=20"]).comparison.equal


def test_place_that_cannot_be_written_is_named(log: imc.Log, tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    out = str(tmp_path / "file" / "out")
    said = shoal("resim", str(log.path.parent), "--task", "GPS", "--out", out)
    assert (said.exit_code, said.output.strip()) == (2, f"Error: {out}: {NO_FOLDER}")
