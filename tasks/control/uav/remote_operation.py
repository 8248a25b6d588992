"""Lets an operator steer a multirotor."""

import math
from typing import ClassVar

import imc
from autonomy.control import AXES, RemoteActionsReader
from runtime import consume, param
from support.number_parsing import clamp_magnitude
from support.planar_geometry import along_and_across
from support.rotations import wrap
from tasks.control.remote_operation_task import Loops, RemoteActionsTask

REACTION = 0.5  # s of speed until a released stick brakes
LARGEST_LEAD = 0.5 * math.pi  # rad, of the reference before the heading: beyond half a turn it would turn back


class RemoteOperation(RemoteActionsTask):
    """Turns RemoteActions into velocity and heading, while the loop TELEOPERATION is enabled.

    Pitch is the speed ahead (negative, nose down) and astern, Roll that to starboard, Thrust the climb, Heading the
    turn. With Pitch and Roll released the vehicle stays over its place, with Thrust released at its height; so it does
    if the operator falls silent. On the ground only Thrust lifts it: no height is kept there. The autopilot keeps the
    limits of altitude.
    """

    axes: ClassVar[tuple[str, ...]] = AXES
    loops: ClassVar[int] = Loops.VELOCITY

    maximum_speed: float = param(5.0, "m/s", "Speed over ground at full deflection.", minimum=0.1)
    maximum_climb_rate: float = param(2.0, "m/s", "Climb at full deflection.", minimum=0.1)
    maximum_descent_rate: float = param(1.0, "m/s", "Descent at full deflection.", minimum=0.1)
    landing_rate: float = param(0.5, "m/s", "Largest descent near the ground.", minimum=0.05)
    landing_altitude: float = param(5.0, "m", "The landing rate applies below this altitude.", minimum=0)
    maximum_acceleration: float = param(2.0, "m/s²", "Braking when the stick is released.", minimum=0.1)
    position_gain: float = param(0.8, "1/s", "Speed toward the place that is kept, per distance.", minimum=0)

    def start(self) -> None:
        self._is_disarmed = False
        super().start()

    @consume
    def on_arming_state(self, arming: imc.ArmingState) -> None:
        """Forget what is kept while the rotors rest: the estimate of the height drifts."""
        self._is_disarmed = arming.state == imc.ArmingState.State.DISARMED
        if self._is_disarmed:
            self._forget_references()

    @consume
    def on_estimated_state(self, state: imc.EstimatedState) -> None:
        before = self._state
        if before is not None and (before.lat, before.lon, before.height) != (state.lat, state.lon, state.height):
            self._place = self._height = None  # offsets are from another reference now
        super().on_estimated_state(state)

    def publish_references(self, operator: RemoteActionsReader, *, blind: bool) -> None:
        state = self._state
        if state is None or self.age(self._located) > self.state_timeout:
            return  # the autopilot descends by itself
        ahead, starboard = self._over_ground(operator, state)
        axes = imc.DesiredVelocity.Flags
        self.publish(
            imc.DesiredVelocity(
                u=ahead, v=starboard, w=self._downward(operator, state), flags=axes.SURGE | axes.SWAY | axes.HEAVE
            )
        )
        self.publish(imc.DesiredHeading(value=self._heading_reference(operator, state)))

    def _over_ground(self, operator: RemoteActionsReader, state: imc.EstimatedState) -> tuple[float, float]:
        ahead, starboard = -operator.axis("Pitch"), operator.axis("Roll")
        if ahead or starboard:
            self._place = None
            scale = self.maximum_speed / max(1.0, math.hypot(ahead, starboard))
            return ahead * scale, starboard * scale
        if self._place is None:
            seconds = self._braking_time(math.hypot(state.vx, state.vy))
            self._place = state.x + state.vx * seconds, state.y + state.vy * seconds
        north, east = (self.position_gain * (to - at) for to, at in zip(self._place, (state.x, state.y), strict=True))
        scale = min(1.0, self.maximum_speed / max(1e-9, math.hypot(north, east)))
        return along_and_across(scale * north, scale * east, state.psi)

    def _downward(self, operator: RemoteActionsReader, state: imc.EstimatedState) -> float:
        climb = operator.axis("Thrust")
        descent = self.maximum_descent_rate
        if state.alt < self.landing_altitude:
            descent = min(descent, self.landing_rate)
        if climb:
            self._height = None
            return -climb * (self.maximum_climb_rate if climb > 0.0 else descent)
        if self._is_disarmed:
            return 0.0
        if self._height is None:
            self._height = state.z + state.vz * self._braking_time(abs(state.vz))
        return max(-self.maximum_climb_rate, min(descent, self.position_gain * (self._height - state.z)))

    def _heading_reference(self, operator: RemoteActionsReader, state: imc.EstimatedState) -> float:
        turn = operator.axis("Heading") * math.radians(self.maximum_heading_rate)
        if turn:
            before = state.psi if self._heading is None else self._heading
            lead = wrap(before + turn / self.execution_frequency - state.psi)
            self._heading = state.psi + clamp_magnitude(lead, LARGEST_LEAD)
            self._turns = True
        elif self._turns or self._heading is None:
            self._heading, self._turns = state.psi, False
        return wrap(self._heading)

    def _braking_time(self, speed: float) -> float:
        """Time (s) at the present speed (m/s) to the place where the vehicle comes to rest."""
        return REACTION + 0.5 * speed / self.maximum_acceleration

    def _release(self) -> None:
        super()._release()
        self._forget_references()

    def _forget_references(self) -> None:
        self._place: tuple[float, float] | None = None
        self._height: float | None = None
        self._heading: float | None = None
        self._turns = False
