"""IMC's activation protocol: activates and deactivates tasks that have a parameter Active."""

from typing import TYPE_CHECKING, TypeAlias

from imc import EntityActivationState, EntityParameter, EntityParameters

if TYPE_CHECKING:
    from runtime.task.task import Task

Phase: TypeAlias = EntityActivationState.State


class ActivationError(RuntimeError):
    """A task cannot become active, or inactive; the text gives the reason."""


class Activation:
    """The activation state of one task; each step is published as EntityActivationState."""

    def __init__(self, task: "Task"):
        self.phase: Phase = Phase.INACTIVE
        self.error: str = ""
        self._task = task

    @property
    def active(self) -> bool:
        return self.phase is Phase.ACTIVE

    def publish(self) -> None:
        self._task.publish(EntityActivationState(state=self.phase, error=self.error))

    def request(self, active: bool) -> None:
        """Activate or deactivate; publishes the present state if nothing changes."""
        if active == self.active:
            self.publish()
            return
        self._enter(Phase.ACT_IP if active else Phase.DEACT_IP)
        try:
            if active:
                self._task.activate()
            else:
                self._task.deactivate()
        except ActivationError as failure:
            self._publish_active(not active)
            self._enter(Phase.ACT_FAIL if active else Phase.DEACT_FAIL, str(failure))
            self._enter(Phase.INACTIVE if active else Phase.ACTIVE)
            return
        self._publish_active(active)
        self._enter(Phase.ACT_DONE if active else Phase.DEACT_DONE)
        self._enter(Phase.ACTIVE if active else Phase.INACTIVE)

    def reset(self) -> None:
        """Return to inactive without calling the task, which is being restarted."""
        self.phase, self.error = Phase.INACTIVE, ""

    def _enter(self, phase: Phase, error: str = "") -> None:
        self.phase, self.error = phase, error
        self.publish()

    def _publish_active(self, active: bool) -> None:
        task = self._task
        task.parameter_set.set(task.parameters()["Active"], active)
        value = EntityParameter(name="Active", value="true" if active else "false")
        task.publish(EntityParameters(name=task.entity.label, params=(value,)))
