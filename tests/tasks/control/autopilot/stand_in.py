"""A stand-in for an autopilot: the modes, arming, commands and motion of ArduPilot or PX4, as far as Shoal uses them.

It speaks MAVLink by pymavlink, over UDP, with time running `--speed` times faster. It is kinematic: it has no wind, no
sensors' noise, no estimator, no battery, no failsafes; it answers what the real ones refuse only where a test says so.
Lines on stdin: `mode N`, `disarm`, `garbage`, `nan`, `quiet NAME`.
"""

import argparse
import math
import os
import select
import socket
import sys
import time

os.environ["MAVLINK20"] = "1"
from pymavlink.dialects.v20 import ardupilotmega as mavlink

STEP = 0.02  # s
EARTH = 6371000.0 * math.pi / 180.0  # m for a degree
HOME = 41.185, -8.7062, 30.0
COPTER = {"guided": 4, "hold": 17, "return": 6, "land": 9, "start": 0}
MODES = {
    "copter": COPTER,
    "rover": {"guided": 15, "hold": 4, "return": 11, "start": 0},
    "boat": {"guided": 15, "hold": 5, "return": 11, "start": 0},
    "submarine": {"guided": 4, "hold": 16, "return": 9, "start": 19},
    "plane": {"guided": 15, "hold": 12, "return": 11, "takeoff": 13, "start": 0},
    "px4": {"guided": 4 << 16 | 3 << 24, "hold": 4 << 16 | 3 << 24, "return": 4 << 16 | 5 << 24,
            "land": 4 << 16 | 6 << 24, "takeoff": 4 << 16 | 2 << 24, "orbit": 3 << 16 | 1 << 24,
            "start": 4 << 16 | 3 << 24},
}  # fmt: skip
TYPES = {"copter": 2, "rover": 10, "boat": 11, "submarine": 12, "plane": 1, "px4": 2}
FLYING = ("copter", "plane", "px4")
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3
POSITION_ONLY = 0x0DF8


class Wire:
    """Where pymavlink writes."""

    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.socket.connect(("127.0.0.1", port))

    def write(self, data):
        try:
            self.socket.send(data)
        except OSError:
            pass

    def read(self):
        try:
            return self.socket.recv(4096)
        except OSError:
            return b""


class StandIn:
    def __init__(self, options):
        self.options, self.kind = options, options.kind
        self.modes, self.px4 = MODES[self.kind], self.kind == "px4"
        self.wire = Wire(options.port)
        self.link = mavlink.MAVLink(self.wire, srcSystem=options.system, srcComponent=1)
        self.link.robust_parsing = True
        self.began, self.now = time.monotonic(), 0.0
        self.mode, self.armed, self.armed_at = self.modes["start"], False, 0.0
        self.at = [options.north, 0.0, 0.0]  # north, east, up of home (m)
        self.velocity = [0.0, 0.0, 0.0]
        self.target, self.circle, self.cruise, self.heading = None, None, 5.0, 0.0
        self.streams, self.due, self.quiet = {}, {}, set()
        self.beat_due = self.landed_since = 0.0

    @property
    def flying(self):
        return self.kind in FLYING and self.at[2] > 0.1

    def position(self):
        lat = HOME[0] + self.at[0] / EARTH
        return lat, HOME[1] + self.at[1] / EARTH / math.cos(math.radians(HOME[0])), HOME[2] + self.at[2]

    def local(self, lat, lon):
        return (lat - HOME[0]) * EARTH, (lon - HOME[1]) * EARTH * math.cos(math.radians(HOME[0]))

    # what it is told

    def hear(self, message):
        name = message.get_type()
        if getattr(message, "target_system", self.options.system) != self.options.system:
            return
        if name in ("COMMAND_LONG", "COMMAND_INT"):
            result = self.obey(message, name == "COMMAND_INT")
            self.link.command_ack_send(
                message.command, result, 0, 0, message.get_srcSystem(), message.get_srcComponent()
            )
        elif name == "REQUEST_DATA_STREAM" and self.options.old:
            for number in (30, 33, 24, 1, 74, 245):
                self.streams[number] = 1.0 / max(1, message.req_message_rate)
        elif name == "TIMESYNC" and message.tc1 == 0:
            self.link.timesync_send(int(self.now * 1e9), message.ts1)
        elif name == "SET_POSITION_TARGET_GLOBAL_INT" and self.is_led(message):
            self.circle = None
            self.target = (*self.local(message.lat_int / 1e7, message.lon_int / 1e7), message.alt)

    def is_led(self, target):
        kind = target.type_mask, target.coordinate_frame
        guided = self.mode == self.modes["guided"] and not self.px4
        return guided and kind == (POSITION_ONLY, 6) and self.can_move()

    def can_move(self):
        return self.armed and (self.kind not in FLYING or self.flying)

    def obey(self, m, whole):
        if m.command == 511:
            if self.options.old:
                return UNSUPPORTED
            self.streams[int(m.param1)] = m.param2 / 1e6 if m.param2 > 0 else 0.0
            return ACCEPTED
        if m.command == 512:
            return ACCEPTED
        if m.command == 176:
            wanted = int(m.param2) << 16 | int(m.param3) << 24 if self.px4 else int(m.param2)
            return self.switch(wanted) if wanted in self.modes.values() else DENIED
        if m.command == 400:
            return self.arm(bool(m.param1))
        if m.command == 178:
            self.cruise = m.param2
            return ACCEPTED
        if m.command == 22:
            return self.take_off(m.param7)
        if m.command == 192 and whole and m.frame == 0 and self.can_move():
            self.cruise = m.param1
            north, east = self.local(m.x / 1e7, m.y / 1e7)
            self.target, self.circle = (north, east, m.z - HOME[2]), None
            if self.kind == "plane":
                self.circle = (north, east, m.z - HOME[2], abs(m.param3) or 60.0, -1 if m.param4 == 1 else 1)
            return ACCEPTED
        if m.command == 34 and self.px4 and whole and self.can_move():
            side = 1 if m.param1 > 0 else -1
            self.circle = (*self.local(m.x / 1e7, m.y / 1e7), m.z - HOME[2], abs(m.param1), side)
            self.cruise, self.mode = m.param2, self.modes["orbit"]
            return ACCEPTED
        return UNSUPPORTED

    def switch(self, mode):
        if mode != self.mode:
            self.mode, self.target, self.circle = mode, None, None
            if self.can_move() and mode == self.modes["hold"]:
                self.target = tuple(self.at)
        return ACCEPTED

    def arm(self, wanted):
        if wanted and self.options.unready:
            self.link.statustext_send(2, b"PreArm: compass not calibrated")
            return DENIED
        if not wanted and self.flying:
            return DENIED
        if wanted and not self.armed:
            self.armed_at = self.now
        self.armed = wanted
        return ACCEPTED

    def take_off(self, height):
        if not self.armed or self.flying or (not self.px4 and self.mode != self.modes["guided"]):
            return DENIED
        up = height - HOME[2] if self.px4 else height
        self.target = (self.at[0], self.at[1], up)
        if self.px4:
            self.mode = self.modes["takeoff"]
        self.at[2] = 0.11
        return ACCEPTED

    # how it moves

    def move(self, dt):
        wanted = (0.0, 0.0, 0.0)
        if self.armed and self.mode == self.modes.get("land"):
            wanted = (0.0, 0.0, -1.0)
        elif self.armed and self.mode == self.modes["return"]:
            away = math.hypot(*self.at[:2])
            wanted = self.towards((0.0, 0.0, self.at[2])) if away > 0.5 else (0.0, 0.0, -1.0)
        elif self.armed and self.kind == "plane" and self.mode == self.modes["takeoff"]:
            wanted = (math.cos(self.heading) * 15.0, math.sin(self.heading) * 15.0, 3.0)
            self.at[2] = max(self.at[2], 0.11)
        elif self.armed and self.circle is not None:
            wanted = self.around(*self.circle)
        elif self.armed and self.target is not None:
            wanted = self.towards(self.target)
            if self.mode == self.modes.get("takeoff") and self.px4 and abs(self.target[2] - self.at[2]) < 0.3:
                self.mode = self.modes["hold"]
        for axis in range(3):
            change = wanted[axis] - self.velocity[axis]
            self.velocity[axis] += max(-3.0 * dt, min(3.0 * dt, change))
            self.at[axis] += self.velocity[axis] * dt
        if self.kind in FLYING and self.at[2] <= 0.1:
            self.at[2], self.velocity = 0.0, [0.0, 0.0, 0.0]
            if self.now - max(self.armed_at, self.landed_since) > 10.0 or self.down():
                self.armed = False
        else:
            self.landed_since = self.now
        if self.kind in ("rover", "boat"):
            self.at[2] = 0.0
        if math.hypot(*self.velocity[:2]) > 0.3:
            self.heading = math.atan2(self.velocity[1], self.velocity[0])

    def down(self):
        return self.mode in (self.modes.get("land"), self.modes["return"]) and self.now - self.landed_since > 1.0

    def towards(self, target):
        gap = [b - a for a, b in zip(self.at, target, strict=True)]
        away = math.hypot(gap[0], gap[1])
        speed = min(self.cruise, math.sqrt(2.0 * away) if away > 0.01 else 0.0, away)
        level = [g * speed / away if away > 0.01 else 0.0 for g in gap[:2]]
        return (*level, max(-1.5, min(2.5, gap[2])))

    def around(self, north, east, up, radius, side):
        x, y = self.at[0] - north, self.at[1] - east
        angle, away = math.atan2(y, x), math.hypot(x, y)
        course = angle + side * (math.pi / 2 + max(-1.2, min(1.2, (away - radius) / radius * 2.0)))
        speed = 15.0 if self.kind == "plane" else self.cruise
        return speed * math.cos(course), speed * math.sin(course), max(-1.5, min(2.5, up - self.at[2]))

    # what it tells

    def tell(self):
        if self.now >= self.beat_due:
            self.beat_due = self.now + 1.0
            autopilot = 12 if self.px4 else 3
            self.link.heartbeat_send(TYPES[self.kind], autopilot, 1 | (128 if self.armed else 0), self.mode, 4)
        for number, period in self.streams.items():
            if period and self.now >= self.due.get(number, 0.0):
                self.due[number] = max(self.now, self.due.get(number, 0.0) + period)
                teller = getattr(self, f"tell_{number}", None)
                if teller is not None and number not in self.quiet:
                    teller(round(self.now * 1000.0))

    def tell_30(self, ms):
        self.link.attitude_send(ms, 0.0, 0.0, self.heading, 0.0, 0.0, 0.0)

    def tell_33(self, ms):
        lat, lon, alt = self.position()
        v = [round(100.0 * value) for value in self.velocity]
        degrees = [round(1e7 * value) for value in (lat, lon)]
        self.link.global_position_int_send(
            ms, *degrees, round(1e3 * alt), round(1e3 * self.at[2]), v[0], v[1], -v[2], 0xFFFF
        )

    def tell_24(self, ms):
        lat, lon, alt = self.position()
        self.link.gps_raw_int_send(ms * 1000, 3, round(1e7 * lat), round(1e7 * lon), round(1e3 * alt), 90, 90, 0, 0, 12)

    def tell_1(self, ms):
        bits = 0x0200002F
        self.link.sys_status_send(bits, bits, bits, 100, 15200, 1000, 80, 0, 0, 0, 0, 0, 0)

    def tell_245(self, ms):
        self.link.extended_sys_state_send(0, 2 if self.flying else 1)

    def tell_74(self, ms):
        speed = math.hypot(*self.velocity[:2])
        self.link.vfr_hud_send(speed, speed, 0, 40, self.at[2], self.velocity[2])

    # a test's hand

    def handle(self, line):
        word, _, rest = line.strip().partition(" ")
        if word == "mode":
            self.switch(int(rest))
        elif word == "disarm":
            self.armed = False
        elif word == "quiet":
            self.quiet.add(int(rest))
        elif word == "nan":
            self.link.attitude_send(round(self.now * 1e3), math.nan, 0.0, math.inf, 0.0, 0.0, 0.0)
        elif word == "garbage":
            for size in range(1, 200, 7):
                self.wire.write(bytes((0xFD, size & 0xFF)) + os.urandom(size))

    def run(self):
        stdin = sys.stdin.fileno()
        before = 0.0
        while True:
            for message in self.link.parse_buffer(self.wire.read()) or ():
                if message.get_type() != "BAD_DATA":
                    self.hear(message)
            if select.select([stdin], [], [], 0.0)[0]:
                line = os.read(stdin, 4096)
                if not line:
                    return
                for word in line.decode().splitlines():
                    self.handle(word)
            self.now = (time.monotonic() - self.began) * self.options.speed
            while before + STEP <= self.now:
                before += STEP
                self.move(STEP)
            self.tell()
            time.sleep(0.004)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("port", type=int)
    parser.add_argument("--kind", default="copter", choices=sorted(MODES))
    parser.add_argument("--system", type=int, default=7)
    parser.add_argument("--speed", type=float, default=1.0)
    parser.add_argument("--north", type=float, default=0.0)
    parser.add_argument("--old", action="store_true", help="knows no SET_MESSAGE_INTERVAL")
    parser.add_argument("--unready", action="store_true", help="refuses to arm")
    StandIn(parser.parse_args()).run()
