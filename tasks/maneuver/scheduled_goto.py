"""Goes to a point by a given time."""

import math
from typing import ClassVar

import imc
from autonomy.plans import LATENESS
from runtime import ParameterError, param
from tasks.maneuver.depth_spiral import CLIMB, vertical_error
from tasks.maneuver.maneuver_task import Completed, Maneuver, ManeuverError, PathEnd, PathFlags

Late = imc.ScheduledGoto.Delayed
WAITING_RADIUS = 15.0  # m
TOLERANCE = 15.0  # s before or after its time, from which on the maneuver reports it
SLOWEST = 0.1  # m/s
REVISION = 2.0  # s between two updates of the speed


class ScheduledGoto(Maneuver):
    """Chooses its speed to arrive at a given time; if late, it continues, is done or fails, by `delayed`.

    With more time than the slowest speed takes, it circles where it is before it leaves. As all paths, it ends some
    seconds before its point, which the vehicle passes within 3 s of its time if its speeds over ground allow; else it
    reports how late or early it is. It travels at one depth and goes to the other shortly before the end.
    """

    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState, imc.EstimatedState)

    minimum_speed: float = param(0.7, "m/s", "Slowest speed.", minimum=0.1)
    maximum_speed: float = param(1.6, "m/s", "Fastest speed.", minimum=0.1)

    def configure(self) -> None:
        if self.minimum_speed > self.maximum_speed:
            raise ParameterError("Minimum Speed", "is above the Maximum Speed")

    async def execute(self, goto: imc.ScheduledGoto) -> None:
        await self.wait_for_state()
        await self._wait_for_departure(goto)
        end = PathEnd(goto.lat, goto.lon, goto.z, goto.z_units, 0.0, imc.SpeedUnits.METERS_PS)
        speed, chosen = self._speed(goto, end), self.now
        self.start_path(end._replace(z=goto.travel_z, z_units=goto.travel_z_units, speed=speed))
        traveling = True
        while not self.is_near_end:
            event = await self.next_message()
            if event is self.path:
                self.report_time_left()
            if self.state is None or self.path is None:
                continue
            if self.now - chosen >= REVISION:
                speed, chosen = self._speed(goto, end), self.now
                self.publish(imc.DesiredSpeed(value=speed, speed_units=end.speed_units))
            if traveling and self.range_to(end) <= abs(vertical_error(self.state, end)) / CLIMB:
                traveling = False
                self.publish(imc.DesiredZ(value=goto.z, z_units=goto.z_units))
        if goto.arrival_time > 0.0:
            self._report_arrival(self.now + self._seconds_left(end) - goto.arrival_time)

    def _seconds_left(self, end: PathEnd) -> float:
        """The time to the point (s) at the speed over ground; 0 if the vehicle stands."""
        speed = 0.0 if self.state is None else math.hypot(self.state.vx, self.state.vy)
        return self.range_to(end) / speed if speed > SLOWEST else 0.0

    def _report_arrival(self, late: float) -> None:
        if abs(late) > TOLERANCE:
            self.report_missed(f"arrived {abs(late):.0f} s {'after' if late > 0.0 else 'before'} its time")

    async def _wait_for_departure(self, goto: imc.ScheduledGoto) -> None:
        """Circle here, at the depth of the journey, while even the slowest speed would arrive early."""
        units = imc.SpeedUnits.METERS_PS
        here = PathEnd(goto.lat, goto.lon, goto.travel_z, goto.travel_z_units, self.minimum_speed, units)
        if not self._is_early(goto, here, LATENESS):  # it is not worth circling for less
            return
        self.start_path(here, radius=WAITING_RADIUS, flags=PathFlags.LOITER_CURR)
        while self._is_early(goto, here, 0.0):
            if await self.next_message() is self.path:
                self.report_progress(goto.arrival_time - self.now)

    def _is_early(self, goto: imc.ScheduledGoto, end: PathEnd, margin: float) -> bool:
        return goto.arrival_time - self.now - self.range_to(end) / self.minimum_speed > margin

    def _speed(self, goto: imc.ScheduledGoto, end: PathEnd) -> float:
        left = goto.arrival_time - self.now
        if self.range_to(end) / self.maximum_speed - left > LATENESS:
            if goto.delayed == Late.SKIP:
                self.report_missed(f"skipped {self.range_to(end):.0f} m before the point: it is too late")
                raise Completed
            if goto.delayed == Late.FAIL:
                raise ManeuverError(f"cannot arrive in time: {self.range_to(end):.0f} m are left")
        needed = self.range_to(end) / left if left > 0.0 else math.inf
        return max(self.minimum_speed, min(self.maximum_speed, needed))
