"""Pose of a camera when it takes a picture: on the true vehicle of a simulation, else on the estimated one."""

import math
from typing import NamedTuple

import imc
from support.pose import Pose
from tasks.pose_history import PoseHistory
from tasks.simulated_world import FARTHEST, TrueState, WorldPose
from world import ObjectPosition, World
from world.rendering import Board, Glider, ScenePose, board_of_object

OLDEST = 1.0  # s, beyond which the true state counts as missing
PATIENCE = 0.1  # s, after which the next true state is not waited for
TIMING = 1e-6  # s, by which a timestamp may be rounded


class VehicleView(NamedTuple):
    """The pose of the vehicle, the gliders in the scene, whether that is true, and the estimated pose."""

    vehicle: ScenePose
    gliders: tuple[Glider, ...] = ()
    is_true: bool = True
    estimate: Pose | None = None
    boards: tuple[Board, ...] = ()


class ViewpointTracker:
    """Follows the states of a vehicle in a world with an origin (rad). `sea`: below is the surface, not the bottom.

    It looks back for as long as an exposure takes, which is `duration` (s), and its states are waited for.
    """

    def __init__(self, origin: tuple[float, float] | None, *, sea: bool, duration: float = 0.0):
        self.sea = sea
        self.estimate: imc.EstimatedState | None = None
        remembered = OLDEST + duration
        self._truth, self._beliefs = TrueState(origin, remembered), PoseHistory(origin, remembered)

    def update_estimate(self, state: imc.EstimatedState) -> None:
        self.estimate = state
        self._beliefs.add(state)

    def update_truth(self, truth: imc.SimulatedState) -> None:
        self._truth.update(truth)

    def is_settled(self, time: float, now: float, *, may_be_late: bool = False) -> bool:
        """Whether no true state will add to a time (s since 1970): one after it is here, or none comes.

        may_be_late: that none has come for a while does not mean that none comes.
        """
        latest = self._truth.latest_time
        return latest >= time - TIMING or not (may_be_late or -PATIENCE < now - latest < PATIENCE)

    def view(self, world: World, now: float, began: float) -> VehicleView | str:
        """The view of a world at `now` (s since 1970) of a run that began at `began`, or why there is none.

        It is between the states before and after; the last one is carried on by its velocities and rates.
        """
        truth, state = self._truth.pose_at(now, OLDEST), self.estimate
        estimated_view = None if state is None else self._estimated_pose(world, state, now, now - began)
        if truth is None and self._truth.fault:
            return self._truth.fault
        if truth is not None:
            view = self._from_truth(world, truth, now - began)
        elif state is None:
            return "waiting for EstimatedState"
        elif estimated_view is None:
            return "no position or attitude" if now - state.timestamp <= OLDEST else "no recent EstimatedState"
        else:
            scene = (
                world,
                now - began,
                estimated_view.height + estimated_view.depth if self._sounded(world) else self._ground(state),
            )
            view = VehicleView(estimated_view, self._gliders(*scene), is_true=False, boards=self._boards(*scene))
        if not 0.0 < view.vehicle.height < FARTHEST:
            return "no altitude"
        return view._replace(estimate=None if estimated_view is None else estimated_view.pose)

    def _from_truth(self, world: World, truth: WorldPose, time: float) -> VehicleView:
        north, east, down, angles = truth
        bottom = 0.0 if self.sea else world.seabed_depth(north, east)
        if bottom is None:
            bottom = _bottom(self.estimate)
        pose = ScenePose(north, east, bottom - down, down, *angles, time)
        return VehicleView(pose, self._gliders(world, time, bottom), boards=self._boards(world, time, bottom))

    def _sounded(self, world: World) -> bool:
        """Whether soundings give the depth of the seabed below, wrong estimate or not."""
        return not self.sea and world.seabed is not None and world.seabed.has_soundings

    def _estimated_pose(self, world: World, state: imc.EstimatedState, now: float, time: float) -> ScenePose | None:
        """The estimated pose; None without a recent place and attitude."""
        belief = self._beliefs.estimate_at(now, OLDEST)
        if isinstance(belief, str) or self._beliefs.latest_state is not state or not math.isfinite(state.depth):
            return None
        height, depth = self._ground(state) - belief.down, state.depth + belief.down - state.z
        if self._sounded(world):
            height = (world.seabed_depth(belief.north, belief.east) or 0.0) - depth
        return ScenePose(belief.north, belief.east, height, depth, *belief.angles, time)

    def _ground(self, state: imc.EstimatedState) -> float:
        """The estimated bottom below the vehicle (m, down like its z)."""
        bottom = _bottom(state)
        return 0.0 if self.sea and not bottom > state.z else bottom

    def _gliders(self, world: World, time: float, ground: float) -> tuple[Glider, ...]:
        """Gliders of the world, at a time (s), above the ground (m, down) beneath the camera.

        On a bottom outside the world's, and in a scene without bottom, they lie on that ground. From above the
        sea, those in deep water are not seen.
        """
        things = (
            (thing, world.object_position(thing, time))
            for thing in world.gliders
            if not (self.sea and (thing.depth or 0.0) > thing.diameter)
        )
        return tuple(
            Glider(
                spot.north,
                spot.east,
                self._rise(spot, thing.depth, ground),
                spot.heading,
                thing.length,
                thing.diameter,
                thing.id,
            )
            for thing, spot in things
        )

    def _boards(self, world: World, time: float, ground: float) -> tuple[Board, ...]:
        """The boards of the world like `_gliders`; none is seen through the surface."""
        boards = (
            (thing, world.object_position(thing, time)) for thing in world.boards if not (self.sea and thing.depth)
        )
        return tuple(board_of_object(thing, spot, self._rise(spot, thing.depth, ground)) for thing, spot in boards)

    def _rise(self, spot: ObjectPosition, depth: float | None, ground: float) -> float:
        return 0.0 if spot.down is None or (self.sea and depth is None) else ground - spot.down


def _bottom(state: imc.EstimatedState | None) -> float:
    """The ground (m, down like its z) by the estimate of a vehicle; -infinity if it has none."""
    return state.z + state.alt if state is not None and 0.0 < state.alt < math.inf else -math.inf
