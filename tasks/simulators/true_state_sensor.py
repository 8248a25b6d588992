"""Base class of simulated sensors that measure the true state of the vehicle."""

import imc
from runtime import State, Task, consume
from tasks.simulated_world import INVALID_TRUTH, is_valid_truth


class TrueStateSensorTask(Task):
    """Keeps the latest SimulatedState, None before the first one and after one that makes no sense."""

    _truth: imc.SimulatedState | None = None

    def start(self) -> None:
        self._truth = None
        self.report_state(State.BOOT, "waiting for SimulatedState")

    def report_state(self, state: State, description: str) -> None:
        """Set the state of all entities of the sensor."""
        self.set_entity_state(state, description)

    @consume
    def update_truth(self, truth: imc.SimulatedState) -> None:
        if not is_valid_truth(truth):
            self._truth = None
            self.report_state(State.FAULT, INVALID_TRUTH)
            return
        if self._truth is None:
            self.report_state(State.NORMAL, "active")
        self._truth = truth
