"""A process that stands still while others send: no system has fallen silent."""

import threading
import time

import pytest

import imc
from runtime.kernel import handler_name
from tests.tasks.transports.imc_station import Station, afloat

STALL = 3.0  # s


class Beating:
    """Sends a Heartbeat ten times a second, whatever the vehicle does."""

    def __init__(self, send):
        self._send, self._stopped = send, threading.Event()
        self._thread = threading.Thread(target=self._beat, daemon=True)

    def _beat(self):
        while not self._stopped.wait(0.1):
            self._send(imc.Heartbeat())

    def __enter__(self):
        self._thread.start()

    def __exit__(self, *_):
        self._stopped.set()
        self._thread.join()


def stand_still_before(vessel, method):
    """Halt the vehicle's thread just before a periodic method that is due already: it runs before sockets are read."""
    kernel, stalled = vessel.vehicle.kernel, threading.Event()

    def halt():
        time.sleep(STALL)
        stalled.set()

    def arrange():
        (tick,) = [timer for timer in kernel.timers() if handler_name(timer.function) == method]
        kernel.at(tick.time - 1, halt)

    kernel.post(arrange)
    assert stalled.wait(STALL + 10.0)
    time.sleep(0.5)


@pytest.mark.heavy
@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter"])
def test_a_stall_is_no_silence_of_a_console_over_udp(profile, tmp_path):
    with afloat(tmp_path, "Transports.UDP:Contact Timeout=2", profile=profile) as vessel:
        console = Station(vessel).join()
        vessel.logged("in contact with ccu-test")
        with Beating(console.send):
            stand_still_before(vessel, "UDP.tick")
        stalls = vessel.vehicle.kernel.stalls.total
        console.get(imc.EstimatedState)
    assert stalls > 2.5e9
    assert not [text for text in vessel.log if "lost contact" in text]
    assert len([text for text in vessel.log if "in contact with ccu-test" in text]) == 1


@pytest.mark.heavy
def test_a_console_that_is_silent_while_the_process_runs_is_lost(tmp_path):
    with afloat(tmp_path, "Transports.UDP:Contact Timeout=2") as vessel:
        Station(vessel).join()
        vessel.logged("in contact with ccu-test")
        began = time.monotonic()
        stand_still_before(vessel, "UDP.tick")
        vessel.logged("lost contact with ccu-test")
        assert time.monotonic() - began < STALL + 5.0
