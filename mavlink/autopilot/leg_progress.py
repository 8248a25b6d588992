"""Progress of a vehicle on its leg, and detection of a stuck one."""

import math

import imc
from autonomy.guidance import AlongTrack, DivergenceMonitor
from mavlink.autopilot.leg import ArrivalTolerance, Leg, ReportedPosition

REPORTS = 1.0  # s
STUCK = AlongTrack(20.0, 0.05, 0.0)


class LegProgress:
    """Judges a leg with each new state; `error` is why it has to be given up, "" if it need not be."""

    def __init__(self) -> None:
        self.error: str = ""
        self._divergence = DivergenceMonitor(STUCK, None)
        self._reported = -math.inf

    def restart(self, now: float) -> None:
        """Begin a new leg."""
        self.error, self._reported = "", -math.inf
        self._divergence.restart(now)

    def update(
        self, leg: Leg, at: ReportedPosition, tolerance: ArrivalTolerance, now: float, *, done: bool, waits: bool
    ) -> tuple[bool, imc.PathControlState | None]:
        """Whether the vehicle has just arrived, and the report that is due.

        done: the autopilot reports its arrival. waits: it has no order to go yet, or circles on its way down.
        """
        arrived = leg.update_arrival(at, tolerance)
        if done:
            arrived = leg.mark_arrived() or arrived
        where = leg.progress(at)
        if waits or leg.near or leg.loitering or leg.arrived:
            self._divergence.restart(now)
        else:
            self.error = self._divergence.error_text(now, where, where.course, 0.0)
        if self.error or not (arrived or now - self._reported >= REPORTS):
            return arrived, None
        self._reported = now
        return arrived, leg.path_control_state(at)
