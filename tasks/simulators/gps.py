"""Simulates a GPS receiver."""

import math
from datetime import UTC, datetime

import imc
from imc import coordinates
from runtime import ParameterError, State, Task, consume, param, periodic
from world.attitude import rotation, to_body, to_ned

SLOWEST = 0.05  # m/s, least speed that has a course
ALL_VALID = 0x1FF  # the nine flags of GpsFix.Validity


class GPS(Task):
    """Publishes position, speed and course over ground, with noise, while the antenna is out of the water.

    Below 0.05 m/s the course is the heading. Below `Activation Depth` nothing is valid, and the dilution and accuracy
    grow by one per second.
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

    def start(self) -> None:
        self._truth: imc.SimulatedState | None = None
        lat, lon = map(math.radians, self.initial_position or (0.0, 0.0))
        self._last = imc.GpsFix(lat=lat, lon=lon, hdop=self.hdop, hacc=self.hacc)
        self.set_entity_state(State.BOOT, "waiting for SimulatedState")
        if self.initial_position:
            self._publish(imc.GpsFix(type=imc.GpsFix.Type.MANUAL_INPUT, validity=ALL_VALID, lat=lat, lon=lon))

    @consume
    def follow(self, truth: imc.SimulatedState) -> None:
        motion = truth.u + truth.v + truth.w + truth.svx + truth.svy + truth.svz
        finite = math.isfinite(truth.x + truth.y + truth.z + truth.phi + truth.theta + truth.psi + motion)
        self._truth = truth if finite else None
        if not finite:
            self.set_entity_state(State.FAULT, "SimulatedState is not finite")

    @periodic("execution_frequency")
    def report(self, periods: int) -> None:
        truth = self._truth
        if truth is None:
            return
        if truth.z > self.activation_depth:
            aged = periods / self.execution_frequency
            lost = self._last.replace(
                validity=0, satellites=0, sog=0.0, cog=0.0, hdop=self._last.hdop + aged, hacc=self._last.hacc + aged
            )
            self._report(lost)
            self.set_entity_state(State.NORMAL, "no fix under water")
            return
        x, y, z = truth.x, truth.y, truth.z
        if self.position_noise or self.height_noise:
            dx, dy, dz = self.random.standard_normal(3).tolist()
            x, y, z = x + self.position_noise * dx, y + self.position_noise * dy, z + self.height_noise * dz
        lat, lon, height = coordinates.displace(truth.lat, truth.lon, truth.height, x, y, z)
        attitude = rotation(truth.phi, truth.theta, truth.psi)
        north, east, down = to_ned(attitude, (truth.u, truth.v, truth.w))
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
            self.publish(imc.EulerAngles(time=self.now, psi=truth.psi, psi_magnetic=truth.psi))
        self.set_entity_state(State.NORMAL, "active")

    def _report(self, fix: imc.GpsFix) -> None:
        self._last = fix
        self._publish(fix)

    def _publish(self, fix: imc.GpsFix) -> None:
        date = datetime.fromtimestamp(self.now, UTC)
        self.publish(
            fix.replace(utc_year=date.year, utc_month=date.month, utc_day=date.day, utc_time=self.now % 86400.0)
        )
