"""Goes to a point while zigzagging in depth."""

import math

import imc
from runtime import ParameterError, param
from tasks.maneuver.protocol import Leg, Loops, Maneuver, PathFlags

TOLERANCE = 0.2  # m
SAFETY = 3.0  # m above the vehicle's maximum depth


class YoYo(Maneuver):
    """Pitches up and down between two depths, or two altitudes, on its way; level at the end."""

    loops = Loops.PATH | Loops.PITCH
    hears = (imc.PathControlState, imc.EstimatedState)

    maximum_pitch_variation: float = param(10.0, "°", "Largest step of the pitch.", minimum=0.1, maximum=90)
    minimum_altitude: float = param(
        5.0, "m", "Lowest altitude of a dive.", name="Minimum Altitude Reference", minimum=0
    )

    def configure(self) -> None:
        text = self.vehicle.profile.value("General", "Absolute Maximum Depth")
        try:
            self._deepest = float(text) - SAFETY if text else math.inf
        except ValueError:
            raise ParameterError("Absolute Maximum Depth", f"[General] has {text!r}, which is not a number") from None

    async def execute(self, yoyo: imc.YoYo) -> None:
        self._pitch = 0.0
        down = True
        self.steer(Leg.of(yoyo), flags=PathFlags.NO_Z)
        while not self.near:
            event = await self.event()
            if event is self.path:
                self.tell()
            elif self.state is not None:
                down = self._turns(yoyo, self.state, down)
                self._tilt(-yoyo.pitch if down else yoyo.pitch)
        while self._pitch:
            self._tilt(0.0)

    def _turns(self, yoyo: imc.YoYo, state: imc.EstimatedState, down: bool) -> bool:
        """Whether to pitch down now."""
        floor = 0.0 <= state.alt <= self.minimum_altitude + TOLERANCE
        if yoyo.z_units == imc.ZUnits.ALTITUDE:
            low = state.alt - max(yoyo.z - yoyo.amplitude, self.minimum_altitude)
            high = yoyo.z + yoyo.amplitude - state.alt
            if state.alt < 0.0:
                return down
        else:
            low = min(yoyo.z + yoyo.amplitude, self._deepest) - state.depth
            high = state.depth - max(0.0, yoyo.z - yoyo.amplitude)
        if down:
            return low > TOLERANCE and not floor
        return high <= TOLERANCE

    def _tilt(self, target: float) -> None:
        """One step towards a pitch."""
        if self._pitch == target:
            return
        step = math.radians(self.maximum_pitch_variation)
        self._pitch += max(-step, min(step, target - self._pitch))
        self.publish(imc.DesiredPitch(value=self._pitch))
