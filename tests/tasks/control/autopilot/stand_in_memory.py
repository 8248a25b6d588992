"""The mission in the stand-in's memory: the protocol of its server, and what the items make it do."""

import math

WAYPOINT, UNLIM, TURNS, TIME, RTL, LAND, TAKEOFF, TO_ALT, DELAY, SPEED = 16, 17, 18, 19, 20, 21, 22, 31, 93, 178
KNOWN = (WAYPOINT, UNLIM, TURNS, TIME, RTL, LAND, TAKEOFF, TO_ALT, DELAY, SPEED)
ACCEPTED, UNSUPPORTED, INVALID, INVALID_SEQUENCE = 0, 3, 5, 13
REACH = {"copter": 1.0, "submarine": 1.5, "rover": 2.0, "boat": 3.0, "plane": 40.0}  # m
CIRCLE_RATE = math.radians(20.0)  # of ArduCopter, whatever the speed
TOUCHDOWN, ROLLOUT = 1.5, 3.0  # m/s down, s
AGAIN = 1.0  # s


class Store:
    """Items by number; ArduPilot's number 0 is home, and it forgets what it does not need of an item."""

    def __init__(self, autopilot):
        self.autopilot, self.px4 = autopilot, autopilot.px4
        self.items, self.current, self.identity = [], 0, 0
        self.coming, self.expected, self.asked_at, self.who = [], None, 0.0, (0, 0)
        self.since = self.turned = 0.0
        self.angle = None
        self.started = False

    # the protocol

    def hear(self, m, name):
        link, who = self.autopilot.link, (m.get_srcSystem(), m.get_srcComponent())
        if name == "MISSION_COUNT":
            self.expected, self.coming, self.who = m.count, [], who
            self.ask()
        elif name == "MISSION_ITEM_INT" and self.expected is not None and m.seq == len(self.coming):
            if self.refuses(m):
                self.expected = None
                link.mission_ack_send(*who, UNSUPPORTED)
                return
            self.coming.append(self.kept(m))
            if len(self.coming) < self.expected:
                self.ask()
                return
            self.items, self.expected = self.coming, None
            self.identity = self.identity + 7 if self.px4 else 0
            self.current = 0 if self.px4 else min(self.current, len(self.items) - 1)
            self.acknowledge(who)
        elif name == "MISSION_REQUEST_LIST":
            link.mission_count_send(*who, len(self.items))
        elif name in ("MISSION_REQUEST_INT", "MISSION_REQUEST") and m.seq < len(self.items):
            values = self.items[m.seq]
            link.mission_item_int_send(*who, m.seq, *values)
        elif name in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
            link.mission_ack_send(*who, INVALID_SEQUENCE)
        elif name == "MISSION_SET_CURRENT" and m.seq < len(self.items):
            self.go_to(m.seq)
            self.tell()

    def ask(self):
        self.asked_at = self.autopilot.now
        link, old = self.autopilot.link, self.autopilot.options.old
        (link.mission_request_send if old else link.mission_request_int_send)(*self.who, len(self.coming))

    def acknowledge(self, who):
        if not self.px4:
            self.autopilot.link.mission_ack_send(*who, ACCEPTED)
            return
        # the id is an extension that pymavlink's dialect lacks
        self.autopilot.send_raw(47, 153, bytes((*who, ACCEPTED, 0)) + self.identity.to_bytes(4, "little"))

    def refuses(self, m):
        """PX4 has no turns for a copter; nobody has what it does not know."""
        return m.command not in KNOWN or (self.px4 and self.autopilot.motion.kind == "copter" and m.command == TURNS)

    def kept(self, m):
        """The values of MISSION_ITEM_INT as they are returned: ArduPilot's numbers are coarse."""
        if m.seq == 0 and not self.px4:  # its home, whatever was sent
            lat, lon, up = self.autopilot.home
            return 0, WAYPOINT, 0, 1, 0.0, 0.0, 0.0, 0.0, round(1e7 * lat), round(1e7 * lon), up
        p = [m.param1, m.param2, m.param3, m.param4]
        frame, z = m.frame, m.z
        if not self.px4:
            frame, z = {5: 0, 6: 3, 11: 10}.get(frame, frame), round(z * 100.0) / 100.0
            if m.command != SPEED:
                p = [float(int(p[0])), 0.0, float(int(p[2])), 0.0]
        return frame, m.command, 0, 1, *p, m.x, m.y, z

    def tell(self):
        total = len(self.items) - (0 if self.px4 else 1)
        state = 1 if not self.items else 3
        payload = self.current.to_bytes(2, "little") + max(0, total).to_bytes(2, "little") + bytes((state, 0))
        self.autopilot.send_raw(42, 28, payload + self.identity.to_bytes(4, "little"))

    # what it does

    def go_to(self, number):
        self.current, self.since, self.turned, self.angle = number, None, 0.0, None

    def wanted(self):
        """The velocity for the item at hand; the next items are begun as they come."""
        a, motion = self.autopilot, self.autopilot.motion
        if not self.px4 and self.current == 0 and self.items:
            self.go_to(1)
        while self.current < len(self.items) and self.items[self.current][1] == SPEED:
            a.cruise = self.items[self.current][5]
            self.finish()
        if self.current >= len(self.items):
            a.mission_is_over()
            return (0.0, 0.0, 0.0)
        _, command, _, _, p1, _, p3, _, x, y, z = self.items[self.current]
        north, east = a.local(x / 1e7, y / 1e7)
        away = math.hypot(north - motion.at[0], east - motion.at[1])
        near = away < REACH[motion.kind] and (
            not motion.flies or abs(z - motion.at[2]) < (8.0 if motion.kind == "plane" else 0.5)
        )
        if command == TAKEOFF:
            return self.climb(z, p1)
        if command == LAND and motion.flies:
            return self.land(north, east, away, p1)
        if command == DELAY:
            self.wait(p1)
            return (0.0, 0.0, 0.0)
        if command in (TURNS, UNLIM, TIME, TO_ALT) and (motion.kind == "plane" or command == TURNS):
            return self.turn(command, p1, p3, north, east, z, away)
        if near and command in (WAYPOINT, TIME, LAND):
            self.wait(p1 if command != LAND else 0.0)
        return motion.toward((north, east, z), a.cruise)

    def climb(self, height, pitch):
        motion = self.autopilot.motion
        if motion.kind != "plane" and not self.px4 and not self.started:
            return (0.0, 0.0, 0.0)  # a copter waits for its throttle, or for MISSION_START
        motion.at[2] = max(motion.at[2], 0.11)
        if motion.at[2] > height - (3.0 if motion.kind == "plane" else 0.3):
            self.finish()
        if motion.kind != "plane":
            return (0.0, 0.0, max(0.3, min(2.5, height - motion.at[2])))
        return math.cos(motion.heading) * 15.0, math.sin(motion.heading) * 15.0, 2.5 if pitch > 5.0 else 1.0

    def land(self, north, east, away, _):
        a, motion = self.autopilot, self.autopilot.motion
        if motion.kind != "plane":
            if away > 1.0 and self.since is None:
                return motion.toward((north, east, motion.at[2]), a.cruise)
            self.since = self.since or a.now
            return (0.0, 0.0, -1.0)
        if motion.at[2] <= 0.1:
            a.touched_down()
            return (0.0, 0.0, 0.0)
        course = math.atan2(east - motion.at[1], north - motion.at[0])
        if self.since is not None or away < 15.0:  # over the threshold: straight on, and down
            self.since, course = self.since or a.now, motion.heading
            return math.cos(course) * 12.0, math.sin(course) * 12.0, -TOUCHDOWN
        sink = motion.at[2] / max(1.0, away / 12.0)
        return math.cos(course) * 12.0, math.sin(course) * 12.0, -min(3.0, sink)

    def turn(self, command, p1, p3, north, east, z, away):
        a, motion = self.autopilot, self.autopilot.motion
        plane = motion.kind == "plane"
        radius, side = abs(p3) or 60.0, -1 if p3 < 0.0 else 1
        speed = a.flight_speed() if plane else CIRCLE_RATE * radius if motion.kind == "copter" else a.cruise
        angle = math.atan2(motion.at[1] - east, motion.at[0] - north)
        on_circle = abs(away - radius) < max(2.0, 0.25 * radius)
        if on_circle:
            self.since = a.now if self.since is None else self.since
            if self.angle is not None:
                self.turned += abs(math.remainder(angle - self.angle, math.tau))
        self.angle = angle
        level = abs(z - motion.at[2]) < 4.0
        over = {TURNS: self.turned > p1 * math.tau, TO_ALT: level and self.since is not None, UNLIM: False}
        waited = self.since is not None and a.now - self.since > p1
        if over.get(command, waited):
            self.finish()
        return motion.around(north, east, z, radius, side, speed)

    def wait(self, seconds):
        self.since = self.autopilot.now if self.since is None else self.since
        if self.autopilot.now - self.since >= seconds:
            self.finish()

    def finish(self):
        self.autopilot.link.mission_item_reached_send(self.current)
        self.go_to(self.current + 1)
