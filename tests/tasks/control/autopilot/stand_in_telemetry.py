"""What the stand-in tells, message by message."""

import math

GEOID = 54_600  # mm
GPS, AHRS = 0x20, 0x200000
BASE_MODES = {  # base_mode in modes of a pilot, in those of the autopilot, and which these are
    "copter": (0x50, 0x58, (3, 4, 5, 6, 7, 16, 17)),
    "submarine": (0x50, 0x58, (3, 4, 7, 16)),
    "rover": (0x40, 0x08, (5, 10, 11, 15)),
    "boat": (0x40, 0x08, (5, 10, 11, 15)),
}
STANDBY, ACTIVE, HOLD = 3, 4, 4
TYPES = {"copter": 2, "rover": 10, "boat": 11, "submarine": 12, "plane": 1}


class Telemetry:
    """Sends HEARTBEAT each second, and each message that was asked for."""

    def tell(self):
        if self.store.expected is not None and self.now - self.store.asked_at > 1.0:
            self.store.ask()
        if self.now >= self.beat_due:
            self.beat_due = self.now + 1.0
            self.tell_heartbeat()
        for number, period in self.streams.items():
            if period and self.now >= self.due.get(number, 0.0):
                self.due[number] = max(self.now, self.due.get(number, 0.0) + period)
                teller = getattr(self, f"tell_{number}", None)
                if teller is not None and number not in self.quiet:
                    teller(self.ms)

    def tell_heartbeat(self):
        kind = self.motion.kind
        mode = 1 | (128 if self.armed else 0)
        status = STANDBY if not self.armed else ACTIVE
        if not self.px4 and kind in BASE_MODES:
            base, guided, itself = BASE_MODES[kind]
            mode |= guided if self.mode in itself else 0 if kind == "rover" and self.mode == HOLD else base
        if not self.px4 and kind == "copter" and not self.has_flown:
            status = STANDBY
        if not self.px4 and kind in ("rover", "boat"):
            status = STANDBY if self.mode == HOLD else ACTIVE
        self.link.heartbeat_send(TYPES[kind], 12 if self.px4 else 3, mode, self.mode, status)

    def tell_version(self):
        software = 0 if self.px4 else 0x040505FF
        self.link.autopilot_version_send(64495, software, 0, 0, 0, bytes(8), bytes(8), bytes(8), 0, 0, 1)

    def tell_arming(self):
        """What ArduPilot says by itself when it is armed."""
        if self.px4:
            return
        if self.motion.kind in ("copter", "submarine"):
            lat, lon, alt = self.position()
            place = round(1e7 * lat), round(1e7 * lon), round(1e3 * alt)
            self.link.gps_global_origin_send(*place)
            self.link.home_position_send(*place, 0, 0, 0, [math.nan] * 4, 0, 0, 0)
        text = b"Throttle armed" if self.motion.kind in ("rover", "boat") else b"Arming motors"
        self.link.statustext_send(6, text)

    def tell_2(self, ms):
        self.link.system_time_send(1_700_000_000_000_000 + ms * 1000, ms)

    def tell_27(self, ms):
        if not self.px4:
            self.link.raw_imu_send(ms * 1000, 0, 0, -1001, 0, 0, 0, 254, -6, 371)

    def tell_29(self, ms):
        self.link.scaled_pressure_send(ms, 1013.2, 0.0, 3500)

    def tell_137(self, ms):
        deep = 98.06 * max(0.0, -self.motion.at[2]) if self.motion.kind == "submarine" else 0.0
        self.link.scaled_pressure2_send(ms, 1013.2 + deep, 0.0, 3500)

    def tell_147(self, ms):
        cells = [12600] + [65535] * 9
        self.link.battery_status_send(0, 0, 0, 32767, cells, 0, 0, 0, max(0, round(self.battery)))

    def tell_87(self, ms):
        """The target, while there is one; ArduSub 4.5 has no such message."""
        if self.px4 or self.target is None or not self.has_target or self.motion.kind in ("submarine", "plane"):
            return
        lat, lon = self.place(*self.target[:2])
        up = self.home[2] + self.target[2]
        self.link.position_target_global_int_send(ms, 0, 65016, round(lat * 1e7), round(lon * 1e7), up, *[0.0] * 8)

    def tell_132(self, ms):
        if self.motion.kind == "submarine":
            self.link.distance_sensor_send(ms, 50, 5000, round(100 * max(0.5, 20 + self.motion.at[2])), 0, 0, 25, 0)

    def tell_30(self, ms):
        motion = self.motion
        angles = [motion.noisy(angle, 0.1) for angle in (motion.roll, motion.pitch, motion.heading)]
        self.link.attitude_send(ms, *angles, *(motion.noisy(0.0, 0.1) for _ in range(3)))

    def tell_33(self, ms):
        lat, lon, alt = self.position()
        v = [round(100.0 * self.motion.noisy(value)) for value in self.motion.velocity]
        degrees = [round(1e7 * value) if self.knows_position else 0 for value in (lat, lon)]
        up = self.motion.noisy(self.motion.at[2])
        self.link.global_position_int_send(
            ms, *degrees, round(1e3 * (alt - self.motion.at[2] + up)), round(1e3 * up), v[0], v[1], -v[2], 0xFFFF
        )

    def tell_24(self, ms):
        lat, lon, alt = self.position()
        place = (round(1e7 * lat), round(1e7 * lon), round(1e3 * alt)) if self.knows_position else (0, 0, 0)
        fix = 3 if self.knows_position else 1
        self.link.gps_raw_int_send(
            ms * 1000, fix, *place, 90, 90, 0, 0, 12, alt_ellipsoid=0 if self.options.old else place[2] + GEOID
        )

    def tell_1(self, ms):
        bits, health = 0x0200002F | AHRS, 0x0200002F | AHRS
        if not self.knows_position:
            health &= ~(GPS | AHRS)
        self.link.sys_status_send(bits, bits, health, 100, 15200, 1000, max(0, round(self.battery)), 0, 0, 0, 0, 0, 0)

    def tell_42(self, ms):
        self.store.tell()

    def tell_105(self, ms):
        if self.px4:
            self.link.highres_imu_send(ms * 1000, 0.0, 0.0, -9.81, 0, 0, 0, 0.2, 0, 0.4, 1000, 0, 0, 20, 0x1FFF)

    def tell_168(self, ms):
        wind = self.options.wind  # toward the north
        self.link.wind_send(180.0 if wind > 0.0 else 0.0, abs(wind), 0.0)

    def tell_231(self, ms):
        self.link.wind_cov_send(ms * 1000, self.options.wind, 0, 0, 0, 0, 0, 0, 0)

    def tell_245(self, ms):
        self.link.extended_sys_state_send(0, 2 if self.flying else 1)

    def tell_74(self, ms):
        speed = math.hypot(*self.motion.velocity[:2])
        self.link.vfr_hud_send(speed, speed, 0, 40, self.motion.at[2], self.motion.velocity[2])
