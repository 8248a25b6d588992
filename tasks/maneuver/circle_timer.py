"""Time and depth on a circle."""

import math

import imc
from tasks.maneuver.maneuver_task import SHORT, VERTICAL, Completed, Maneuver, ManeuverError, PathEnd, PathState

ON_CIRCLE = 5.0  # m, or a quarter of the radius; no vehicle keeps a circle more exactly in a current


class CircleTimer:
    """Waits while a maneuver circles for `seconds`, counted from the arrival on the circle; 0 is forever.

    ManeuverDone ends it if the maneuver subscribes to that, as StationKeeping does and Loiter does not.
    """

    def __init__(self, maneuver: Maneuver, seconds: float):
        self._maneuver = maneuver
        self._seconds = float(seconds) or math.inf
        self._end = self._nearest = self._off = math.inf

    async def process_next_message(self) -> bool:
        """Wait for the next message and report the time left; True if the time is over."""
        maneuver = self._maneuver
        event = await maneuver.next_message()
        if isinstance(event, imc.ManeuverDone):
            raise Completed
        path = maneuver.path
        if path is not None and event is path:
            if path.flags & PathState.LOITERING:
                self._nearest = min(self._nearest, path.z, key=abs)
                self._off = min(self._off, path.y, key=abs)
                self._end = min(self._end, maneuver.now + self._seconds)
                maneuver.report_progress(self._end - maneuver.now)
            elif self._end == math.inf:
                maneuver.report_time_left(after=self._seconds)
            else:
                maneuver.report_progress(self._end - maneuver.now)
        return maneuver.now >= self._end

    def report_missed_circle(self, leg: PathEnd, radius: float) -> None:
        """Report if the circle was never reached, or the depth or altitude of `leg`.

        As in DUNE the time begins inside the circle, too; it may be over before the vehicle gets to a large one. Raises
        ManeuverError if most is missing: more than half of the radius or of the depth.
        """
        if max(ON_CIRCLE, 0.25 * radius) < abs(self._off) < math.inf:
            text = f"radius {radius + self._off:.0f} m instead of {radius:g} m"
            if abs(self._off) > 0.5 * radius:
                raise ManeuverError(text)
            self._maneuver.report_missed(text)
        if math.isfinite(self._nearest):
            if leg.z_units == imc.ZUnits.DEPTH and self._nearest > max(SHORT, 0.5 * leg.z):
                name = VERTICAL[leg.z_units]
                raise ManeuverError(f"{name} {leg.z - self._nearest:.1f} m instead of {leg.z:g} m")
            self._maneuver.check_depth(leg, self._nearest)
