"""Estimated poses of a vehicle at the times of its pictures."""

import math
from collections import deque
from typing import NamedTuple

import imc
from support.pose import Pose
from support.rotations import Vector, integrate_body_rates, wrap
from tasks.simulated_world import FARTHEST, WorldFrame, has_valid_pose

DURATION = 5.0  # s of states
GAP = 1.0  # s between states, beyond which the motion in between is not known


class PoseEstimate(NamedTuple):
    """m north and east of the world's origin, `down` below the surface, `bottom` that of the seabed; angles in rad.

    `bottom` is NaN if the altitude is not known.
    """

    north: float
    east: float
    down: float
    bottom: float
    angles: Vector

    @property
    def pose(self) -> Pose:
        return Pose(self.north, self.east, self.down, *self.angles)


class PoseHistory:
    """Remembers EstimatedState for `duration` seconds, in a world with an origin (rad)."""

    def __init__(self, origin: tuple[float, float] | None, duration: float = DURATION):
        self.duration = duration
        self._chart = WorldFrame(origin)
        self._states: deque[tuple[imc.EstimatedState, PoseEstimate]] = deque()

    def add(self, state: imc.EstimatedState) -> str:
        """Take the next state; returns what is wrong with it, if anything is. After a jump back, it is the first."""
        if not has_valid_pose(state):
            return "no position or attitude"
        fault = ""
        if self._states and state.timestamp < self._states[-1][0].timestamp:
            self._states.clear()
            fault = "time goes backwards"
        north, east = self._chart.position(state)
        bottom = state.z + state.alt if 0.0 < state.alt < math.inf else math.nan
        belief = PoseEstimate(north, east, state.z, bottom, (state.phi, state.theta, state.psi))
        self._states.append((state, belief))
        # One older state stays, so that a time just before the first state after a long silence lies between two.
        while len(self._states) > 2 and state.timestamp - self._states[1][0].timestamp > self.duration:
            self._states.popleft()
        return fault

    @property
    def latest_state(self) -> imc.EstimatedState | None:
        return self._states[-1][0] if self._states else None

    def pose_at(self, time: float, oldest: float) -> Pose | None:
        """The estimated pose at a time, like `estimate_at`; None where that gives the reason why it is not known."""
        belief = self.estimate_at(time, oldest)
        return None if isinstance(belief, str) else belief.pose

    def estimate_at(self, time: float, oldest: float) -> PoseEstimate | str:
        """The belief of a time (s since 1970), or why there is none; the last state is carried on for `oldest` s.

        In a longer gap between states, it is carried on from the one before, or back from the one after.
        """
        if not self._states:
            return "no EstimatedState"
        last, belief = self._states[-1]
        if time >= last.timestamp:
            return _carried(last, belief, time) if time - last.timestamp <= oldest else "no recent EstimatedState"
        later, after, longest = belief, last, max(oldest, GAP)
        for state, belief in reversed(self._states):
            if state.timestamp <= time:
                gap, since = after.timestamp - state.timestamp, time - state.timestamp
                if gap <= longest:
                    return _between(belief, later, since / gap)
                if min(since, gap - since) > longest:
                    return "no EstimatedState near"
                return _carried(state, belief, time) if since < gap - since else _carried(after, later, time)
            later, after = belief, state
        return "older than the states"


def _carried(state: imc.EstimatedState, belief: PoseEstimate, time: float) -> PoseEstimate:
    """Carry a state on by its velocities and rates; those that make no sense count as 0."""
    seconds = time - state.timestamp
    speeds = state.vx, state.vy, state.vz
    north, east, down = speeds if math.hypot(*speeds) < FARTHEST else (0.0, 0.0, 0.0)
    rates = state.p, state.q, state.r
    angles = integrate_body_rates(belief.angles, rates, seconds) if math.hypot(*rates) < FARTHEST else belief.angles
    return PoseEstimate(
        belief.north + seconds * north,
        belief.east + seconds * east,
        belief.down + seconds * down,
        belief.bottom,
        angles,
    )


def _between(first: PoseEstimate, second: PoseEstimate, share: float) -> PoseEstimate:
    north, east, down, bottom = (a + share * (b - a) for a, b in zip(first[:4], second[:4], strict=True))
    phi, theta, psi = (a + share * wrap(b - a) for a, b in zip(first.angles, second.angles, strict=True))
    return PoseEstimate(north, east, down, bottom, (phi, theta, psi))
