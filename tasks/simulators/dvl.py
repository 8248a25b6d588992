"""Simulates a Doppler velocity log."""

import math
from collections.abc import Mapping
from typing import ClassVar

import imc
from runtime import Entity, State, param, periodic
from runtime.task import SharedOption
from support.pose import Pose
from support.rotations import Vector, cross, rotate_to_body, to_body, to_ned
from tasks.simulated_world import WorldFrame, mount_pose, position_param, world_of
from tasks.simulators.true_state_sensor import TrueStateSensorTask
from world import SECTIONS
from world.sensors import BeamEcho, SonarBeam, distance_to_bottom, janus_directions, nearest_echo, velocity_from_beams

ALL_VALID = 0x7
BEAMS = 4
OLDEST = 1.0  # s, of the last state
FARTHEST = 1000.0  # m, for beams without a limit


class DVL(TrueStateSensorTask):
    """Measures velocity over ground and through the water in the body frame, with white noise.

    Some samples are invalid; their velocities are zero. Without the bottom of [World] in range, straight below the
    device, there is no velocity over ground.

    With four `Beams`, each receives the echo of the nearest of bottom, surface, walls and objects of [World] within its
    range, and publishes its Distance (invalid without an echo). The velocity over ground is then that of three or four
    beams: it is relative to the surface if they measure that, and wrong by the motion of an object that they measure.
    The device measures at its place, along its own axes; its beams are around its z axis, which looks down unless it is
    turned.
    """

    reads: ClassVar[Mapping[str, Mapping[str, SharedOption]]] = SECTIONS

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
        0.0, "m", "Range to the bottom beyond which no echo returns; 0 for no limit.", minimum=0, maximum=11000
    )

    blanking_distance: float = param(0.0, "m", "Distance below which a beam receives no echo.", minimum=0, maximum=100)
    beams: int = param(
        0,
        "",
        "Number of beams that also receive echoes of objects; 0 for an ideal device that measures the bottom only.",
        choices=(0, BEAMS),
        editable=False,
    )
    beam_tilt: float = param(30.0, "°", "Angle between each beam and the device's axis.", minimum=5, maximum=60)
    beam_noise: float = param(
        0.0, "m", "White noise of the distance of each beam.", name="Standard Deviation - Beam Distance", minimum=0
    )
    device_position: list[float] = position_param(
        "Place in the vehicle: forward, right, down of its origin; empty for the origin."
    )
    device_orientation: list[float] = param(
        [], "°", "Roll, pitch and yaw of its axes against the vehicle's; empty for none.", size=(0, 3)
    )

    def configure(self) -> None:
        world_of(self)
        self._mount = mount_pose(self.device_position, self.device_orientation)
        self._directions = janus_directions(math.radians(self.beam_tilt))
        self._ears = [self.reserve_entity(f"{self.entity.label} Beam {n}") for n in range(1, self.beams + 1)]

    def start(self) -> None:
        self._chart = WorldFrame(world_of(self).origin)
        super().start()

    @periodic("execution_frequency")
    def measure(self) -> None:
        draws: list[float] = self.random.standard_normal(6).tolist()
        invalid = self.random.random() * 100.0 < self.invalid_reading_probability
        further: list[float] = self.random.standard_normal(BEAMS).tolist() if self.beams else []
        truth = self.true_state()
        if truth is not None and self.age(truth.timestamp) > OLDEST:
            self._truth = truth = None
            self.report_state(State.FAULT, "no recent SimulatedState")
        if truth is None:
            return
        time, water, ground = truth.timestamp, imc.WaterVelocity(), imc.GroundVelocity()
        echoes = self._find_echoes(truth) if self.beams else None
        if not invalid:
            through, over = self._velocities(truth)
            x, y, z = _noisy(through, self.water_noise, draws)
            water = imc.WaterVelocity(validity=ALL_VALID, x=x, y=y, z=z)
            if echoes is not None:
                over = self._relative(truth, over, echoes)
            elif not self._reaches_bottom(truth):
                over = None
            if over is not None:
                x, y, z = _noisy(over, self.ground_noise, draws[3:])
                ground = imc.GroundVelocity(validity=ALL_VALID, x=x, y=y, z=z)
        self.publish(water.replace(timestamp=time), keep_time=True)
        self.publish(ground.replace(timestamp=time), keep_time=True)
        for ear, echo, draw in zip(self._ears, echoes or (), further, strict=True):
            self._report(ear, echo, self.beam_noise * draw, time)

    def _velocities(self, truth: imc.SimulatedState) -> tuple[Vector, Vector]:
        """Velocities through the water and over ground, along the axes of the device."""
        sx, sy, sz = rotate_to_body(truth.phi, truth.theta, truth.psi, (truth.svx, truth.svy, truth.svz))
        around = cross((truth.p, truth.q, truth.r), self._mount.position)
        u, v, w = truth.u + around[0], truth.v + around[1], truth.w + around[2]
        axes = self._mount.rotation
        return to_body(axes, (u, v, w)), to_body(axes, (u + sx, v + sy, w + sz))

    def _pose(self, truth: imc.SimulatedState) -> Pose:
        """The pose of the device in the world."""
        here = Pose(*self._chart.position(truth), truth.z, truth.phi, truth.theta, truth.psi)
        return here.compose(self._mount)

    def _find_echoes(self, truth: imc.SimulatedState) -> list[BeamEcho | None]:
        pose, world = self._pose(truth), world_of(self)
        elapsed, stream = truth.timestamp - self.vehicle.start_time, (truth.svx, truth.svy, truth.svz)
        beams = [SonarBeam(pose.position, to_ned(pose.rotation, direction)) for direction in self._directions]
        reach = self.bottom_range or FARTHEST
        return [nearest_echo(world, beam, elapsed, stream, self.blanking_distance, reach) for beam in beams]

    def _relative(self, truth: imc.SimulatedState, over: Vector, echoes: list[BeamEcho | None]) -> Vector | None:
        """The velocity by the beams, each from the Doppler shift of its echo."""
        axes, found = self._pose(truth).rotation, list[tuple[Vector, float]]()
        for direction, echo in zip(self._directions, echoes, strict=True):
            if echo is not None:
                moved = to_body(axes, echo.velocity)
                pairs = zip(direction, over, moved, strict=True)
                found.append((direction, math.fsum(part * (own - its) for part, own, its in pairs)))
        return velocity_from_beams([direction for direction, _ in found], [speed for _, speed in found])

    def report_state(self, state: State, description: str) -> None:
        for entity in (self.entity, *self._ears):
            self.set_entity_state(state, description, entity=entity)

    def _report(self, ear: Entity, echo: BeamEcho | None, noise: float, time: float) -> None:
        self.set_entity_state(State.NORMAL, "no echo" if echo is None else echo.source, entity=ear)
        validity = imc.Distance.Validity.INVALID if echo is None else imc.Distance.Validity.VALID
        value = 0.0 if echo is None else max(0.0, echo.distance + noise)
        self.publish(imc.Distance(timestamp=time, validity=validity, value=value), entity=ear, keep_time=True)

    def _reaches_bottom(self, truth: imc.SimulatedState) -> bool:
        seabed = world_of(self).seabed
        if (self.bottom_range == 0.0 and self.blanking_distance == 0.0) or seabed is None:
            return True
        pose, reach = self._pose(truth), self.bottom_range or FARTHEST
        beam = SonarBeam(pose.position, to_ned(pose.rotation, (0.0, 0.0, 1.0)))
        return self.blanking_distance <= distance_to_bottom(beam, seabed, reach) <= reach


def _noisy(velocity: Vector, sigma: float, draws: list[float]) -> Vector:
    x, y, z = velocity
    return x + sigma * draws[0], y + sigma * draws[1], z + sigma * draws[2]
