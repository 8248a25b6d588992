"""Executes plans, maneuver by maneuver, along their transitions."""

import math
from dataclasses import replace

import imc
from imc.addresses import BROADCAST, UNKNOWN_SYSTEM
from runtime import Script, State, Task, consume, param, periodic
from runtime.task import Inbox
from tasks.plan.actions import Leads, PlanActions, unknown_settings
from tasks.plan.flight import NOTHING, Flight
from tasks.plan.graph import FINISH, PlanError, PlanNode
from tasks.plan.outlook import Outlook
from tasks.plan.preflight import Preflight
from tasks.plan.replies import Replies
from tasks.plan.requests import PATIENCE, Latest, Requests

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
        True, "", "End the plan when an entity cannot be activated; refuse one that sets what the vehicle lacks."
    )
    compute_progress: bool = param(True, "", "Report the progress of the plan.")
    fuel_prediction: bool = param(True, "", "Refuse plans that need more energy than is left.")
    fuel_reserve: float = param(
        10.0, "%", "Battery level below which plans are refused, and the running one ends; 0 for none.", minimum=0
    )
    hotel_load: float = param(45.0, "W", "Power that the vehicle draws without moving.", minimum=0)
    maximum_leg_length: float = param(25000.0, "m", "Longest leg that path control follows.", minimum=1)
    plan_generator_entity_label: str = param("Plan Generator", "", "Entity that may start the recovery plan.")

    def configure(self) -> None:
        profile = self.vehicle.profile
        self._recovery = profile.value("General", "Recovery Plan", "dislodge")
        self._preflight = Preflight(
            lambda option: profile.value("General", option), self.hotel_load, self.maximum_leg_length
        )

    def start(self) -> None:
        lost: Flight | None = getattr(self, "_flight", None)
        before: Latest | None = getattr(self, "_situation", None)
        self._phase, self._outcome = Phase.READY, Outcome.NONE
        self._plan_id = ""
        self._flight: Flight | None = None
        self._stops = 0
        self._requests, self._replies = Requests(self), Replies(self)
        self._supported: set[int] = set()
        self._leads = Leads(self.vehicle.entities)
        self._latest = Latest()
        self._situation = before or Latest()
        self._vehicle: imc.VehicleState | None = None
        self._silence = 0
        self.set_entity_state(State.NORMAL, "active")
        if lost is not None:  # nobody else would end its maneuver
            self._plan_id = lost.request.plan_id
            self._fail(lost, "the plan engine failed, and has restarted")
        self._tell()

    @consume
    def register(self, maneuver: imc.RegisterManeuver) -> None:
        self._supported.add(maneuver.mid)

    @consume
    def learn(self, entity: imc.EntityInfo) -> None:
        self._leads.learn(entity)

    @consume
    def note(
        self,
        news: imc.EstimatedState | imc.FuelLevel | imc.OperationalLimits | imc.VehicleMedium | imc.ControlLoops,
    ) -> None:
        self._situation[type(news)] = news

    @consume
    def gauge(self, fuel: imc.FuelLevel) -> None:
        """End the plan when only the reserve of the battery is left."""
        if self._flight is not None and fuel.value < self.fuel_reserve:
            self._fail(self._flight, f"the battery is below its reserve of {self.fuel_reserve:g} %")

    @consume
    def watch_activations(self, state: imc.EntityActivationState) -> None:
        """End the plan if an entity that it needs cannot be activated."""
        flight = self._flight
        label = self.vehicle.entities.label(self.system, state.src_ent)
        if flight is None or flight.actions is None or state.state != imc.EntityActivationState.State.ACT_FAIL:
            return
        if label in flight.actions.activated and self.abort_on_failed_activation:
            self._fail(flight, f"failed to activate {label}: {state.error}")

    @consume
    def listen(self, maneuver: imc.ManeuverControlState) -> None:
        """A maneuver that is done says what it has missed."""
        if self._flight is not None and maneuver.state == imc.ManeuverControlState.State.DONE:
            self._flight.note(maneuver.info)

    @consume
    def follow(self, vehicle: imc.VehicleState) -> None:
        """The mode of the vehicle decides whether a plan can start or continue."""
        self._vehicle, self._silence = vehicle, 0
        flight = self._flight
        if vehicle.op_mode in (Mode.ERROR, Mode.BOOT, Mode.EXTERNAL):
            if flight is not None:
                errors = f"vehicle errors: {vehicle.error_ents}" if vehicle.error_count else vehicle.last_error
                self._fail(flight, errors or f"vehicle is in {Mode(vehicle.op_mode).name} mode", lost=True)
            self._enter(Phase.BLOCKED)
        elif flight is None:
            calibrating = vehicle.op_mode == Mode.CALIBRATION
            if calibrating or self._phase is Phase.BLOCKED:
                self._enter(Phase.BLOCKED if calibrating else Phase.READY)
        elif vehicle.op_mode == Mode.SERVICE and flight.node is not None and not flight.commanding:
            self._fail(flight, vehicle.last_error or "vehicle left the maneuver", command=False)

    @periodic("state_report_frequency")
    def tick(self) -> None:
        self._silence += 1
        if self._silence > PATIENCE * self.state_report_frequency:  # in ticks, so a late kernel is not silence
            if self._flight is not None:
                self._fail(self._flight, "VehicleState is missing", lost=True)
            if self._vehicle is not None:  # Failsafe may be silent, too
                self._vehicle = None
                self._requests.stop_everything(self._situation.of(imc.ControlLoops))
            self._enter(Phase.BLOCKED)
        if self._flight is not None:
            self._flight.foresee(self._vehicle, self.now)
        self._tell()

    @consume(others=True)
    def obey(self, request: imc.PlanControl) -> None:
        own = request.src == self.system and request.dst == UNKNOWN_SYSTEM  # of a task that left it open
        if request.type != Type.REQUEST or not (own or request.dst in (self.system, BROADCAST)):
            return
        if self._replies.is_copy(request):
            return
        if request.op == Op.START:
            self._start(request)
        elif request.op == Op.STOP:
            self._stop(request)
        elif request.op == Op.LOAD:
            self._load(request)
        elif request.op == Op.GET:
            flight = self._flight
            if flight is None or flight.outlook is None:
                self._replies.refuse(request, "no plan is running")
            else:
                self._replies.succeed(request, "OK", flight.outlook.graph.plan, plan_id=self._plan_id)
        else:
            self._replies.refuse(request, f"no such operation: {request.op}")

    def _start(self, request: imc.PlanControl, outlook: Outlook | None = None) -> None:
        """Start a plan; one that replaces another has already been checked and has its `outlook`."""
        flight = self._flight
        if flight is not None and flight.is_repeated(request, self.now):
            if flight.info:
                self._replies.succeed(flight.request, flight.info, flight.statistics)
        elif self._phase is Phase.BLOCKED:
            mode = "unknown" if self._vehicle is None else Mode(self._vehicle.op_mode).name
            self._replies.refuse(request, f"cannot start a plan: vehicle mode is {mode}")
        elif request.plan_id == self._recovery and not self._requests.come_from(
            self.plan_generator_entity_label, request
        ):
            self._replies.refuse(request, "only the plan generator may start the recovery plan")
        elif flight is not None and outlook is None:
            self.run(self._switch, request, self._stops)
        else:
            if flight is not None:
                self.log.warning(f"switching to {request.plan_id}")
                self._give_up(flight, "replaced by another plan")
            self._flight = flight = Flight(request, self.now, outlook=outlook)
            self._enter(Phase.INITIALIZING)
            flight.script = self.run(self._fly, flight)

    async def _switch(self, script: Script, request: imc.PlanControl, stops: int) -> None:
        """Replace the running plan if the new one passes its check, else it continues. A STOP meanwhile ends both."""
        try:
            outlook = await self._prepare(script, request)
            if stops != self._stops:
                raise PlanError("plan was stopped")
            self._start(request, outlook)
        except PlanError as error:
            self._replies.refuse(request, str(error))

    def _stop(self, request: imc.PlanControl) -> None:
        flight, self._stops = self._flight, self._stops + 1
        if flight is None:
            self._replies.refuse(request, "no plan is running, request ignored")
            return
        self._requests.command(Command.STOP_MANEUVER)
        self._give_up(flight, "plan was stopped")
        self._replies.succeed(request, "OK", plan_id=self._plan_id)
        self._enter(Phase.READY)
        self._end_log(flight)

    def _load(self, request: imc.PlanControl) -> None:
        if self._flight is not None:
            self._replies.refuse(request, "cannot load plan now")
        else:
            self.run(self._look, request)

    async def _look(self, script: Script, request: imc.PlanControl) -> None:
        """LOAD: only check the plan."""
        try:
            outlook = await self._prepare(script, request)
        except PlanError as error:
            self._outcome = Outcome.FAILURE if self._flight is None else self._outcome
            self._replies.refuse(request, str(error))
        else:
            self._plan_id = outlook.graph.plan.plan_id
            self._replies.succeed(request, "plan loaded", outlook.statistics(self._preflight.capacity))

    def _say(self, message: imc.Message) -> None:
        self.publish(message)  # looked up each time: a fault may stand before it

    async def _fly(self, script: Script, flight: Flight) -> None:
        """START: from loading to the last maneuver."""
        inbox = script.listen(imc.VehicleCommand, imc.VehicleState)
        try:
            outlook = flight.outlook or await self._prepare(script, flight.request)
            graph = outlook.graph
            self._plan_id = graph.plan.plan_id
            flight.actions = PlanActions(graph, self._say, self._leads.of)
            if flight.request.flags & imc.PlanControl.Flags.CALIBRATE and self.perform_calibration:
                preparation = max(self.minimum_calibration_time, flight.actions.preparation)
                outlook = replace(outlook, calibration=preparation)
            flight.outlook = outlook
            flight.statistics = outlook.statistics(self._preflight.capacity)
            # First the log, so that what follows is in it: Neptus shows a plan only if the log with its states has it.
            self.publish(imc.LoggingControl(op=imc.LoggingControl.Op.REQUEST_START, name=self._plan_id))
            self.publish(flight.statistics)
            self.publish(graph.plan.replace(src=self.system, src_ent=self.entity.id, timestamp=-1.0))
            self._succeed(flight, "plan loaded")
            self._latest.watch(self._bus, graph.kinds, self)
            flight.actions.begin()
            if outlook.calibration:
                duration = math.ceil(outlook.calibration)
                await self._demand(inbox, flight, Command.START_CALIBRATION, calib_time=duration)
                await script.sleep(outlook.calibration)
            name = graph.start
            while name != FINISH:
                name = await self._execute(inbox, flight, graph.nodes[name])
            self._requests.command(Command.STOP_MANEUVER)
            self._end(flight, Outcome.SUCCESS)
            self._succeed(flight, "; ".join(["plan completed", *flight.notes]))
            self._enter(Phase.READY)
            self._end_log(flight)
        except PlanError as error:
            self._fail(flight, str(error))

    async def _execute(self, inbox: Inbox, flight: Flight, node: PlanNode) -> str:
        """Execute one maneuver until a transition holds; returns the name of the next."""
        flight.enter(node, self.now)
        if loop := flight.loop:
            raise PlanError(f"{' -> '.join(loop)}: these maneuvers end each other at once")
        if self._phase is Phase.INITIALIZING:
            self._enter(Phase.EXECUTING)
            self._succeed(flight, f"{node.name}: executing maneuver")
        else:
            self._tell()
        self.log.info(f"{node.name}: executing maneuver")
        await self._demand(inbox, flight, Command.EXEC_MANEUVER, maneuver=node.maneuver)
        name: str | None = None
        while name is None:
            event = await inbox.next()
            if isinstance(event, imc.VehicleState):
                name = node.next(self._latest, done=bool(event.flags & imc.VehicleState.Flags.MANEUVER_DONE))
        flight.leave(self.now)
        return name

    async def _prepare(self, script: Script, request: imc.PlanControl) -> Outlook:
        """Check the plan of a request. Raises PlanError."""
        plan, situation = await self._requests.plan(script, request), self._situation
        state, limits = situation.of(imc.EstimatedState), situation.of(imc.OperationalLimits)
        fuel, medium = situation.of(imc.FuelLevel), situation.of(imc.VehicleMedium)
        if fuel is not None and fuel.value < self.fuel_reserve:
            raise PlanError(f"the battery is below its reserve of {self.fuel_reserve:g} %")
        level = fuel.value - self.fuel_reserve if fuel is not None and self.fuel_prediction else None
        aloft = medium is not None and medium.medium == imc.VehicleMedium.Medium.AIR
        outlook = self._preflight.check(plan, self._supported, state, level, self.now, limits, aloft)
        for reason in unknown_settings(outlook.graph, self.vehicle):
            if self.abort_on_failed_activation:
                raise PlanError(reason)
            self.log.warning(reason)
        return outlook

    async def _demand(self, inbox: Inbox, flight: Flight, command: Command, **fields: object) -> None:
        """Command the vehicle, and wait until it obeys."""
        flight.commanding = True
        self._requests.command(command, **fields)
        await self._requests.obeyed(inbox)
        flight.commanding = False

    def _fail(self, flight: Flight, reason: str, *, command: bool = True, lost: bool = False) -> None:
        """End a plan that failed. `command` also stops the vehicle, unless it is `lost`, out of our control."""
        if command and not lost and flight.actions is not None:
            self._requests.command(Command.STOP_MANEUVER)
        self._end(flight, Outcome.FAILURE)
        self._replies.fail(flight.request, reason, flight.statistics)
        self._enter(Phase.BLOCKED if lost else Phase.READY)
        self._end_log(flight)

    def _give_up(self, flight: Flight, reason: str) -> None:
        """End a plan at the request of a console; who started it gets the last reply."""
        self._end(flight, Outcome.FAILURE)
        self._replies.fail(flight.request, reason, flight.statistics, meant=True)

    def _end(self, flight: Flight, outcome: Outcome) -> None:
        """End a plan: end actions, statistics."""
        self._flight, self._outcome = None, outcome
        if flight.script is not None:
            flight.script.cancel()
        self._latest.watch(self._bus, (), self)
        if flight.actions is None:
            return
        if outcome is Outcome.FAILURE:
            flight.leave(self.now)
        flight.actions.end()
        self.publish(flight.result(self._plan_id, self.now))

    def _end_log(self, flight: Flight) -> None:
        """End the log of a plan, which has its outcome by now; the plan that replaces one begins its own."""
        if flight.actions is not None:
            self.publish(imc.LoggingControl(op=imc.LoggingControl.Op.REQUEST_START))

    def _succeed(self, flight: Flight, info: str) -> None:
        flight.info = info
        self.log.info(f"reply -- Start Plan ({self._plan_id}) -- {info}")
        self._replies.succeed(flight.request, info, flight.statistics)

    def _enter(self, phase: Phase) -> None:
        before, self._phase = self._phase, phase
        if phase is not before:
            self._tell()

    def _tell(self) -> None:
        state = imc.PlanControlState(plan_progress=-1.0, man_type=NOTHING)
        if self._flight is not None:
            state = self._flight.report(self._vehicle, self.now, compute_progress=self.compute_progress)
        self.publish(state.replace(state=self._phase, plan_id=self._plan_id, last_outcome=self._outcome))
