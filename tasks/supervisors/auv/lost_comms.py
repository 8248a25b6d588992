"""Starts a plan when a vehicle whose plan has failed waits at the surface and no console is in reach."""

import imc
from imc.console_links import has_console
from imc.reserved_ids import OPERATORS
from runtime import State, Task, consume, param, periodic
from runtime.profile import listed_consoles

Op = imc.PlanDB.Op
Control = imc.PlanControl
Phase = imc.PlanControlState.State
Mode = imc.VehicleState.OpMode
Where = imc.VehicleMedium.Medium
RETRY = 5.0  # s between two questions to a plan database that does not answer


class LostComms(Task):
    """Starts the stored plan `Plan Name` after a failed plan, at the surface, without a console for the timeout.

    It waits for the plan: one that an operator stores, or that the database has at the start. An Abort disarms it until
    the plan is stored again: the operator decides what comes next. The time begins when the vehicle floats,
    in mode SERVICE or ERROR, after a plan that has failed, and again with each Heartbeat of a console that
    may command, and while VehicleLinks has a ground station.
    """

    plan_name: str = param("lostcomms", "", "Plan that is started.")
    lost_comms_timeout: float = param(300.0, "s", "Time without a console.")
    execution_frequency: float = param(1.0, "Hz", "Rate of its checks.", minimum=0.001, maximum=1000)

    def configure(self) -> None:
        self._consoles = listed_consoles(self)

    def start(self) -> None:
        self._armed, self._aborted, self._known = False, False, False
        self._asked = -RETRY
        self._mode = self._medium = -1
        self._plan = imc.PlanControlState()
        self._since: float | None = None
        self._started = False
        self._report_state()

    @consume(others=True)
    def on_abort(self, abort: imc.Abort) -> None:
        """Leave the vehicle to the operator."""
        if self.is_addressed_or_broadcast(abort):
            self._armed, self._aborted, self._since = False, True, None
            self._report_state()

    @consume(others=True)
    def on_heartbeat(self, beat: imc.Heartbeat) -> None:
        """Begin again while a console is in reach."""
        if beat.src in OPERATORS and self._since is not None and self._consoles.may_command(beat.src):
            self._since = self.now

    @consume
    def on_links(self, links: imc.VehicleLinks) -> None:
        """Begin again while a ground station of another protocol is in reach."""
        if self._since is not None and has_console(links):
            self._since = self.now

    @consume
    def on_plan_state(self, state: imc.PlanControlState) -> None:
        self._plan = state

    @consume
    def on_vehicle_state(self, state: imc.VehicleState) -> None:
        self._mode = state.op_mode

    @consume
    def on_medium(self, medium: imc.VehicleMedium) -> None:
        self._medium = medium.medium

    @consume
    def on_plan_database(self, answer: imc.PlanDB) -> None:
        """Note whether the plan is stored."""
        succeeded, ours = answer.type == imc.PlanDB.Type.SUCCESS, answer.plan_id == self.plan_name
        if succeeded and (answer.op == Op.CLEAR or (answer.op == Op.DEL and ours)):
            self._known, self._armed = True, False
        elif succeeded and answer.op == Op.SET and ours:
            self._known, self._armed, self._aborted = True, True, False
        elif succeeded and answer.op == Op.GET_STATE and isinstance(answer.arg, imc.PlanDBState):
            self._read_state(answer.arg)
        elif answer.op == Op.GET_INFO and ours and (succeeded or answer.type == imc.PlanDB.Type.FAILURE):
            self._known, self._armed = True, succeeded and not self._aborted
        self._report_state()

    def _read_state(self, state: imc.PlanDBState) -> None:
        """Read the list of all plans, which is empty if there are too many for one message."""
        names = [plan.plan_id for plan in state.plans_info if isinstance(plan, imc.PlanDBInformation)]
        if len(names) >= state.plan_count:
            self._known, self._armed = True, self.plan_name in names and not self._aborted
        elif not self._known:
            self.publish(imc.PlanDB(op=Op.GET_INFO, plan_id=self.plan_name, dst=self.system))

    @consume
    def report_start_result(self, answer: imc.PlanControl) -> None:
        """Log a START that is rejected; the time begins again."""
        refused = answer.type == Control.Type.FAILURE and answer.op == Control.Op.START
        if refused and self._started and self.is_reply_to_me(answer):
            self.log.error(f"{self.plan_name} has not been carried out: {answer.info}")
            self._started, self._since = False, None

    @periodic("execution_frequency")
    def check(self) -> None:
        if not self._known and self.now - self._asked >= RETRY:
            self._asked = self.now
            self.publish(imc.PlanDB(op=Op.GET_STATE, dst=self.system))
        if self._started:
            self._started = self._plan.state in (Phase.INITIALIZING, Phase.EXECUTING)
        elif not self._armed or not self._is_idle_after_failure() or self._medium not in self._media():
            self._since = None
        elif self._since is None:
            self._since = self.now
        elif self.age(self._since) >= self.lost_comms_timeout:
            self._start_plan()
        self._report_state()

    def _start_plan(self) -> None:
        self.log.warning(f"no console for {self.lost_comms_timeout:g} s: starting {self.plan_name}")
        self._started, self._since = True, None
        flags = Control.Flags.IGNORE_ERRORS
        self._plan = imc.PlanControlState(state=Phase.INITIALIZING)
        self.publish(Control(op=Control.Op.START, plan_id=self.plan_name, flags=flags, dst=self.system))

    def _is_idle_after_failure(self) -> bool:
        failed = self._plan.last_outcome == imc.PlanControlState.LastOutcome.FAILURE
        waits = self._plan.state in (Phase.BLOCKED, Phase.READY)
        return self._mode in (Mode.SERVICE, Mode.ERROR) and failed and waits

    def _media(self) -> tuple[int, ...]:
        """The media in which the vehicle may be; a wave over it does not stop a time that has begun."""
        return (Where.WATER,) if self._since is None else (Where.WATER, Where.UNDERWATER)

    def _report_state(self) -> None:
        if self._started:
            words = f"started {self.plan_name}"
        elif self._since is not None:
            words = "no console in reach"
        elif self._armed:
            words = "active"
        else:
            words = "idle after an Abort" if self._aborted else f"idle: there is no plan {self.plan_name}"
        self.set_entity_state(State.NORMAL, words)
