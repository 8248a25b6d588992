"""Follows references that another system sends."""

from typing import ClassVar

import imc
from imc.reserved_ids import UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from runtime import param
from tasks.maneuver.depth_spiral import vertical_error
from tasks.maneuver.maneuver_task import Completed, Loops, Maneuver, ManeuverError, PathEnd, PathFlags

Has = imc.Reference.Flags
Doing = imc.FollowRefState.State
Near = imc.FollowRefState.Proximity
UNITS = {"None": 0, "DEPTH": 1, "ALTITUDE": 2, "HEIGHT": 3}
SPEEDS = {"m/s": 0, "RPM": 1, "%": 2}


class AUV(Maneuver):
    """Follows each Reference from the system and entity that the maneuver names.

    At the position it loiters if a radius is given; otherwise it spirals to the depth, then hovers with all loops off.
    A speed of 0 stops the vehicle. The flag MANDONE ends the maneuver; no Reference for the timeout is an error.
    """

    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState, imc.EstimatedState)
    subscribed_from_others: ClassVar[tuple[type[imc.Message], ...]] = (imc.Reference,)
    loops: ClassVar[int | None] = 0

    default_speed: float = param(1.2, "-", "Speed if a reference has none.", minimum=0)
    default_speed_units: str = param("m/s", "", "Unit of the default speed.", choices=tuple(SPEEDS))
    default_z: float = param(0.0, "m", "Depth or altitude if a reference has none.")
    default_z_units: str = param("DEPTH", "", "Kind of the default z.", choices=tuple(UNITS))
    horizontal_tolerance: float = param(15.0, "m", "The position is reached within this distance.", minimum=0.1)
    vertical_tolerance: float = param(1.0, "m", "The depth is reached within this distance.", minimum=0.1)
    loitering_radius: float = param(7.5, "m", "Radius of spirals.", minimum=1)

    async def execute(self, order: imc.FollowReference) -> None:
        self._order, self._reference, self._leg = order, imc.Reference(), None
        self._doing, self._state_published_at = Doing.WAIT, -1.0
        received = self.now
        self._publish_follow_state(0)
        while True:
            event = await self.next_message()
            if isinstance(event, imc.Reference) and self._obeys(event):
                if event.flags & Has.MANDONE:
                    raise Completed
                received = self.now
                await self._accept(event)
            if order.timeout > 0.0 and self.age(received) > order.timeout:
                self._doing, self._state_published_at = Doing.TIMEOUT, -1.0
                self._publish_follow_state(0)
                raise ManeuverError("reference timeout")
            if isinstance(event, imc.EstimatedState):
                self._move(event)

    def _obeys(self, reference: imc.Reference) -> bool:
        order = self._order
        return (
            order.control_src in (reference.src, UNKNOWN_SYSTEM)
            and order.control_ent in (reference.src_ent, UNKNOWN_ENTITY)
            and reference.dst in (self.system, UNKNOWN_SYSTEM)
        )

    async def _accept(self, reference: imc.Reference) -> None:
        """Follow a new reference; a missing location stays, a missing speed or z is the default."""
        state = await self.wait_for_state()
        before = self._leg
        self._reference, self._doing = reference, Doing.WAIT
        speed, z = reference.speed, reference.z
        lat, lon = reference.lat, reference.lon
        if not reference.flags & Has.LOCATION:
            lat, lon = (before.lat, before.lon) if before else imc.coordinates.absolute_position(state)[:2]
        leg = PathEnd(
            lat, lon, self.default_z, UNITS[self.default_z_units], self.default_speed, SPEEDS[self.default_speed_units]
        )
        if reference.flags & Has.SPEED and isinstance(speed, imc.DesiredSpeed):
            leg = leg._replace(speed=speed.value, speed_units=speed.speed_units)
        if reference.flags & Has.Z and isinstance(z, imc.DesiredZ):
            leg = leg._replace(z=z.value, z_units=z.z_units)
        self._leg = leg
        self._move(state)

    def _move(self, state: imc.EstimatedState) -> None:
        """Choose what to do from the reference and the distance to it."""
        leg = self._leg
        if leg is None:
            self._publish_follow_state(0)
            return
        near = self.range_to(leg) <= max(self.horizontal_tolerance, 1.5 * self._radius())
        deep = abs(vertical_error(state, leg)) <= self.vertical_tolerance
        if leg.speed <= 0.0:
            doing = Doing.HOVER
        elif not near:
            doing = Doing.GOTO
        elif self._radius() > 0.0:
            doing = Doing.LOITER
        else:
            doing = Doing.HOVER if deep else Doing.ELEVATOR
        if doing is not self._doing:
            self._doing = doing
            self._state_published_at = -1.0
            self._begin_doing(leg, doing)
        self._publish_follow_state((Near.XY_NEAR if near else 0) | (Near.Z_NEAR if deep else 0) or Near.FAR)

    def _begin_doing(self, leg: PathEnd, doing: Doing) -> None:
        self.set_control_loops(0 if doing is Doing.HOVER else Loops.PATH)
        if doing is Doing.GOTO:
            self.start_path(leg, flags=PathFlags.DIRECT if self._reference.flags & Has.DIRECT else 0)
        elif doing in (Doing.LOITER, Doing.ELEVATOR):
            self.start_path(leg, radius=self._radius() or self.loitering_radius)

    def _radius(self) -> float:
        if self._reference.flags & Has.RADIUS:
            return self._reference.radius
        return max(0.0, self._order.loiter_radius)

    def _publish_follow_state(self, proximity: int) -> None:
        """Publish FollowRefState at each change and once per second."""
        if self._state_published_at >= 0.0 and self.now - self._state_published_at < 1.0:
            return
        self._state_published_at = self.now
        self.report_progress()
        self.publish(
            imc.FollowRefState(
                control_src=self._order.control_src,
                control_ent=self._order.control_ent,
                reference=self._reference,
                state=self._doing,
                proximity=proximity,
            )
        )
