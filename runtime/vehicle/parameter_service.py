"""Queries, sets, pushes, pops and saves parameters over IMC, by entity label; the part of the Daemon that does so."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import imc
from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime.kernel import to_ordinary_exception
from runtime.profile import format_option
from runtime.task import Parameter, ParameterError, Task, consume
from runtime.vehicle.reply_quota import ReplyQuota
from support.file_errors import describe_os_error
from support.log_limit import LogLimit

if TYPE_CHECKING:
    from runtime.vehicle.vehicle import Vehicle

VISIBILITIES = ("user", "developer")
SCOPES = ("global", "idle", "plan", "maneuver")


class ParameterService(Task):
    """Answers parameter requests for all tasks of the vehicle, each from the task's entity.

    With `publishes_all`, changed parameters are also published for all.
    """

    vehicle: "Vehicle"
    publishes_all = False

    def configure(self) -> None:
        self.reply_quota: ReplyQuota = ReplyQuota()
        self.refusals: LogLimit = LogLimit("more requests about parameters are rejected")

    @consume(others=True)
    def set_parameters(self, request: imc.SetEntityParameters) -> None:
        """Set what can be set, log the rest as errors, and reply with what was accepted."""
        task = self._addressed(request, request.name)
        if task is None:
            return
        before = task.parameter_set.snapshot()
        accepted: list[Parameter] = []
        for entry in request.params:
            if not isinstance(entry, imc.EntityParameter):
                continue
            parameter = task.parameter_set.find(entry.name)
            reason = self._refusal(task, parameter, entry)
            if parameter is None or reason:
                text = f"{entry.name} = {entry.value!r} from {self._peer(request)}: {reason}"
                self.refusals.write(task.log.error, text, self.now)
                continue
            task.parameter_set.set(parameter, parameter.parse(entry.value))
            accepted.append(parameter)
        if accepted and self._apply(task, before):
            self._answer(request, task, accepted)

    @consume(others=True)
    def query(self, request: imc.QueryEntityParameters) -> None:
        """Reply with the parameters of the requested visibility and scope, sorted by name.

        There may be none: the console needs an answer to see that.
        """
        task = self._addressed(request, request.name)
        if task is None:
            self._answer_without_task(request)
            return
        visibility, scope = request.visibility or "developer", request.scope or "global"
        if visibility not in VISIBILITIES or scope not in SCOPES:
            text = f"query from {self._peer(request)}: visibility {visibility!r} and scope {scope!r} "
            text += f"must be one of {VISIBILITIES} and {SCOPES}"
            self.refusals.write(self.log.warning, text, self.now)
            return
        chosen = [
            parameter
            for _, parameter in sorted(task.parameter_set.declarations.items())
            if visibility in ("developer", parameter.visibility) and scope in ("global", parameter.scope)
        ]
        if chosen or not task.parameter_set.declarations:
            self._answer(request, task, chosen)

    def _answer_without_task(self, request: imc.QueryEntityParameters) -> None:
        """Reply that an entity of this process, such as a beam of a DVL, has no parameters of its own."""
        entity = self.vehicle.entities.find(request.name)
        ours = entity is not None and not entity.process and self.find_task(request.name) is None
        if ours and entity is not self.entity and self.is_for_me(request) and self._affords(request, 1):
            self.reply(request, imc.EntityParameters(name=request.name), entity=entity)

    @consume(others=True)
    def push(self, request: imc.PushEntityParameters) -> None:
        """Remember the values whose scope is not global."""
        task = self._addressed(request, request.name)
        if task is not None:
            task.parameter_set.push()

    @consume(others=True)
    def pop(self, request: imc.PopEntityParameters) -> None:
        """Restore the remembered values."""
        task = self._addressed(request, request.name)
        if task is not None:
            before = task.parameter_set.snapshot()
            if task.parameter_set.pop():
                self._apply(task, before)

    @consume(others=True)
    def save(self, request: imc.SaveEntityParameters) -> None:
        """Write what differs from the profile to the vehicle's file of saved parameters."""
        task = self._addressed(request, request.name)
        if task is None:
            return
        try:
            path = self.vehicle.save_parameters(task)
        except (OSError, ValueError) as error:
            reason = describe_os_error(error, self.vehicle.state_folder) if isinstance(error, OSError) else error
            self.log.error(f"parameters of {task.entity.label} not saved: {reason}")
        else:
            self.log.info(f"parameters of {task.entity.label} saved to {path.name}")

    @consume(others=True)
    def query_typed(self, request: imc.QueryTypedEntityParameters) -> None:
        """Reply with types, units and limits; an empty name asks every task."""
        if request.op != imc.QueryTypedEntityParameters.Op.REQUEST:
            return
        here = [task for task in self.vehicle.tasks if self.find_task(task.entity.label) is task]
        asked = [task for task in here if request.entity_name in ("", task.entity.label)]
        if self._grants(request, len(asked)):
            for task in asked:
                reply = imc.QueryTypedEntityParameters(
                    op=imc.QueryTypedEntityParameters.Op.REPLY,
                    request_id=request.request_id,
                    entity_name=task.entity.label,
                    parameters=tuple(_typed(task, p) for p in task.parameter_set.declarations.values()),
                )
                self.reply(request, reply, entity=task.entity)

    def _addressed(self, request: imc.Message, label: str) -> Task | None:
        task = self.find_task(label) if self.is_for_me(request) else None
        return task if task is not None and self._affords(request, 1) else None

    def find_task(self, label: str) -> Task | None:
        """The task with this label, if it runs here; of the daemons of several processes only the main one answers."""
        task = self.vehicle.task_by_label(label)
        return None if task is self and self.vehicle.process else task

    def _grants(self, request: imc.Message, replies: int) -> bool:
        """Whether a request is for us, and its sender has not asked too much."""
        return request.dst in (self.system, UNKNOWN_SYSTEM) and self._affords(request, replies)

    def _affords(self, request: imc.Message, replies: int) -> bool:
        return request.src == self.system or self.reply_quota.try_acquire(request.src, replies, self.now)

    def _peer(self, request: imc.Message) -> str:
        return self.vehicle.systems.name(request.src)

    def _refusal(self, task: Task, parameter: Parameter | None, entry: imc.EntityParameter) -> str:
        if parameter is None:
            return f"{task.name} has no such parameter"
        if not parameter.editable:
            return "cannot be changed while the vehicle runs"
        try:
            parameter.parse_strict(entry.value)
            format_option(parameter.name, entry.value)
        except ValueError as error:
            return str(error)
        return ""

    def _apply(self, task: Task, before: dict[str, object]) -> bool:
        """Apply new values; the old ones are restored if the task rejects them. Other exceptions are its own errors."""
        active = task.parameters()["Active"] if task.activation else None
        wish = active is not None and task.parameter_set.value(active)
        try:
            if active is not None:  # only the activation protocol changes it
                task.parameter_set.set(active, before[active.name])
            self._configure(task, before)
            self.vehicle.update_effective_config(task)
            if active is not None and task.name not in self.vehicle.running:
                task.parameter_set.set(active, wish)
            elif active is not None:
                self.vehicle.activations[task.name].request(wish)
        except ParameterError as error:
            task.log.error(f"{error}; the old values stay")
            return False
        except BaseException as error:
            self._kernel.on_error(task, to_ordinary_exception(error))
            return False
        if self.publishes_all:
            self._publish_parameters(task)
        return True

    def _configure(self, task: Task, before: dict[str, object]) -> None:
        try:
            task.configure()
            task.update_rates()
        except BaseException:
            task.parameter_set.restore(before)
            task.configure()
            task.update_rates()
            raise

    def _publish_parameters(self, task: Task) -> None:
        """Publish all parameters of a task for everybody."""
        if declared := task.parameter_set.declarations:
            self.publish(_values(task, [declared[name] for name in sorted(declared)]), entity=task.entity)

    def _answer(self, request: imc.Message, task: Task, chosen: Iterable[Parameter]) -> None:
        self.reply(request, _values(task, chosen), entity=task.entity)


def _values(task: Task, chosen: Iterable[Parameter]) -> imc.EntityParameters:
    values = tuple(imc.EntityParameter(name=p.name, value=task.parameter_set.text(p)) for p in chosen)
    return imc.EntityParameters(name=task.entity.label, params=values)


def _typed(task: Task, parameter: Parameter) -> imc.TypedEntityParameter:
    kinds = imc.TypedEntityParameter.Type
    name = parameter.xml_type_name.replace("list:", "LIST_").upper().replace("REAL", "FLOAT").replace("BOOLEAN", "BOOL")
    low, high = parameter.size or (0, 0)
    return imc.TypedEntityParameter(
        name=parameter.name,
        type=kinds[name.replace("INTEGER", "INT")],
        default_value=task.parameter_set.text(parameter),
        units=parameter.unit,
        description=parameter.description,
        values_list=",".join(map(str, parameter.choices)),
        min_value=float("-inf") if parameter.minimum is None else parameter.minimum,
        max_value=float("inf") if parameter.maximum is None else parameter.maximum,
        list_min_size=low,
        list_max_size=high,
        visibility=VISIBILITIES.index(parameter.visibility) + (0 if parameter.editable else 2),
        scope=SCOPES.index(parameter.scope),
    )
