"""Changes depth in circles."""

import math

import imc
from tasks.maneuver.maneuver_task import SHORT, Maneuver, ManeuverError, PathEnd, PathState

NEAR_ENOUGH = 0.3  # m
CLIMB = math.sin(math.radians(15.0))  # vertical speed as a part of the forward speed


def vertical_error(state: imc.EstimatedState, leg: PathEnd) -> float:
    """Depth (m) of the end of `leg` below the vehicle; 0 if `leg` has no depth or altitude, or it is unknown."""
    if leg.z_units == imc.ZUnits.DEPTH:
        return leg.z - state.depth
    if leg.z_units == imc.ZUnits.ALTITUDE and state.alt >= 0.0:
        return state.alt - leg.z
    return 0.0


async def spiral(
    maneuver: Maneuver,
    leg: PathEnd,
    radius: float,
    *,
    flags: int = 0,
    after: float = 0.0,
    slowest: float = 0.0,
    patience: float = math.inf,
    required: bool = False,
) -> None:
    """Circle around the end of `leg` with `radius` (m) until its depth is reached; `after` (s) is added to the eta.

    Raises ManeuverError if the vertical speed on the circle is below `slowest` (m/s) over `patience` (s). Where control
    holds the vehicle off the bottom, or the water is too shallow for an altitude, it is done, and the maneuver reports
    it; a depth that is `required` is an error. For that, the maneuver must receive DesiredZ.
    """
    state = await maneuver.wait_for_state()
    maneuver.start_path(leg, radius=radius, flags=flags)
    mark, marked, held = vertical_error(state, leg), maneuver.now, False
    while True:
        event = await maneuver.next_message()
        if isinstance(event, imc.DesiredZ):
            held = event.z_units != leg.z_units or abs(event.value - leg.z) > NEAR_ENOUGH
        if maneuver.state is None:
            continue
        error = vertical_error(maneuver.state, leg)
        held = held or (leg.z_units == imc.ZUnits.ALTITUDE and maneuver.state.depth < NEAR_ENOUGH and error < 0.0)
        if abs(error) <= NEAR_ENOUGH:
            return
        if event is maneuver.path:
            maneuver.report_time_left(after + abs(error) / (max(0.1, leg.speed) * CLIMB))
        if maneuver.path is None or not maneuver.path.flags & PathState.LOITERING:
            mark, marked = error, maneuver.now
        elif maneuver.now - marked >= patience:
            if abs(mark) - abs(error) < slowest * patience:
                if held and required and abs(error) > SHORT and leg.z_units == imc.ZUnits.DEPTH:
                    raise ManeuverError(f"depth {leg.z - error:.1f} m instead of {leg.z:g} m: kept off the bottom")
                if held:
                    maneuver.check_depth(leg, error if leg.z_units == imc.ZUnits.DEPTH else -error)
                    return
                raise ManeuverError(f"vertical speed is below {slowest:g} m/s")
            mark, marked = error, maneuver.now
