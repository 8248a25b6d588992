"""Simulates a Doppler velocity log."""

import math

import imc
from runtime import State, Task, consume, param, periodic
from world.attitude import rotation, to_body

ALL_VALID = 0x7


class DVL(Task):
    """Measures velocity over ground and through the water in the body frame, with white noise.

    Some samples are invalid; their velocities are zero.
    """

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

    def start(self) -> None:
        self._truth: imc.SimulatedState | None = None
        self.set_entity_state(State.BOOT, "waiting for SimulatedState")

    @consume
    def follow(self, truth: imc.SimulatedState) -> None:
        motion = truth.u + truth.v + truth.w + truth.svx + truth.svy + truth.svz
        if not math.isfinite(motion + truth.phi + truth.theta + truth.psi):
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
            ground = imc.GroundVelocity(
                validity=ALL_VALID, x=u + sx + b * draws[3], y=v + sy + b * draws[4], z=w + sz + b * draws[5]
            )
        self.publish(water.replace(timestamp=time), keep_time=True)
        self.publish(ground.replace(timestamp=time), keep_time=True)
