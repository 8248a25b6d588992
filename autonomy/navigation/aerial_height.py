"""The height of an aerial vehicle: accelerations, corrected by the barometer and, without one, by GPS."""

import math

from autonomy.navigation.barometric_height import BarometricHeight
from autonomy.navigation.fault_detection import GateDecision, JumpGate
from autonomy.navigation.inertial_filter import InertialFilter

FALLS = 20  # samples that agree before a jump of theirs is used
FALL, SIGMAS, AGREEMENT = 5.0, 5.5, 10.0  # m; a larger change of pressure is a jump
LARGEST_JUMP = 30.0  # m; a barometer that jumps farther alone has another unit or a defect, and no other ground
HEIGHT_FACTOR = 4.0  # of the variance of heights by GPS, to that of its positions
HEIGHT_JUMP, HEIGHTS = 20.0, 10  # m, fixes in a row: GPS against barometer
UNCORRECTED = 5.0  # s; accelerations alone do not give a height for longer
OFFSET_SHARE = 0.02  # per fix, of the mean by which GPS and barometer differ
APART = "GPS and barometer disagree on the height, which is not trusted"
ALONE = "neither barometer nor GPS measures the height, which is not trusted"


class AerialHeight:
    """`filter` has m below the reference; `timeout` (s) is how long the barometer may be silent.

    Two sources have to agree before the height follows one that jumps: a barometer that jumps while GPS does not keeps
    the height, with another pressure of the ground. After a very large jump it is not used until it agrees again.
    `now` in all methods is a time without stalls of the process.
    """

    def __init__(self, noise: float, timeout: float, acceleration: tuple[float, float]):
        self.barometer: BarometricHeight = BarometricHeight(noise)
        self.timeout = timeout
        self._noise, self._acceleration = noise, acceleration
        self.ground: float = 0.0
        self.pressed: float = -math.inf
        self.start(0.0, 0.0, -math.inf, (1.0, 1.0))

    def start(self, ground: float, down: float, now: float, variances: tuple[float, float]) -> None:
        """Start `down` (m) below a reference at the barometric height `ground` (m).

        `variances` are those of velocity and accelerometer bias.
        """
        self.filter: InertialFilter = InertialFilter(1, *self._acceleration, (self._noise**2, *variances))
        self.filter.position[0] = down
        self.ground, self.pressed = ground, now
        self._falls = JumpGate(FALLS, AGREEMENT)
        self._offset = self._above = 0.0
        self._apart, self._corrected = 0, now
        self._is_useless = False
        self._unknown_velocity: float | None = None

    def resume(self, velocity_variance: float) -> None:
        """Take the next pressure as it is: it is unknown how far the vehicle has climbed meanwhile, and how it climbs.

        The latter has a variance (m²/s²).
        """
        self._unknown_velocity = velocity_variance

    @property
    def rejects_pressure(self) -> bool:
        """Whether the latest pressure was rejected."""
        return self._falls.rejected > 0

    def advance(self, now: float, dt: float, acceleration: float) -> str:
        """Advance by `dt` (s) with an acceleration downward (m/s²); what is wrong with the pressure, or empty."""
        self.filter.predict(dt, (acceleration,))
        mean = self.barometer.mean
        if not mean.update():
            return ""
        down, state, variance = self.ground - mean.value[0], self.filter, self._noise**2
        if self._unknown_velocity is not None and not self._is_useless:
            state.reset((down,), variance, self._unknown_velocity)
            self._unknown_velocity = None
        off = down - state.position[0]
        limit = FALL + SIGMAS * math.sqrt(variance + state.variances[0])
        verdict = self._falls.evaluate(not abs(off) <= limit, off)
        if verdict is GateDecision.RESET:
            return self._jump(now, off)
        if verdict is GateDecision.ACCEPTED:
            self.pressed = self._corrected = now
            self._is_useless = False
            state.correct((down,), variance)
        return ""

    def _jump(self, now: float, off: float) -> str:
        """Use a pressure that has jumped by `off` (m) and stays there, unless it cannot be used; what is wrong."""
        fault = "" if self._is_useless else f"pressure has jumped by {off:.0f} m"
        alone = abs(self._above) < abs(self._above + off)  # GPS agrees with the height, not with the barometer
        self._is_useless = alone and abs(off) > LARGEST_JUMP
        if not self._is_useless:
            self.pressed = self._corrected = now
            self.ground -= off if alone else 0.0
            self.filter.reset((self.filter.position[0] + (0.0 if alone else off),), self._noise**2)
        return fault

    def correct_by_gps(self, now: float, above_reference: float, variance: float) -> None:
        """Compare with a height by GPS (m above the reference) of a variance (m²), or correct by it alone.

        One that is unknown, NaN, neither agrees nor disagrees.
        """
        if math.isnan(above_reference):
            return
        above = above_reference + self.filter.position[0]
        alone = now - self.pressed > self.timeout
        off = above - self._offset if alone else above
        if not abs(off) <= HEIGHT_JUMP:
            self._apart += 1
            return
        self._apart, self._above = 0, off
        if alone:
            self._corrected = now
            self.filter.correct((self._offset - above_reference,), HEIGHT_FACTOR * variance)
        else:
            self._offset += OFFSET_SHARE * (above - self._offset)

    def fault(self, now: float) -> str:
        """Reason why the height is not trusted; empty if it is."""
        if now - self._corrected > UNCORRECTED:
            return ALONE
        return APART if self._apart >= HEIGHTS and now - self.pressed <= self.timeout else ""
