"""Goes to a point while zigzagging in depth."""

import math
from functools import partial

import imc
from autonomy.limits import YOYO_ALTITUDE_MARGIN, YOYO_MARGIN, OperatingLimits
from runtime import param
from runtime.vehicle import general_number
from tasks.maneuver.maneuver_task import Loops, Maneuver, ManeuverError, PathEnd, PathFlags

TOLERANCE = 0.2  # m
SURFACE = 0.3  # m
LEAST_DIVE = 1.0  # m of water that a dive from the surface needs
USUAL_DIVE = 2.0  # m of water that a dive from below the surface needs, or the amplitude
STALL = 10.0  # s without getting deeper, after which a dive ends
BLIND = 60.0  # s for which the altitude may be unknown, if it is to be followed
UP, LEVEL, DOWN = 1, 0, -1


class YoYo(Maneuver):
    """Pitches up and down between two depths, or two altitudes, on its way; level at the end.

    Above the bottom it turns at the lowest altitude, and rises until there is enough water below for another dive,
    beyond its upper depth if necessary. At the surface of water that is too shallow it stays level. If it never gets to
    its lower depth or altitude, it says so at the end.
    """

    loops = Loops.PATH | Loops.PITCH
    subscribed = (imc.PathControlState, imc.EstimatedState)

    maximum_pitch_variation: float = param(10.0, "°", "Largest step of the pitch.", minimum=0.1, maximum=90)
    minimum_altitude: float = param(
        5.0, "m", "Lowest altitude of a dive.", name="Minimum Altitude Reference", minimum=0
    )

    def configure(self) -> None:
        number = partial(general_number, self.vehicle.profile)
        limits = OperatingLimits.from_options(number, deepest=math.inf, lowest=-math.inf)
        self._deepest = limits.deepest - YOYO_MARGIN
        self._lowest = max(self.minimum_altitude, limits.lowest + YOYO_ALTITUDE_MARGIN)

    async def execute(self, yoyo: imc.YoYo) -> None:
        self._pitch = 0.0
        self._direction = DOWN
        self._dived, self._deeper = -math.inf, self.now
        self._sounded = self.now
        self._short = math.inf
        self.start_path(PathEnd.from_maneuver(yoyo), flags=PathFlags.NO_Z)
        while not self.is_near_end:
            event = await self.next_message()
            if event is self.path:
                self.report_time_left()
            elif self.state is not None:
                self._direction = self._turn(yoyo, self.state)
                self._tilt(self._direction * yoyo.pitch)
        while self._pitch:
            self._tilt(0.0)
        if math.isfinite(self._short):
            short, up = max(0.0, self._short), yoyo.z_units == imc.ZUnits.ALTITUDE
            lower = max(0.0, yoyo.z - yoyo.amplitude) if up else yoyo.z + yoyo.amplitude
            self.check_depth(PathEnd.from_maneuver(yoyo)._replace(z=lower), -short if up else short)

    def _turn(self, yoyo: imc.YoYo, state: imc.EstimatedState) -> int:
        """Where to go from here: UP, DOWN or LEVEL. Raises ManeuverError if the altitude stays unknown."""
        below, above = self._deepest - state.depth, state.depth
        if state.alt >= 0.0:
            self._sounded = self.now
            below = min(below, state.alt - self._lowest)
        if yoyo.z_units == imc.ZUnits.ALTITUDE:
            if state.alt < 0.0:
                if self.age(self._sounded) > BLIND:
                    raise ManeuverError(f"altitude has been unknown for {BLIND:g} s")
                return UP if state.depth > SURFACE else LEVEL
            left = state.alt - max(0.0, yoyo.z - yoyo.amplitude)
            above = min(above, yoyo.z + yoyo.amplitude - state.alt)
        else:
            left = yoyo.z + yoyo.amplitude - state.depth
            above = min(above, state.depth - yoyo.z + yoyo.amplitude)
        below, self._short = min(below, left), min(self._short, left)
        if self._direction == DOWN:
            return UP if below <= TOLERANCE or self._stalls(state.depth) else DOWN
        if state.depth <= SURFACE:
            turns, otherwise = below >= LEAST_DIVE, LEVEL
        else:
            turns, otherwise = above <= TOLERANCE and below >= min(USUAL_DIVE, yoyo.amplitude), UP
        self._dived, self._deeper = -math.inf, self.now
        return DOWN if turns else otherwise

    def _stalls(self, depth: float) -> bool:
        """Whether a dive has come to its end, whatever stops it."""
        if depth > self._dived + TOLERANCE:
            self._dived, self._deeper = depth, self.now
        return self.age(self._deeper) > STALL

    def _tilt(self, target: float) -> None:
        """One step towards a pitch."""
        if self._pitch == target:
            return
        step = math.radians(self.maximum_pitch_variation)
        self._pitch += max(-step, min(step, target - self._pitch))
        self.publish(imc.DesiredPitch(value=self._pitch))
