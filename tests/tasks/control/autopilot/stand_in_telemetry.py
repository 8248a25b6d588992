"""What the stand-in tells, message by message."""

import math

GEOID = 54_600  # mm
GPS, AHRS = 0x20, 0x200000
TYPES = {"copter": 2, "rover": 10, "boat": 11, "submarine": 12, "plane": 1}


class Telemetry:
    """Sends HEARTBEAT each second, and each message that was asked for."""

    def tell(self):
        if self.store.expected is not None and self.now - self.store.asked_at > 1.0:
            self.store.ask()
        if self.now >= self.beat_due:
            self.beat_due = self.now + 1.0
            beat = TYPES[self.motion.kind], 12 if self.px4 else 3, 1 | (128 if self.armed else 0), self.mode, 4
            self.link.heartbeat_send(*beat)
        for number, period in self.streams.items():
            if period and self.now >= self.due.get(number, 0.0):
                self.due[number] = max(self.now, self.due.get(number, 0.0) + period)
                teller = getattr(self, f"tell_{number}", None)
                if teller is not None and number not in self.quiet:
                    teller(self.ms)

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
        wind = self.options.wind  # towards the north
        self.link.wind_send(180.0 if wind > 0.0 else 0.0, abs(wind), 0.0)

    def tell_231(self, ms):
        self.link.wind_cov_send(ms * 1000, self.options.wind, 0, 0, 0, 0, 0, 0, 0)

    def tell_245(self, ms):
        self.link.extended_sys_state_send(0, 2 if self.flying else 1)

    def tell_74(self, ms):
        speed = math.hypot(*self.motion.velocity[:2])
        self.link.vfr_hud_send(speed, speed, 0, 40, self.motion.at[2], self.motion.velocity[2])
