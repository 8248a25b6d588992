"""A stand-in for an autopilot: modes, arming, refusals and motion of ArduPilot or PX4, as far as Shoal uses them.

It speaks MAVLink by pymavlink, with time running `--speed` times faster. Its numbers and refusals are those that the
two document; it has no estimator, no compass and no servos. Lines on stdin
are the hand of a test: see `stand_in_hand`.
"""

import hashlib
import math
import os
import select
import sys
import time
from pathlib import Path

os.environ["MAVLINK20"] = "1"
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from pymavlink.generator.mavcrc import x25crc

from tests.tasks.control.autopilot.stand_in_hand import handle, parse_options
from tests.tasks.control.autopilot.stand_in_memory import Store
from tests.tasks.control.autopilot.stand_in_motion import EARTH, SLOWEST_FLIGHT, Motion
from tests.tasks.control.autopilot.stand_in_telemetry import Telemetry
from tests.tasks.control.autopilot.stand_in_wires import Wire

STEP = 0.02  # s
HOME = 41.185, -8.7062, 30.0
BOOT = 2.0  # s until its position is good
ROVER = {"guided": 15, "return": 11, "mission": 10, "start": 0}
MODES = {
    "copter": {"guided": 4, "hold": 17, "return": 6, "land": 9, "mission": 3, "start": 0},
    "rover": {**ROVER, "hold": 4},
    "boat": {**ROVER, "hold": 5, "drift": 4},
    "submarine": {"guided": 4, "hold": 16, "return": 9, "mission": 3, "start": 19, "depth": 2},
    "plane": {"guided": 15, "hold": 12, "return": 11, "takeoff": 13, "mission": 10, "start": 0},
}
PX4 = {"guided": 4 << 16 | 3 << 24, "hold": 4 << 16 | 3 << 24, "return": 4 << 16 | 5 << 24,
       "land": 4 << 16 | 6 << 24, "takeoff": 4 << 16 | 2 << 24, "orbit": 3 << 16 | 1 << 24,
       "mission": 4 << 16 | 4 << 24, "offboard": 6 << 16, "start": 4 << 16 | 3 << 24}  # fmt: skip
NEED_POSITION = ("guided", "hold", "return", "mission", "offboard", "orbit")
ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED, INT_ONLY = 0, 1, 2, 3, 4, 8
POSITION_ONLY = 0x0DF8
LEAST_STREAM = 3  # setpoints before offboard


class StandIn(Telemetry):
    def __init__(self, options):
        self.options, self.px4 = options, options.kind.startswith("px4")
        kind = "copter" if options.kind == "px4" else options.kind.removeprefix("px4-")
        self.modes = PX4 if self.px4 else MODES[kind]
        self.motion = Motion(kind, options.north, (options.wind, 0.0))
        self.wire, self.store = Wire(options), Store(self)
        self.link = mavlink.MAVLink(self.wire, srcSystem=options.system, srcComponent=1)
        self.link.robust_parsing = True
        if options.key:
            signing = self.link.signing
            signing.secret_key, signing.sign_outgoing = hashlib.sha256(options.key.encode()).digest(), True
            signing.timestamp = int((time.time() - 1420070400) * 1e5)
            signing.allow_unsigned_callback = lambda *_: False
        self.began, self.now, self.shift = time.monotonic(), 0.0, 0.0
        self.gps, self.battery, self.refused, self.deaf, self.mumbles = True, 80.0, {}, set(), False
        self.silent_until, self.cruise, self.beat_due, self.input = 0.0, 5.0, 0.0, None
        self.diary, self.written = options.diary and Path(options.diary), 0.0
        self.boot()

    def boot(self):
        """Begin anew: disarmed, without streams; its clock counts from 0."""
        self.booted, self.shift = self.now, 0.0
        self.mode, self.armed, self.armed_at, self.landed_since = self.modes["start"], False, 0.0, self.now
        self.target = self.circle = None
        self.setpoint_at, self.setpoints = -math.inf, 0
        self.streams, self.due, self.quiet = {}, {}, set()

    @property
    def ms(self):
        return round((self.now - self.booted + self.shift) * 1000.0)

    @property
    def knows_position(self):
        return self.gps and self.now - self.booted > BOOT

    @property
    def flying(self):
        return self.motion.flying

    def position(self):
        at = self.motion.at
        lat = HOME[0] + at[0] / EARTH
        return lat, HOME[1] + at[1] / EARTH / math.cos(math.radians(HOME[0])), HOME[2] + at[2]

    def local(self, lat, lon):
        return (lat - HOME[0]) * EARTH, (lon - HOME[1]) * EARTH * math.cos(math.radians(HOME[0]))

    def flight_speed(self):
        return max(SLOWEST_FLIGHT, self.cruise)

    def say(self, text):
        self.link.statustext_send(2, text.encode()[:50])

    def send_raw(self, number, extra, payload):
        """A message as newer autopilots send it, with fields that the dialect lacks."""
        head = bytes((len(payload), 0, 0, self.link.seq, self.options.system, 1)) + number.to_bytes(3, "little")
        self.link.seq = (self.link.seq + 1) % 256
        crc = x25crc(head + payload)
        crc.accumulate(bytes((extra,)))
        self.wire.write(b"\xfd" + head + payload + crc.crc.to_bytes(2, "little"))

    # what it is told

    def hear(self, message):
        name = message.get_type()
        if getattr(message, "target_system", self.options.system) not in (self.options.system, 0):
            return
        if name in ("COMMAND_LONG", "COMMAND_INT"):
            self.command(message, name == "COMMAND_INT")
        elif name.startswith("MISSION_"):
            self.store.hear(message, name)
        elif name == "REQUEST_DATA_STREAM" and self.options.old:
            for number in (30, 33, 24, 1, 74, 245, 42):
                self.streams[number] = 1.0 / max(1, message.req_message_rate)
        elif name == "TIMESYNC" and message.tc1 == 0:
            self.link.timesync_send(self.ms * 1_000_000, message.ts1)
        elif name == "SET_POSITION_TARGET_GLOBAL_INT" and message.coordinate_frame == 6:
            self.aim(message)
        elif name == "GPS_INPUT":
            self.input = message
            self.link.statustext_send(6, f"GPS {message.lat} {message.lon} {message.fix_type}".encode())

    def aim(self, message):
        self.setpoints = self.setpoints + 1 if self.now - self.setpoint_at < self.options.of_loss else 1
        self.setpoint_at = self.now
        led = self.mode == self.modes["offboard" if self.px4 else "guided"] and self.motion.kind != "plane"
        if led and message.type_mask == POSITION_ONLY and self.can_move():
            self.circle = None
            self.target = (*self.local(message.lat_int / 1e7, message.lon_int / 1e7), message.alt)

    def can_move(self):
        return self.armed and self.knows_position and (not self.motion.flies or self.flying)

    def command(self, m, whole):
        if m.command in self.deaf:
            return
        result = self.refused.get(m.command)
        result = self.obey(m, whole) if result is None else result
        to = (0, 0) if self.options.old else (m.get_srcSystem(), m.get_srcComponent())
        if self.mumbles:  # the answer to somebody else's command, and one to our own for another program
            self.link.command_ack_send(m.command + 1, DENIED, 0, 0, *to)
            self.link.command_ack_send(m.command, DENIED, 0, 0, 255, 190)
        self.link.command_ack_send(m.command, result, 0, 0, *to)

    def obey(self, m, whole):
        if m.command == 511:
            if self.options.old:
                return UNSUPPORTED
            self.streams[int(m.param1)] = m.param2 / 1e6 if m.param2 > 0 else 0.0
            return ACCEPTED
        if m.command == 512:
            return ACCEPTED
        if m.command == 176:
            return self.ask_mode(int(m.param2) << 16 | int(m.param3) << 24 if self.px4 else int(m.param2))
        if m.command == 400:
            return self.arm(bool(m.param1), forced=m.param2 == 21196)
        if m.command == 178:
            low = SLOWEST_FLIGHT if self.motion.kind == "plane" else 0.1
            if not low <= m.param2 <= 30.0:
                return FAILED
            self.cruise = m.param2
            return ACCEPTED
        if m.command == 22:
            return self.take_off(m)
        if m.command == 300:
            if self.mode != self.modes["mission"] or not self.armed:
                return FAILED
            self.store.started = True
            return ACCEPTED
        if m.command in (192, 34) and not whole:
            return INT_ONLY
        if m.command == 192:
            return self.reposition(m)
        if m.command == 34 and self.px4 and self.motion.kind == "copter" and self.can_move():
            side = 1 if m.param1 > 0 else -1
            self.circle = (*self.local(m.x / 1e7, m.y / 1e7), m.z - HOME[2], abs(m.param1), side)
            self.cruise, self.mode = m.param2, self.modes["orbit"]
            return ACCEPTED
        return UNSUPPORTED

    def reposition(self, m):
        if m.frame != 0 or not self.can_move():
            return DENIED
        if not self.px4 and not int(m.param2) & 1 and self.mode != self.modes["guided"]:
            return FAILED
        self.mode = self.modes["guided"]
        if self.px4 and m.param1 > 0:  # ArduPlane ignores the speed here
            self.cruise = m.param1
        north, east = self.local(m.x / 1e7, m.y / 1e7)
        self.target, self.circle = (north, east, m.z - HOME[2]), None
        if self.motion.kind == "plane":
            turns_left = m.param3 < 0 if self.px4 else m.param4 == 1
            radius = abs(m.param3) if self.px4 else max(0.0, m.param3)
            self.circle = (north, east, m.z - HOME[2], radius or 60.0, -1 if turns_left else 1)
        return ACCEPTED

    def ask_mode(self, mode):
        name = next((name for name, number in self.modes.items() if number == mode), None)
        if name is None:
            return DENIED
        if name in NEED_POSITION and not self.knows_position and (name != "hold" or self.motion.kind != "rover"):
            self.say("Mode change failed: requires position")
            return FAILED
        if name == "mission" and len(self.store.items) < 2:
            self.say("Mode change failed: no mission")
            return FAILED
        if name == "offboard" and self.setpoints < LEAST_STREAM:
            self.say("Offboard: no setpoints")
            return REJECTED
        if name == "mission" and mode != self.mode:
            self.store.started = self.flying
        self.switch(mode)
        return ACCEPTED

    def switch(self, mode):
        if mode != self.mode:
            self.mode, self.target, self.circle = mode, None, None
            if self.can_move() and mode == self.modes["hold"]:
                self.stay()

    def stay(self):
        at = tuple(self.motion.at)
        self.target, self.circle = at, (*at, 60.0, 1) if self.motion.kind == "plane" else None

    def arm(self, wanted, forced=False):
        if wanted and not self.armed:
            if self.options.unready or not self.knows_position:
                self.say("PreArm: compass not calibrated" if self.options.unready else "PreArm: GPS 1: Bad fix")
                return REJECTED if self.px4 else FAILED
            if not self.px4 and self.motion.kind == "copter" and self.mode != self.modes["guided"] and self.mode > 2:
                self.say("Arm: mode not armable")
                return FAILED
            self.armed_at = self.now
        if not wanted and self.flying and not forced:
            return FAILED
        self.armed = wanted
        return ACCEPTED

    def take_off(self, m):
        if not self.armed or self.flying or not self.knows_position:
            return FAILED
        if not self.px4 and (self.mode != self.modes["guided"] or self.motion.kind != "copter"):
            return FAILED
        up = m.param7 - HOME[2] if self.px4 else m.param7
        if up <= 0.0:
            return DENIED
        self.target = (*self.motion.at[:2], up)
        if self.px4:
            self.mode = self.modes["takeoff"]
        self.motion.at[2] = 0.11
        return ACCEPTED

    # how it moves

    def move(self, dt):
        motion, mode, modes = self.motion, self.mode, self.modes
        if self.mode == modes.get("offboard") and self.now - self.setpoint_at > self.options.of_loss:
            self.say("Failsafe: offboard signal lost, hold")
            self.switch(modes["hold"])
        if motion.flying or not self.armed:
            self.landed_since = self.now if motion.flying else self.landed_since
        powered = self.armed and (self.flying or not motion.flies or mode in (modes["mission"], modes.get("takeoff")))
        wanted = self.wanted() if powered else (0.0, 0.0, 0.0)
        rolls = motion.flies and not motion.flying
        if wanted is None or mode == modes.get("drift"):
            powered, wanted = False, (0.0, 0.0, 0.0)
        motion.step(dt, wanted, powered=powered, rolls=rolls)
        if motion.flies and not motion.flying and self.armed:
            idle = self.now - max(self.armed_at, self.landed_since)
            waits = mode == modes["mission"] and not (self.store.started or motion.kind == "plane")
            if idle > (1.0 if mode in (modes.get("land"), modes["return"]) else 10.0) and not waits:
                self.armed = False
        self.battery -= dt / 120.0

    def wanted(self):
        motion, mode, modes = self.motion, self.mode, self.modes
        if mode == modes["mission"]:
            return self.store.wanted()
        if mode == modes.get("land"):
            return (0.0, 0.0, -1.0)
        if mode == modes["return"]:
            if motion.kind == "submarine":
                return (0.0, 0.0, 0.5)  # ArduSub's 9 is SURFACE
            if motion.kind == "plane":
                return motion.around(0.0, 0.0, 50.0, 60.0, 1, self.flight_speed())
            away = math.hypot(*motion.at[:2])
            return motion.towards((0.0, 0.0, motion.at[2]), self.cruise) if away > 0.5 else (0.0, 0.0, -1.0)
        if motion.kind == "plane" and not self.px4 and mode == modes["takeoff"]:
            motion.at[2] = max(motion.at[2], 0.11)
            return math.cos(motion.heading) * 15.0, math.sin(motion.heading) * 15.0, 2.5
        if self.circle is not None:
            speed = self.flight_speed() if motion.kind == "plane" else self.cruise
            return motion.around(*self.circle, speed)
        if self.target is None:
            return motion.velocity if motion.kind == "plane" else (0.0, 0.0, 0.0)
        if mode == modes.get("takeoff") and abs(self.target[2] - motion.at[2]) < 0.5:
            self.mode = modes["hold"]  # at the height of the takeoff
        return motion.towards(self.target, self.flight_speed() if motion.kind == "plane" else self.cruise)

    def touched_down(self):
        if self.motion.airspeed < 0.5:
            self.armed = False

    def mission_is_over(self):
        """A plane returns; rovers, boats and submarines hold; copters stay in the mode."""
        if not self.px4 and self.motion.kind != "copter":
            self.switch(self.modes["return" if self.motion.kind == "plane" else "hold"])
        elif self.motion.kind == "plane":
            self.switch(self.modes["hold"])

    def run(self):
        stdin = sys.stdin.fileno()
        before = 0.0
        while True:
            heard = self.link.parse_buffer(self.wire.read()) or ()
            for message in heard if self.now >= self.silent_until else ():
                if message.get_type() != "BAD_DATA":
                    self.hear(message)
            if select.select([stdin], [], [], 0.0)[0]:
                line = os.read(stdin, 4096)
                if not line:
                    return
                for words in line.decode().splitlines():
                    handle(self, words)
            self.now = (time.monotonic() - self.began) * self.options.speed
            while before + STEP <= self.now:
                before += STEP
                self.move(STEP)
            if self.now >= self.silent_until:
                self.tell()
            if self.diary and self.now >= self.written + 1.0:
                self.written = self.now
                with self.diary.open("a") as diary:
                    print(self.mode, int(self.armed), *self.motion.at, file=diary)
            time.sleep(0.004)


if __name__ == "__main__":
    StandIn(parse_options()).run()
