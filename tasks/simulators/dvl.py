"""Simulates a Doppler velocity log."""

import math

import imc
from runtime import State, Task, consume, param, periodic
from tasks.surroundings import Chart, world_of
from world import SECTIONS
from world.attitude import rotation, to_body
from world.sensors import Beam

ALL_VALID = 0x7
DOWN = -0.5 * math.pi


class DVL(Task):
    """Measures velocity over ground and through the water in the body frame, with white noise.

    Some samples are invalid; their velocities are zero. Without the bottom of [World] in range, straight below the
    vehicle's keel, there is no velocity over ground.
    """

    reads = SECTIONS

    execution_frequency: float = param(5.0, "Hz", "Rate of the velocities.", minimum=0.1, maximum=100)
    ground_noise: float = param(
        0.002, "m/s", "White noise of velocity over ground.", name="Standard Deviation - Ground Velocity", minimum=0
    )
    water_noise: float = param(
        0.002,
        "m/s",
        "White noise of velocity through the water.",
        name="Standard Deviation - Water Velocity",
        minimum=0,
    )
    invalid_reading_probability: float = param(10.0, "%", "Share of invalid samples.", minimum=0, maximum=100)
    bottom_range: float = param(
        0.0, "m", "Distance beyond which the bottom is not heard; 0 for any.", minimum=0, maximum=11000
    )

    def configure(self) -> None:
        world_of(self)

    def start(self) -> None:
        self._chart = Chart(world_of(self).origin)
        self._truth: imc.SimulatedState | None = None
        self.set_entity_state(State.BOOT, "waiting for SimulatedState")

    @consume
    def follow(self, truth: imc.SimulatedState) -> None:
        motion = truth.u + truth.v + truth.w + truth.svx + truth.svy + truth.svz
        place = truth.lat + truth.lon + truth.x + truth.y + truth.z
        if not math.isfinite(motion + truth.phi + truth.theta + truth.psi + place):
            self._truth = None
            self.set_entity_state(State.FAULT, "SimulatedState is not finite")
            return
        if self._truth is None:
            self.set_entity_state(State.NORMAL, "active")
        self._truth = truth

    @periodic("execution_frequency")
    def measure(self) -> None:
        draws: list[float] = self.random.standard_normal(6).tolist()
        invalid = self.random.random() * 100.0 < self.invalid_reading_probability
        truth = self._truth
        if truth is None:
            return
        time, water, ground = truth.timestamp, imc.WaterVelocity(), imc.GroundVelocity()
        if not invalid:
            sx, sy, sz = to_body(rotation(truth.phi, truth.theta, truth.psi), (truth.svx, truth.svy, truth.svz))
            a, b = self.water_noise, self.ground_noise
            u, v, w = truth.u, truth.v, truth.w
            water = imc.WaterVelocity(validity=ALL_VALID, x=u + a * draws[0], y=v + a * draws[1], z=w + a * draws[2])
            if self._hears_bottom(truth):
                ground = imc.GroundVelocity(
                    validity=ALL_VALID, x=u + sx + b * draws[3], y=v + sy + b * draws[4], z=w + sz + b * draws[5]
                )
        self.publish(water.replace(timestamp=time), keep_time=True)
        self.publish(ground.replace(timestamp=time), keep_time=True)

    def _hears_bottom(self, truth: imc.SimulatedState) -> bool:
        seabed = world_of(self).seabed
        if self.bottom_range == 0.0 or seabed is None:
            return True
        place, angles = (*self._chart.place(truth), truth.z), (truth.phi, truth.theta, truth.psi)
        beam = Beam.of(place, angles, (0.0, 0.0, 0.0), 0.0, DOWN)
        return beam.bottom(seabed.depth, self.bottom_range, seabed.shallowest) <= self.bottom_range
