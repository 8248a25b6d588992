"""Height and vertical speed of a multirotor from accelerometer and barometer alone, beside those of navigation."""

import math

from autonomy.navigation.barometric_height import BarometricHeight
from autonomy.navigation.fault_detection import GateDecision, JumpGate, StuckDetector
from autonomy.navigation.inertial_filter import InertialFilter
from autonomy.navigation.sample_mean import SampleMean

GRAVITY = 9.80665
PRESSURE_NOISE, GPS_NOISE = 0.15, 3.0  # m
# Wide, so that the barometer corrects within two seconds what an accelerometer that lies makes of the speed.
ACCELERATION_NOISE, BIAS_WALK = 0.5, 0.1  # m/s²/√Hz, m/s³/√Hz
THRUST_NOISE = 1.5  # m/s²/√Hz, of accelerations that the thrust should make
INITIAL_VARIANCES = 0.02, 0.01, 0.01  # m², (m/s)², (m/s²)²
LARGEST_FORCE = 160.0  # m/s², the range of 16 g of the accelerometer
PLAUSIBLE_FORCES = 0.4, 2.2  # of what the commanded thrust and the known weight make
IMPACT = 2  # steps; the ground makes a larger force for a moment, an accelerometer that lies for longer
FRESH, FORCE_FRESH = 1.0, 0.3  # s; older measurements, and forces, are not used
BIAS_MEMORY = 10.0  # s
BY_FORCE_ALONE = 60.0  # s, how long the accelerometer alone gives the speed
JUMP, SIGMAS = 3.0, 5.5  # m; a larger change of pressure is a jump
JUMPS, AGREEMENT = 20, 3.0  # steps in a row that agree to within m make a jump one of the ground pressure
LARGEST_JUMP = 30.0  # m; a barometer that has jumped farther is not used until the next landing
SPEED_APART, HEIGHT_APART = 2.0, 15.0  # m/s, m: an estimate that differs by more
APART = 0.5  # s, for so long, is wrong
FIXES, LARGEST_STEP = 5, 15.0  # heights by GPS in a row that agree make a jump one of their reference; m


class VerticalSpeedEstimator:
    """Needs no attitude: the mast is where the autopilot commands it, and force acts along it.

    Without barometer and accelerometer, heights by GPS correct it coarsely. `height` is m above the ground where it
    rested last, `speed` m/s downward.
    """

    def __init__(self) -> None:
        self._pressure = BarometricHeight(PRESSURE_NOISE)
        self._force, self._repetitions = SampleMean(), StuckDetector()
        self._fix: float | None = None
        self._ground: float | None = None
        self._start(0.0)

    def _start(self, height: float) -> None:
        self._filter = InertialFilter(1, ACCELERATION_NOISE, BIAS_WALK, INITIAL_VARIANCES)
        self._filter.position[0] = -height
        self._gate = JumpGate(JUMPS, AGREEMENT)
        self._steps, self._reference = JumpGate(FIXES, LARGEST_STEP), math.nan
        self._pressed, self._useless = -math.inf, False
        self._fixed = -math.inf
        self._since = 0.0  # s without barometer
        self._usual_bias = 0.0  # m/s², the mean of the filter's, which is noisy
        self._apart = 0.0
        self._odd = 0
        self._is_unknown = False

    def resume(self) -> None:
        """Take the next pressure as it is: it is unknown how far the vehicle has climbed since."""
        self._is_unknown = True

    def receive_force(self, now: float, x: float, y: float, z: float) -> None:
        """A specific force (m/s²) in the body frame at a time (s)."""
        possible = abs(x) <= LARGEST_FORCE and abs(y) <= LARGEST_FORCE and abs(z) <= LARGEST_FORCE
        if possible and not self._repetitions.update(x + y + z):
            self._force.add(now, x, y, z)

    def receive_pressure(self, now: float, pressure: float) -> None:
        """A pressure (hPa) at a time (s)."""
        self._pressure.receive(now, pressure)

    def receive_gps_height(self, height: float) -> None:
        """A height by GPS (m above anything that stays)."""
        if math.isfinite(height):
            self._fix = height

    def rest(self, height: float = 0.0) -> None:
        """The vehicle rests, at a height (m)."""
        self._force.update()
        mean = self._pressure.mean
        if mean.update():
            level = mean.value[0] - height
            self._ground = level if self._ground is None else self._ground + 0.1 * (level - self._ground)
        self._start(height)

    def advance(self, now: float, dt: float, expected: float, lift: float) -> None:
        """Advance by `dt` (s) to a time (s).

        `expected` is the specific force (m/s²) along the mast by the commanded thrust, `lift` the cosine of the
        commanded tilt.
        """
        self._force.update()
        force = self.measured_force(now, expected)
        self._odd = 0 if force is not None else self._odd + 1
        if force is None and self._odd <= IMPACT and now - self._force.last <= FORCE_FRESH:
            force = self._filter.bias[0] - self._force.value[2]
        measured = expected if force is None else force - self._filter.bias[0]
        self._filter.predict(dt, (GRAVITY - lift * measured,), THRUST_NOISE if force is None else None)
        self._since += dt
        if self._pressure.mean.update() and not self._useless:
            self._correct(now, self._pressure.mean.value[0])
        if self.knows_height(now):
            self._usual_bias += min(1.0, dt / BIAS_MEMORY) * (self._filter.bias[0] - self._usual_bias)
        elif force is not None:
            self._filter.bias[0] = self._usual_bias
        fix, self._fix = self._fix, None
        if fix is not None:
            self._correct_by_gps(now, fix, needed=force is None or self._since > BY_FORCE_ALONE)

    def measured_force(self, now: float, expected: float) -> float | None:
        """The specific force (m/s²) along the mast, without the bias by which speed and barometer contradict it.

        None if it is unknown or cannot be that of an `expected` one.
        """
        force = self._filter.bias[0] - self._force.value[2]
        least, most = PLAUSIBLE_FORCES
        plausible = now - self._force.last <= FORCE_FRESH and least * expected <= force <= most * expected
        return force if plausible else None

    def _correct(self, now: float, level: float) -> None:
        state, variance = self._filter, PRESSURE_NOISE**2
        if self._ground is None:
            self._ground = level + state.position[0]
        down = self._ground - level
        if self._is_unknown:
            self._is_unknown = False
            state.reset((down,), variance)
        off = down - state.position[0]
        limit = JUMP + SIGMAS * math.sqrt(variance + state.variances[0])
        verdict = self._gate.evaluate(not abs(off) <= limit, off)
        if verdict is GateDecision.REJECTED:
            return
        if verdict is GateDecision.RESET:
            self._ground -= off
            down, self._useless = state.position[0], abs(off) > LARGEST_JUMP
        self._pressed, self._since = now, 0.0
        state.correct((down,), variance)

    def _correct_by_gps(self, now: float, height: float, *, needed: bool) -> None:
        """Correct by a height (m) from GPS if it is `needed`; its reference is known by the barometer."""
        state = self._filter
        if not math.isfinite(self._reference) or self.knows_height(now) or not needed:
            known = self._reference if math.isfinite(self._reference) else height + state.position[0]
            self._reference = known + 0.1 * (height + state.position[0] - known)
            return
        off = self._reference - height - state.position[0]
        verdict = self._steps.evaluate(not abs(off) <= LARGEST_STEP, off)
        if verdict is GateDecision.RESET:
            self._reference -= off
        if verdict is GateDecision.ACCEPTED:
            self._fixed = now
            state.correct((self._reference - height,), GPS_NOISE**2)

    def knows_height(self, now: float) -> bool:
        """Whether the barometer measures the height."""
        return now - self._pressed <= FRESH

    def knows_speed(self, now: float) -> bool:
        """Whether barometer, GPS or, for a minute, accelerometer measures the speed."""
        by_force = now - self._force.last <= FORCE_FRESH and self._since <= BY_FORCE_ALONE
        return by_force or now - max(self._pressed, self._fixed) <= FRESH

    def contradicts(self, now: float, dt: float, height: float, speed: float) -> bool:
        """Whether an estimate of height (m) and speed downward (m/s) has been far off for long.

        Call it each `dt` s.
        """
        apart = self.knows_speed(now) and abs(speed - self.speed) > SPEED_APART
        apart = apart or (self.knows_height(now) and abs(height - self.height) > HEIGHT_APART)
        self._apart = self._apart + dt if apart else 0.0
        return self._apart >= APART

    @property
    def height(self) -> float:
        """Height (m) above the ground where it rested."""
        return -self._filter.position[0]

    @property
    def speed(self) -> float:
        """Speed (m/s) downward."""
        return self._filter.velocity[0]
