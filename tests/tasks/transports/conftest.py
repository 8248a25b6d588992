"""Ground stations for tests: a MAVLink session without a socket, and consoles on the bus of shipped vehicles."""

import pytest

from tests.mavlink.vehicle.desk import Desk
from tests.tasks.transports.console import PROFILES, Console
from tests.tasks.transports.mavlink_dive import Dive


@pytest.fixture(scope="session")
def open_desk():
    """Makes a desk with a flavor and a type of vehicle."""
    return Desk


@pytest.fixture
def desk():
    return Desk()


@pytest.fixture(scope="module", params=PROFILES)
def console(request, tmp_path_factory):
    """A console of a vehicle in SERVICE."""
    found = Console(request.param, tmp_path_factory.mktemp("vehicle"))
    found.calm()
    yield found
    found.vehicle.close()


@pytest.fixture(scope="module")
def noptilus(tmp_path_factory):
    found = Console("lauv-noptilus-1", tmp_path_factory.mktemp("vehicle"))
    found.calm()
    yield found
    found.vehicle.close()


@pytest.fixture(scope="module")
def diving(tmp_path_factory):
    """An AUV under water, on its first circle."""
    found = Dive(tmp_path_factory.mktemp("vehicle"), detection_markers=True)
    found.run(40.0)
    yield found
    found.vehicle.close()


@pytest.fixture
def dive(diving):
    """Both stations are heard of, and have read everything."""
    for station in range(2):
        diving.ask("HEARTBEAT", 0, station=station, seconds=0, type=6)
    return diving
