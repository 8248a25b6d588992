"""Common parts of all path controllers: when a path begins, what is steered by, and when it is reported."""

import math

import imc
from autonomy.control import EnabledLoops
from autonomy.guidance import is_valid_path
from runtime import State, Task, consume, param

EARLY = 1e-3  # s; a state may come this much early for its cycle


class DesiredPathTask(Task):
    """Takes DesiredPath while the loop PATH is enabled; a path that comes before EstimatedState waits for it."""

    report_frequency: float = param(
        1.0, "Hz", "Rate of PathControlState.", name="State Report Frequency", minimum=0.001, maximum=1000
    )

    def start(self) -> None:
        self._loops = EnabledLoops(imc.CLoopsMask.PATH)
        self._waiting: imc.DesiredPath | None = None
        self._path: imc.DesiredPath | None = None
        self._state: imc.EstimatedState | None = None
        self._reported = -math.inf

    @consume
    def follow_path(self, path: imc.DesiredPath) -> None:
        """Follow a path, as soon as there is an EstimatedState."""
        if not self._loops.mask:
            return
        if fault := self.path_fault(path):
            self.fail(fault)
        elif self._state is None:
            self._waiting = path
        else:
            self.begin_path(path, self._state)

    @consume
    def steer(self, state: imc.EstimatedState) -> None:
        """Begin the path that waits, and steer by a state."""
        before, self._state = self._state, state
        if self._waiting is not None:
            path, self._waiting = self._waiting, None
            self.begin_path(path, state)
        if self._path is not None:
            self.steer_along(self._path, before, state)

    def path_fault(self, path: imc.DesiredPath) -> str:
        """Reason why a path cannot be followed; empty if there is none."""
        return "" if is_valid_path(path) else "the desired path has an invalid position or number"

    def begin_path(self, path: imc.DesiredPath, state: imc.EstimatedState) -> None:
        """Begin to follow a path from where a state is."""
        raise NotImplementedError

    def steer_along(self, path: imc.DesiredPath, before: imc.EstimatedState | None, state: imc.EstimatedState) -> None:
        """Steer along the present path by a state; `before` is the one before, None at first."""
        raise NotImplementedError

    def is_report_due(self, state: imc.EstimatedState) -> bool:
        """Whether PathControlState is to be published with this state; then the period begins again."""
        if state.timestamp - self._reported < 1.0 / self.report_frequency - EARLY:
            return False
        self._reported = state.timestamp
        return True

    def fail(self, reason: str) -> None:
        """Set the entity to ERROR; the first reason is logged."""
        if self.entity.state is not State.ERROR:
            self.log.error(reason)
        self.set_entity_state(State.ERROR, reason)
