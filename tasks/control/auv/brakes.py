"""Brakes before obstacles."""

import math

import imc
from runtime import State, Task, consume, param, periodic
from tasks.control.auv.echo import Echo, judge
from tasks.control.loops import EnabledLoops

Op = imc.Brake.Op
STALE = 1.0  # s; an older state does not say where the sonar looks


class Brakes(Task):
    """Publishes Brake while a path is followed and an echo sounder sees an obstacle near ahead.

    The surface is none, nor a bottom that is no steeper than the vehicle can climb; at the surface the two cannot be
    told apart, so that nothing brakes there. The brake is released when nothing is near any more, or when no path is
    followed; one that lasts too long is an error.
    """

    echo_sounder: str = param(
        "Echo Sounder", "", "Entity that looks ahead.", name="Entity Label - Forward Distance", editable=False
    )
    minimum_range: float = param(8.0, "m", "A nearer obstacle brakes.", minimum=0.1)
    range_hysteresis: float = param(1.5, "m", "So much further away it does no more.", minimum=0)
    samples: int = param(3, "1", "Echoes in a row that decide.", minimum=1, maximum=100)
    steepest_slope: float = param(5.0, "°", "Bottom that is none.", minimum=0, maximum=80)
    beam_width: float = param(10.0, "°", "Opening of the beam, up and down.", minimum=0, maximum=90)
    longest_brake: float = param(30.0, "s", "How long it brakes before it is an error.", minimum=1)

    def start(self) -> None:
        self._loops = EnabledLoops(imc.CLoopsMask.PATH)
        self._state: imc.EstimatedState | None = None
        self._near = self._clear = 0
        self._braked: float | None = None
        self.set_entity_state(State.NORMAL, "idle")

    def stop(self) -> None:
        self._release()

    @consume
    def enable(self, loops: imc.ControlLoops) -> None:
        if self._loops.hear(loops):
            self._near = self._clear = 0
            self._release()
            self.set_entity_state(State.NORMAL, "watching" if self._loops.mask else "idle")

    @consume
    def locate(self, state: imc.EstimatedState) -> None:
        self._state = state

    @consume
    def look(self, distance: imc.Distance) -> None:
        """Take an echo: several obstacles in a row brake, several that are far release."""
        state = self._state
        if not self._loops.mask or state is None or self.now - state.timestamp > STALE:
            return
        if self.vehicle.entities.label(self.system, distance.src_ent) != self.echo_sounder:
            return
        if distance.validity != imc.Distance.Validity.VALID or not 0.0 <= distance.value < math.inf:
            return
        slope, half = math.radians(self.steepest_slope), 0.5 * math.radians(self.beam_width)
        echo = judge(distance.value, state.depth, state.alt, state.theta, half, slope)
        far = distance.value > self.minimum_range + self.range_hysteresis
        self._near = self._near + 1 if echo is Echo.OBSTACLE and distance.value < self.minimum_range else 0
        self._clear = self._clear + 1 if far or echo is Echo.BOTTOM else 0
        if self._braked is None and self._near >= self.samples:
            self._braked = self.now
            self.log.warning(f"obstacle {distance.value:.1f} m ahead: braking")
            self.publish(imc.Brake(op=Op.START))
            self.set_entity_state(State.NORMAL, "braking")
        elif self._clear >= self.samples:
            self._release()

    @periodic(1.0)
    def supervise(self) -> None:
        if self._braked is not None and self.now - self._braked > self.longest_brake:
            self.set_entity_state(State.ERROR, "an obstacle is in the way")

    def _release(self) -> None:
        if self._braked is not None:
            self._braked = None
            self.publish(imc.Brake(op=Op.STOP))
            self.log.info("the way is free again")
            self.set_entity_state(State.NORMAL, "watching")
