"""Base class of simulated sensors that measure the true state of the vehicle."""

import imc
from runtime import State, Task, consume
from tasks.simulated_world import INVALID_TRUTH, is_valid_truth


class TrueStateSensorTask(Task):
    """Keeps the latest SimulatedState; there is none before the first one, and after one that makes no sense."""

    _truth: imc.SimulatedState | None = None
    _is_checked = True

    def start(self) -> None:
        self._truth, self._is_checked = None, True
        self.report_state(State.BOOT, "waiting for SimulatedState")

    def report_state(self, state: State, description: str) -> None:
        """Set the state of all entities of the sensor."""
        self.set_entity_state(state, description)

    @consume
    def update_truth(self, truth: imc.SimulatedState) -> None:
        had_none = self._truth is None
        self._truth, self._is_checked = truth, False  # most states are replaced before the sensor measures
        if had_none and self.true_state() is not None:
            self.report_state(State.NORMAL, "active")

    def true_state(self) -> imc.SimulatedState | None:
        """The state to measure; None, and a fault of the sensor, if it makes no sense."""
        if not self._is_checked and self._truth is not None:
            self._is_checked = True
            if not is_valid_truth(self._truth):
                self._truth = None
                self.report_state(State.FAULT, INVALID_TRUTH)
        return self._truth
