"""AirSim's time as the clock of a vehicle: both go in lock-step."""

import math
from collections.abc import Callable

from runtime.kernel import SECOND
from tasks.vision.airsim_api.client import RpcClient

POLL = 2e-3  # s of real time between two questions whether a step has ended


class AirSimClock:
    """Lets AirSim run for `step` s at a time, and stand still while the vehicle works.

    AirSim is at most one step ahead: handlers see it as it is at the end of the step that they run in. `start` is in ns
    since 1970. Raises OSError or AirSimError when AirSim does not answer within `timeout` s; no time passes then.
    """

    virtual = True
    speed: float = math.inf

    def __init__(
        self, start: int, host: str = "127.0.0.1", port: int = 41451, *, step: float = 0.02, timeout: float = 5.0
    ):
        if not 1e-3 <= step <= 1.0:
            raise ValueError(f"a step of {step:g} s is not within 0.001 to 1 s")
        self._rpc = RpcClient(host, port, timeout)
        self._now = self._end = start  # the end of the last step that was begun
        self._step = step
        self._running = False

    def read(self) -> int:
        return self._now

    def advance(self, target: int | None, wait: Callable[[float], object]) -> int | None:
        if self._running:
            self._running = not self._rpc.call("simIsPaused", bool)
            if self._running:
                wait(POLL)
                return self._now
        elif self._now == self._end:
            self._begin()
            return self._now
        self._now = self._end if target is None else max(self._now, min(target, self._end))
        return self._now

    def _begin(self) -> None:
        if not self._rpc.exchange.is_open:
            self._rpc.call("simPause", type(None), True)
        self._rpc.call("simContinueForTime", type(None), self._step)
        self._running, self._end = True, self._end + round(self._step * SECOND)

    def close(self) -> None:
        self._rpc.exchange.close()
