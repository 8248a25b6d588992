"""Whether measurements agree with each other and with what is known: jumps, repetitions, growing disagreement."""

from dataclasses import dataclass
from enum import Enum, auto

NOISY = 20  # points of noise: each reversal gives two, each step in the same direction takes one
ROUGH_SAMPLES = 40  # over which noise is averaged
COARSE = 10  # a sensor that repeats fewer values than this before the next one has a coarse resolution


class GateDecision(Enum):
    """Decision on a measurement: take it, ignore it, or start again from it."""

    ACCEPTED = auto()
    REJECTED = auto()
    RESET = auto()


@dataclass
class JumpGate:
    """Rejects surprising measurements until `count` in a row agree with each other to within `spread`.

    One that jumps and stays there is accepted in the end: a filter that rejects for ever would never recover.
    """

    count: int
    spread: float

    def __post_init__(self) -> None:
        self.rejected: int = 0
        self._surprise: tuple[float, ...] = ()

    def evaluate(self, surprising: bool, *innovation: float) -> GateDecision:
        """Judge a measurement by its innovation, the difference from what was expected."""
        if not surprising:
            self.rejected = 0
            return GateDecision.ACCEPTED
        agrees = self.rejected and all(
            abs(a - b) <= self.spread for a, b in zip(innovation, self._surprise, strict=True)
        )
        self.rejected = self.rejected + 1 if agrees else 1
        self._surprise = innovation
        if self.rejected < self.count:
            return GateDecision.REJECTED
        self.rejected = 0
        return GateDecision.RESET


def missing_reason(*, stuck: bool, jumps: bool, impossible: bool = False) -> str:
    """Reason why there is no measurement, for people; an `impossible` one is mostly in degrees."""
    return "is impossible in radians" if impossible else "is stuck" if stuck else "jumps" if jumps else "is missing"


class StuckDetector:
    """Notices that a sensor whose noise never let it repeat a value does so now."""

    def __init__(self) -> None:
        self.repetitions: int = 0
        self._value = self._change = 0.0
        self._noise = 0
        self._coarse = False

    @property
    def stuck(self) -> bool:
        """Whether the latest sample repeated the one before, although the sensor has noise."""
        return self.repetitions > 0 and self._noise >= NOISY and not self._coarse

    def update(self, value: float) -> bool:
        """Take a sample; whether it repeats the one before although the sensor has noise."""
        change = value - self._value
        if change == 0.0:
            self.repetitions += 1
            return self.stuck
        self._coarse |= 0 < self.repetitions < COARSE
        self.repetitions = 0
        if self._noise < NOISY:
            self._noise = max(0, self._noise + (2 if change * self._change < 0.0 else -1))
        self._value, self._change = value, change
        return False


@dataclass
class NoiseMonitor:
    """Notices that the noise of a sensor has a larger standard deviation than `limit`; one jump is not noise."""

    limit: float

    def __post_init__(self) -> None:
        self.noisy: bool = False
        self._variance = 0.0
        self._last: float | None = None
        self._before_last: float | None = None

    def update(self, value: float) -> bool:
        """Take a sample; whether they are too noisy."""
        a, b, self._before_last, self._last = self._before_last, self._last, self._last, value
        if a is not None and b is not None:
            bend = (a - 2.0 * b + value) ** 2 / 6.0  # its mean is the variance, also in a steady climb
            most = self.limit**2
            self._variance += (min(bend, 9.0 * most) - self._variance) / ROUGH_SAMPLES
            self.noisy = self._variance > most
        return self.noisy


@dataclass
class Disagreement:
    """Recent divergence of two sensors: the sum of their differences, forgotten within `memory` s."""

    memory: float
    value: float = 0.0

    def add(self, dt: float, difference: float) -> None:
        """Add what they differ by in a step of `dt` s."""
        self.value += difference - self.value * min(1.0, dt / self.memory)


@dataclass
class CumulativeSum:
    """Notices a small difference that stays: sums of differences beyond an allowance, up and down, each at least 0.

    A difference below the allowance adds up to nothing, a larger one without limit, however slow it is (E. S. Page,
    Continuous Inspection Schemes, Biometrika 41, 1954).
    """

    above: float = 0.0
    below: float = 0.0

    def add(self, difference: float, allowance: float) -> None:
        """Add what two sensors differ by, and by how much they may differ meanwhile."""
        self.above = max(0.0, self.above + difference - allowance)
        self.below = max(0.0, self.below - difference - allowance)

    @property
    def value(self) -> float:
        """The larger of both sums."""
        return max(self.above, self.below)

    def reset(self) -> None:
        """Forget both sums."""
        self.above = self.below = 0.0
