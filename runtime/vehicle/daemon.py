"""The vehicle's own task: publishes its heartbeat, its entities and their states."""

import imc
from runtime.task import consume, periodic
from runtime.vehicle.parameter_service import ParameterService

ANY_ENTITY = 0xFF


class Daemon(ParameterService):
    """Entity 0 of every vehicle: publishes its heartbeat, its entities and their states."""

    def start(self) -> None:
        self.set_entity_state(imc.EntityState.State.NORMAL, "active")

    @periodic(1.0)
    def beat(self) -> None:
        """Once a second: Heartbeat, and the state of each entity that has one."""
        self.publish(imc.Heartbeat())
        if self.vehicle.pace is not None:
            self.vehicle.pace.look()
        for entity in self.vehicle.entities:
            if entity.stateful:
                self.publish(imc.EntityState(state=entity.state, description=entity.description), entity=entity)

    @consume(others=True)
    def tell_states(self, request: imc.QueryEntityState) -> None:
        if self._for_us(request):
            for entity in self.vehicle.entities:
                if entity.stateful and request.dst_ent in (entity.id, ANY_ENTITY):
                    report = imc.EntityState(state=entity.state, description=entity.description)
                    self.reply(request, report, entity=entity)

    @consume(others=True)
    def introduce(self, request: imc.QueryEntityInfo) -> None:
        """Reply for one entity; a request for any is answered for all entities, to everybody."""
        if not self._for_us(request):
            return
        for entity in self.vehicle.entities:
            info = imc.EntityInfo(
                id=entity.id,
                label=entity.label,
                component=entity.component,
                act_time=entity.activation_time,
                deact_time=entity.deactivation_time,
            )
            if request.dst_ent == entity.id:
                self.reply(request, info, entity=entity)
            elif request.dst_ent == ANY_ENTITY:
                self.publish(info, entity=entity)

    @consume(others=True)
    def list_entities(self, request: imc.EntityList) -> None:
        if request.op == imc.EntityList.Op.QUERY and self._for_us(request):
            text = ";".join(f"{entity.label}={entity.id}" for entity in self.vehicle.entities)
            self.reply(request, imc.EntityList(op=imc.EntityList.Op.REPORT, list=text))
        elif request.op == imc.EntityList.Op.REPORT and request.src != self.system:
            for entry in request.list.split(";"):
                label, _, number = entry.rpartition("=")
                if label and number.isascii() and number.isdecimal() and len(number) <= 3:
                    self.vehicle.entities.hear(request.src, int(number), label)

    @consume(others=True)
    def learn_label(self, info: imc.EntityInfo) -> None:
        self.vehicle.entities.hear(info.src, info.src_ent, info.label)

    @consume(others=True)
    def tell_activation(self, request: imc.QueryEntityActivationState) -> None:
        if self._for_us(request):
            for name, activation in self.vehicle.activations.items():
                task = self.vehicle.task(name)
                if request.dst_ent in (task.entity.id, ANY_ENTITY):
                    activation.publish()
