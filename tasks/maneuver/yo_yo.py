"""Goes to a point while zigzagging in depth."""

import math
from typing import ClassVar

import imc
from autonomy.guidance import UnknownAltitudeError, YoYoMotion
from runtime import param
from tasks.maneuver.maneuver_task import Loops, Maneuver, ManeuverError, PathEnd, PathFlags
from tasks.maneuver.yo_yo_limits import YoYoLimits


class YoYo(Maneuver):
    """Pitches up and down between two depths, or two altitudes, on its way; level at the end.

    Above the bottom it turns at the lowest altitude, and rises until there is enough water below for another dive,
    beyond its upper depth if necessary. At the surface of water that is too shallow it stays level. If it never gets to
    its lower depth or altitude, it reports that at the end.
    """

    loops: ClassVar[int | None] = Loops.PATH | Loops.PITCH
    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState, imc.EstimatedState)

    maximum_pitch_variation: float = param(10.0, "°", "Largest step of the pitch.", minimum=0.1, maximum=90)
    minimum_altitude: float = param(
        5.0, "m", "Lowest altitude of a dive.", name="Minimum Altitude Reference", minimum=0
    )

    def configure(self) -> None:
        self._limits = YoYoLimits.of_profile(self.vehicle.profile, self.minimum_altitude)

    async def execute(self, yoyo: imc.YoYo) -> None:
        motion = YoYoMotion(
            self._limits.settings(yoyo, math.radians(self.maximum_pitch_variation)), self.now_without_stalls
        )
        self.start_path(PathEnd.from_maneuver(yoyo), flags=PathFlags.NO_Z)
        while not self.is_near_end:
            event = await self.next_message()
            if event is self.path:
                self.report_time_left()
            elif self.state is not None:
                try:
                    tilts = motion.update(self.state.depth, self.state.alt, self.now_without_stalls)
                except UnknownAltitudeError as error:
                    raise ManeuverError(str(error)) from None
                if tilts:
                    self.publish(imc.DesiredPitch(value=motion.pitch))
        while motion.level():
            self.publish(imc.DesiredPitch(value=motion.pitch))
        if math.isfinite(motion.short):
            short = max(0.0, motion.short)
            leg = PathEnd.from_maneuver(yoyo)._replace(z=motion.settings.lower_turn)
            self.check_depth(leg, -short if motion.settings.by_altitude else short)
