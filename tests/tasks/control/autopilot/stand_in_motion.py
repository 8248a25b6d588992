"""How the bodies of the stand-in move: copters tilt, planes bank, boats turn slowly and drift."""

import math
import random

GRAVITY = 9.81
EARTH = 6371000.0 * math.pi / 180.0  # m for a degree
HOVERS = ("copter", "submarine")
TURNING = {"rover": 1.2, "boat": 0.5}  # rad/s
BANK = math.radians(40.0)
SLOWEST_FLIGHT, FASTEST_FLIGHT = 10.0, 25.0  # m/s
ACCELERATION = {"copter": 3.0, "submarine": 0.7, "rover": 1.5, "boat": 0.8, "plane": 2.0}  # m/s²
LAG = {"copter": 0.8, "rover": 1.2, "boat": 1.2}  # s by which the velocity follows what is wanted
PLANNING = 0.3  # m/s², in which the speed of a submarine's new path grows
CLIMB, DESCENT = 2.5, 1.5  # m/s
NOISE = 0.03  # m, m/s and rad/10
CURRENT = 0.1  # m/s to the east, for what floats without power


class Motion:
    """Position north, east and up of home (m), velocity (m/s), attitude (rad) of one kind of vehicle.

    First-order: no aerodynamics, waves or motors. wind: north and east (m/s), which carries planes.
    """

    def __init__(self, kind, north, wind):
        self.kind, self.wind = kind, wind
        self.at, self.velocity = [north, 0.0, 0.0], [0.0, 0.0, 0.0]
        self.heading = self.roll = self.pitch = self.airspeed = 0.0
        self.random = random.Random(1)
        self.planned, self.asked = 0.0, (0.0, 0.0)
        self.climb = CLIMB

    @property
    def flies(self):
        return self.kind in ("copter", "plane")

    @property
    def flying(self):
        return self.flies and self.at[2] > 0.1

    def noisy(self, value, scale=1.0):
        return value + self.random.gauss(0.0, NOISE * scale)

    def toward(self, target, cruise):
        """The velocity to a place, slowing down before it."""
        gap = [b - a for a, b in zip(self.at, target, strict=True)]
        away = math.hypot(gap[0], gap[1])
        limit = ACCELERATION[self.kind]
        speed = min(cruise, math.sqrt(limit * away), away)
        if self.kind == "plane":
            speed = cruise
        level = [g * speed / away if away > 0.01 else 0.0 for g in gap[:2]]
        return (*level, max(-DESCENT, min(self.climb, gap[2])))

    def around(self, north, east, up, radius, side, speed):
        x, y = self.at[0] - north, self.at[1] - east
        angle, away = math.atan2(y, x), math.hypot(x, y)
        ahead = speed / radius * 0.6 if self.kind in HOVERS else 0.0
        course = angle + side * (math.pi / 2 + max(-1.2, min(1.2, (away - radius) / radius * 2.0)) + ahead)
        return speed * math.cos(course), speed * math.sin(course), max(-DESCENT, min(self.climb, up - self.at[2]))

    def step(self, dt, wanted, *, powered, rolls=False):
        """Move on; without power it falls, stays or drifts. rolls: a plane on the ground."""
        if not powered:
            wanted = (0.0, CURRENT if self.kind == "boat" else 0.0, -DESCENT if self.flying else 0.0)
            if self.kind == "submarine":
                wanted = (0.0, 0.0, max(0.0, min(0.1, -self.at[2])))
        if powered and self.kind in LAG:
            share = min(1.0, dt / LAG[self.kind])
            self.asked = tuple(a + share * (w - a) for a, w in zip(self.asked, wanted[:2], strict=True))
            wanted = (*self.asked, wanted[2])
        elif self.kind == "submarine":
            self.planned += PLANNING * dt
            share = min(1.0, self.planned / max(0.01, math.hypot(*wanted)))
            wanted = tuple(share * w for w in wanted) if powered else wanted
        if self.kind in HOVERS or not powered:
            self._hover(dt, wanted)
        else:
            self._steer(dt, wanted, rolls)
        change = max(-2.0 * dt, min(2.0 * dt, wanted[2] - self.velocity[2]))
        self.velocity[2] += change
        for axis in range(3):
            self.at[axis] += self.velocity[axis] * dt
        if self.kind in ("rover", "boat") or (self.kind == "submarine" and self.at[2] > 0.0):
            self.at[2] = self.velocity[2] = 0.0
        if self.flies and self.at[2] <= 0.0:
            self.at[2] = self.velocity[2] = 0.0

    def _hover(self, dt, wanted):
        limit = ACCELERATION[self.kind]
        for axis in range(2):
            change = max(-limit * dt, min(limit * dt, wanted[axis] - self.velocity[axis]))
            self.velocity[axis] += change
            tilt = change / dt / GRAVITY if self.kind == "copter" else 0.0
            ahead, side = math.cos(self.heading), math.sin(self.heading)
            if axis == 0:
                self.pitch, self.roll = -tilt * ahead, -tilt * side
            else:
                self.pitch, self.roll = self.pitch - tilt * side, self.roll + tilt * ahead
        if math.hypot(*self.velocity[:2]) > 0.3:
            course = math.atan2(self.velocity[1], self.velocity[0])
            self.heading += max(-dt, min(dt, math.remainder(course - self.heading, math.tau)))

    def _steer(self, dt, wanted, rolls):
        """Only ahead, in turns: a plane's by its bank and speed."""
        plane, wind = self.kind == "plane" and not rolls, self.wind if self.kind == "plane" else (0.0, 0.0)
        north, east = wanted[0], wanted[1]
        speed = math.hypot(north, east)
        if plane:  # the course over ground is steered, the speed is that through the air
            speed = max(SLOWEST_FLIGHT, min(FASTEST_FLIGHT, speed))
        limit = ACCELERATION[self.kind] * dt
        self.airspeed += max(-limit, min(limit, speed - self.airspeed))
        if math.hypot(north, east) > 0.05:
            course = math.atan2(east, north)
            if plane:
                across = wind[1] * math.cos(course) - wind[0] * math.sin(course)
                course -= math.asin(max(-0.9, min(0.9, across / max(self.airspeed, 1.0))))
            turn = math.remainder(course - self.heading, math.tau)
            rate = GRAVITY * math.tan(BANK) / max(self.airspeed, 5.0) if plane else TURNING.get(self.kind, 1.0)
            rate = max(-rate, min(rate, 1.5 * turn))
            self.heading = math.remainder(self.heading + rate * dt, math.tau)
            self.roll = math.atan(rate * self.airspeed / GRAVITY) if plane else 0.0
            if not plane and abs(turn) > 1.0:
                self.airspeed = min(self.airspeed, 0.5 + 0.5 * self.airspeed)
        blown = wind if plane else (0.0, 0.0)
        self.velocity[0] = self.airspeed * math.cos(self.heading) + blown[0]
        self.velocity[1] = self.airspeed * math.sin(self.heading) + blown[1]
