"""A computer that stands still, or is too slow, is no failed sensor: no plan is lost, and one entity reports it."""

import math

import pytest
from lean import BLIND, UNLOGGED

import imc
from autonomy.navigation import DepthCheck
from runtime.kernel import SECOND
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.missions import Mission, parse_plan, prepare
from tests.outside import ALONE
from tests.repeats import all_but, repeat
from tests.tasks.mission.lies import DEEP, DEPTH, lies
from tests.tasks.mission.stalling_clock import StallingClock

HOST = "Monitors.HostResources:Enabled=Never"  # its messages depend on this computer, and each costs time here
OFFLINE = (HOST, *ALONE)
START = 1_750_000_000_000_000_000
BAD = (imc.EntityState.State.ERROR, imc.EntityState.State.FAILURE, imc.EntityState.State.FAULT)
PLANS = {
    "lauv-noptilus-1": "origin: 41.185°, -8.7062°\nspeed: 1.6 m/s\nmaneuvers:\n"
    "  - goto: {north: 120, depth: 1}\n  - goto: {north: 120, east: 60, depth: 1}\n",
    "otter": "origin: 41.185°, -8.7062°\nspeed: 1.5 m/s\nmaneuvers:\n"
    "  - goto: {north: 60}\n  - goto: {north: 60, east: 60}\n",
    "caravel": "origin: 41.185°, -8.7062°\nspeed: 1 m/s\nmaneuvers:\n"
    "  - goto: {north: 40}\n  - goto: {north: 40, east: 40}\n",
    "hexa-00": "origin: 41.185°, -8.7062°\nspeed: 5 m/s\naltitude: 20\nmaneuvers:\n"
    "  - takeoff: {altitude: 15}\n  - goto: {north: 100}\n  - goto: {north: 100, east: 100}\n  - land: {}\n",
}

DIVES = "origin: 41.185°, -8.7062°\nspeed: 1.6 m/s\nmaneuvers:\n" + "".join(
    f"  - goto: {{north: {120 * (leg % 2)}, east: {20 * leg}, depth: {depth}}}\n"
    for leg, depth in enumerate([9, 4, 8, 2, 6, 1] * 10, start=1)
)


class Run:
    """A plan of a shipped vehicle on a clock that is not virtual, with what it blames."""

    def __init__(self, profile, folder, clock, *, happen=None, seconds=900.0, maneuvers=None):
        overrides = [*OFFLINE, UNLOGGED, *([BLIND] if profile.startswith("lauv") else [])]
        if maneuvers is not None:
            overrides.append(DEEP)
        places = {"log_root": folder / "log", "state_folder": folder / "db"}
        self.vehicle = prepare(profile, overrides=overrides, clock=clock, **places).vehicle
        self.log, self.bad = [], []
        self.vehicle.observe(imc.LogBookEntry, self.log.append)
        self.vehicle.observe(imc.EntityState, self._judge)
        if happen is not None:
            self.vehicle.kernel.soon(self.vehicle.daemon.start_script, happen)
        with pytest.MonkeyPatch.context() as patches:
            clock.measure_computer(patches)
            self.report = Mission(self.vehicle, parse_plan("plan: test\n" + (maneuvers or PLANS[profile]))).fly(seconds)

    def _judge(self, state):
        label = self.vehicle.entities.label(state.src, state.src_ent)
        if state.state in BAD:
            self.bad.append((round(state.timestamp - self.vehicle.start_time, 1), label, state.description))

    @property
    def complaints(self):
        worse = (imc.LogBookEntry.Type.WARNING, imc.LogBookEntry.Type.ERROR)
        return [(m.context, m.text) for m in self.log if m.type in worse and not m.text.startswith("now in")]


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("late", [{"cost": 0.001}, {"delay": 0.1}])
def test_two_runs_on_such_a_computer_are_the_same(late, tmp_path):
    def fly(folder):
        run = Run("hexa-00", folder, StallingClock(START, overload=(5.0, 100.0), **late), seconds=20.0)
        return run.vehicle.kernel.events, [(entry.timestamp, entry.text) for entry in run.log]

    assert fly(tmp_path / "first") == fly(tmp_path / "second")


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("profile", all_but(["lauv-noptilus-1", "otter", "hexa-00"], PLANS))
def test_a_stall_of_seconds_loses_no_plan_and_blames_no_sensor(profile, tmp_path):
    run = Run(profile, tmp_path, StallingClock(START, [(20.0, 2.0), (45.0, 5.0), (70.0, 3.3)]))
    assert run.report.outcome == "SUCCESS"
    assert not run.bad
    assert {context for context, _ in run.complaints} == {"Daemon"}
    assert any("the process stood still for " in text for _, text in run.complaints)


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(
    "stalls",
    [
        [(31.0, 8.0), (60.0, 4.0), (75.0, 9.0)],
        repeat([(20, 3.39), (38.28, 4.67), (59.29, 2.03), (84.56, 8.84)]),
        repeat([(20, 3.4), (50.64, 4.46), (84.01, 6.51), (104.35, 1.61), (141.41, 3.57), (163.54, 9.47)]),
    ],
)
def test_a_multirotor_on_a_circle_finds_its_velocity_again_after_a_stall(stalls, monkeypatch, tmp_path):
    loaded = load_profile("hexa-00", overrides=[*ALONE, UNLOGGED, HOST])
    clock = StallingClock(START, stalls)
    clock.measure_computer(monkeypatch)
    vehicle = build(loaded, loaded.parse_modes("Simulation"), clock=clock, log_root=tmp_path).vehicle
    bad, truths, estimates = [], [], []
    vehicle.observe(imc.EntityState, lambda s: bad.append(s) if s.state in BAD else None)
    vehicle.observe(imc.SimulatedState, truths.append)
    vehicle.observe(imc.EstimatedState, estimates.append)
    vehicle.start()
    vehicle.run(sum(stalls[-1]) + 20.0)
    vehicle.close()
    assert not bad
    assert math.dist((truths[-1].x, truths[-1].y), (estimates[-1].x, estimates[-1].y)) < 2.0


@pytest.mark.heavy
@pytest.mark.parametrize("late", [{"delay": 0.06}, {"delay": 0.1}, {"cost": 0.001}, {"cost": 0.0015}])
def test_a_multirotor_takes_off_on_a_computer_that_is_late(late, monkeypatch, tmp_path):
    loaded = load_profile("hexa-00", overrides=[*ALONE, UNLOGGED, HOST])
    clock = StallingClock(START, overload=(0.0, 10.0), **late)
    clock.measure_computer(monkeypatch)
    vehicle = build(loaded, loaded.parse_modes("Simulation"), clock=clock, log_root=tmp_path).vehicle
    truths, log = [], []
    vehicle.observe(imc.SimulatedState, truths.append)
    vehicle.observe(imc.LogBookEntry, lambda entry: log.append(entry.text))
    vehicle.start()
    vehicle.run(8.0)
    vehicle.close()
    assert not [text for text in log if "descending level" in text]
    assert truths[-1].z < -3.0


@pytest.mark.heavy
@pytest.mark.computing
def test_after_a_stall_of_half_a_minute_the_plan_ends_in_error(tmp_path):
    run = Run("lauv-noptilus-1", tmp_path, StallingClock(START, [(30.0, 30.0)]))
    assert run.report.outcome == "FAILURE"
    assert {label for _, label, _ in run.bad} == {"Daemon"}
    assert 60.0 <= run.bad[0][0] < 62.0
    assert run.bad[0][2].startswith("the process stood still for ")
    assert run.report.reason == "vehicle errors: Daemon: the process stood still for 29.9 s"


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("profile", ["lauv-noptilus-1", repeat("otter"), "hexa-00"])
def test_on_an_overloaded_computer_no_sensor_is_blamed(profile, tmp_path):
    delay = 0.15 if profile == "hexa-00" else 0.6  # a multirotor cannot be held at 2 Hz
    run = Run(profile, tmp_path, StallingClock(START, overload=(20.0, 500.0), delay=delay))
    assert run.report.outcome == "SUCCESS"
    assert not run.bad


@pytest.mark.heavy
@pytest.mark.computing
def test_on_an_overloaded_computer_a_vehicle_that_pitches_does_not_brake_for_the_surface(monkeypatch, tmp_path):
    loaded = load_profile("lauv-noptilus-1", overrides=[*ALONE, UNLOGGED, BLIND, HOST])
    clock = StallingClock(START, overload=(0.0, 1000.0), cost=0.001, delay=0.1)
    clock.measure_computer(monkeypatch)
    vehicle = build(loaded, loaded.parse_modes("Simulation"), clock=clock, log_root=tmp_path).vehicle
    brakes, angles = [], []
    vehicle.observe(imc.Brake, lambda brake: brakes.append(round(brake.timestamp - vehicle.start_time, 1)))
    vehicle.observe(imc.EstimatedState, lambda state: angles.append(abs(state.theta)))
    vehicle.start()
    vehicle.run(90.0)
    vehicle.close()
    assert max(angles) > math.radians(20.0), "it has to see the surface ahead"
    assert not brakes


@pytest.mark.heavy
@pytest.mark.computing
def test_where_all_moments_are_more_than_a_second_apart_no_sensor_is_blamed(tmp_path):
    """In deep water: at 0.8 Hz an AUV cannot be steered, and one on the bottom is an error of its own."""
    clock = StallingClock(START, overload=(20.0, 500.0), delay=1.2)
    run = Run("lauv-noptilus-1", tmp_path, clock, maneuvers=PLANS["lauv-noptilus-1"])
    assert {label for _, label, _ in run.bad} <= {"Path Control"}


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(
    ("profile", "cost"), [("lauv-noptilus-1", 0.002), repeat(("otter", 0.003)), ("hexa-00", 0.001)]
)
def test_where_every_call_takes_long_no_sensor_is_blamed(profile, cost, tmp_path):
    run = Run(profile, tmp_path, StallingClock(START, overload=(20.0, 1000.0), cost=cost))
    assert run.vehicle.kernel.stalls.total > 4 * SECOND
    assert run.report.outcome == "SUCCESS"
    assert not run.bad


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("late", [{"delay": 0.4}, {"cost": 0.0018}], ids=["late", "slow"])
@pytest.mark.parametrize(
    ("profile", "task", "label"),
    [
        ("lauv-noptilus-1", "Simulators.IMU/AHRS", "Navigation"),
        ("lauv-noptilus-1", "Simulators.DepthSensor", "Navigation"),
        ("otter", "Simulators.GPS", "Navigation"),
    ],
)
def test_on_an_overloaded_computer_a_sensor_that_is_silent_is_still_found(profile, task, label, late, tmp_path):
    """Timeouts are up to 10 s. With the slow calls, turns of the AUV take nearly a second each."""
    silent = []

    async def silence(script):
        await script.sleep(30.0)
        script.task.vehicle.task(task).cancel_callbacks()
        silent.append(script.now - script.task.vehicle.start_time)

    run = Run(profile, tmp_path, StallingClock(START, overload=(20.0, 500.0), **late), happen=silence)
    assert run.report.outcome == "FAILURE"
    assert label in {found for _, found, _ in run.bad}
    assert run.bad[0][0] - silent[0] < 15.0


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("late", [repeat({"delay": 0.4}), repeat({"cost": 0.0013}), {"cost": 0.0009, "delay": 0.1}])
def test_on_an_overloaded_computer_no_drift_of_the_depth_is_found(late, monkeypatch, tmp_path):
    largest, judge = 0.0, DepthCheck.evaluate

    def note(check, *measured):
        nonlocal largest
        decision = judge(check, *measured)
        largest = max(largest, check.drift)
        return decision

    monkeypatch.setattr(DepthCheck, "evaluate", note)
    stalls = [(7.0 * n, 1.0 + 0.1 * (n % 6)) for n in range(5, 42)]
    clock = StallingClock(START, stalls, overload=(20.0, 1000.0), **late)
    run = Run("lauv-noptilus-1", tmp_path, clock, seconds=300.0, maneuvers=DIVES)
    assert run.vehicle.kernel.stalls.total > 100 * SECOND
    assert not run.bad
    assert 0.05 < largest < 0.8


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("late", [{"delay": 0.3}, {"cost": 0.001}], ids=["late", "slow"])
def test_on_an_overloaded_computer_a_depth_that_drifts_is_still_found(late, tmp_path):
    async def drift(script):
        await script.sleep(40.0)
        lies(DEPTH, imc.Depth, ("value", lambda z, t: z + 0.06 * t))(script.task.vehicle)

    clock = StallingClock(START, overload=(20.0, 500.0), **late)
    run = Run("lauv-noptilus-1", tmp_path, clock, happen=drift, seconds=300.0, maneuvers=DIVES)
    assert run.bad[0][1:] == ("Navigation", "depth drifts away from the vertical speed")
    assert run.bad[0][0] < 100.0
