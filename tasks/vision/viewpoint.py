"""Where a camera is when it takes a picture: on the true vehicle of a simulation, else on the estimated one."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import imc
from imc.coordinates import StartPoint, offset
from world.attitude import turned
from world.pictures import Pose
from world.sea import Bathymetry
from world.sensors import BodyMotion

OLDEST = 1.0  # s, beyond which the true state counts as missing


class View(NamedTuple):
    """A pose, how much higher than the ground beneath it each glider lies (m), and whether it is the true one."""

    pose: Pose
    rises: tuple[float, ...] = ()
    true: bool = True


class Viewpoint:
    """Follows the states of a vehicle; gliders lie north and east (m) of its first position.

    `sea`: below is the surface of the sea, not its bottom.
    """

    def __init__(self, gliders: Sequence[tuple[float, float]], *, sea: bool):
        self.gliders = gliders
        self.sea = sea
        self.estimate: imc.EstimatedState | None = None
        self._truth: imc.SimulatedState | None = None
        self._start, self._true_start = StartPoint(), StartPoint()

    def follow(self, state: imc.EstimatedState) -> None:
        self.estimate = state
        if math.isfinite(state.lat + state.lon + state.x + state.y):
            self._start.follow(state)

    def follow_truth(self, truth: imc.SimulatedState) -> None:
        if BodyMotion.of(truth).is_finite and math.isfinite(truth.lat + truth.lon + truth.x + truth.y + truth.z):
            self._truth = truth
            self._true_start.follow(truth)

    def view(self, now: float, began: float, seabed: Bathymetry | None) -> View | str:
        """The view at `now` (s since 1970) of a run that began at `began`, or why there is none.

        States are carried on to that moment by their velocities and rates. `seabed` is the true bottom, if known.
        """
        truth, state = self._truth, self.estimate
        if truth is not None and now - truth.timestamp <= OLDEST:
            view = self._from_truth(truth, now, began, seabed)
        elif state is None:
            return "waiting for EstimatedState"
        elif not math.isfinite(
            state.lat + state.lon + state.x + state.y + state.z + state.depth + state.phi + state.theta + state.psi
        ):
            return "no position or attitude"
        else:
            view = self._from_estimate(state, now, began)
        return view if view.pose.height > 0.0 else "no altitude"

    def _from_truth(self, truth: imc.SimulatedState, now: float, began: float, seabed: Bathymetry | None) -> View:
        (north, east, down), angles = BodyMotion.of(truth).moved(now - truth.timestamp)
        north, east, down = truth.x + north, truth.y + east, truth.z + down
        start, rises = self._true_start, ()
        if self.sea:
            bottom = 0.0
        elif seabed is not None:
            at = offset(*seabed.reference, truth.lat, truth.lon)
            bottom = seabed.depth(at[0] + north, at[1] + east)
            rises = tuple(
                bottom - seabed.depth(at[0] + start.north + n, at[1] + start.east + e) for n, e in self.gliders
            )
        else:
            bottom = _bottom(self.estimate)
        pose = Pose(north - start.north, east - start.east, bottom - down, down, *angles, now - began)
        return View(pose, rises)

    def _from_estimate(self, state: imc.EstimatedState, now: float, began: float) -> View:
        seconds = max(0.0, min(OLDEST, now - state.timestamp))
        angles = turned((state.phi, state.theta, state.psi), (state.p, state.q, state.r), seconds)
        height = _bottom(state) - state.z
        if self.sea and not height > 0.0:
            height = -state.z
        return View(
            Pose(
                state.x + seconds * state.vx - self._start.north,
                state.y + seconds * state.vy - self._start.east,
                height - seconds * state.vz,
                state.depth + seconds * state.vz,
                *angles,
                now - began,
            ),
            true=False,
        )


def _bottom(state: imc.EstimatedState | None) -> float:
    """Where a vehicle estimates the ground (m, down like its z); -infinity if it does not know."""
    return state.z + state.alt if state is not None and 0.0 < state.alt < math.inf else -math.inf
