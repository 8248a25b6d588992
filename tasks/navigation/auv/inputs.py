"""What the sensors of an underwater vehicle measure between two steps of navigation."""

import math

import imc
from runtime import Task, consume, param
from support.rotations import Vector, wrap
from tasks.navigation.auv.averages import Mean
from tasks.navigation.auv.consistency import JumpGate, Repetition, Verdict
from tasks.navigation.auv.gates import LARGEST_ANGLE, LARGEST_RATE, DvlReason, FixGate, Reason, VelocityGate, located

VEL_X_AND_Y = int(imc.GroundVelocity.Validity.VEL_X | imc.GroundVelocity.Validity.VEL_Y)
VEL_Z = int(imc.GroundVelocity.Validity.VEL_Z)
UNKNOWN_ALTITUDE = -1.0
LIE = 2.0  # m/s between velocity log and motor that no current explains
STOPPED = 0.5  # m/s backward at most of a vehicle that is held fast
DEEPEST = 12000.0  # m; no sea is deeper
ALTITUDE_JUMP, ALTITUDE_SHARE = 2.0, 0.2  # m, and of the altitude: a larger change needs
ALTITUDE_JUMPS = 5  # samples that agree


class Sensors(Task):
    """Receives sensor messages, rejects invalid ones, averages the rest. An empty entity label accepts any entity."""

    compass: str = param("AHRS", "", "Entity of attitude and rates.", name="Entity Label - Compass")
    dvl: str = param("DVL", "", "Entity of velocities.", name="Entity Label - DVL")
    depth_sensor: str = param("Depth Sensor", "", "Entity of depth.", name="Entity Label - Depth")
    altimeter: str = param(
        "Altimeter", "", "Entity of the distance to the bottom.", name="Entity Label - Altitude - Simulation"
    )
    true_altimeter: str = param(
        "", "", "Altimeter to use instead, if the vehicle has it.", name="Entity Label - Altitude - Hardware"
    )
    altitude_gain: float = param(0.2, "1", "Weight of a new distance.", name="Altitude EMA gain", minimum=0, maximum=1)
    altitude_compensation: bool = param(
        True, "", "Correct distances for roll and pitch.", name="Altitude Attitude Compensation"
    )
    altitude_timeout: float = param(
        5.0, "s", "Time without distance before altitude is unknown.", name="Altitude timeout", minimum=0
    )
    depth_timeout: float = param(5.0, "s", "Time without depth before an error.", name="Depth timeout", minimum=0)
    euler_timeout: float = param(10.0, "s", "Time without attitude before an error.", name="Euler timeout", minimum=0)
    dvl_timeout: float = param(3.0, "s", "Time after which velocities count as missing.", name="DVL timeout", minimum=0)
    dvl_silence: float = param(
        60.0, "s", "Time without any message of the DVL before an error; 0 for never.", name="DVL silence", minimum=0
    )
    dvl_jumps: list[float] = param(
        [1.5, 0.6], "m/s", "Largest change of surge and sway.", name="DVL relative thresholds", size=2
    )
    dvl_jump_window: float = param(
        0.5, "s", "Longest time between compared velocities.", name="DVL relative threshold time window", minimum=0
    )
    dvl_largest: list[float] = param(
        [5.0, 1.5], "m/s", "Largest surge and sway.", name="DVL absolute thresholds", size=2
    )
    speed_per_rpm: float = param(1.015e-3, "m/s/rpm", "Speed per rpm.", name="Revolutions to speed factor")
    dvl_arm: float = param(0.0, "m", "Distance of the DVL ahead of the CG.", name="Distance Between DVL and CG")
    gps_arm: float = param(0.0, "m", "Height of the antenna above the CG.", name="Distance Between GPS and CG")
    gps_factor: float = param(
        1.8,
        "1",
        "Rejects a fix whose accuracy exceeds the mean by this factor.",
        name="GPS Maximum Dynamic HACC factor",
        minimum=1,
    )
    gps_samples: int = param(
        7, "1", "Fixes whose accuracy is averaged.", name="GPS Moving Average Samples", minimum=1, maximum=1000
    )
    gps_deepest: float = param(
        1.0,
        "m",
        "Depth below which the antenna has no reception: a fix is rejected.",
        name="GPS Maximum Depth",
        minimum=0,
    )
    gps_hacc: float = param(20.0, "m", "Worst accepted accuracy of a fix.", name="GPS Maximum HACC", minimum=0)
    gps_hdop: float = param(
        4.0, "1", "Worst accepted HDOP, if accuracy is unknown.", name="GPS Maximum HDOP", minimum=0
    )

    def configure(self) -> None:
        jumps, largest = self.dvl_jumps, self.dvl_largest
        gates = (VelocityGate((jumps[0], jumps[1]), (largest[0], largest[1]), self.dvl_jump_window) for _ in range(2))
        self._ground_gate, self._water_gate = gates
        self._fix_gate = FixGate(self.gps_factor, self.gps_samples, self.gps_hacc, self.gps_hdop)

    def start(self) -> None:
        self.euler, self.rates, self.depth = Mean(), Mean(), Mean()
        self.ground, self.water = Mean(), Mean()
        true = self.true_altimeter
        self._sounder = true if true and self.vehicle.entities.find(true) is not None else self.altimeter
        self.received: imc.GpsFix | None = None
        self.place: imc.GpsFix | None = None
        fitted = bool(self.dvl) and self.vehicle.entities.find(self.dvl) is not None
        self.spoken = self.now if fitted else math.inf  # a vehicle without a DVL does not wait for one
        self.rpm = 0
        self.altitude = UNKNOWN_ALTITUDE
        self.revolved = self.sounded = -math.inf
        self.velocity: Vector = (0.0, 0.0, 0.0)
        self.velocity_at = self.heave_at = self.contradicted = -math.inf
        self.velocity_doubt = ""
        self.attitude_noise, self.altitude_noise = Repetition(), Repetition()
        self.ground_noise, self.water_noise = Repetition(), Repetition()
        self._altitude_gate = JumpGate(ALTITUDE_JUMPS, ALTITUDE_JUMP)
        self._turns = 0.0

    @consume
    def orient(self, angles: imc.EulerAngles) -> None:
        phi, theta, psi = angles.phi, angles.theta, angles.psi
        most = LARGEST_ANGLE
        possible = -most <= phi <= most and -most <= theta <= most and -most <= psi <= most
        if not possible or not self._is_from(angles, self.compass):
            return
        if not self.attitude_noise.repeats(phi + theta + psi):
            self._turns += wrap(psi - self._turns)
            self.euler.add(self.now, phi, theta, self._turns)

    @consume
    def turn(self, rates: imc.AngularVelocity) -> None:
        p, q, r = rates.x, rates.y, rates.z
        most = LARGEST_RATE
        possible = -most <= p <= most and -most <= q <= most and -most <= r <= most
        if possible and self._is_from(rates, self.compass):
            self.rates.add(self.now, p, q, r)

    @consume
    def sink(self, depth: imc.Depth) -> None:
        if abs(depth.value) <= DEEPEST and self._is_from(depth, self.depth_sensor):
            self.depth.add(self.now, depth.value)

    @consume
    def sound(self, distance: imc.Distance) -> None:
        if distance.validity != imc.Distance.Validity.VALID or not self._is_from(distance, self._sounder):
            return
        measured = distance.value
        if not 0.0 <= measured <= DEEPEST or (self.altitude_noise.repeats(measured) and measured):
            return
        phi, theta, _ = self.euler.value
        if self.altitude_compensation:
            measured *= math.cos(phi) * math.cos(theta)
        before = self.altitude if self.altitude >= 0.0 else measured
        change = measured - before
        verdict = self._altitude_gate.judge(abs(change) > ALTITUDE_JUMP + ALTITUDE_SHARE * before, change)
        if verdict is Verdict.REJECTED:
            return
        self.altitude = measured if verdict is Verdict.BELIEVED else before + self.altitude_gain * change
        self.sounded = self.now

    @consume
    def revolve(self, rpm: imc.Rpm) -> None:
        if abs(rpm.value) * self.speed_per_rpm <= self.dvl_largest[0]:
            self.rpm, self.revolved = rpm.value, self.now

    @consume
    def hear_velocity(self, velocity: imc.GroundVelocity | imc.WaterVelocity) -> None:
        numbers = velocity.x, velocity.y, velocity.z
        if not self._is_from(velocity, self.dvl):
            return
        self.spoken = self.now
        if velocity.validity & VEL_X_AND_Y != VEL_X_AND_Y:
            return
        if not all(map(math.isfinite, numbers)):
            return
        heave = velocity.validity & VEL_Z and abs(velocity.z) <= self.dvl_largest[1]
        over_ground = isinstance(velocity, imc.GroundVelocity)
        gate, mean = (self._ground_gate, self.ground) if over_ground else (self._water_gate, self.water)
        refused = gate.refuses(self.now, velocity.x, velocity.y)
        if refused is None and over_ground and self._contradicts_motor(velocity.x):
            self.contradicted, refused = self.now, (DvlReason.INNOV_THRESHOLD_X, velocity.x)
        if refused is not None:
            kind = imc.DvlRejection.Type.GV if over_ground else imc.DvlRejection.Type.WV
            elapsed = min(self.now - mean.last, self.dvl_timeout)
            self.publish(imc.DvlRejection(type=kind, reason=refused[0], value=refused[1], timestep=elapsed))
            return
        y = velocity.y - self.dvl_arm * self.rates.value[2]
        if (self.ground_noise if over_ground else self.water_noise).repeats(velocity.x + velocity.y):
            return
        if over_ground:
            self.velocity, self.velocity_at = (velocity.x, y, velocity.z), self.now
            if heave:
                self.heave_at = self.now
        if not self.velocity_doubt:
            mean.add(self.now, velocity.x, y, velocity.z if heave else self.ground.value[2])

    @consume
    def note_rest(self, activation: imc.EntityActivationState) -> None:
        """Do not wait for a DVL that was switched off, until it speaks again."""
        if self.dvl and self._is_from(activation, self.dvl):
            active = activation.state == imc.EntityActivationState.State.ACTIVE
            self.spoken = self.now if active else math.inf

    def _contradicts_motor(self, surge: float) -> bool:
        """Whether a surge (m/s) is backward or ahead of the motor by more than a current; a stop is possible."""
        motor = self.speed_per_rpm * self.rpm
        ahead = surge if motor >= 0.0 else -surge
        off = abs(surge - motor) > LIE and not -STOPPED <= ahead <= abs(motor)
        return off and self.now - self.revolved < self.dvl_timeout

    @consume
    def fix(self, fix: imc.GpsFix) -> None:
        if fix.type == imc.GpsFix.Type.MANUAL_INPUT:
            self.place = fix if located(fix) else self.place
            return
        reason = self._fix_gate.refuses(fix)
        if reason is None and not located(fix):
            reason = Reason.INVALID
        if reason is not None:
            self.publish(imc.GpsFixRejection(utc_time=fix.utc_time, reason=reason))
        else:
            self.received = fix

    def _is_from(self, message: imc.Message, label: str) -> bool:
        return not label or self.vehicle.entities.label(message.src, message.src_ent) == label
