"""A stand-in for an autopilot: modes, arming, refusals and motion of ArduPilot or PX4, as far as Shoal uses them.

It speaks MAVLink by pymavlink, in the time that `go_on` is given. `stand_in_sources.md` names for each of its answers
the recording or the public source that it follows; it has no estimator, no compass and no servos. `stand_in_hand` is
the hand of a test.
"""

import hashlib
import math
import os
from pathlib import Path

os.environ["MAVLINK20"] = "1"
from pymavlink.dialects.v20 import ardupilotmega as mavlink
from pymavlink.generator.mavcrc import x25crc

from tests.tasks.control.autopilot.stand_in_commands import USUAL_SPEED, Commands
from tests.tasks.control.autopilot.stand_in_memory import Store
from tests.tasks.control.autopilot.stand_in_motion import EARTH, SLOWEST_FLIGHT, Motion
from tests.tasks.control.autopilot.stand_in_telemetry import Telemetry
from tests.tasks.control.autopilot.stand_in_wires import Wire

STEP = 0.02  # s
EPOCH = 1_420_070_400.0  # s since 1970, from which signatures count
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
POSITION_ONLY = 0x0DF8
UNASKED = (30, 33, 1, 24, 74, 27, 2, 147, 29, 137, 42, 87)  # what Rover streams by itself, as far as it is here


class StandIn(Commands, Telemetry):
    position_only, home = POSITION_ONLY, HOME

    def __init__(self, options, wire=None, epoch=EPOCH):
        self.options, self.px4 = options, options.kind.startswith("px4")
        kind = "copter" if options.kind == "px4" else options.kind.removeprefix("px4-")
        self.modes = PX4 if self.px4 else MODES[kind]
        self.motion = Motion(kind, options.north, (options.wind, 0.0))
        self.wire, self.store = wire or Wire(options), Store(self)
        self.link = mavlink.MAVLink(self.wire, srcSystem=options.system, srcComponent=1)
        self.link.robust_parsing = True
        if options.key:
            signing = self.link.signing
            signing.secret_key, signing.sign_outgoing = hashlib.sha256(options.key.encode()).digest(), True
            signing.timestamp = int((epoch - EPOCH) * 1e5)
            signing.allow_unsigned_callback = lambda *_: False
        self.now = self.shift = 0.0
        self.gps, self.battery, self.refused, self.deaf, self.mumbles = True, 80.0, {}, set(), False
        self.unheard = set()
        self.silent_until, self.beat_due, self.input = 0.0, 0.0, None
        self.afterward, self.ignored = [], {}
        self.diary, self.written = options.diary and Path(options.diary), 0.0
        self.boot()

    def boot(self):
        """Begin anew: disarmed, without streams; its clock counts from 0."""
        self.booted, self.shift = self.now, 0.0
        self.mode, self.armed, self.armed_at, self.landed_since = self.modes["start"], False, 0.0, self.now
        self.target = self.circle = None
        self.setpoint_at, self.setpoints, self.targets = -math.inf, 0, 0
        self.has_target = self.has_flown = False
        self.cruise = USUAL_SPEED[self.motion.kind]
        rover = self.motion.kind in ("rover", "boat") and not self.px4 and not self.options.old
        self.streams = dict.fromkeys(UNASKED, 1.0) if rover else {}
        self.due, self.quiet = {}, set()

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
        return *self.place(at[0], at[1]), HOME[2] + at[2]

    def place(self, north, east):
        return HOME[0] + north / EARTH, HOME[1] + east / EARTH / math.cos(math.radians(HOME[0]))

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

    def can_move(self):
        return self.armed and self.knows_position and (not self.motion.flies or self.flying)

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
            if idle > (2.0 if mode in (modes.get("land"), modes["return"]) else 10.0) and not waits:
                self.armed = self.has_flown = False
                self.link.statustext_send(6, b"Disarming motors")
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
            return motion.toward((0.0, 0.0, motion.at[2]), self.cruise) if away > 0.5 else (0.0, 0.0, -1.0)
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
        return motion.toward(self.target, self.flight_speed() if motion.kind == "plane" else self.cruise)

    def touched_down(self):
        if self.motion.airspeed < 0.5:
            self.armed = False

    def mission_is_over(self):
        """A plane returns; rovers, boats and submarines hold; copters stay in the mode."""
        if not self.px4 and self.motion.kind != "copter":
            self.switch(self.modes["return" if self.motion.kind == "plane" else "hold"])
        elif self.motion.kind == "plane":
            self.switch(self.modes["hold"])

    def receive(self, data):
        heard = self.link.parse_buffer(data) or ()
        for message in heard if self.now >= self.silent_until else ():
            if message.get_type() != "BAD_DATA":
                self.hear(message)

    def advance(self, now):
        """Move and speak until a time (s)."""
        while self.now + STEP <= now:
            self.now += STEP
            self.move(STEP)
        if self.now >= self.silent_until:
            self.tell()

    def go_on(self, now):
        """Hear, move and speak until a time (s); each second comes into the diary."""
        self.receive(self.wire.read())
        self.advance(now)
        if self.diary and self.now >= self.written + 1.0:
            self.written = self.now
            with self.diary.open("a") as diary:
                print(self.mode, int(self.armed), *self.motion.at, file=diary)
