"""Makes plans from templates, on request."""

import imc
from autonomy.plans import LatLon, TemplateDefaults, TemplateError, plan_from_template
from imc.coordinates import absolute_position
from imc.tuple_list import parse_tuple_list
from runtime import Script, State, Task, consume, param
from tasks.plan.outgoing_requests import OutgoingRequests
from tasks.plan.replies import truncate_reply

Op = imc.PlanGeneration.Op
Command = imc.PlanGeneration.Cmd
MOST_PEERS = 1000


class Generator(Task):
    """Stores the plan of a template in the database and starts it on request."""

    dive_depth: float = param(2.0, "m", "Depth of the template dive.", minimum=0, name="Dive depth")
    dive_seconds: int = param(
        300, "s", "Duration of the templates dive and loiter.", minimum=0, maximum=65535, name="Dive seconds"
    )
    loiter_radius: float = param(10.0, "m", "Radius of circles and stations.", minimum=1, name="Loiter radius")
    rpm_speed: float = param(1000.0, "rpm", "Speed of the propeller.", minimum=1, name="RPM Speed")
    traveling_depth: float = param(1.0, "m", "Depth on the way.", minimum=0, name="Traveling depth")
    generate_at_boot: str = param("", "", "Template to store at the start; empty for none.")

    def start(self) -> None:
        self._state: imc.EstimatedState | None = None
        self._peers: dict[int, LatLon] = {}
        self._requests = OutgoingRequests(self)
        self.set_entity_state(State.NORMAL, "active")
        if self.generate_at_boot:
            self._generate(imc.PlanGeneration(plan_id=self.generate_at_boot, dst=self.system))

    @consume
    def on_estimated_state(self, state: imc.EstimatedState) -> None:
        self._state = state

    @consume(others=True)
    def on_announce(self, announce: imc.Announce) -> None:
        if announce.src in self._peers or len(self._peers) < MOST_PEERS:
            self._peers[announce.src] = announce.lat, announce.lon

    @consume(others=True)
    def dispatch(self, request: imc.PlanGeneration) -> None:
        if request.op == Op.REQUEST and self.is_for_me(request):
            self._generate(request)

    def _generate(self, request: imc.PlanGeneration) -> None:
        params = parse_tuple_list(request.params)
        usual = TemplateDefaults(
            self.traveling_depth, self.dive_depth, self.dive_seconds, self.loiter_radius, self.rpm_speed
        )
        here = absolute_position(self._state)[:2] if self._state is not None else None
        try:
            plan = plan_from_template(request.plan_id, params, here, self._peers.get(request.src), usual)
        except TemplateError as error:
            self._fail(request, str(error))
        else:
            self.start_script(self._store, request, plan, params.get("calibrate") != "false")

    async def _store(
        self, script: Script, request: imc.PlanGeneration, plan: imc.PlanSpecification, calibrate: bool
    ) -> None:
        put = imc.PlanDB(op=imc.PlanDB.Op.SET, plan_id=plan.plan_id, arg=plan)
        try:
            answer = await self._requests.query_database(script, put)
        except TimeoutError:
            self._fail(request, "no answer from the plan database")
            return
        if answer.type == imc.PlanDB.Type.FAILURE:
            self._fail(request, answer.info)
            return
        if request.cmd == Command.EXECUTE:
            flags = imc.PlanControl.Flags.CALIBRATE if calibrate else 0
            start = imc.PlanControl(plan_id=plan.plan_id, request_id=answer.request_id, flags=flags, dst=self.system)
            self.publish(start)
        self._reply(request, Op.SUCCESS, "")

    def _fail(self, request: imc.PlanGeneration, reason: str) -> None:
        self.log.error(f"{request.plan_id}: {reason}")
        self._reply(request, Op.ERROR, f"error={reason}")

    def _reply(self, request: imc.PlanGeneration, op: Op, params: str) -> None:
        plan_id = truncate_reply(request.plan_id)
        self.reply(request, imc.PlanGeneration(cmd=request.cmd, op=op, plan_id=plan_id, params=truncate_reply(params)))
