"""The vehicle's own task: publishes its heartbeat, its entities and their states."""

from collections import Counter

import imc
from imc.reserved_ids import UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from runtime.task import Entity, consume, periodic
from runtime.vehicle.parameter_service import ParameterService
from support.log_limit import ReportLimit

ANY_ENTITY = UNKNOWN_ENTITY
REPORT_PERIOD = 10.0  # s
MOST_NAMED = 5


class Daemon(ParameterService):
    """Entity 0 of every vehicle: publishes its heartbeat, its entities and their states."""

    def configure(self) -> None:
        super().configure()
        self._excess = ReportLimit(REPORT_PERIOD)
        self._malformed = ReportLimit()
        self._has_published_all = False

    def start(self) -> None:
        self.set_entity_state(imc.EntityState.State.NORMAL, "active")

    def stop(self) -> None:
        self._report_excess()
        if malformed := self.vehicle.bus.malformed:
            self.log.warning(f"{malformed} malformed packet{'s' * (malformed != 1)} of others dropped in this run")

    @periodic(1.0)
    def publish_heartbeat_and_entities(self) -> None:
        """Publish Heartbeat, and the state of each entity that has one, once a second."""
        if self._is_main:
            self.publish(imc.Heartbeat())
        if self.vehicle.realtime_lag is not None:
            self.vehicle.realtime_lag.poll()
        if self.publishes_all and not self._has_published_all:
            self._has_published_all = True
            self._publish_kept_messages()
        for entity in self.vehicle.entities:
            if entity.stateful and self.reports_state_of(entity):
                self.publish(imc.EntityState(state=entity.state, description=entity.description), entity=entity)
        dropped = self.vehicle.bus.inbox.dropped or self.reply_quota.refused
        if dropped and self._excess.is_due(now=self.now):
            self._report_excess()

    def _publish_kept_messages(self) -> None:
        """Publish what a bus keeps for those who join later: the entities, and their parameters."""
        if self._is_main:
            self.publish_entities()
        else:
            for entity in filter(self.reports_state_of, self.vehicle.entities):
                self.publish(_described(entity), entity=entity)
        for task in self.vehicle.tasks:
            if self.reports_state_of(task.entity):
                self._publish_parameters(task)

    def publish_entities(self) -> None:
        """Publish the list of entities for all."""
        self.publish(self._entities())

    @property
    def _is_main(self) -> bool:
        """Whether this process speaks for the vehicle; the others for their own entities only."""
        return not self.vehicle.process

    def reports_state_of(self, entity: Entity) -> bool:
        """Whether this process reports the state of an entity."""
        return self._is_main if entity is self.entity else not entity.process or entity.orphan

    def _entities(self) -> imc.EntityList:
        text = ";".join(f"{entity.label}={entity.id}" for entity in self.vehicle.entities)
        return imc.EntityList(op=imc.EntityList.Op.REPORT, list=text)

    def _report_excess(self) -> None:
        """Log who sends or asks too much."""
        excess = (("packets", self.vehicle.bus.inbox.drain_dropped), ("requests", self.reply_quota.refused.drain))
        name, counts = self.vehicle.systems.name, Counter[str]()
        for kind, drain in excess:
            for source, number in drain().items():
                counts[f"{kind} from {name(source) if source != UNKNOWN_SYSTEM else 'further systems'}"] += number
        if not counts:
            return
        worst = counts.most_common()
        listed = ", ".join(f"{number} {source}" for source, number in worst[:MOST_NAMED])
        rest = f" and from {len(worst) - MOST_NAMED} more" if len(worst) > MOST_NAMED else ""
        self.log.warning(f"dropped because too many arrive: {listed}{rest}")

    @consume(others=True)
    def on_unknown(self, message: imc.Unknown) -> None:
        if message.dst == self.system and message.src != self.system:
            self.log_malformed(message.src, f"there is no message with id {message.id} here, see [General] Messages")

    def log_malformed(self, source: int, why: str) -> None:
        """Log who has sent what this vehicle cannot read: once for each system and reason."""
        if self._is_main and self._malformed.is_due((source, why)):
            rest = "; further ones are not named" if self._malformed.is_full else ""
            self.log.warning(f"packet from 0x{source:04X} dropped: {why}{rest}")

    @consume(others=True)
    def answer_entity_states(self, request: imc.QueryEntityState) -> None:
        asked = [e for e in self.vehicle.entities if e.stateful and request.dst_ent in (e.id, ANY_ENTITY)]
        if asked and self._is_main and self._grants(request, len(asked)):
            for entity in asked:
                report = imc.EntityState(state=entity.state, description=entity.description)
                self.reply(request, report, entity=entity)

    @consume(others=True)
    def answer_entity_info(self, request: imc.QueryEntityInfo) -> None:
        """Reply for one entity; a request for any is answered for all entities, to everybody."""
        asked = [entity for entity in self.vehicle.entities if request.dst_ent in (entity.id, ANY_ENTITY)]
        if not asked or not self._is_main or not self._grants(request, len(asked)):
            return
        for entity in asked:
            info = _described(entity)
            if request.dst_ent == entity.id:
                self.reply(request, info, entity=entity)
            else:
                self.publish(info, entity=entity)

    @consume(others=True)
    def answer_entity_list(self, request: imc.EntityList) -> None:
        if request.op == imc.EntityList.Op.QUERY and self._is_main and self._grants(request, 1):
            self.reply(request, self._entities())
        elif request.op == imc.EntityList.Op.REPORT and request.src != self.system:
            for entry in request.list.split(";"):
                label, _, number = entry.rpartition("=")
                if label and number.isascii() and number.isdecimal() and len(number) <= 3:
                    self.vehicle.entities.learn_label(request.src, int(number), label)

    @consume(others=True)
    def learn_label(self, info: imc.EntityInfo) -> None:
        self.vehicle.entities.learn_label(info.src, info.src_ent, info.label)

    @consume(others=True)
    def answer_activation_states(self, request: imc.QueryEntityActivationState) -> None:
        asked = [
            activation
            for name, activation in self.vehicle.activations.items()
            if request.dst_ent in (self.vehicle.task(name).entity.id, ANY_ENTITY)
        ]
        if asked and self._grants(request, len(asked)):
            for activation in asked:
                activation.publish()


def _described(entity: Entity) -> imc.EntityInfo:
    return imc.EntityInfo(
        id=entity.id,
        label=entity.label,
        component=entity.component,
        act_time=entity.activation_time,
        deact_time=entity.deactivation_time,
    )
