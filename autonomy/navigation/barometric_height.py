"""Heights by a barometer."""

from autonomy.navigation.fault_detection import NoiseMonitor, StuckDetector, missing_reason
from autonomy.navigation.sample_mean import SampleMean

NOISE_FACTOR = 5.0  # what is noisier than so many standard deviations is not used
HIGHEST_PRESSURE = 2000.0  # hPa


def pressure_altitude(pressure: float) -> float:
    """Height (m) of a pressure (hPa) above that of 1013.25 hPa in the standard atmosphere; ISO 2533:1975."""
    return 288.15 / 0.0065 * (1.0 - (pressure / 1013.25) ** (1.0 / 5.25588))


class BarometricHeight:
    """Averages heights between two steps, without impossible, stuck and noisy ones; `noise` (m) is the usual one."""

    def __init__(self, noise: float):
        self.mean: SampleMean = SampleMean()
        self._repetitions, self._roughness = StuckDetector(), NoiseMonitor(NOISE_FACTOR * noise)

    def receive(self, now: float, pressure: float) -> bool:
        """Take a pressure (hPa) at a time (s); returns whether it is possible."""
        if not 0.0 < pressure < HIGHEST_PRESSURE:
            return False
        if not self._repetitions.update(pressure):
            height = pressure_altitude(pressure)
            if not self._roughness.update(height):
                self.mean.add(now, height)
        return True

    def missing_reason(self, *, jumps: bool) -> str:
        """Reason for missing heights, for people."""
        return missing_reason(stuck=self._repetitions.stuck, jumps=jumps or self._roughness.noisy)
