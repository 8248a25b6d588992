"""The mode of the vehicle: boot, service, calibration, maneuver, external, error."""

import math

import imc
from imc.discovery import displayable_name
from runtime import State, Task, consume, param, periodic
from runtime.kernel import Timer
from support.log_limit import LogLimit
from tasks.supervisors.maneuver_launcher import ManeuverLauncher

Mode = imc.VehicleState.OpMode
Command = imc.VehicleCommand.Command
Phase = imc.ManeuverControlState.State
PlanPhase = imc.PlanControlState.State
NOBODY = 0xFFFF
ALL_LOOPS = 0xFFFFFFFF
EXTERNAL_AFTER = 2.0  # s with loops enabled without a maneuver
NEXT_MANEUVER = 1.0  # s, longest time between two maneuvers
SHORTEST_CALIBRATION, SHORTEST_ANSWER = 15.0, 0.1  # s
LATE_COMMAND = 5.0  # s before an Abort in which a command was sent that does not count any more
MOST_NAMES = 256  # of systems that no profile lists, such as consoles
PLANLESS = 3.0  # s that a maneuver of the own plan engine may last without a plan
BEGINNING = (Command.EXEC_MANEUVER, Command.START_CALIBRATION)
BROKEN = (imc.EntityState.State.ERROR, imc.EntityState.State.FAILURE)
ROBUST = (Mode.BOOT, Mode.CALIBRATION, Mode.ERROR)  # entity errors do not change these modes


class Vehicle(Task):
    """Decides the mode of the vehicle, and starts and stops maneuvers on command.

    VehicleState is published at its rate and on every change. A maneuver fails if no task answers it, if its task
    fails, or if it reports nothing for too long; so does one of the own plan engine when no plan runs any more.
    """

    execution_frequency: float = param(2.0, "Hz", "Rate of VehicleState.", minimum=0.001, maximum=1000)
    allows_external_control: bool = param(False, "", "Allow control loops without a maneuver.")
    maneuver_handling_timeout: float = param(1.0, "s", "Time for a maneuver to answer, at least 0.1 s.")
    maneuver_report_timeout: float = param(
        3.0, "s", "A maneuver without a report for this time has failed; 0 means never.", minimum=0
    )
    failsafe_label: str = param(
        "Failsafe", "", "Entity whose Heartbeat must not stop after the first.", name="Entity Label - Failsafe"
    )
    failsafe_timeout: float = param(5.0, "s", "Longest time without this Heartbeat.", minimum=1.5, maximum=60)
    vital_entities: list[str] = param([], "", "Entities whose errors count even if a plan ignores errors.")
    reported_entities: list[str] = param(
        ["Logger"], "", "Further entities whose errors VehicleState names; they do not change the mode."
    )

    def start(self) -> None:
        self._mode = Mode.BOOT
        self._type, self._since, self._eta, self._done = NOBODY, -1.0, NOBODY, False
        self._loops, self._scope, self._loops_since = 0, 0, self.now
        self._errors: list[str] = []
        self._ignore_errors = False
        self._complaints: dict[int, str] = {}
        self._announced: dict[int, str] = {}  # names of other systems, the oldest first
        self._missed_beats = -1
        self._planned, self._planless_since = False, math.inf
        self._last_error, self._last_error_time = "", -1.0
        self._aborted_at = -math.inf
        self._abort_lines = LogLimit("more Aborts come")
        self._waiting: Timer | None = None
        self._executor, self._reported = NOBODY, self.now
        self._starter = ManeuverLauncher(self, max(SHORTEST_ANSWER, self.maneuver_handling_timeout), self._unanswered)
        self.set_entity_state(State.NORMAL, "active")

    @periodic("execution_frequency")
    def monitor_and_publish_state(self) -> None:
        if self._mode is Mode.SERVICE and self._loops and self.age(self._loops_since) > EXTERNAL_AFTER:
            if self.allows_external_control:
                self._enter(Mode.EXTERNAL)
            else:
                self.log.error("control loops are enabled without a maneuver; disabling them")
                self._disable_loops()
        silence = self.maneuver_report_timeout
        if self._is_executing() and silence and self.age(self._reported) > silence:
            self._fail(f"no report for {silence:g} s")
        if self._planned and self.age(max(self._planless_since, self._since)) > PLANLESS:
            self._fail("its plan does not run")
        if self._missed_beats >= 0:
            self._watch_failsafe()
        self._publish_state()

    @consume
    def on_failsafe_heartbeat(self, beat: imc.Heartbeat) -> None:
        if self.vehicle.entities.label(self.system, beat.src_ent) == self.failsafe_label:
            self._missed_beats = 0

    @consume
    def on_plan_control_state(self, plan: imc.PlanControlState) -> None:
        """Note since when no plan runs: a late command may start a maneuver that no task ends."""
        runs = plan.state in (PlanPhase.INITIALIZING, PlanPhase.EXECUTING)
        self._planless_since = math.inf if runs else min(self._planless_since, self.now)

    @consume
    def on_monitoring_state(self, entities: imc.EntityMonitoringState) -> None:
        """Leave BOOT and ERROR when all entities are well; go to ERROR when one is not."""
        broken = [name for name in entities.cnames.split(",") if name]
        broken += [self.failsafe_label] if self._lost_failsafe and self.failsafe_label not in broken else []
        booting = [name for name in entities.enames.split(",") if name]
        self._errors = [*broken, *booting]
        if self._mode in (Mode.BOOT, Mode.ERROR):
            if not self._errors:
                self._enter(Mode.SERVICE)
            elif self._mode is Mode.BOOT and broken and not booting:
                self._report_errors(entities, broken)
                self._enter(Mode.ERROR)
        elif self._errors and self._mode not in ROBUST and not self._ignores():
            self._report_errors(entities, self._errors)
            self._reset(Mode.ERROR)

    @consume
    def detect_maneuver_failure(self, entity: imc.EntityState) -> None:
        """Fail the maneuver if its task fails: a restarted task does not continue it. Store states of entities."""
        if entity.state in BROKEN:
            self._complaints[entity.src_ent] = entity.description
        else:
            self._complaints.pop(entity.src_ent, None)
        if entity.state == imc.EntityState.State.FAILURE and entity.src_ent == self._executor and self._is_executing():
            self._starter.mark_ended()
            self._fail(f"its task has failed: {entity.description}")

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        if loops.scope_ref < self._scope:
            return
        self._scope = loops.scope_ref
        before = self._loops
        self._loops = before | loops.mask if loops.enable else before & ~loops.mask
        if not before:
            self._loops_since = self.now
        if self._mode is Mode.EXTERNAL and not self._loops:
            self._enter(Mode.SERVICE)

    @consume(others=True)
    def on_announce(self, other: imc.Announce) -> None:
        """Note the names of consoles, which no profile lists: the log says who has aborted."""
        if self.vehicle.systems.name(other.src) == f"0x{other.src:04X}":
            self._announced.pop(other.src, None)
            self._announced[other.src] = displayable_name(other.sys_name)
            if len(self._announced) > MOST_NAMES:
                del self._announced[next(iter(self._announced))]

    @consume(others=True)
    def on_abort(self, abort: imc.Abort) -> None:
        """Stop everything in any mode, on request of any system, unless the Abort is addressed to another one."""
        if not self.is_addressed_or_broadcast(abort):
            return
        system = self._announced.get(abort.src) or self.vehicle.systems.name(abort.src)
        entity = self.vehicle.entities.label(abort.src, abort.src_ent) or str(abort.src_ent)
        ours = abort.src == self.system and abort.src_ent in self._complaints
        reason = f"{entity}: {self._complaints[abort.src_ent]}" if ours else ""
        self._note(reason or f"got abort request from system {system} - {abort.src} @ {entity}")
        self._abort_lines.write(self.log.error, self._last_error, self.now)
        self._aborted_at = self.now
        self._reset(Mode.ERROR)
        self.publish(imc.Aborted())

    @consume
    def record_ignore_errors_flag(self, answer: imc.PlanControl) -> None:
        """Remember whether the started plan ignores errors; a rejected request changes nothing."""
        kind = imc.PlanControl
        if answer.type == kind.Type.SUCCESS and answer.op == kind.Op.START:
            self._ignore_errors = bool(answer.flags & kind.Flags.IGNORE_ERRORS)

    @consume(others=True)
    def on_vehicle_command(self, request: imc.VehicleCommand) -> None:
        if request.type != imc.VehicleCommand.Type.REQUEST or not self.is_for_me(request):
            return
        if request.command in BEGINNING and self._was_aborted_since(request):
            self._answer(request, "it was aborted before it began", failed=True)
        elif request.command == Command.EXEC_MANEUVER:
            self._execute(request)
        elif request.command == Command.STOP_MANEUVER:
            if self._mode in (Mode.MANEUVER, Mode.CALIBRATION):
                self._reset(Mode.SERVICE)
            self._answer(request, "OK")
        elif request.command == Command.START_CALIBRATION:
            self._calibrate(request)
        elif request.command == Command.STOP_CALIBRATION:
            if self._mode is Mode.CALIBRATION:
                self._reset(Mode.SERVICE)
            self._answer(request, "OK")
        else:
            self._answer(request, f"no such command: {request.command}", failed=True)

    @consume
    def on_maneuver_state(self, report: imc.ManeuverControlState) -> None:
        """Take the state of the maneuver; stop one that still runs from before a restart of this task."""
        if self._mode in (Mode.BOOT, Mode.SERVICE, Mode.ERROR) and self._starter.is_stray(report):
            self.log.error("stopping a maneuver that was not started here")
            self._starter.adopt()
            self._reset(self._mode)
            return
        if not self._starter.track_maneuver_state(report) or self._mode not in (Mode.MANEUVER, Mode.CALIBRATION):
            return
        self._executor, self._reported = report.src_ent, self.now
        if report.state == Phase.EXECUTING:
            self._eta = report.eta
        elif report.state == Phase.DONE:
            self._eta, self._done = 0, True
            if self._mode is Mode.MANEUVER:
                self._wait(NEXT_MANEUVER, "maneuver request timeout")
        elif report.state == Phase.ERROR:
            self._fail(report.info)
            return
        self._publish_state()

    def _was_aborted_since(self, request: imc.VehicleCommand) -> bool:
        """Whether an Abort came after a command of the own plan engine was sent."""
        return request.src == self.system and 0.0 <= self._aborted_at - request.timestamp <= LATE_COMMAND

    def _execute(self, request: imc.VehicleCommand) -> None:
        if self._mode is Mode.EXTERNAL:
            self._answer(request, "cannot start a maneuver in EXTERNAL mode", failed=True)
        elif request.maneuver is None:
            self._answer(request, "no maneuver given", failed=True)
        else:
            self._begin(request.maneuver)
            self._planned = request.src == self.system
            self._enter(Mode.MANEUVER)
            self._answer(request, f"{type(request.maneuver).__name__} maneuver started")

    def _calibrate(self, request: imc.VehicleCommand) -> None:
        if self._mode is Mode.EXTERNAL:
            self._answer(request, "cannot calibrate in EXTERNAL mode", failed=True)
            return
        self._clear()
        if request.maneuver is not None:
            self._begin(request.maneuver)
        else:
            self._starter.stop()
        self.publish(imc.Calibration(duration=request.calib_time))
        self._wait(1.5 * max(SHORTEST_CALIBRATION, request.calib_time), "calibration timeout")
        self._enter(Mode.CALIBRATION)
        self._answer(request, "calibrating vehicle")

    def _begin(self, maneuver: imc.Message) -> None:
        self._clear()
        self._type, self._since = maneuver.ID, self.now
        self._starter.start(maneuver)

    def _clear(self) -> None:
        if self._waiting is not None:
            self._waiting.cancel()
        self._type, self._since, self._eta, self._done, self._waiting = NOBODY, -1.0, NOBODY, False, None
        self._executor, self._planned = NOBODY, False

    def _is_executing(self) -> bool:
        """Whether a maneuver has started and is not done."""
        return self._mode in (Mode.MANEUVER, Mode.CALIBRATION) and self._executor != NOBODY and not self._done

    def _reset(self, mode: Mode) -> None:
        """Stop the maneuver and idle."""
        self._clear()
        self._loops_since = self.now
        self._starter.start(imc.IdleManeuver())
        self._enter(mode)

    def _wait(self, seconds: float, reason: str) -> None:
        """Go to SERVICE with the error `reason` after this time, unless canceled."""
        self._waiting = self.after(seconds, self._missed, reason)

    def _missed(self, reason: str) -> None:
        self._note(reason)
        self.log.error(reason)
        self._reset(Mode.SERVICE)

    def _unanswered(self, maneuver: imc.Message) -> None:
        if self._mode in (Mode.MANEUVER, Mode.CALIBRATION) and self._type == maneuver.ID:
            self._fail("no task executes it")
        elif isinstance(maneuver, imc.IdleManeuver):
            self._disable_loops()

    def _disable_loops(self) -> None:
        """Replace a missing IdleManeuver."""
        self._scope += 1
        self._loops = 0
        disable = imc.ControlLoops.Enable.DISABLE
        self.publish(imc.ControlLoops(enable=disable, mask=ALL_LOOPS, scope_ref=self._scope))

    def _fail(self, reason: str) -> None:
        name = imc.builtin().by_id(self._type).__name__ if self._type != NOBODY else "unknown"
        self._note(f"{name} maneuver error: {reason}")
        self.log.error(self._last_error)
        self._reset(Mode.SERVICE)

    @property
    def _lost_failsafe(self) -> bool:
        return self._missed_beats > max(1.0, self.failsafe_timeout * self.execution_frequency)

    def _watch_failsafe(self) -> None:
        """Stop a vehicle without its last resort. Counted in ticks, so a late kernel is not silence."""
        before = self._lost_failsafe
        self._missed_beats += 1
        if self._lost_failsafe and not before:
            self._errors = [*self._errors, self.failsafe_label]
            self._note(f"{self.failsafe_label}: no Heartbeat for {self.failsafe_timeout:g} s")
            self.log.error(self._last_error)
            if self._mode not in ROBUST and not self._ignores():
                self._reset(Mode.ERROR)

    def _ignores(self) -> bool:
        vital = set(self._errors) & set(self.vital_entities)
        return self._ignore_errors and self._mode is Mode.MANEUVER and not vital

    def _report_errors(self, entities: imc.EntityMonitoringState, errors: list[str]) -> None:
        """Log the entities with errors, and the last reported error."""
        names = f"entity errors: {', '.join(errors)}"
        self._note(entities.last_error or names)
        self.log.error(f"{names}; last {entities.last_error}" if entities.last_error else names)

    def _note(self, error: str) -> None:
        self._last_error, self._last_error_time = error, self.now

    def _enter(self, mode: Mode) -> None:
        if mode is not self._mode:
            self.log.warning(f"now in '{'MANEUVERING' if mode is Mode.MANEUVER else mode.name}' mode")
        self._mode = mode
        self._publish_state()

    def _publish_state(self) -> None:
        errors = [*self._errors]
        if errors or self._mode is not Mode.ERROR:  # an ERROR without them has another reason
            ill = (self.vehicle.entities.label(self.system, entity) for entity in self._complaints)
            errors += [label for label in ill if label in self.reported_entities and label not in errors]
        self.publish(
            imc.VehicleState(
                op_mode=self._mode,
                error_count=min(255, len(errors)),
                error_ents=",".join(errors),
                maneuver_type=self._type,
                maneuver_stime=self._since,
                maneuver_eta=self._eta,
                control_loops=self._loops,
                flags=imc.VehicleState.Flags.MANEUVER_DONE if self._done else 0,
                last_error=self._last_error,
                last_error_time=self._last_error_time,
            )
        )

    def _answer(self, request: imc.VehicleCommand, info: str, *, failed: bool = False) -> None:
        kind = imc.VehicleCommand.Type.FAILURE if failed else imc.VehicleCommand.Type.SUCCESS
        if failed:
            self.log.error(info)
        answer = imc.VehicleCommand(type=kind, request_id=request.request_id, command=request.command, info=info)
        self.reply(request, answer)
