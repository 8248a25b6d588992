"""The commands that the stand-in takes. What each answer follows is in `stand_in_sources.md`."""

from tests.tasks.control.autopilot.stand_in_motion import CLIMB, SLOWEST_FLIGHT

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED, INT_ONLY = 0, 1, 2, 3, 4, 8
NEED_POSITION = ("guided", "hold", "return", "mission", "offboard", "orbit")
LEAST_STREAM = 3  # setpoints before offboard
USUAL_SPEED = {"copter": 10.0, "rover": 5.0, "boat": 5.0, "submarine": 1.0, "plane": 15.0}  # m/s, of a mode it enters
WIND, VERSION = 168, 148
CLIMB_SPEED = 2  # SPEED_TYPE

COMMANDS = {
    511: "set_interval", 512: "request_message", 176: "set_mode", 400: "set_arming", 178: "change_speed",
    22: "take_off", 300: "start_mission", 192: "reposition", 34: "orbit",
}  # fmt: skip


class Commands:
    """Answers of ArduPilot or PX4 to commands; the host has the state."""

    def command(self, m, whole):
        if m.command in self.deaf:
            return
        result = self.refused.get(m.command)
        result = self.obey(m, whole) if result is None else result
        if m.command in self.unheard:
            self.unheard.discard(m.command)
            return
        to = (0, 0) if self.options.old else (m.get_srcSystem(), m.get_srcComponent())
        if self.mumbles:  # the answer to somebody else's command, and one to our own for another program
            self.link.command_ack_send(m.command + 1, DENIED, 0, 0, *to)
            self.link.command_ack_send(m.command, DENIED, 0, 0, 255, 190)
        self.link.command_ack_send(m.command, result, 0, 0, *to)
        while self.afterward:
            self.afterward.pop(0)()

    def obey(self, m, whole):
        if m.command in (192, 34) and not whole:
            return INT_ONLY
        name = COMMANDS.get(m.command)
        return UNSUPPORTED if name is None else getattr(self, name)(m)

    def set_interval(self, m):
        if self.options.old:
            return UNSUPPORTED
        if m.param1 == WIND and self.motion.kind == "submarine" and not self.px4:
            raise SystemExit("PANIC: Sending unknown ap_message")
        self.streams[int(m.param1)] = m.param2 / 1e6 if m.param2 > 0 else 0.0
        return ACCEPTED

    def request_message(self, m):
        if m.param1 == VERSION:
            self.afterward.append(self.tell_version)
        return ACCEPTED

    def set_mode(self, m):
        return self.ask_mode(int(m.param2) << 16 | int(m.param3) << 24 if self.px4 else int(m.param2))

    def set_arming(self, m):
        return self.arm(bool(m.param1), forced=m.param2 == 21196)

    def change_speed(self, m):
        low = SLOWEST_FLIGHT if self.motion.kind == "plane" else 0.1
        if not low <= m.param2 <= 30.0:
            return FAILED
        lacks_target = self.mode == self.modes["guided"] and not self.has_target
        if lacks_target and not self.px4 and self.motion.kind in ("rover", "boat"):
            return FAILED
        if "speed" in self.ignored:
            return ACCEPTED
        if m.param1 == CLIMB_SPEED and not self.px4:
            self.motion.climb = m.param2
        else:
            self.cruise = m.param2
        return ACCEPTED

    def start_mission(self, _):
        if self.mode != self.modes["mission"] or not self.armed:
            return FAILED
        self.store.started = True
        return ACCEPTED

    def orbit(self, m):
        if not (self.px4 and self.motion.kind == "copter" and self.can_move()):
            return UNSUPPORTED
        side = 1 if m.param1 > 0 else -1
        self.circle = (*self.local(m.x / 1e7, m.y / 1e7), m.z - self.home[2], abs(m.param1), side)
        self.cruise, self.mode = m.param2, self.modes["orbit"]
        return ACCEPTED

    def reposition(self, m):
        if m.frame != 0 or not self.can_move():
            return DENIED
        if not self.px4 and not int(m.param2) & 1 and self.mode != self.modes["guided"]:
            return FAILED
        self.mode = self.modes["guided"]
        if self.px4 and m.param1 > 0 and "speed" not in self.ignored:  # ArduPlane ignores the speed here
            self.cruise = m.param1
        north, east = self.local(m.x / 1e7, m.y / 1e7)
        self.target, self.circle = (north, east, m.z - self.home[2]), None
        if self.motion.kind == "plane":
            turns_left = m.param3 < 0 if self.px4 else m.param4 == 1
            radius = abs(m.param3) if self.px4 else max(0.0, m.param3)
            self.circle = (north, east, m.z - self.home[2], radius or 60.0, -1 if turns_left else 1)
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
        self.afterward.append(self.tell_heartbeat)
        return ACCEPTED

    def switch(self, mode):
        if mode != self.mode:
            self.mode, self.target, self.circle, self.has_target = mode, None, None, False
            if not self.px4 and self.motion.kind in ("copter", "rover", "boat"):
                self.cruise = USUAL_SPEED[self.motion.kind]
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
            self.armed_at, self.has_flown = self.now, False
            self.afterward.append(self.tell_arming)
        if not wanted and self.flying and not forced:
            return FAILED
        self.armed = wanted
        return ACCEPTED

    def take_off(self, m):
        if not self.armed or self.flying or not self.knows_position:
            return FAILED
        if not self.px4 and (self.mode != self.modes["guided"] or self.motion.kind != "copter"):
            return FAILED
        up = m.param7 - self.home[2] if self.px4 else m.param7
        if up <= 0.0:
            return DENIED
        self.target, self.has_target = (*self.motion.at[:2], up), False
        if self.px4:
            self.mode = self.modes["takeoff"]
        self.motion.at[2], self.has_flown = 0.11, True
        return ACCEPTED

    def aim(self, message):
        """A position target: ArduCopter's first one after a mode or a takeoff sets its own speed again."""
        self.setpoints = self.setpoints + 1 if self.now - self.setpoint_at < self.options.of_loss else 1
        self.setpoint_at = self.now
        led = self.mode == self.modes["offboard" if self.px4 else "guided"] and self.motion.kind != "plane"
        if not (led and message.type_mask == self.position_only and self.can_move()):
            return
        self.targets += 1
        if "targets" in self.ignored and self.targets <= self.ignored["targets"]:
            return
        if not self.px4 and self.motion.kind == "copter" and not self.has_target:
            self.cruise, self.motion.climb = USUAL_SPEED["copter"], CLIMB
        self.circle, self.has_target = None, True
        self.target = (*self.local(message.lat_int / 1e7, message.lon_int / 1e7), message.alt)
        if self.motion.kind == "submarine":
            self.motion.planned = 0.0  # its path begins anew, from a standstill
