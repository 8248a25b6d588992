"""The steps of a simulator that integrates with a fixed period."""

from collections.abc import Callable

from runtime.kernel import SECOND

LONGEST = 60.0  # s, made up for at once; more would be a computer that was asleep, or a program that was halted


class FixedSteps:
    """Steps through all periods that have passed, also those whose ticks came too late and were merged.

    `time` (s since 1970) is that of the last step: motion and times fit to the digit, however late a tick is. If no
    tick comes for `patience` (s), `release` is called before the rest of the steps, since the actuators of a vehicle
    stop if its computer hangs.
    """

    def __init__(self, hertz: float, patience: float):
        self._hertz = hertz
        self._patience = max(1, round(patience * hertz))
        self._most = round(LONGEST * hertz)
        self._began: int | None = None
        self._count = 0

    @property
    def time(self) -> float:
        """Time at which the last step ended."""
        assert self._began is not None
        return (self._began + round(self._count * SECOND / self._hertz)) / SECOND

    def skip_periods(self, now_ns: int, periods: int) -> None:
        """Let the `periods` that end now pass without a step, such as before a vehicle has a place."""
        if self._began is None:
            self._began, self._count = now_ns, 0
        else:
            self._count += periods

    def run(self, now_ns: int, periods: int, step: Callable[[float], None], release: Callable[[], None]) -> str:
        """Call `step(seconds)` for each of the `periods` that end now; returns a text if some are left out."""
        if periods == 1 and self._began is not None:
            self._count += 1
            step(1.0 / self._hertz)
            return ""
        self.skip_periods(now_ns, periods)
        period, released = 1.0 / self._hertz, min(periods, self._patience)
        for _ in range(released):
            step(period)
        if periods == released:
            return ""
        release()
        for _ in range(released, min(periods, self._most)):
            step(period)
        lost = max(0, periods - self._most) * period
        stall = f"the computer stood still for {periods * period:.1f} s"
        return f"{stall}; the last {lost:.1f} s of them are not simulated" if lost else ""
