"""The clock of an autopilot, which counts from its start."""

import pytest

from mavlink.autopilot.boot_clock import BootClock


def test_the_clock_of_the_autopilot():
    clock = BootClock()
    clock.update(10.0, 1010.3)
    clock.update(11.0, 1011.1)  # a faster message
    assert clock.time(12.0, 1013.0) == pytest.approx(1012.1, abs=1e-3)
    clock.apply_timesync(1013.0, 12.96, 1013.02)  # 10 ms each way: its clock is 1000.05 s behind
    assert clock.time(13.0, 1013.5) == pytest.approx(1013.05)
    clock.apply_timesync(1014.0, 20.0, 1014.6)  # too slow to believe
    assert clock.time(13.0, 1013.5) == pytest.approx(1013.05)
    assert clock.time(1.0, 1013.5) == 1013.5, "a stamp that is too old is not believed"
    assert clock.update(0.5, 1020.0)
    assert clock.time(0.5, 1020.0) == 1020.0
