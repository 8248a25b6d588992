"""Keeps near a point: drifts inside a circle at the surface, or stays on a circle under water."""

import math
from typing import NamedTuple

import imc
from tasks.maneuver.circle_timer import CircleTimer
from tasks.maneuver.maneuver_task import (
    SHORT,
    VERTICAL,
    Completed,
    Loops,
    Maneuver,
    ManeuverError,
    PathEnd,
    PathFlags,
)

REVISION = 1.0  # s between two updates of the speed
NEAR = 2.5  # radii within which it goes back at the surface, as in DUNE
PASSED = 3.0  # s for a new path after the end of one outside a small circle; the controller waits 5 s


class ApproachSpeed(NamedTuple):
    """The approach of a vehicle that coasts to a point: deceleration (m/s²), 0 for none, and least speed (m/s)."""

    deceleration: float = 0.0
    slowest: float = 0.3

    def speed(self, wanted: float, distance: float) -> float:
        """The speed (m/s) at a distance (m), at most `wanted`."""
        return min(wanted, max(self.slowest, math.sqrt(2.0 * self.deceleration * distance)))


AT_ONCE = ApproachSpeed()


async def keep_station(
    maneuver: Maneuver,
    leg: PathEnd,
    radius: float,
    seconds: float,
    approach: ApproachSpeed = AT_ONCE,
    *,
    circle: bool = False,
) -> None:
    """Stay within `radius` (m) of the end of `leg` for `seconds` from the first arrival; 0 is forever.

    From outside the circle it goes to the center, at the depth of `leg` or, if it has only drifted out, at the surface.
    Inside all loops are off, and an AUV floats up; `approach` lowers a speed in m/s on the way. With `circle`, it stays
    on the circle under water, at its depth or altitude, for `seconds` from the arrival there. ManeuverDone ends it.
    Raises ManeuverError if the vehicle is far outside at the end: the current has carried it off.
    """
    await maneuver.wait_for_state()
    if circle and leg.z_units in VERTICAL and leg.z > SHORT:
        maneuver.set_control_loops(Loops.PATH)
        maneuver.start_path(leg, radius=radius)
        circling = CircleTimer(maneuver, seconds)
        while not await circling.process_next_message():
            pass
        circling.report_missed_circle(leg, radius)
        return
    end, arrived, reported, chosen = math.inf, False, -math.inf, -math.inf

    def slow_down() -> None:
        nonlocal chosen
        if approach.deceleration and leg.speed_units == imc.SpeedUnits.METERS_PS and maneuver.now - chosen >= REVISION:
            chosen = maneuver.now
            speed = approach.speed(leg.speed, maneuver.range_to(leg))
            maneuver.publish(imc.DesiredSpeed(value=speed, speed_units=leg.speed_units))

    async def wait() -> bool:
        """Wait for the next message and report the time left; True if the time is over."""
        nonlocal reported
        event = await maneuver.next_message()
        if isinstance(event, imc.ManeuverDone):
            raise Completed
        if seconds and not arrived:
            if event is maneuver.path:
                maneuver.report_time_left(after=seconds)
        elif maneuver.now - reported >= 1.0:
            reported = maneuver.now
            maneuver.report_progress(end - maneuver.now if seconds else math.inf)
        over = maneuver.now >= end
        if over and (away := maneuver.range_to(leg)) > NEAR * radius:
            raise ManeuverError(f"{away:.0f} m from the station at the end, with a radius of {radius:g} m")
        return over

    while True:
        distance = maneuver.range_to(leg)
        if distance > radius:
            maneuver.log.info(f"outside safe region (distance: {distance:.1f} m)")
            maneuver.set_control_loops(Loops.PATH)
            # One that floats and has only drifted out returns at the surface, without a dive.
            back = leg._replace(z=0.0, z_units=imc.ZUnits.DEPTH) if arrived and distance < NEAR * radius else leg
            maneuver.start_path(back, flags=PathFlags.DIRECT)
            steered = maneuver.now
            while not (maneuver.is_near_end and maneuver.range_to(leg) < radius):
                if await wait():
                    return
                # It has passed beside the center: a new path turns it round.
                if maneuver.is_near_end and maneuver.now - steered >= PASSED and maneuver.range_to(leg) >= radius:
                    maneuver.start_path(back, flags=PathFlags.DIRECT)
                    steered, chosen = maneuver.now, -math.inf
                slow_down()
        maneuver.log.info(f"inside safe region (distance: {maneuver.range_to(leg):.1f} m)")
        maneuver.set_control_loops(0)
        if not arrived:
            arrived, end = True, maneuver.now + seconds if seconds else math.inf
        while maneuver.range_to(leg) <= radius:
            if await wait():
                return
