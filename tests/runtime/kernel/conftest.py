"""Kernels in virtual time and on a wall clock."""

import pytest

from runtime.kernel import Kernel, VirtualClock, WallClock


@pytest.fixture
def kernel():
    made = Kernel(VirtualClock(0))
    yield made
    made.close()


@pytest.fixture
def wall():
    made = Kernel(WallClock(), slow=0.02)
    yield made
    made.close()
