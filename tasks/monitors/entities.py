"""Watches the entities that the vehicle needs."""

from collections.abc import Iterator

import imc
from runtime import State, Task, consume, param, periodic
from runtime.profile import split_list
from support.diagnostics import ConfigWarning
from support.terminal_text import quoted, suggestion

Condition = imc.EntityState.State
ALWAYS = "Daemon"
BROKEN = (Condition.FAULT, Condition.ERROR, Condition.FAILURE)


class Entities(Task):
    """Publishes which monitored entities are in error or boot; an entity that is silent too long has failed."""

    default_monitoring: list[str] = param([], "", "Labels of the entities to be monitored.", editable=False)
    default_monitoring_hardware: list[str] = param(
        [], "", "Additional entities outside simulation.", name="Default Monitoring -- Hardware", editable=False
    )
    report_timeout: float = param(5.0, "s", "An entity without a report for this time has failed.", minimum=0.1)

    def configuration_warnings(self) -> Iterator[ConfigWarning]:
        known = [entity.label for entity in self.vehicle.entities]
        lists = {"default_monitoring": self.default_monitoring, "default_monitoring_hardware": self._hardware()}
        for parameter in self.parameters().values():
            for label in lists.get(parameter.attribute, []):
                if label not in known:
                    text = f"{parameter.name}: no running task has the entity {quoted(label)}; the mode becomes ERROR"
                    yield ConfigWarning(parameter.name, text, suggestion(label, known))

    def start(self) -> None:
        wanted = [ALWAYS, *self.default_monitoring, *self._hardware()]
        self._states: dict[str, Condition] = dict.fromkeys(wanted, Condition.BOOT)
        self._received_at = dict.fromkeys(wanted, self.now)
        self._error, self._error_time = "", -1.0
        self.set_entity_state(State.NORMAL, "active")

    def _hardware(self) -> list[str]:
        simulated = self.vehicle.has_virtual_time or "Simulation" in split_list(
            self.vehicle.profile.value("General", "Selected")
        )
        return [] if simulated else self.default_monitoring_hardware

    @consume
    def on_entity_state(self, report: imc.EntityState) -> None:
        label = self.vehicle.entities.label(self.system, report.src_ent)
        if label not in self._states:
            return
        self._received_at[label] = self.now
        if report.state <= Condition.FAILURE:
            self._change(label, Condition(report.state), report.description)

    @periodic(1.0)
    def publish_state(self) -> None:
        """Publish the state of all entities, once a second."""
        for label, received_at in self._received_at.items():
            if self.age(received_at) > self.report_timeout:
                self._change(label, Condition.FAILURE, f"no report for {self.report_timeout:g} s", is_logged=False)
        self._publish()

    def _change(self, label: str, state: Condition, description: str, *, is_logged: bool = True) -> None:
        if state is self._states[label]:
            return
        self._states[label] = state
        if state in BROKEN:
            self._error, self._error_time = f"{label}: {description}", self.now
        if is_logged:
            self._publish()

    def _publish(self) -> None:
        broken = [label for label, state in self._states.items() if state in BROKEN]
        booting = [label for label, state in self._states.items() if state is Condition.BOOT]
        self.publish(
            imc.EntityMonitoringState(
                mcount=len(self._states),
                mnames=",".join(self._states),
                ccount=len(broken),
                cnames=",".join(broken),
                ecount=len(booting),
                enames=",".join(booting),
                last_error=self._error,
                last_error_time=self._error_time,
            )
        )
