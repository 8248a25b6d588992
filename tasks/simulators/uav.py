"""Simulates a multirotor, moved by its rotors, its tilt and the wind."""

import math

import imc
from runtime import State, consume, param, periodic
from support.wgs84 import is_on_earth
from tasks.simulators.fixed_steps import FixedSteps
from tasks.simulators.powered_device import PoweredDeviceTask
from tasks.true_motion import simulated_state
from world.bodies import Airframe, Multirotor

MANUAL_INPUT = imc.GpsFix.Type.MANUAL_INPUT
VALID_POS = imc.GpsFix.Validity.VALID_POS
TOUCHDOWN, HARDEST_TOUCHDOWN = 0.2, 2.0  # m/s, above which a touchdown is logged, and is an error
DESCENT = 0.98  # share of the weight that the rotors carry without commands


class UAV(PoweredDeviceTask):
    """Moves a multirotor by its commands and publishes the truth.

    Its attitude controller follows DesiredRoll, DesiredPitch and DesiredHeadingRate; SetThrusterActuation 0 sets the
    speed of all rotors. It stands on flat ground at the position of the first manual GpsFix; a later one moves it over
    ground. After `Command Timeout` without a command for the rotors it descends level, and the rotors stop on the
    ground. Without power the rotors stop at once. In SimulatedState, u, v, w are velocities through the air, svx, svy,
    svz the wind, and z is 0 on the ground.
    """

    execution_frequency: float = param(100.0, "Hz", "Rate of SimulatedState.", minimum=50, maximum=1000, editable=False)
    initial_heading: float = param(0.0, "°", "Heading at the start, true north.", minimum=-360, maximum=360)
    ground_height: float = param(
        0.0, "m", "Height of the ground above the ellipsoid.", minimum=-500, maximum=9000, editable=False
    )
    mass: float = param(3.0, "kg", "Mass.", minimum=0.01, editable=False)
    maximum_thrust: float = param(60.0, "N", "Thrust of all rotors at full speed.", minimum=0.1, editable=False)
    rotor_time_constant: float = param(0.05, "s", "Lag of the rotors' speed.", minimum=1e-3, editable=False)
    tilt_bandwidth: float = param(
        12.0, "rad/s", "Natural frequency of roll and pitch.", minimum=0.1, maximum=25, editable=False
    )
    tilt_damping: float = param(0.8, "1", "Damping ratio of roll and pitch.", minimum=0.1, maximum=1.5, editable=False)
    maximum_tilt: float = param(45.0, "°", "Largest roll and pitch.", minimum=1, maximum=60, editable=False)
    heading_rate_time_constant: float = param(0.2, "s", "Lag of the heading rate.", minimum=1e-3, editable=False)
    maximum_heading_rate: float = param(120.0, "°/s", "Largest heading rate.", minimum=1, editable=False)
    linear_drag: float = param(0.35, "N s/m", "Drag of the rotors.", minimum=0, editable=False)
    quadratic_drag: float = param(0.02, "N s²/m²", "Drag of the body.", minimum=0, editable=False)
    command_timeout: float = param(1.0, "s", "Time without a command before it descends.", minimum=0.1)
    wind_source: str = param(
        "Wind Simulator",
        "",
        "Entity whose EstimatedStreamVelocity is the wind.",
        name="Entity Label - Stream Velocity Source",
    )

    def start(self) -> None:
        self.craft: Multirotor = Multirotor(
            Airframe(
                mass=self.mass,
                thrust=self.maximum_thrust,
                rotor_lag=self.rotor_time_constant,
                bandwidth=self.tilt_bandwidth,
                damping=self.tilt_damping,
                max_tilt=math.radians(self.maximum_tilt),
                yaw_lag=self.heading_rate_time_constant,
                max_yaw_rate=math.radians(self.maximum_heading_rate),
                linear_drag=self.linear_drag,
                quadratic_drag=self.quadratic_drag,
            )
        )
        self.craft.psi = math.radians(self.initial_heading)
        if self.craft.airframe.hover_speed >= 1.0:
            self.log.warning("the rotors are too weak to carry the weight")
        self._origin: imc.GpsFix | None = None
        self._steps = FixedSteps(self.execution_frequency, self.command_timeout)
        self._unknown: set[str] = set()
        self._commanded = math.inf
        self.set_entity_state(State.BOOT, "waiting for the start position")

    @consume(others=True)
    def set_start_position(self, fix: imc.GpsFix) -> None:
        if fix.type != MANUAL_INPUT or (fix.src != self.system and fix.dst != self.system):
            return
        if not is_on_earth(fix.lat, fix.lon):
            self.log.warning(f"a manual fix is not a position on Earth: {fix.lat}, {fix.lon} rad")
            return
        before = self._origin
        if before is not None and (before.lat, before.lon) == (fix.lat, fix.lon) and not fix.validity & VALID_POS:
            return  # a receiver that lost its fix repeats the last position
        self.craft.x = self.craft.y = 0.0
        self._origin = fix
        self.set_entity_state(State.NORMAL, "active")

    @consume
    def on_desired_roll(self, desired: imc.DesiredRoll) -> None:
        if self._accepts("roll", desired.value):
            self.craft.command_roll(desired.value)

    @consume
    def on_desired_pitch(self, desired: imc.DesiredPitch) -> None:
        if self._accepts("pitch", desired.value):
            self.craft.command_pitch(desired.value)

    @consume
    def on_desired_heading_rate(self, desired: imc.DesiredHeadingRate) -> None:
        if self._accepts("heading rate", desired.value):
            self.craft.command_yaw_rate(desired.value)

    @consume
    def on_set_thruster_actuation(self, actuation: imc.SetThrusterActuation) -> None:
        if actuation.id == 0 and self._accepts("rotor speed", actuation.value):
            self.craft.command_rotor_speed(actuation.value if self.has_power else 0.0)
            self._commanded = self.now

    def on_power_loss(self) -> None:
        self.craft.command_rotor_speed(0.0)

    @consume
    def on_wind(self, wind: imc.EstimatedStreamVelocity) -> None:
        label = self.vehicle.entities.label(wind.src, wind.src_ent)
        velocity = wind.x, wind.y, wind.z
        if label == self.wind_source and all(map(math.isfinite, velocity)):
            self.craft.wind = velocity

    @periodic("execution_frequency")
    def simulate(self, periods: int) -> None:
        origin, craft = self._origin, self.craft
        if origin is None:
            self._steps.skip_periods(self.now_ns, periods)
            return
        waited = self.now - (periods - 1) / self.execution_frequency - self._commanded
        if self.has_power and waited > self.command_timeout:
            self._descend()
        flew = not craft.on_ground
        if stall := self._steps.run(self.now_ns, periods, craft.step, self._descend):
            self.log.warning(stall)
        if flew and craft.on_ground and craft.touchdown_speed > TOUCHDOWN:
            say = self.log.error if craft.touchdown_speed > HARDEST_TOUCHDOWN else self.log.info
            say(f"touchdown at {craft.touchdown_speed:.1f} m/s")
        place, angles, rates = (
            (craft.x, craft.y, craft.z),
            (craft.phi, craft.theta, craft.psi),
            (craft.p, craft.q, craft.r),
        )
        start, time = (origin.lat, origin.lon, self.ground_height), self._steps.time
        truth = simulated_state(place, craft.air_velocity, angles, rates, craft.wind, start, time)
        self.publish(truth, keep_time=True)

    def _descend(self) -> None:
        craft = self.craft
        if craft.on_ground:
            craft.command_rotor_speed(0.0)
            self._commanded = math.inf
            return
        if "nothing" not in self._unknown and self.age(self._commanded) > self.command_timeout:
            self._unknown.add("nothing")
            self.log.error("no commands for the rotors: descending level")
        craft.command_roll(0.0)
        craft.command_pitch(0.0)
        craft.command_yaw_rate(0.0)
        craft.command_rotor_speed(math.sqrt(DESCENT) * craft.airframe.hover_speed)

    def _accepts(self, what: str, value: float) -> bool:
        if math.isfinite(value):
            return True
        if what not in self._unknown:
            self._unknown.add(what)
            self.log.warning(f"a command for the {what} has no effect: {value} is not a number")
        return False
