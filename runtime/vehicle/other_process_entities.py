"""The other processes of a vehicle: which run, their entities, and as which they may publish."""

from typing import TYPE_CHECKING

import imc
from runtime.bus import Subscription
from runtime.task import Entity, State

if TYPE_CHECKING:
    from runtime.vehicle.vehicle import Vehicle

STARTING_TIME = 20.0  # s until a process that does not appear has failed


def may_publish(vehicle: "Vehicle", message: imc.Message) -> bool:
    """Whether another process may publish a message as its entity: not if that runs here, which is warned of once."""
    entity = vehicle.entities.by_id(message.src_ent)
    if entity is None or entity is vehicle.daemon.entity or entity.process:
        return True
    if vehicle.process and isinstance(message, imc.EntityInfo | imc.EntityState):
        return False  # the main process speaks for all entities in a new log, and for those of a process that starts
    if not vehicle.bus.refused:
        vehicle.daemon.log.warning(
            f"another process publishes as {entity.label} of {vehicle.name}; its packets are ignored. Is the vehicle "
            "running twice? Give one of them another name (-V), or another bus"
        )
    return False


class ProcessMonitor:
    """Keeps the entities of the vehicle's other processes in the main one's table.

    While a process runs it reports their states itself; when it has ended, they are in FAILURE. Call `update` from the
    kernel's thread.
    """

    def __init__(self, vehicle: "Vehicle") -> None:
        self._vehicle = vehicle
        self.running: set[str] = set()
        for kind, handler in ((imc.EntityState, self._follow), (imc.EntityInfo, self._adopt)):
            vehicle.bus.subscribe(Subscription(kind, handler, handler))
        for entity in self.entities_of_process():
            entity.orphan = entity.stateful = True
            entity.description = f"process {entity.process} starts"
        vehicle.kernel.after(STARTING_TIME, self._give_up)

    def entities_of_process(self, process: str = "") -> list[Entity]:
        """Entities of one other process, or of all."""
        return [e for e in self._vehicle.entities if e.process and process in ("", e.process)]

    def update_process_state(self, process: str, runs: bool) -> None:
        """A process has appeared, or gone; when the vehicle ends, all go."""
        if runs == (process in self.running) or self._vehicle.stopped or self._vehicle.closing:
            return
        log = self._vehicle.daemon.log
        if runs:
            self.running.add(process)
            log.info(f"process {process} runs")
            for entity in self.entities_of_process(process):
                entity.orphan = False
        else:
            self.running.discard(process)
            log.error(f"process {process} has ended")
            self._fail(process, f"process {process} has ended")

    def _fail(self, process: str, why: str) -> None:
        daemon = self._vehicle.daemon
        for entity in self.entities_of_process(process):
            entity.orphan = entity.stateful = True
            entity.state, entity.description = State.FAILURE, why
            daemon.publish(imc.EntityState(state=entity.state, description=why), entity=entity)

    def _give_up(self) -> None:
        for process in sorted({entity.process for entity in self.entities_of_process()} - self.running):
            self._fail(process, f"process {process} does not run")

    def _follow(self, report: imc.EntityState) -> None:
        entity = self._vehicle.entities.by_id(report.src_ent)
        if entity is not None and entity.process in self.running:
            entity.state, entity.description, entity.stateful = State(report.state), report.description, True

    def _adopt(self, info: imc.EntityInfo) -> None:
        """Take a further entity of a task of another process into the table."""
        process = next((e.process for e in self.entities_of_process() if e.component == info.component), "")
        entities = self._vehicle.entities
        if (
            process
            and entities.by_id(info.id) is None
            and entities.add_other_process_entity(info.id, info.label, info.component, process)
        ):
            self._vehicle.daemon.publish_entities()
