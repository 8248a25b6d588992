"""Simulates a GPS receiver."""

import math
from collections import deque
from datetime import UTC, datetime

import imc
from runtime import ParameterError, State, Task, consume, param, periodic
from support import wgs84
from support.rotations import cross, rotation, to_body, to_ned
from tasks.simulated_world import INVALID_TRUTH, is_valid_truth, mount_pose, position_param
from world.sensors import Drift

SLOWEST = 0.05  # m/s, least speed that has a course
OLDEST = 1.0  # s, of the last state
ALL_VALID = 0x1FF  # the nine flags of GpsFix.Validity


class GPS(Task):
    """Publishes position, speed and course over ground, with noise, while the antenna is out of the water.

    Below 0.05 m/s the course is the heading. Below `Activation Depth`, and until satellites are found, nothing is
    valid, and the dilution and accuracy grow by one per second.
    """

    execution_frequency: float = param(1.0, "Hz", "Rate of GpsFix.", minimum=0.1, maximum=100)
    activation_depth: float = param(0.2, "m", "Depth below which there is no fix.", minimum=0)
    hdop: float = param(0.9, "1", "Horizontal dilution of precision of a fix.", name="HDOP", minimum=0)
    hacc: float = param(2.0, "m", "Horizontal accuracy reported in each fix.", name="HACC", minimum=0)
    number_of_satellites: int = param(
        8, "1", "Number of satellites reported in each fix.", name="Number of Satellites", minimum=0, maximum=255
    )
    position_noise: float = param(
        0.0,
        "m",
        "Standard deviation of white noise on north and on east.",
        name="Standard Deviation - Position",
        minimum=0,
    )
    height_noise: float = param(0.0, "m", "White noise of the height.", name="Standard Deviation - Height", minimum=0)
    position_drift: float = param(
        0.0,
        "m",
        "Standard deviation of an error of north and of east that wanders (Gauss-Markov).",
        name="Standard Deviation - Position Drift",
        minimum=0,
        editable=False,
    )
    height_drift: float = param(
        0.0,
        "m",
        "Standard deviation of an error of the height that wanders.",
        name="Standard Deviation - Height Drift",
        minimum=0,
        editable=False,
    )
    drift_time: float = param(
        1100.0,
        "s",
        "Time in which the wandering errors change.",
        name="Time Constant - Drift",
        minimum=1e-3,
        editable=False,
    )
    latency: float = param(0.0, "s", "Age of a fix when it is published.", minimum=0, maximum=10)
    start_up_time: float = param(0.0, "s", "Time from the start to the first fix.", name="Start-Up Time", minimum=0)
    reacquisition_time: float = param(0.0, "s", "Time from surfacing to the next fix.", minimum=0)
    device_position: list[float] = position_param(
        "Antenna in the vehicle: forward, right, down of its origin; empty for the origin."
    )
    report_ground_velocity: bool = param(
        False, "", "Whether to publish GroundVelocity with each fix, like a dual-antenna receiver."
    )
    report_yaw: bool = param(False, "", "Whether to publish EulerAngles with the true heading with each fix.")
    initial_position: list[float] = param(
        [], "°", "Latitude and longitude published as a manual fix at the start; none if empty.", size=(0, 2)
    )

    def configure(self) -> None:
        position = self.initial_position
        if len(position) == 1 or (position and not (abs(position[0]) <= 90.0 and abs(position[1]) <= 180.0)):
            raise ParameterError("Initial Position", f"{position} is not a latitude and a longitude")
        self._antenna = mount_pose(self.device_position).position

    def start(self) -> None:
        self._truths: deque[imc.SimulatedState] = deque()
        self._fix_from = self.now + self.start_up_time
        self._drift: Drift | None = None
        if self.position_drift or self.height_drift:
            sigmas = self.position_drift, self.position_drift, self.height_drift
            self._drift = Drift(sigmas, self.drift_time, self.random.standard_normal(3).tolist())
        lat, lon = map(math.radians, self.initial_position or (0.0, 0.0))
        self._last = imc.GpsFix(lat=lat, lon=lon, hdop=self.hdop, hacc=self.hacc)
        self.set_entity_state(State.BOOT, "waiting for SimulatedState")
        if self.initial_position:
            self._publish(imc.GpsFix(type=imc.GpsFix.Type.MANUAL_INPUT, validity=ALL_VALID, lat=lat, lon=lon))

    @consume
    def update_truth(self, truth: imc.SimulatedState) -> None:
        truths, time = self._truths, truth.timestamp
        if not self.latency or (truths and time < truths[-1].timestamp):
            truths.clear()
        truths.append(truth)
        if self.latency:
            self._drop_older_than(time - self.latency)

    @periodic("execution_frequency")
    def report(self, periods: int) -> None:
        self._drop_older_than(self.now - self.latency)
        if self._truths and self.age(self._truths[-1].timestamp) > OLDEST:
            self.set_entity_state(State.FAULT, "no recent SimulatedState")
            return
        if not self._truths or (self.latency and self._truths[0].timestamp > self.now - self.latency):
            return
        if not is_valid_truth(self._truths[0]):  # most states are replaced before they are due
            self._truths.popleft()
            self.set_entity_state(State.FAULT, INVALID_TRUTH)
            return
        truth, antenna, elapsed = self._truths[0], self._antenna, periods / self.execution_frequency
        attitude = rotation(truth.phi, truth.theta, truth.psi)
        north, east, down = to_ned(attitude, antenna)
        x, y, z = truth.x + north, truth.y + east, truth.z + down
        wander = (0.0, 0.0, 0.0)
        if self._drift is not None:
            wander = self._drift.advance(elapsed, self.random.standard_normal(3).tolist())
        if z > self.activation_depth:
            self._fix_from = max(self._fix_from, self.now + self.reacquisition_time)
            self._lose("no fix under water", elapsed)
            return
        if self.now < self._fix_from:
            self._lose("waiting for satellites", elapsed)
            return
        if self.position_noise or self.height_noise:
            dx, dy, dz = self.random.standard_normal(3).tolist()
            x, y, z = x + self.position_noise * dx, y + self.position_noise * dy, z + self.height_noise * dz
        x, y, z = x + wander[0], y + wander[1], z + wander[2]
        lat, lon, height = wgs84.displace(truth.lat, truth.lon, truth.height, x, y, z)
        u, v, w = cross((truth.p, truth.q, truth.r), antenna)
        north, east, down = to_ned(attitude, (truth.u + u, truth.v + v, truth.w + w))
        north, east, down = north + truth.svx, east + truth.svy, down + truth.svz
        speed = math.hypot(north, east)
        fix = imc.GpsFix(
            validity=ALL_VALID,
            type=imc.GpsFix.Type.STANDALONE,
            lat=lat,
            lon=lon,
            height=height,
            satellites=self.number_of_satellites,
            cog=math.atan2(east, north) if speed > SLOWEST else truth.psi,
            sog=speed,
            hdop=self.hdop,
            hacc=self.hacc,
        )
        self._report(fix)
        if self.report_ground_velocity:
            velocity = to_body(attitude, (north, east, down))
            self.publish(imc.GroundVelocity(validity=0x7, x=velocity[0], y=velocity[1], z=velocity[2]))
        if self.report_yaw:
            self.publish(imc.EulerAngles(time=self.now - self.latency, psi=truth.psi, psi_magnetic=truth.psi))
        self.set_entity_state(State.NORMAL, "active")

    def _drop_older_than(self, time: float) -> None:
        """Keep the last state before a time, and what is newer."""
        truths = self._truths
        while len(truths) > 1 and truths[1].timestamp <= time:
            truths.popleft()

    def _lose(self, why: str, elapsed: float) -> None:
        hdop, hacc = self._last.hdop + elapsed, self._last.hacc + elapsed
        self._report(self._last.replace(validity=0, satellites=0, sog=0.0, cog=0.0, hdop=hdop, hacc=hacc))
        self.set_entity_state(State.NORMAL, why)

    def _report(self, fix: imc.GpsFix) -> None:
        self._last = fix
        self._publish(fix)

    def _publish(self, fix: imc.GpsFix) -> None:
        time = self.now - self.latency
        date = datetime.fromtimestamp(time, UTC)
        self.publish(fix.replace(utc_year=date.year, utc_month=date.month, utc_day=date.day, utc_time=time % 86400.0))
