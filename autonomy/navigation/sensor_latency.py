"""Whether accelerometer and barometer of a multirotor show its motion at once, or late, held or drifting."""

import math
from bisect import bisect_left, bisect_right
from collections import deque

from autonomy.navigation.inertial_filter import InertialFilter

GRAVITY = 9.80665
MEMORY = 2.0  # s, of forces that are compared
WASHOUT = 1.5  # s; slower changes, as of the load, are not compared
ROTOR_LAG = 0.08  # s, of the rotors' speed behind its command
LONGEST, COARSENESS = 4.5, 0.3  # s: latencies that are tried, and their steps
LATENCIES = tuple(i * COARSENESS for i in range(2, 1 + int(LONGEST / COARSENESS)))  # one step may be the rotors'
FORGOTTEN = 4.0 * MEMORY  # s, after which less than two hundredths of a difference are left
STIRRED = 0.25  # m²/s³, squared changes of the force in MEMORY from which it can be judged
EXPLAINED = 0.5  # share of the squared differences that the best latency leaves of those without latency
FOLLOWS = 0.35  # share of the squared changes of the thrust that a force which follows leaves
LEAST_MADE = 1.0  # m/s², below which the force shows no load
LOAD_TIME = 0.3  # s, in which the scale of the force follows another load
LONGEST_JUDGED = 0.06  # s; over a longer step, of a computer that is late, the mean force is that of an earlier command
EXPLAINED_FOR, WITHIN = 2.0, 0.15  # s, and the share by which a force may differ from a thrust in this time

ACCELERATION_NOISE, BIAS_WALK = 0.002, 5e-4  # m/s²/√Hz, m/s³/√Hz: corrects by the barometer within some seconds
AT_REST, IN_THE_AIR = (0.02, 1e-4, 4e-4), (0.02, 0.09, 1e-3)  # variances: m², (m/s)², (m/s²)²
BAROMETER_NOISE = 0.15  # m
APART, APART_FOR = 1.0, 0.3  # m, s: a barometer that differs by more, for so long, contradicts the accelerometer


class ThrustResponseCheck:
    """Compares the specific force along the mast (m/s²) with the one that the commanded thrust makes.

    `lags` if forces of some time before explain the measured one better than those of now, and than another load does,
    which scales the force; until it follows again.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start over: the vehicle rests."""
        self.lags: bool = False
        self._begin(COARSENESS)  # thrust of the takeoff that has not arrived yet, on a slow computer, is no latency

    def resume(self) -> None:
        """Compare nothing of before, since it is unknown which thrust the vehicle had meanwhile.

        Nothing is judged until there is a thrust of each latency.
        """
        self._begin(LONGEST)

    def _begin(self, wait: float) -> None:
        self._wait = wait
        self._made: float | None = None
        self._usual = self._usual_force = 0.0
        self._times: list[float] = []  # of the history, s
        self._thrusts: list[float] = []
        self._changes: list[float] = []  # of the thrust
        self._at_once, self._late = 0.0, [0.0] * len(LATENCIES)
        self._waiting: deque[tuple[float, float, float, float]] = deque()  # time, step, share kept, change of the force
        self._is_forgotten = False  # whether the differences of before are too old
        self._stirred = 0.0
        self._scale, self._off_scaled = 1.0, 0.0

    def update(self, now: float, dt: float, expected: float, force: float | None) -> None:
        """A force `dt` s after the last at a time (s), None if it is unknown, and the one that is `expected`."""
        if self._made is None:
            self._made = self._usual = expected
            self._usual_force = expected if force is None else force
        # Thrust is the square of the rotors' speed, and so it goes faster than it comes back.
        speed, wanted = math.sqrt(max(0.0, self._made)), math.sqrt(max(0.0, expected))
        self._made = (speed + (wanted - speed) * -math.expm1(-dt / ROTOR_LAG)) ** 2
        share = min(1.0, dt / WASHOUT)
        self._usual += share * (self._made - self._usual)
        change = self._made - self._usual
        self._record(now, self._made, change)
        self._wait -= dt
        if force is None or dt >= LONGEST_JUDGED or self._wait > 0.0:
            self._usual_force += share * (self._made - self._usual_force)
            return
        self._usual_force += share * (force - self._usual_force)
        measured, keep = force - self._usual_force, max(0.0, 1.0 - dt / MEMORY)
        self._stirred = keep * self._stirred + dt * change * change
        self._at_once = at_once = keep * self._at_once + dt * (measured - change) ** 2
        self._waiting.append((now, dt, keep, measured))
        self._off_scaled = keep * self._off_scaled + dt * (force - self._scale * self._made) ** 2
        self._scale += min(1.0, dt / LOAD_TIME) * (force / max(self._made, LEAST_MADE) - self._scale)
        if self.lags:
            self.lags = not (self._stirred > STIRRED and at_once < FOLLOWS * self._stirred)
        elif at_once > STIRRED:
            by_load = min(at_once, self._off_scaled)
            self.lags = self._least_late() < min(EXPLAINED * by_load, FOLLOWS * self._stirred)

    def _least_late(self) -> float:
        """The squared differences of the latency that explains the force best.

        In calm flight nobody asks, so the forces since the last call are compared with earlier thrusts here.
        """
        times, changes, found = self._times, self._changes, self._late
        if self._is_forgotten:
            found[:] = [0.0] * len(LATENCIES)
            self._is_forgotten = False
        if len(self._waiting) > 1:
            self._compare_waiting()
        else:
            now, dt, keep, measured = self._waiting[0]
            for number, late in enumerate(LATENCIES):  # the oldest change is that of all times before it
                apart = measured - changes[bisect_right(times, now - late, 1) - 1]
                found[number] = keep * found[number] + dt * (apart * apart)
        self._waiting.clear()
        return min(found)

    def _compare_waiting(self) -> None:
        """Compare many forces: seconds of them come in one step, which a search for each would delay too much."""
        times, changes, last = self._times, self._changes, len(self._times) - 1
        first = self._waiting[0][0]
        for number, late in enumerate(LATENCIES):
            found, at = self._late[number], bisect_right(times, first - late, 1) - 1
            for now, dt, keep, measured in self._waiting:
                earlier = now - late
                while at < last and times[at + 1] <= earlier:
                    at += 1
                apart = measured - changes[at]
                found = keep * found + dt * (apart * apart)
            self._late[number] = found

    def _record(self, now: float, thrust: float, change: float) -> None:
        times = self._times
        times.append(now)
        self._thrusts.append(thrust)
        self._changes.append(change)
        while self._waiting and self._waiting[0][0] < now - FORGOTTEN:
            self._waiting.popleft()
            self._is_forgotten = True
        oldest, old = now - LONGEST - COARSENESS - FORGOTTEN, 0
        while times[old] < oldest:  # mostly it is one
            old += 1
        if old:
            del times[:old], self._thrusts[:old], self._changes[:old]

    @property
    def made(self) -> float:
        """The specific force (m/s²) that the thrust makes now, some time behind its command."""
        return GRAVITY if self._made is None else self._made

    def explains(self, now: float, force: float) -> bool:
        """Whether a thrust of the last seconds makes such a force, so that the load may be as before."""
        if not self._times or self._times[-1] < now - EXPLAINED_FOR:
            return False
        if self._thrusts[-1] * (1.0 - WITHIN) <= force <= self._thrusts[-1] * (1.0 + WITHIN):
            return True  # mostly the last one does
        made = self._thrusts[bisect_left(self._times, now - EXPLAINED_FOR) :]
        return min(made) * (1.0 - WITHIN) <= force <= max(made) * (1.0 + WITHIN)


class BarometerLagCheck:
    """Height and vertical speed by the accelerometer, corrected slowly: a barometer that is late or drifts differs.

    `filter` has m and m/s downward. `contradicts` if the barometer differs, and heights by GPS do not side with it.
    """

    def __init__(self) -> None:
        self.start(0.0)

    def start(self, height: float, bias: float = 0.0) -> None:
        """Start at rest, at a height (m) and with a bias of the accelerometer (m/s²)."""
        self._begin(-height, 0.0, bias, AT_REST)
        self.contradicts: bool = False

    def _begin(self, down: float, speed: float, bias: float, variances: tuple[float, float, float]) -> None:
        self.filter: InertialFilter = InertialFilter(1, ACCELERATION_NOISE, BIAS_WALK, variances)
        self.filter.position[0], self.filter.velocity[0], self.filter.bias[0] = down, speed, bias
        self._apart = 0.0

    def resume(self, down: float, speed: float, bias: float) -> None:
        """Continue from m and m/s downward, and a bias of the accelerometer (m/s²)."""
        self._begin(down, speed, bias, IN_THE_AIR)

    def advance(self, dt: float, acceleration: float) -> None:
        """Advance by `dt` s with an acceleration downward (m/s²)."""
        self.filter.predict(dt, (acceleration,))

    def correct(self, dt: float, down: float, down_by_gps: float | None) -> None:
        """Compare with a barometric position (m downward), `dt` s after the last, and with one by GPS if known."""
        off = down - self.filter.position[0]
        self._apart = self._apart + dt if abs(off) > APART else 0.0
        if 0.0 < self._apart <= APART_FOR:
            return
        if self._apart > APART_FOR:
            by_gps = None if down_by_gps is None else down_by_gps - self.filter.position[0]
            if by_gps is None or abs(by_gps) < abs(off - by_gps):
                self.contradicts = True
                return
        self.filter.correct((down,), BAROMETER_NOISE**2)
