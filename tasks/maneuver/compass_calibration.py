"""Circles to calibrate the compass."""

import math
from typing import ClassVar, NamedTuple

import imc
from autonomy.guidance import UnknownAltitudeError, YoYoMotion
from autonomy.navigation import HardIronError, HardIronFit
from runtime import param
from support.rotations import wrap
from tasks.maneuver.maneuver_task import VERTICAL, Loops, Maneuver, ManeuverError, PathEnd, PathFlags, PathState
from tasks.maneuver.yo_yo_limits import YoYoLimits

SMALLEST_RADIUS = 5.0  # m
LEAST_AMPLITUDE = 0.5  # m; with less the vehicle stays level
OLD = 1.0  # s after which the attitude does not belong to a sample of the field any more
PROGRESS, PATIENCE = 0.3, 30.0  # m that the depth must change in a time (s) until it is between the turns


class _Turns(NamedTuple):
    """The turn of the vehicle since it began: heading at present, and the sum of its changes (rad)."""

    heading: float
    turned: float = 0.0

    def add(self, heading: float) -> "_Turns":
        return _Turns(heading, self.turned + wrap(heading - self.heading))


class CompassCalibration(Maneuver):
    """Circles, up and down around its depth or altitude, and finds the vehicle's own magnetic field.

    On the circle it turns `Number Of Turns` times, or circles for the duration of the maneuver, whichever is over
    first; samples count once it is between the two depths. The result is a MagneticField (G) to the entity of the
    compass and a line in the log book. Without usable samples nothing is sent, and the maneuver ends with an error.
    With an amplitude of at most 0.5 m it stays at its depth, so that a boat can do it, too. A vehicle that never gets
    between its two depths, in shallow water for example, ends with an error.
    """

    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (
        imc.PathControlState,
        imc.EstimatedState,
        imc.EulerAngles,
        imc.MagneticField,
    )

    maximum_pitch_variation: float = param(10.0, "°", "Largest step of the pitch.", minimum=0.1, maximum=90)
    entity_label_compass: str = param(
        "AHRS", "", "Entity whose EulerAngles and MagneticField count.", name="Entity Label - Compass"
    )
    cross_track_tolerance: float = param(
        1.0, "m", "Not used, kept for DUNE's profiles: path control reports when the circle is reached.", minimum=0
    )
    number_of_turns: float = param(1.0, "1", "Turns that end the maneuver.", name="Number Of Turns", minimum=0)
    calibrate_compass: bool = param(True, "", "Publish the result; otherwise it only circles.", scope="maneuver")

    def configure(self) -> None:
        self._limits = YoYoLimits.of_profile(self.vehicle.profile)

    async def execute(self, order: imc.CompassCalibration) -> None:
        if order.z_units not in VERTICAL:
            raise ManeuverError("z is neither a depth nor an altitude")
        if order.radius < SMALLEST_RADIUS:
            self.log.warning(f"radius {order.radius:g} m is raised to {SMALLEST_RADIUS:g} m")
        self._fit, self._attitude = HardIronFit(), None
        self._leg, self._radius = PathEnd.from_maneuver(order), max(SMALLEST_RADIUS, order.radius)
        self._flags = PathFlags.CCLOCKW if order.direction == order.Direction.CCLOCKW else 0
        self._motion: YoYoMotion | None = None
        self._turns: _Turns | None = None
        self._away, self._nearer = math.inf, self.now
        self.start_path(self._leg, radius=self._radius, flags=self._flags)
        end = math.inf
        while not self._is_over(end):
            event = await self.next_message()
            if isinstance(event, imc.EulerAngles | imc.MagneticField):
                self._sample(event)
            elif event is self.path and self.path is not None:
                if not self.path.flags & PathState.LOITERING and self._turns is None:
                    self.report_time_left(after=min(order.duration or math.inf, self._turns_time()))
                    continue
                self._begin_turns(order)
                if self._turns is not None and order.duration:
                    end = min(end, self.now + order.duration)
                self.report_progress(min(end - self.now, self._turns_time()))
            elif isinstance(event, imc.EstimatedState):
                self._turn(event)
        self._publish_result()

    def _is_over(self, end: float) -> bool:
        return self.now >= end or self._angle_left() < 0.0

    def _angle_left(self) -> float:
        """Angle (rad) of the turns that are left."""
        return self.number_of_turns * math.tau - (0.0 if self._turns is None else abs(self._turns.turned))

    def _turns_time(self) -> float:
        """Time (s) that they take; infinite if the speed is unknown."""
        return self._leg.duration(self._angle_left() * self._radius)

    def _begin_turns(self, order: imc.CompassCalibration) -> None:
        """Begin to go up and down when the circle is reached, and to count when that is between the two depths."""
        state = self.state
        if self._turns is not None or state is None:
            return
        if order.amplitude > LEAST_AMPLITUDE and order.pitch:
            if self._motion is None:
                settings = self._limits.settings(order, math.radians(self.maximum_pitch_variation))
                self._motion = YoYoMotion(settings, self.now_without_stalls)
                self.set_control_loops(Loops.PATH | Loops.PITCH)
                self.start_path(self._leg, radius=self._radius, flags=self._flags | PathFlags.NO_Z)
            if not self._motion.is_between_turns(state.depth, state.alt):
                self._require_progress(order, state)
                return
        self._turns = _Turns(state.psi)

    def _require_progress(self, order: imc.CompassCalibration, state: imc.EstimatedState) -> None:
        height = state.alt if order.z_units == imc.ZUnits.ALTITUDE else state.depth
        if (away := abs(height - order.z)) < self._away - PROGRESS:
            self._away, self._nearer = away, self.now
        elif self.age(self._nearer) > PATIENCE:
            name = VERTICAL[order.z_units]
            raise ManeuverError(f"{name} {height:.1f} m instead of {order.z:g} m, give or take {order.amplitude:g} m")

    def _turn(self, state: imc.EstimatedState) -> None:
        if self._turns is not None and math.isfinite(state.psi):
            self._turns = self._turns.add(state.psi)
        if self._motion is None:
            return
        try:
            if self._motion.update(state.depth, state.alt, self.now_without_stalls):
                self.publish(imc.DesiredPitch(value=self._motion.pitch))
        except UnknownAltitudeError as error:
            raise ManeuverError(str(error)) from None

    def _sample(self, event: imc.EulerAngles | imc.MagneticField) -> None:
        """Use a sample of the field with the attitude at its time, while turning."""
        if self.vehicle.entities.label(event.src, event.src_ent) != self.entity_label_compass:
            return
        if isinstance(event, imc.EulerAngles):
            self._attitude = event
        elif self._turns is not None and self._attitude is not None:
            at = self._attitude
            if abs(event.timestamp - at.timestamp) <= OLD:
                self._fit.add((event.x, event.y, event.z), at.phi, at.theta, self._turns.heading)

    def _publish_result(self) -> None:
        if not self.calibrate_compass:
            return
        try:
            found = self._fit.solve()
        except HardIronError as error:
            raise ManeuverError(f"{self.entity_label_compass} is not calibrated: {error}") from None
        turns = 0.0 if self._turns is None else abs(self._turns.turned) / math.tau
        self.log.info(
            f"own field of {self.entity_label_compass} after {turns:.1f} turns: {found.x:.4f} G ahead, {found.y:.4f} G "
            f"to starboard; the Earth's is {found.earth:.4f} G, misfit {found.misfit:.4f} G"
        )
        compass = self.vehicle.entities.find(self.entity_label_compass)
        if compass is not None:
            self.publish(imc.MagneticField(x=found.x, y=found.y, dst=self.system, dst_ent=compass.id))
