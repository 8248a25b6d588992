"""Frees a vehicle that is stuck."""

import math
from typing import ClassVar

import imc
from runtime import param
from tasks.maneuver.maneuver_task import Loops, Maneuver, ManeuverError

Direction = imc.Dislodge.Direction
SURFACE = 0.3  # m


class Dislodge(Maneuver):
    """Runs the thruster in bursts until the vehicle rises or surfaces; AUTO changes direction at each attempt.

    The vehicle points up while it goes ahead, and stays level astern; with neutral fins it might dive.
    """

    loops: ClassVar[int | None] = Loops.SPEED | Loops.PITCH
    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.EstimatedState,)

    attempts: int = param(5, "1", "Number of attempts.", minimum=1, maximum=1000)
    bursts: int = param(5, "1", "Bursts per attempt.", minimum=1, maximum=1000)
    burst_time: float = param(10.0, "s", "Duration of a burst.", minimum=0.1)
    interval_time: float = param(5.0, "s", "Pause after a burst.", minimum=0)
    minimum_distance: float = param(3.0, "m", "A vehicle that has risen this far is free.", minimum=0.1)
    pitch: float = param(15.0, "°", "Pitch while going ahead.", minimum=0, maximum=45)

    async def execute(self, dislodge: imc.Dislodge) -> None:
        began = (await self.wait_for_state()).depth
        end = self.now + dislodge.timeout if dislodge.timeout else math.inf
        backward = dislodge.direction == Direction.BACKWARD
        for attempt in range(self.attempts):
            if dislodge.direction == Direction.AUTO:
                backward = attempt % 2 == 1
            self.publish(imc.DesiredPitch(value=0.0 if backward else math.radians(self.pitch)))
            for _ in range(self.bursts):
                for rpm, seconds in (
                    (-dislodge.rpm if backward else dislodge.rpm, self.burst_time),
                    (0.0, self.interval_time),
                ):
                    self.publish(imc.DesiredSpeed(value=rpm, speed_units=imc.SpeedUnits.RPM))
                    if await self._rises(began, min(end, self.now + seconds)):
                        self.publish(imc.DesiredSpeed(value=0.0, speed_units=imc.SpeedUnits.RPM))
                        return
                    if self.now >= end:
                        raise ManeuverError("timeout")
        raise ManeuverError("vehicle is still stuck")

    async def _rises(self, began: float, until: float) -> bool:
        """Wait until a time (s); True as soon as the vehicle is free."""
        reported = self.now
        self.report_progress()
        while self.now < until:
            await self.next_message()
            depth = self.state.depth if self.state is not None else began
            if depth <= max(SURFACE, began - self.minimum_distance):
                return True
            if self.now - reported >= 1.0:
                reported = self.now
                self.report_progress()
        return False
