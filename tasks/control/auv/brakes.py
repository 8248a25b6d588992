"""Brakes for obstacles."""

import math
from collections import deque
from collections.abc import Sequence

import imc
from autonomy.control import EchoClass, EnabledLoops, classify_echo
from runtime import State, Task, consume, param, periodic

Op = imc.Brake.Op
STALE = 1.0  # s; a state that is farther from an echo than this does not show where the sonar pointed
MOST_ECHOES = 32  # between two states


class Brakes(Task):
    """Publishes Brake if an echo sounder sees an obstacle close ahead while the vehicle follows a path.

    The surface is not an obstacle, nor is a bottom that the vehicle can climb. Near the surface, surface and obstacles
    cannot be distinguished, so the vehicle does not brake there. An echo is an obstacle only if it is one for the state
    before it and for the state after it: a vehicle that pitches has turned the sonar in between. The brake is released
    when nothing is near or path control is disabled; braking for too long is an error.
    """

    echo_sounder: str = param(
        "Echo Sounder",
        "",
        "Entity of the forward-looking echo sounder.",
        name="Entity Label - Forward Distance",
        editable=False,
    )
    minimum_range: float = param(8.0, "m", "Brake for obstacles nearer than this.", minimum=0.1)
    range_hysteresis: float = param(1.5, "m", "Release the brake this far beyond the minimum range.", minimum=0)
    samples: int = param(3, "1", "Echoes in a row needed to brake or release.", minimum=1, maximum=100)
    steepest_slope: float = param(5.0, "°", "A bottom up to this slope is not an obstacle.", minimum=0, maximum=80)
    beam_width: float = param(10.0, "°", "Full vertical opening of the beam.", minimum=0, maximum=90)
    longest_brake: float = param(30.0, "s", "Braking for longer than this is an error.", minimum=1)

    def start(self) -> None:
        self._loops = EnabledLoops(imc.CLoopsMask.PATH)
        self._state: imc.EstimatedState | None = None
        self._echoes = deque[imc.Distance](maxlen=MOST_ECHOES)
        self._near = self._clear = 0
        self._braked: float | None = None
        self.set_entity_state(State.NORMAL, "idle")

    def stop(self) -> None:
        self._release()

    @consume
    def on_control_loops(self, loops: imc.ControlLoops) -> None:
        if self._loops.receive(loops):
            self._near = self._clear = 0
            self._echoes.clear()
            self._release()
            self.set_entity_state(State.NORMAL, "watching" if self._loops.mask else "idle")

    @consume
    def on_estimated_state(self, state: imc.EstimatedState) -> None:
        before, self._state = self._state, state
        while self._echoes:
            echo = self._echoes.popleft()
            around = [s for s in (before, state) if s is not None and abs(s.timestamp - echo.timestamp) <= STALE]
            self._judge(echo, around)

    @consume
    def keep_echo(self, distance: imc.Distance) -> None:
        """Keep an echo until the next state gives the direction of the sonar."""
        if not self._loops.mask:
            return
        if self.vehicle.entities.label(self.system, distance.src_ent) != self.echo_sounder:
            return
        if distance.validity != imc.Distance.Validity.VALID or not 0.0 <= distance.value < math.inf:
            return
        self._echoes.append(distance)

    def _judge(self, distance: imc.Distance, states: Sequence[imc.EstimatedState]) -> None:
        """Judge an echo: enough near obstacles in a row brake, enough clear echoes in a row release.

        A far echo is clear wherever the sonar pointed; a near one is an obstacle only with states on both sides.
        """
        slope, half = math.radians(self.steepest_slope), 0.5 * math.radians(self.beam_width)
        found = {classify_echo(distance.value, s.depth, s.alt, s.theta, half, slope, _arm(distance)) for s in states}
        far = distance.value > self.minimum_range + self.range_hysteresis
        if len(states) < 2:
            found.discard(EchoClass.OBSTACLE)
        self._near = self._near + 1 if found == {EchoClass.OBSTACLE} and distance.value < self.minimum_range else 0
        self._clear = self._clear + 1 if far or EchoClass.BOTTOM in found else 0
        if self._braked is None and self._near >= self.samples:
            self._braked = self.now
            self.log.warning(f"obstacle {distance.value:.1f} m ahead: braking")
            self.publish(imc.Brake(op=Op.START))
            self.set_entity_state(State.NORMAL, "braking")
        elif self._clear >= self.samples:
            self._release()

    @periodic(1.0)
    def check_brake_duration(self) -> None:
        if self._braked is not None and self.age(self._braked) > self.longest_brake:
            self.set_entity_state(State.ERROR, "an obstacle is in the way")

    def _release(self) -> None:
        if self._braked is not None:
            self._braked = None
            self.publish(imc.Brake(op=Op.STOP))
            self.log.info("brake released")
            self.set_entity_state(State.NORMAL, "watching")


def _arm(distance: imc.Distance) -> float:
    """Distance (m) of the sonar ahead of the center of the vehicle, as it reports itself; else 0."""
    place = distance.location[0] if distance.location else None
    return place.x if isinstance(place, imc.DeviceState) and math.isfinite(place.x) else 0.0
