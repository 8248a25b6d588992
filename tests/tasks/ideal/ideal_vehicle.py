"""A vehicle without dynamics that follows paths exactly, to fly plans in tests."""

import math

import imc
from runtime import State, Task, consume, param, periodic
from support.wgs84 import displace, displacement

Flags = imc.DesiredPath.Flags
Reached = imc.PathControlState.Flags
STEP = 0.05  # s


class IdealVehicle(Task):
    """Follows DesiredPath kinematically; publishes EstimatedState and PathControlState as path control does."""

    start_lat: float = param(0.7188138702989088, "rad", "Latitude of the start.")
    start_lon: float = param(-0.15195185535150277, "rad", "Longitude of the start.")
    bottom: float = param(30.0, "m", "Depth of the bottom.")
    current_east: float = param(0.0, "m/s", "Current that drifts a vehicle without control.")
    ahead: float = param(5.0, "s", "Time before the end of a path at which the vehicle is near it.")

    def start(self) -> None:
        self.north = self.east = self.depth = self.course = self.pitch = self.turned = 0.0
        self.velocity = (0.0, 0.0, 0.0)
        self.scope = 0
        self.loops = 0
        self.path: imc.DesiredPath | None = None
        self.near = self.loitering = False
        self.begin = self.target = (0.0, 0.0)
        self.paths: list[imc.DesiredPath] = []
        self.speed = 0.0
        self.set_entity_state(State.NORMAL, "active")

    @consume
    def switch(self, loops: imc.ControlLoops) -> None:
        if loops.scope_ref >= self.scope:
            self.scope = loops.scope_ref
            self.loops = self.loops | loops.mask if loops.enable else self.loops & ~loops.mask
            if not self.loops & imc.CLoopsMask.PATH:
                self.path = None

    @consume
    def follow(self, path: imc.DesiredPath) -> None:
        if not all(map(math.isfinite, (path.end_lat, path.end_lon, path.end_z, path.speed, path.lradius))):
            return
        if path.speed_units not in tuple(imc.SpeedUnits):
            return
        north, east, _ = displacement(self.start_lat, self.start_lon, 0.0, path.end_lat, path.end_lon, 0.0)
        here = path.flags & Flags.LOITER_CURR and path.lradius > 0.0
        self.target = (self.north, self.east) if here else (north, east)
        self.begin = self.north, self.east
        self.path, self.near, self.loitering = path, False, False
        self.paths.append(path)
        self.speed = {0: path.speed, 1: path.speed / 1000.0, 2: path.speed / 50.0}[path.speed_units]
        mask = imc.CLoopsMask.YAW | imc.CLoopsMask.SPEED
        if not path.flags & Flags.NO_Z:
            mask |= imc.CLoopsMask.ALTITUDE if path.end_z_units == imc.ZUnits.ALTITUDE else imc.CLoopsMask.DEPTH
        self.loops |= mask
        self.publish(imc.ControlLoops(enable=1, mask=mask, scope_ref=self.scope))
        self.tell_path()

    @consume
    def tilt(self, pitch: imc.DesiredPitch) -> None:
        self.pitch = pitch.value

    @consume
    def accelerate(self, speed: imc.DesiredSpeed) -> None:
        self.speed = {0: speed.value, 1: speed.value / 1000.0, 2: speed.value / 50.0}[speed.speed_units]

    @periodic(1.0)
    def tell_path(self) -> None:
        path = self.path
        if path is None or not path.path_ref:
            return
        flags = (Reached.NEAR if self.near else 0) | (Reached.LOITERING if self.loitering else 0)
        left = self._left()
        eta = 0 if self.near or self.loitering else max(0.0, left / max(self.speed, 0.1) - self.ahead)
        self.publish(
            imc.PathControlState(
                path_ref=path.path_ref,
                end_lat=path.end_lat,
                end_lon=path.end_lon,
                end_z=path.end_z,
                end_z_units=path.end_z_units,
                lradius=path.lradius,
                flags=flags | (Reached.NO_Z if path.flags & Flags.NO_Z else 0),
                x=left,
                z=self._vertical_error(),
                eta=min(65535, int(eta)),
            )
        )

    @periodic(1.0 / STEP)
    def move(self) -> None:
        before = self.north, self.east, self.depth
        if self.path is not None:
            self._move_along(self.path)
        else:
            self.east += self.current_east * STEP
            self.depth = max(0.0, self.depth - 0.3 * STEP)
        now = self.north, self.east, self.depth
        vx, vy, vz = self.velocity = tuple((b - a) / STEP for a, b in zip(before, now, strict=True))
        self.publish(
            imc.EstimatedState(
                lat=self.start_lat,
                lon=self.start_lon,
                x=self.north,
                y=self.east,
                z=self.depth,
                depth=self.depth,
                alt=self.bottom - self.depth,
                psi=self.course,
                u=math.hypot(vx, vy),
                vx=vx,
                vy=vy,
                vz=vz,
            )
        )

    def position(self) -> tuple[float, float]:
        """Latitude and longitude (rad)."""
        return displace(self.start_lat, self.start_lon, 0.0, self.north, self.east)[:2]

    def _move_along(self, path: imc.DesiredPath) -> None:
        if path.flags & Flags.NO_Z:
            self.depth = max(0.0, self.depth - self.speed * math.sin(self.pitch) * STEP)
        else:
            climb = self.speed * math.sin(math.radians(15.0)) * STEP
            self.depth = max(0.0, self.depth + max(-climb, min(climb, self._vertical_error())))
        dn, de = self.target[0] - self.north, self.target[1] - self.east
        distance = math.hypot(dn, de)
        if path.lradius > 0.0 and (self.loitering or distance <= path.lradius + self.speed * STEP):
            if not self.loitering:
                self.loitering = True
                self.tell_path()
            side = -1.0 if path.flags & Flags.CCLOCKW else 1.0
            around = math.atan2(-de, -dn) + side * self.speed * STEP / path.lradius
            self.turned += self.speed * STEP / path.lradius
            self.course = math.remainder(around + side * math.pi / 2.0, math.tau)
            self.north = self.target[0] + path.lradius * math.cos(around)
            self.east = self.target[1] + path.lradius * math.sin(around)
            return
        if distance > 1e-6:
            step = min(distance, self.speed * STEP)
            self.course = math.atan2(de, dn)
            self.north += step * dn / distance
            self.east += step * de / distance
        if not self.near and path.lradius == 0.0 and self._left() <= self.speed * self.ahead:
            self.near = True
            self.tell_path()

    def _left(self) -> float:
        return math.hypot(self.target[0] - self.north, self.target[1] - self.east)

    def _vertical_error(self) -> float:
        if self.path is None:
            return 0.0
        if self.path.end_z_units == imc.ZUnits.ALTITUDE:
            return self.bottom - self.path.end_z - self.depth
        return self.path.end_z - self.depth if self.path.end_z_units == imc.ZUnits.DEPTH else 0.0
