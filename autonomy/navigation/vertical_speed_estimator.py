"""Height and vertical speed of a multirotor from accelerometer and barometer alone, beside those of navigation."""

import math

from autonomy.navigation.barometric_height import BarometricHeight
from autonomy.navigation.fault_detection import GateDecision, JumpGate, StuckDetector
from autonomy.navigation.inertial_filter import InertialFilter
from autonomy.navigation.sample_mean import SampleMean
from autonomy.navigation.sensor_latency import EXPLAINED_FOR, BarometerLagCheck, ThrustResponseCheck
from support.number_parsing import clamp_magnitude
from support.rotations import Vector

GRAVITY = 9.80665
PRESSURE_NOISE, GPS_NOISE = 0.15, 3.0  # m
SLOW_GPS_NOISE = 10.0  # m; with an accelerometer, a correction by heights that may be late takes many seconds
# Wide, so that the barometer corrects within two seconds what an accelerometer that lies makes of the speed.
ACCELERATION_NOISE, BIAS_WALK = 0.5, 0.1  # m/s²/√Hz, m/s³/√Hz
THRUST_NOISE = 1.5  # m/s²/√Hz, of accelerations that the thrust should make
INITIAL_VARIANCES = 0.02, 0.01, 0.01  # m², (m/s)², (m/s²)²
UNKNOWN_SPEED, KNOWN_SPEED = 25.0, 0.25  # (m/s)², of a speed that may be any, and of one by which others are judged
LARGEST_FORCE = 160.0  # m/s², the range of 16 g of the accelerometer
PLAUSIBLE_FORCES = 0.4, 2.2  # of what the commanded thrust and the known weight make
IMPACT = 2  # steps; the ground makes a larger force for a moment, an accelerometer that lies for longer
FRESH, FORCE_FRESH = 1.0, 0.3  # s; older measurements, and forces, are not used
BIAS_MEMORY = 10.0  # s
UNDERGROUND = -5.0  # m; a height below it shows that the speed by force is wrong, or a barometer below GPS by as much
BY_FORCE_ALONE = 60.0  # s, how long the accelerometer alone gives the speed
JUMP, SIGMAS = 3.0, 5.5  # m; a larger change of pressure is a jump
JUMPS, AGREEMENT = 20, 3.0  # steps in a row that agree to within m make a jump one of the ground pressure
LARGEST_JUMP = 30.0  # m; a barometer that has jumped farther is not used until the next landing
SPEED_APART, HEIGHT_APART = 2.0, 15.0  # m/s, m: an estimate that differs by more
APART = 0.5  # s, for so long, is wrong
FIXES, LARGEST_STEP = 5, 15.0  # heights by GPS in a row that agree make a jump one of their reference; m
GPS_JUMP, GPS_DOUBTED = 9.0, 60.0  # m, s: heights by GPS are doubted for so long after a step
SUPPORT = 0.5  # m/s², how far the force that the ground makes on a vehicle at rest differs from gravity
CARRIED, STOOD = 0.6, 0.5  # share of the weight, s: a vehicle that its rotors do not carry, and feels gravity, stands
LARGEST_BIAS, REST_SHARE = 0.3, 0.02  # m/s²; per step at rest
RATE_SHARE, CLIMBS, RATE_APART = 0.1, 5.0, 8.0  # per fix, m/s: a climb by GPS, and a speed that differs from it
WITNESS_SHARE, WITNESS_REFERENCE_SHARE = 0.3, 0.02  # per fix, of the means that judge the barometer


class VerticalSpeedEstimator:
    """Needs no attitude: the mast is where the autopilot commands it, and force acts along it.

    Without barometer and accelerometer, heights by GPS correct it coarsely. `height` is m above the ground where it
    rested last, `speed` m/s downward.
    """

    def __init__(self) -> None:
        self._pressure = BarometricHeight(PRESSURE_NOISE)
        self._force, self._repetitions = SampleMean(), StuckDetector()
        self._response, self._lag = ThrustResponseCheck(), BarometerLagCheck()
        self._fix: float | None = None
        self._rest_bias, self._weighs = 0.0, True  # whether the accelerometer has shown gravity at rest
        self._ground: float | None = None
        self._start(0.0)

    def _start(self, height: float) -> None:
        self._filter = InertialFilter(1, ACCELERATION_NOISE, BIAS_WALK, INITIAL_VARIANCES)
        self._filter.position[0] = -height
        self._response.reset()
        self._lag.start(height, self._rest_bias)
        self._received_at, self._witness_reference, self._off_by_gps = -math.inf, math.nan, 0.0
        self._unexplained, self._stood = -math.inf, 0.0
        self._fix_before, self._sinks = math.nan, 0.0  # m, m/s downward by GPS
        self._gate = JumpGate(JUMPS, AGREEMENT)
        self._steps, self._reference, self._jumped = JumpGate(FIXES, LARGEST_STEP), math.nan, -math.inf
        self._pressed, self._useless = -math.inf, False
        self._fixed = -math.inf
        self._since = 0.0  # s without barometer
        self._usual_bias = 0.0  # m/s², the mean of the filter's, which is noisy
        self._apart = 0.0
        self._odd = 0
        self._is_unknown = self._is_vague = self._known = self._buried = False

    def resume(self) -> None:
        """Take the next pressure as it is: it is unknown how far the vehicle has climbed since, and how it climbs.

        Until pressures have given the speed, nothing is judged by it.
        """
        self._is_unknown = self._is_vague = True
        self._response.resume()

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
        if self._force.update():
            bias = self._force.value[2] + GRAVITY
            self._weighs = abs(bias) < LARGEST_BIAS
            self._rest_bias += REST_SHARE * (bias - self._rest_bias) if self._weighs else 0.0
        mean = self._pressure.mean
        if mean.update():
            level = mean.value[0] - height
            self._ground = level if self._ground is None else self._ground + 0.1 * (level - self._ground)
        self._start(height)

    def advance(self, now: float, dt: float, expected: float, mast: Vector) -> None:
        """Advance by `dt` (s) to a time (s).

        `expected` is the specific force (m/s²) along the mast by the commanded thrust, `mast` the share of each body
        axis that points down at the commanded tilt.
        """
        new = self._force.update()
        x, y, z = self._force.value
        carried = self._response.made < GRAVITY and abs(z + GRAVITY) < SUPPORT  # by the ground, perhaps
        self._response.update(now, dt, expected, -z if new and not carried else None)
        force = self.measured_force(now, expected)
        self._odd = 0 if force is not None else self._odd + 1
        if force is None and self._odd <= IMPACT and now - self._force.last <= FORCE_FRESH:
            force = self._filter.bias[0] - z
        idle = 0.0 < expected < CARRIED * GRAVITY and self._response.made < CARRIED * GRAVITY  # not without power
        stands = new and carried and idle and not self._response.lags
        self._stood = self._stood + dt if stands else 0.0
        if stands:  # something else carries it: the thrust is no measure of speed then
            force = self._filter.bias[0] - z
            if self._stood > STOOD and not self._known:
                self._filter.velocity[0] = 0.0
        measured = self._response.made if force is None else force - self._filter.bias[0]
        across = 0.0 if force is None else mast[0] * x + mast[1] * y
        self._filter.predict(dt, (GRAVITY + across - mast[2] * measured,), THRUST_NOISE if force is None else None)
        if force is None or not self._weighs:
            self._lag.resume(self._filter.position[0], self._filter.velocity[0], self._usual_bias)
        else:
            self._lag.advance(dt, GRAVITY + across + mast[2] * z)
        slow = self._lag.filter
        self._since += dt
        fix, self._fix = self._fix, None
        if fix is not None:
            self._take_gps_height(now, fix)
        if self._pressure.mean.update() and not self._useless:
            self._correct(now, dt, self._pressure.mean.value[0])
        known, self._known = self._known, self.has_height(now)
        if known and not self._known and force is not None:  # late or noisy pressures may have led the other one astray
            self._filter.position[0], self._filter.velocity[0] = slow.position[0], slow.velocity[0]
        if self._known:
            self._usual_bias += min(1.0, dt / BIAS_MEMORY) * (self._filter.bias[0] - self._usual_bias)
        elif force is not None:
            self._filter.bias[0] = self._usual_bias
        if force is None and not self._useless and now - self._pressed > FORCE_FRESH:
            self._is_vague = True  # thrust alone gives the speed, without regard to the ground
        self._buried = not self._known and (self._buried or self.height < UNDERGROUND)
        if fix is not None:
            alone = self._useless or self._since > BY_FORCE_ALONE  # its speed may be that of a barometer that lied
            alone = alone and now - self._jumped > GPS_DOUBTED
            noise = GPS_NOISE if force is None or self._buried else SLOW_GPS_NOISE
            self._correct_by_gps(now, fix, noise, needed=force is None or alone or self._buried)

    def measured_force(self, now: float, expected: float) -> float | None:
        """The specific force (m/s²) along the mast, without the bias by which speed and barometer contradict it.

        None if it is unknown, late or cannot be that of an `expected` one.
        """
        force = self._filter.bias[0] - self._force.value[2]
        least, most = PLAUSIBLE_FORCES
        plausible = now - self._force.last <= FORCE_FRESH and least * expected <= force <= most * expected
        return force if plausible and not self._response.lags else None

    def load_force(self, now: float, expected: float) -> float | None:
        """The measured force (m/s²) if lately only another load explained it, else the `expected` one."""
        force = self.measured_force(now, expected)
        if force is None:
            return None
        if not self._response.explains(now, force):
            self._unexplained = now
        return force if now - self._unexplained <= EXPLAINED_FOR else expected

    def fresh_force(self, now: float, within: float = FORCE_FRESH) -> float | None:
        """The specific force (m/s²) along the mast as measured `within` s; None if it is older or late."""
        fresh = now - self._force.last <= within and not self._response.lags
        return -self._force.value[2] if fresh else None

    @property
    def fault(self) -> str:
        """Sensor whose values are delayed, for people; empty without one."""
        if self._response.lags:
            return "acceleration does not follow the thrust"
        return "pressure does not follow the acceleration" if self._lag.contradicts else ""

    def _take_gps_height(self, now: float, height: float) -> None:
        """Keep means by which heights (m) from GPS judge the barometer, and the speed where there is none."""
        sunk, self._fix_before = self._fix_before - height, height
        if abs(sunk) > GPS_JUMP and now - self._received_at <= 2.0 * FRESH:
            self._jumped = now
        if 0.0 < (dt := now - self._received_at) <= FRESH and abs(sunk) <= LARGEST_STEP:
            self._sinks += RATE_SHARE * (sunk / dt - self._sinks)
            if not self._known and self._sinks < min(-CLIMBS, self._filter.velocity[0] - RATE_APART):
                self._filter.velocity[0] = self._sinks
        above = height + self._lag.filter.position[0]
        if now - self._received_at > FRESH or not abs(above - self._witness_reference) <= LARGEST_STEP:
            self._witness_reference, self._off_by_gps = above, 0.0
        off = self._witness_reference - above
        if self._known:
            self._witness_reference -= WITNESS_REFERENCE_SHARE * off
        self._off_by_gps += WITNESS_SHARE * (off - self._off_by_gps)
        self._received_at = now

    def _possible_bias(self, bias: float) -> float:
        """A bias (m/s²) as far from that at rest as an accelerometer's may get; more comes from wrong heights."""
        return self._rest_bias + clamp_magnitude(bias - self._rest_bias, LARGEST_BIAS)

    def _correct(self, now: float, dt: float, level: float) -> None:
        state, variance = self._filter, PRESSURE_NOISE**2
        if self._ground is None:
            self._ground = level + state.position[0]
        down = self._ground - level
        if self._is_unknown:
            self._is_unknown = False
            state.reset((down,), variance, UNKNOWN_SPEED)
        if self._is_vague:
            self._lag.resume(state.position[0], state.velocity[0], self._usual_bias)
            self._is_vague = state.variances[1] > KNOWN_SPEED
        off = down - state.position[0]
        limit = JUMP + SIGMAS * math.sqrt(variance + state.variances[0])
        verdict = self._gate.evaluate(not abs(off) <= limit, off)
        if verdict is GateDecision.REJECTED:
            return
        if verdict is GateDecision.RESET:
            self._ground -= off  # the pressure has changed, not the height of the vehicle
            down, self._useless = state.position[0], abs(off) > LARGEST_JUMP
        slow, witnessed = self._lag.filter, now - self._received_at <= FRESH
        if witnessed and max(-down, self._off_by_gps) < UNDERGROUND:
            self._useless, self._pressed = True, -math.inf
            state.position[0] += self._off_by_gps
            self._reference += self._off_by_gps
            return
        self._lag.correct(dt, down, slow.position[0] + self._off_by_gps if witnessed else None)
        if self._lag.contradicts:
            self._useless, self._pressed = True, -math.inf
            state.position[0], state.velocity[0] = slow.position[0], slow.velocity[0]
            self._usual_bias = state.bias[0] = self._possible_bias(slow.bias[0])
            return
        self._pressed, self._since = now, 0.0
        state.correct((down,), variance)

    def _correct_by_gps(self, now: float, height: float, noise: float, *, needed: bool) -> None:
        """Correct by a height (m) from GPS if it is `needed`; its reference is known by the barometer."""
        state = self._filter
        if not math.isfinite(self._reference) or self.has_height(now) or not needed:
            known = self._reference if math.isfinite(self._reference) else height + state.position[0]
            self._reference = known + 0.1 * (height + state.position[0] - known)
            return
        off = self._reference - height - state.position[0]
        verdict = self._steps.evaluate(not abs(off) <= LARGEST_STEP, off)
        if verdict is GateDecision.RESET:
            self._reference -= off
        if verdict is GateDecision.ACCEPTED:
            self._fixed = now
            state.correct((self._reference - height,), noise**2)

    def has_height(self, now: float) -> bool:
        """Whether the barometer measures the height."""
        return now - self._pressed <= FRESH

    def has_speed(self, now: float) -> bool:
        """Whether barometer, GPS or, for a minute, accelerometer measures the speed."""
        by_force = now - self._force.last <= FORCE_FRESH and self._since <= BY_FORCE_ALONE
        return by_force or now - max(self._pressed, self._fixed) <= FRESH

    def measured_height(self, now: float) -> float | None:
        """Height (m) above the ground where it rested, None if the barometer does not measure it."""
        return self.height if self.has_height(now) else None

    def highest(self, now: float) -> float:
        """The largest height (m) that barometer, accelerometer or GPS shows; 0 if none does."""
        by_gps = -self._off_by_gps - self._lag.filter.position[0] if now - self._received_at <= FRESH else 0.0
        return max(by_gps, self.height if self.has_speed(now) else 0.0)

    def contradicts(self, now: float, dt: float, height: float, speed: float) -> bool:
        """Whether an estimate of height (m) and speed downward (m/s) has been far off for long.

        Call it each `dt` s.
        """
        apart = self.has_speed(now) and abs(speed - self.speed) > SPEED_APART
        apart = apart or (self.has_height(now) and abs(height - self.height) > HEIGHT_APART)
        self._apart = self._apart + dt if apart and not self._is_vague else 0.0
        return self._apart >= APART

    @property
    def height(self) -> float:
        """Height (m) above the ground where it rested."""
        return -self._filter.position[0]

    @property
    def speed(self) -> float:
        """Speed (m/s) downward."""
        return self._filter.velocity[0]
