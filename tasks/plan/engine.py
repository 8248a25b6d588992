"""Executes plans, maneuver by maneuver, along their transitions."""

import math
from dataclasses import replace
from functools import partial

import imc
from autonomy.plans import FINISH, PlanError, PlanForecast, PlanNode, Preflight, PreflightOptionError
from imc.reserved_ids import BROADCAST, UNKNOWN_SYSTEM
from runtime import Script, State, Task, consume, param, periodic
from runtime.task import Inbox, ParameterError
from tasks.plan.actions import ActivationTimes, PlanActions
from tasks.plan.execution_progress import NO_MANEUVER, PlanExecution
from tasks.plan.outgoing_requests import COMMAND_TIMEOUT, MessageCache, OutgoingRequests
from tasks.plan.plan_check import PlanCheck
from tasks.plan.plan_lines import PlanLines
from tasks.plan.replies import Replies

Op = imc.PlanControl.Op
Type = imc.PlanControl.Type
Phase = imc.PlanControlState.State
Outcome = imc.PlanControlState.LastOutcome
Command = imc.VehicleCommand.Command
Mode = imc.VehicleState.OpMode


class Engine(Task):
    """Loads, checks, starts and stops plans on request, and reports their progress.

    A plan is checked before it starts: graph, positions, depths, lengths of legs, energy if it is known. Conditions of
    transitions are evaluated in order when a maneuver is done, and those without ManeuverIsDone all the time.
    """

    state_report_frequency: float = param(3.0, "Hz", "Rate of PlanControlState.", minimum=0.1, maximum=100)
    perform_calibration: bool = param(True, "", "Calibrate if a request asks for it.")
    minimum_calibration_time: float = param(3.0, "s", "Shortest calibration.", minimum=0, maximum=65535)
    abort_on_failed_activation: bool = param(
        True,
        "",
        "End the plan when an entity cannot be activated; reject one with parameters that the vehicle lacks.",
    )
    compute_progress: bool = param(True, "", "Report the progress of the plan.")
    fuel_prediction: bool = param(True, "", "Reject plans that need more energy than is left.")
    fuel_reserve: float = param(
        10.0, "%", "Battery level below which plans are rejected, and the running one ends; 0 for none.", minimum=0
    )
    hotel_load: float = param(45.0, "W", "Power that the vehicle draws without moving.", minimum=0)
    maximum_leg_length: float = param(25000.0, "m", "Longest leg that path control follows.", minimum=1)
    plan_generator_entity_label: str = param("Plan Generator", "", "Entity that may start the recovery plan.")

    def configure(self) -> None:
        profile = self.vehicle.profile
        self._recovery = profile.value("General", "Recovery Plan", "dislodge")
        try:
            general = partial(profile.value, "General")
            preflight = Preflight(general, self.hotel_load, self.maximum_leg_length, profile.value)
        except PreflightOptionError as error:
            raise ParameterError(error.option, error.reason) from None
        settings = self.fuel_reserve, self.fuel_prediction, self.abort_on_failed_activation
        self._check = PlanCheck(self, preflight, *settings)

    def start(self) -> None:
        lost: PlanExecution | None = getattr(self, "_execution", None)
        before: MessageCache | None = getattr(self, "_situation", None)
        self._phase, self._outcome = Phase.READY, Outcome.NONE
        self._plan_id, self._stops = "", 0
        self._execution: PlanExecution | None = None
        self._requests, self._replies, self._lines = OutgoingRequests(self), Replies(self), PlanLines(self)
        self._supported: set[int] = set()
        self._activation_times = ActivationTimes(self.vehicle.entities)
        self._latest = MessageCache()
        self._situation = before or MessageCache()
        self._vehicle: imc.VehicleState | None = None
        self._silence = 0
        self.set_entity_state(State.NORMAL, "active")
        if lost is not None:  # no other task would end its maneuver
            self._plan_id = lost.request.plan_id
            self._fail(lost, "the plan engine failed, and has restarted")
        self._publish_state()

    @consume
    def on_register_maneuver(self, maneuver: imc.RegisterManeuver) -> None:
        self._supported.add(maneuver.mid)

    @consume
    def on_entity_info(self, entity: imc.EntityInfo) -> None:
        self._activation_times.receive(entity)

    @consume
    def keep_latest_message(
        self,
        news: imc.EstimatedState | imc.FuelLevel | imc.OperationalLimits | imc.VehicleMedium | imc.ControlLoops,
    ) -> None:
        self._situation[type(news)] = news

    @consume
    def end_on_low_fuel(self, fuel: imc.FuelLevel) -> None:
        """End the plan when only the reserve of the battery is left."""
        if self._execution is not None and fuel.value < self.fuel_reserve:
            self._fail(self._execution, self._check.reserve_text)

    @consume
    def end_on_failed_activation(self, state: imc.EntityActivationState) -> None:
        """End the plan if an entity that it needs cannot be activated."""
        execution = self._execution
        label = self.vehicle.entities.label(self.system, state.src_ent)
        if execution is None or execution.actions is None or state.state != imc.EntityActivationState.State.ACT_FAIL:
            return
        if label in execution.actions.activated and self.abort_on_failed_activation:
            self._fail(execution, f"failed to activate {label}: {state.error}")

    @consume
    def note_maneuver_info(self, maneuver: imc.ManeuverControlState) -> None:
        """A maneuver that is done reports what it has missed."""
        if self._execution is not None and maneuver.state == imc.ManeuverControlState.State.DONE:
            self._execution.add_note(maneuver.info)

    @consume
    def on_vehicle_state(self, vehicle: imc.VehicleState) -> None:
        """The mode of the vehicle decides whether a plan can start or continue."""
        self._vehicle, self._silence = vehicle, 0
        execution = self._execution
        if vehicle.op_mode in (Mode.ERROR, Mode.BOOT, Mode.EXTERNAL):
            if execution is not None:
                errors = f"vehicle errors: {vehicle.error_ents}" if vehicle.error_count else vehicle.last_error
                self._fail(execution, errors or f"vehicle is in {Mode(vehicle.op_mode).name} mode", lost=True)
            self._enter(Phase.BLOCKED)
        elif execution is None:
            calibrating = vehicle.op_mode == Mode.CALIBRATION
            if calibrating or self._phase is Phase.BLOCKED:
                self._enter(Phase.BLOCKED if calibrating else Phase.READY)
        elif vehicle.op_mode == Mode.SERVICE and execution.node is not None and not execution.commanding:
            self._fail(execution, vehicle.last_error or "vehicle left the maneuver", command=False)

    @periodic("state_report_frequency")
    def tick(self) -> None:
        self._silence += 1
        if self._silence > COMMAND_TIMEOUT * self.state_report_frequency:  # in ticks, so a late kernel is not silence
            if self._execution is not None:
                self._fail(self._execution, "VehicleState is missing", lost=True)
            if self._vehicle is not None:  # Failsafe may be silent, too
                self._vehicle = None
                self._requests.stop_without_supervisor(self._situation.of(imc.ControlLoops))
            self._enter(Phase.BLOCKED)
        if self._execution is not None:
            self._execution.activate_ahead(self._vehicle, self.now)
        self._publish_state()

    @consume(others=True)
    def dispatch(self, request: imc.PlanControl) -> None:
        own = request.src == self.system and request.dst == UNKNOWN_SYSTEM  # of a task that left it open
        if request.type != Type.REQUEST or not (own or request.dst in (self.system, BROADCAST)):
            return
        if self._replies.answer_duplicate(request) or not self._replies.admits(request):
            return
        if request.op == Op.START:
            self._start(request)
        elif request.op == Op.STOP:
            self._stop(request)
        elif request.op == Op.LOAD:
            self._load(request)
        elif request.op == Op.GET:
            execution = self._execution
            if execution is None or execution.forecast is None:
                self._replies.refuse(request, "no plan is running")
            else:
                self._replies.succeed(request, "OK", execution.forecast.graph.plan, plan_id=self._plan_id)
        else:
            self._replies.refuse(request, f"no such operation: {request.op}")

    def _start(self, request: imc.PlanControl, forecast: PlanForecast | None = None) -> None:
        """Start a plan; one that replaces another has already been checked and has its `forecast`."""
        execution = self._execution
        if execution is not None and execution.is_repeated_request(request, self.now):
            if execution.info:
                self._replies.succeed(execution.request, execution.info, execution.statistics)
        elif self._phase is Phase.BLOCKED:
            mode = "unknown" if self._vehicle is None else Mode(self._vehicle.op_mode).name
            self._replies.refuse(request, f"cannot start a plan: vehicle mode is {mode}")
        elif request.plan_id == self._recovery and not self._requests.is_from_entity(
            self.plan_generator_entity_label, request
        ):
            self._replies.refuse(request, "only the plan generator may start the recovery plan")
        elif execution is not None and forecast is None:
            self.start_script(self._switch, request, self._stops)
        else:
            self._lines.begin_plan("" if execution is None else f"switching to {request.plan_id}")
            if execution is not None:
                self._give_up(execution, "replaced by another plan")
            self._execution = execution = PlanExecution(request, self.now, forecast=forecast)
            self._enter(Phase.INITIALIZING)
            execution.script = self.start_script(self._fly, execution)

    async def _switch(self, script: Script, request: imc.PlanControl, stops: int) -> None:
        """Replace the running plan if the new one passes its check, else it continues. A STOP meanwhile ends both."""
        try:
            forecast = await self._prepare(script, request)
            if stops != self._stops:
                raise PlanError("plan was stopped")
            self._start(request, forecast)
        except PlanError as error:
            self._replies.refuse(request, str(error))

    def _stop(self, request: imc.PlanControl) -> None:
        execution, self._stops = self._execution, self._stops + 1
        if execution is None:
            self._replies.refuse(request, "no plan is running, request ignored")
            return
        self._requests.command(Command.STOP_MANEUVER)
        self._give_up(execution, "plan was stopped")
        self._replies.succeed(request, "OK", plan_id=self._plan_id)
        self._enter(Phase.READY)
        self._end_log(execution)

    def _load(self, request: imc.PlanControl) -> None:
        if self._execution is not None:
            self._replies.refuse(request, "cannot load plan now")
        else:
            self.start_script(self._check_only, request)

    async def _check_only(self, script: Script, request: imc.PlanControl) -> None:
        """LOAD: only check the plan; the state reports the plan before, and its outcome."""
        try:
            forecast = await self._prepare(script, request)
        except PlanError as error:
            self._replies.refuse(request, str(error))
        else:
            self._replies.succeed(request, "plan loaded", forecast.statistics(self._check.preflight.capacity))

    def _publish_action(self, message: imc.Message) -> None:
        self.publish(message)  # looked up each time: a fault may stand before it

    async def _fly(self, script: Script, execution: PlanExecution) -> None:
        """START: from loading to the last maneuver."""
        inbox = script.listen(imc.VehicleCommand, imc.VehicleState)
        try:
            forecast = execution.forecast or await self._prepare(script, execution.request)
            graph = forecast.graph
            self._plan_id = graph.plan.plan_id
            execution.actions = PlanActions(graph, self._publish_action, self._activation_times.of)
            if execution.request.flags & imc.PlanControl.Flags.CALIBRATE and self.perform_calibration:
                preparation = max(self.minimum_calibration_time, execution.actions.preparation_time)
                forecast = replace(forecast, calibration=preparation)
            execution.forecast = forecast
            execution.statistics = forecast.statistics(self._check.preflight.capacity)
            # First the log, so that what follows is in it: Neptus shows a plan only if the log with its states has it.
            self.publish(imc.LoggingControl(op=imc.LoggingControl.Op.REQUEST_START, name=self._plan_id))
            self.publish(execution.statistics)
            self.publish(graph.plan.replace(src=self.system, src_ent=self.entity.id, timestamp=-1.0))
            self._succeed(execution, "plan loaded")
            self._latest.subscribe(self._bus, graph.condition_messages, self)
            execution.actions.begin_plan()
            if forecast.calibration:
                duration = math.ceil(forecast.calibration)
                await self._command(inbox, execution, Command.START_CALIBRATION, calib_time=duration)
                await script.sleep(forecast.calibration)
            name = graph.start
            while name != FINISH:
                name = await self._execute(inbox, execution, graph.nodes[name])
            self._requests.command(Command.STOP_MANEUVER)
            self._end(execution, Outcome.SUCCESS)
            self._succeed(execution, "; ".join(["plan completed", *execution.notes]))
            self._enter(Phase.READY)
            self._end_log(execution)
        except PlanError as error:
            self._fail(execution, str(error))

    async def _execute(self, inbox: Inbox, execution: PlanExecution, node: PlanNode) -> str:
        """Execute one maneuver until a transition holds; returns the name of the next."""
        execution.begin_maneuver(node, self.now)
        if loop := execution.instant_loop:
            raise PlanError(f"{' -> '.join(loop)}: these maneuvers end each other at once")
        if self._phase is Phase.INITIALIZING:
            self._enter(Phase.EXECUTING)
            self._succeed(execution, f"{node.name}: executing maneuver")
        else:
            self._publish_state()
        self._lines.write(f"{node.name}: executing maneuver")
        await self._command(inbox, execution, Command.EXEC_MANEUVER, maneuver=node.maneuver)
        name: str | None = None
        while name is None:
            event = await inbox.next()
            if isinstance(event, imc.VehicleState):
                name = node.evaluate_transitions(
                    self._latest, done=bool(event.flags & imc.VehicleState.Flags.MANEUVER_DONE)
                )
        execution.end_maneuver(self.now)
        return name

    async def _prepare(self, script: Script, request: imc.PlanControl) -> PlanForecast:
        """Check the plan of a request. Raises PlanError."""
        plan = await self._requests.resolve_requested_plan(script, request)
        return self._check.forecast(plan, self._supported, self._situation)

    async def _command(self, inbox: Inbox, execution: PlanExecution, command: Command, **fields: object) -> None:
        """Command the vehicle, and wait until it obeys."""
        execution.commanding = True
        self._requests.command(command, **fields)
        await self._requests.wait_until_accepted(inbox)
        execution.commanding = False

    def _fail(self, execution: PlanExecution, reason: str, *, command: bool = True, lost: bool = False) -> None:
        """End a plan that failed. `command` also stops the vehicle, unless it is `lost`, out of our control."""
        if command and not lost and execution.actions is not None:
            self._requests.command(Command.STOP_MANEUVER)
        self._end(execution, Outcome.FAILURE)
        self._lines.write_failure(reason)
        self._replies.fail(execution.request, reason, execution.statistics)
        self._enter(Phase.BLOCKED if lost else Phase.READY)
        self._end_log(execution)

    def _give_up(self, execution: PlanExecution, reason: str) -> None:
        """End a plan at the request of a console; who started it gets the last reply."""
        self._end(execution, Outcome.FAILURE)
        self._lines.write(reason)
        self._replies.fail(execution.request, reason, execution.statistics)

    def _end(self, execution: PlanExecution, outcome: Outcome) -> None:
        """End a plan: end actions, statistics."""
        self._execution, self._outcome = None, outcome
        if execution.script is not None:
            execution.script.cancel()
        self._latest.subscribe(self._bus, (), self)
        if execution.actions is None:
            return
        if outcome is Outcome.FAILURE:
            execution.end_maneuver(self.now)
        execution.actions.end_plan()
        self.publish(execution.final_statistics(self._plan_id, self.now))

    def _end_log(self, execution: PlanExecution) -> None:
        """End the log of a plan, which has its outcome by now; the plan that replaces one begins its own."""
        if execution.actions is not None:
            self.publish(imc.LoggingControl(op=imc.LoggingControl.Op.REQUEST_START))

    def _succeed(self, execution: PlanExecution, info: str) -> None:
        execution.info = info
        self._lines.write(f"reply -- Start Plan ({self._plan_id}) -- {info}")
        self._replies.succeed(execution.request, info, execution.statistics)

    def _enter(self, phase: Phase) -> None:
        before, self._phase = self._phase, phase
        if phase is not before:
            self._publish_state()

    def _publish_state(self) -> None:
        state = imc.PlanControlState(plan_progress=-1.0, man_type=NO_MANEUVER)
        if self._execution is not None:
            state = self._execution.control_state(self._vehicle, self.now, compute_progress=self.compute_progress)
        self.publish(state.replace(state=self._phase, plan_id=self._plan_id, last_outcome=self._outcome))
