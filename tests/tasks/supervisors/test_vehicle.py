"""The mode machine."""

from itertools import pairwise

import pytest
from flying import BROADCAST, CCU, OWN, changes

import imc
from runtime import State, Task, consume, param, periodic
from runtime.testing import simulate
from tasks.supervisors.vehicle import Vehicle

Command = imc.VehicleCommand.Command
Mode = imc.VehicleState.OpMode
Phase = imc.ManeuverControlState.State
CALM = imc.EntityMonitoringState(mcount=1, mnames="Daemon")
SICK = CALM.replace(ccount=1, cnames="GPS", last_error="GPS: no fix")
BOOTING = CALM.replace(ecount=1, enames="GPS")


class Puppet(Task):
    """Answers like a maneuver, reports every second, and after 3 s ends in the state given by its Goto's timeout."""

    def start(self):
        self.running = False

    @periodic(1.0)
    def report(self):
        if self.running:
            self.publish(imc.ManeuverControlState(state=Phase.EXECUTING, eta=9))

    @consume
    def begin(self, maneuver: imc.Goto | imc.IdleManeuver) -> None:
        self.running = True
        self.publish(imc.ManeuverControlState(state=Phase.EXECUTING, eta=9))
        if isinstance(maneuver, imc.Goto) and maneuver.timeout:
            self.after(3.0, self.end, maneuver.timeout)

    def end(self, state):
        self.running = False
        self.publish(imc.ManeuverControlState(state=state, info="why"))

    @consume
    def halt(self, _: imc.StopManeuver) -> None:
        if self.running:
            self.running = False
            self.publish(imc.ManeuverControlState(state=Phase.STOPPED))


def order(command, at=2.0, maneuver=None, **fields):
    fields = {"src": CCU, "src_ent": 5, "request_id": 12, **fields}
    return imc.VehicleCommand(timestamp=at, command=command, maneuver=maneuver, **fields)


def watched(*feed, seconds=10, calm=True, tasks=(Puppet,), **parameters):
    """A run of the supervisor; the monitor reports every second that all is well, unless other messages are fed."""
    reports = [CALM.replace(timestamp=float(t)) for t in range(int(seconds))] if calm else []
    return simulate([(Vehicle, parameters), *tasks], [*reports, *feed], seconds=seconds)


def modes(run):
    return changes(imc.VehicleState.OpMode(m.op_mode).name for m in run.of(imc.VehicleState))


def answers(run):
    return [(imc.VehicleCommand.Type(m.type).name, m.info) for m in run.of(imc.VehicleCommand)]


def test_a_vehicle_boots_and_reports_twice_a_second():
    run = watched(seconds=10, calm=False)
    assert modes(run) == ["BOOT"]
    assert len(run.of(imc.VehicleState)) == 20
    state = run.of(imc.VehicleState)[0]
    assert (state.maneuver_type, state.maneuver_stime, state.maneuver_eta) == (0xFFFF, -1.0, 0xFFFF)
    assert (state.last_error, state.last_error_time, state.control_loops) == ("", -1.0, 0)


def test_entities_decide_between_boot_error_and_service():
    feed = [BOOTING.replace(timestamp=1.0), SICK.replace(timestamp=2.0), CALM.replace(timestamp=3.0)]
    assert modes(watched(*feed, calm=False)) == ["BOOT", "ERROR", "SERVICE"]
    later = [CALM.replace(timestamp=1.0), SICK.replace(timestamp=2.0), CALM.replace(timestamp=3.0)]
    run = watched(*later, calm=False)
    assert modes(run) == ["BOOT", "SERVICE", "ERROR", "SERVICE"]
    errors = [(m.error_count, m.error_ents) for m in run.of(imc.VehicleState) if m.op_mode == 2]
    assert set(errors) == {(1, "GPS")}
    assert run.of(imc.VehicleState)[-1].last_error == "GPS: no fix"


@pytest.mark.parametrize("calm", [False, True])
def test_the_log_book_names_the_entities_that_make_an_error(calm):
    lost = SICK.replace(timestamp=2.5, ccount=2, cnames="GPS,Nix", last_error="Nix: no report for 5 s")
    run = watched(lost, calm=calm, seconds=3)
    assert run.log[-2:] == ["entity errors: GPS, Nix; last Nix: no report for 5 s", "now in 'ERROR' mode"]
    assert run.of(imc.VehicleState)[-1].last_error == "Nix: no report for 5 s"


def test_a_maneuver_is_begun_and_reported():
    run = watched(order(Command.EXEC_MANEUVER, maneuver=imc.Goto(timeout=1)), seconds=12)
    assert modes(run) == ["BOOT", "SERVICE", "MANEUVER", "SERVICE"]
    (reply,) = run.of(imc.VehicleCommand)
    assert (reply.type, reply.info, reply.request_id) == (imc.VehicleCommand.Type.SUCCESS, "Goto maneuver started", 12)
    assert (reply.dst, reply.dst_ent) == (CCU, 5)
    during = [m for m in run.of(imc.VehicleState) if m.op_mode == 3]
    assert {m.maneuver_type for m in during} == {imc.Goto.ID}
    assert changes(m.maneuver_eta for m in during) == [0xFFFF, 9, 0]
    assert changes(m.flags for m in during) == [0, imc.VehicleState.Flags.MANEUVER_DONE]
    assert run.of(imc.VehicleState)[-1].last_error == "maneuver request timeout"


def test_the_next_maneuver_stops_the_last():
    feed = [order(0, maneuver=imc.Goto()), order(0, 4.0, maneuver=imc.Goto(speed=2.0))]
    run = watched(*feed)
    sent = [type(m).__name__ for m in run.messages if isinstance(m, imc.Goto | imc.StopManeuver)]
    assert sent == ["Goto", "StopManeuver", "Goto"]
    assert modes(run) == ["BOOT", "SERVICE", "MANEUVER"]


def test_a_maneuver_that_fails():
    run = watched(order(Command.EXEC_MANEUVER, maneuver=imc.Goto(timeout=Phase.ERROR)))
    assert modes(run)[-1] == "SERVICE"
    assert run.of(imc.VehicleState)[-1].last_error == "Goto maneuver error: why"
    assert run.of(imc.IdleManeuver)


def test_a_maneuver_that_nobody_executes():
    run = watched(order(Command.EXEC_MANEUVER, maneuver=imc.Goto()), tasks=())
    assert modes(run)[-1] == "SERVICE"
    assert "no maneuver answers Goto within 1 s" in run.log
    assert run.of(imc.VehicleState)[-1].last_error == "Goto maneuver error: no task executes it"


@pytest.mark.parametrize(
    ("src", "plan", "ends"),
    [(OWN, "READY", True), (OWN, "BLOCKED", True), (OWN, "EXECUTING", False), (CCU, "READY", False)],
)
def test_a_maneuver_of_the_plan_engine_ends_without_a_plan(src, plan, ends):
    state = imc.PlanControlState(state=imc.PlanControlState.State[plan])
    reports = [state.replace(timestamp=0.5 * k) for k in range(30)]
    run = watched(order(Command.EXEC_MANEUVER, maneuver=imc.Goto(), src=src), *reports, seconds=15)
    assert modes(run) == ["BOOT", "SERVICE", "MANEUVER", *["SERVICE"] * ends]
    if ends:
        assert run.of(imc.VehicleState)[-1].last_error == "Goto maneuver error: its plan does not run"
        assert run.of(imc.IdleManeuver)[-1].timestamp - run.vehicle.start_time == pytest.approx(5.5, abs=0.6)


def test_stop_idles():
    run = watched(order(Command.EXEC_MANEUVER, maneuver=imc.Goto()), order(Command.STOP_MANEUVER, 4.0))
    assert answers(run)[-1] == ("SUCCESS", "OK")
    assert modes(run)[-1] == "SERVICE"
    assert [type(m).__name__ for m in run.messages if isinstance(m, imc.StopManeuver | imc.IdleManeuver)] == [
        "StopManeuver",
        "IdleManeuver",
    ]


def test_bad_commands():
    run = watched(order(Command.EXEC_MANEUVER), order(9, 3.0), order(0, 4.0, maneuver=imc.Goto(), dst=0x1B))
    assert answers(run) == [("FAILURE", "no maneuver given"), ("FAILURE", "no such command: 9")]
    assert modes(run)[-1] == "SERVICE"


@pytest.mark.parametrize("dst", [0xFFFF, BROADCAST])
@pytest.mark.parametrize(("src", "mode"), [(0x1B, "SERVICE"), (CCU, "MANEUVER"), (OWN, "MANEUVER")])
def test_what_another_vehicle_commands_everybody_is_its_own(src, mode, dst):
    run = watched(order(Command.EXEC_MANEUVER, maneuver=imc.Goto(), src=src, dst=dst), seconds=4)
    assert modes(run)[-1] == mode


def test_calibration_begins_ends_and_times_out():
    run = watched(order(Command.START_CALIBRATION, calib_time=4), order(Command.STOP_CALIBRATION, 6.0))
    assert modes(run) == ["BOOT", "SERVICE", "CALIBRATION", "SERVICE"]
    assert [m.duration for m in run.of(imc.Calibration)] == [4]
    run = watched(order(Command.START_CALIBRATION, calib_time=4), seconds=40)
    (ended,) = {m.last_error_time for m in run.of(imc.VehicleState)} - {-1.0}
    assert ended - run.vehicle.start_time == pytest.approx(2.0 + 22.5)


def test_calibration_ignores_errors():
    run = watched(order(Command.START_CALIBRATION), SICK.replace(timestamp=3.5), seconds=4)
    assert modes(run)[-1] == "CALIBRATION"


@pytest.mark.parametrize("src", [CCU, 0x1B, 0x3334])
@pytest.mark.parametrize(("dst", "obeyed"), [(OWN, True), (0xFFFF, True), (BROADCAST, True), (0x1B, False)])
def test_an_abort_to_this_vehicle_or_to_everybody_is_obeyed(src, dst, obeyed):
    run = watched(order(0, maneuver=imc.Goto()), imc.Abort(timestamp=4.5, src=src, src_ent=7, dst=dst), seconds=8)
    assert (modes(run)[3:4] == ["ERROR"]) is obeyed
    assert len(run.of(imc.Aborted)) == (1 if obeyed else 0)
    if obeyed:
        assert modes(run)[-1] == "SERVICE"
        expected = f"got abort request from system 0x{src:04X} - {src} @ 7"
        assert run.of(imc.VehicleState)[-1].last_error == expected


ON = imc.ControlLoops(timestamp=1.2, enable=1, mask=imc.CLoopsMask.YAW, scope_ref=7)


@pytest.mark.parametrize(
    ("feed", "mode"),
    [
        ((BOOTING.replace(timestamp=1.0),), "BOOT"),
        ((CALM.replace(timestamp=1.0),), "SERVICE"),
        ((CALM.replace(timestamp=1.0), SICK.replace(timestamp=1.5)), "ERROR"),
        ((CALM.replace(timestamp=1.0), order(Command.EXEC_MANEUVER, maneuver=imc.Goto())), "MANEUVER"),
        ((CALM.replace(timestamp=1.0), order(Command.START_CALIBRATION)), "CALIBRATION"),
        ((CALM.replace(timestamp=1.0), ON), "EXTERNAL"),
    ],
)
def test_an_abort_works_in_any_mode(feed, mode):
    abort = imc.Abort(timestamp=4.5, src=CCU, dst=BROADCAST)
    run = watched(*feed, abort, seconds=6, calm=False, allows_external_control=True)
    assert {Mode(m.op_mode).name for m in run.of(imc.VehicleState) if m.timestamp - run.vehicle.start_time > 4.5} == {
        "ERROR"
    }
    assert mode in modes(run)
    assert len(run.of(imc.Aborted)) == 1


def test_loops_without_a_maneuver_are_disabled():
    loops = imc.ControlLoops(timestamp=2.0, enable=1, mask=imc.CLoopsMask.YAW, scope_ref=7)
    run = watched(loops)
    (disabled,) = run.of(imc.ControlLoops)
    assert (disabled.enable, disabled.mask, disabled.scope_ref) == (0, 0xFFFFFFFF, 8)
    assert run.of(imc.VehicleState)[-1].control_loops == 0


def test_loops_without_a_maneuver_may_be_allowed():
    on = imc.ControlLoops(timestamp=2.0, enable=1, mask=imc.CLoopsMask.YAW, scope_ref=7)
    off, old = on.replace(timestamp=7.0, enable=0), on.replace(timestamp=8.0, scope_ref=6)
    run = watched(on, order(0, 6.0, maneuver=imc.Goto()), off, old, seconds=12, allows_external_control=True)
    assert modes(run) == ["BOOT", "SERVICE", "EXTERNAL", "SERVICE"]
    assert answers(run) == [("FAILURE", "cannot start a maneuver in EXTERNAL mode")]


def test_vital_entities_count_even_where_a_plan_ignores_errors():
    kind = imc.PlanControl
    ignoring = kind(timestamp=1.0, type=kind.Type.SUCCESS, dst=CCU, flags=kind.Flags.IGNORE_ERRORS)
    go = order(0, maneuver=imc.Goto())
    run = watched(ignoring, go, SICK.replace(timestamp=5.5), seconds=6)
    assert modes(run)[-1] == "MANEUVER"
    run = watched(ignoring, go, SICK.replace(timestamp=5.5), seconds=6, vital_entities=["GPS"])
    assert modes(run)[-1] == "ERROR"


class Faint(Puppet):
    """Becomes silent after 4 s."""

    @consume
    def begin(self, maneuver: imc.Goto | imc.IdleManeuver) -> None:
        super().begin(maneuver)
        self.after(4.0, self.fall_silent)

    def fall_silent(self) -> None:
        self.running = False


class Broken(Puppet):
    """Fails 4 s after the start of a Goto."""

    @consume
    def begin(self, maneuver: imc.Goto | imc.IdleManeuver) -> None:
        super().begin(maneuver)
        if isinstance(maneuver, imc.Goto):
            self.after(4.0, self.fail)

    def fail(self) -> None:
        raise RuntimeError("no more")


def left(run):
    """When (s) the vehicle left the mode MANEUVER, and its last error."""
    at, error = next(
        (m.timestamp, m.last_error)
        for before, m in pairwise(run.of(imc.VehicleState))
        if before.op_mode == Mode.MANEUVER != m.op_mode
    )
    return at - run.vehicle.start_time, error


def test_a_maneuver_that_falls_silent_has_failed():
    run = watched(order(Command.EXEC_MANEUVER, maneuver=imc.Goto()), seconds=20, tasks=(Faint,))
    at, error = left(run)
    assert 8.0 < at <= 9.0, "begun at 2 s, heard last at 5 s"
    assert error == "Goto maneuver error: no report for 3 s"
    patient = watched(
        order(Command.EXEC_MANEUVER, maneuver=imc.Goto()), seconds=20, tasks=(Faint,), maneuver_report_timeout=0.0
    )
    assert modes(patient)[-1] == "MANEUVER"


def test_a_maneuver_whose_task_fails_is_noticed_at_once():
    reports = [CALM.replace(timestamp=float(t)) for t in range(20)]
    feed = [*reports, order(Command.EXEC_MANEUVER, maneuver=imc.Goto())]
    run = simulate([Vehicle, Broken], feed, seconds=20, keep_going=True)
    at, error = left(run)
    assert at == pytest.approx(6.0, abs=0.01)
    assert error == "Goto maneuver error: its task has failed: RuntimeError: no more"
    assert modes(run)[-1] == "SERVICE"
    assert not any("no maneuver answers StopManeuver" in text for text in run.log)


def test_the_failure_of_another_entity_changes_nothing():
    other = imc.EntityState(timestamp=4.0, src_ent=200, state=imc.EntityState.State.FAILURE)
    assert modes(watched(order(Command.EXEC_MANEUVER, maneuver=imc.Goto()), other))[-1] == "MANEUVER"


class Logger(Task):
    """Has no disk from the fourth to the seventh second."""

    @periodic(1.0)
    def look(self) -> None:
        full = 4.0 <= self.now - self.vehicle.start_time < 7.0
        self.set_entity_state(State.FAILURE if full else State.NORMAL, "No space left on device" if full else "")


def test_a_full_disk_is_an_error_of_the_vehicle_that_leaves_its_mode():
    run = watched(order(Command.EXEC_MANEUVER, maneuver=imc.Goto()), tasks=(Puppet, Logger))
    begun = [m for m in run.of(imc.VehicleState) if m.timestamp - run.vehicle.start_time >= 2.1]
    assert {m.op_mode for m in begun} == {Mode.MANEUVER}
    told = changes((m.error_count, m.error_ents) for m in begun)
    assert told == [(0, ""), (1, "Logger"), (0, "")]
    sick = [order(Command.EXEC_MANEUVER, maneuver=imc.Goto()), imc.Abort(timestamp=5.0), SICK.replace(timestamp=5.4)]
    run = watched(*sick, tasks=(Puppet, Logger))
    errors = changes(m.error_ents for m in run.of(imc.VehicleState) if m.op_mode == Mode.ERROR)
    assert errors == ["", "GPS,Logger"], "an ERROR is not put down to the Logger"


class Beating(Task):
    """Shows that it runs, as the last resort of a vehicle does, for some seconds."""

    lasts: float = param(100.0, "s", "For so long.")

    @periodic(1.0)
    def beat(self) -> None:
        if self.now < self.vehicle.start_time + self.lasts:
            self.publish(imc.Heartbeat())


@pytest.mark.parametrize(
    ("rate", "lasts", "lost"), [(0.05, 99, 0), (0.1, 99, 0), (2.0, 99, 0), (2.0, 8, 1), (0.1, 8, 1)]
)
def test_a_slow_supervisor_misses_no_heartbeat_that_came(rate, lasts, lost):
    last_resort = (Beating, {"entity_label": "Failsafe", "lasts": lasts})
    run = watched(seconds=60, tasks=(Puppet, last_resort), execution_frequency=rate)
    assert ("no Heartbeat" in run.of(imc.VehicleState)[-1].last_error) == bool(lost)
