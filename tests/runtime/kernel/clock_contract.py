"""What every clock keeps: subclass ClockContract and make a `clock`."""

import socket
import threading
import time

import pytest

from runtime.kernel import SECOND, Clock, Kernel


class ClockContract:
    """The tests that all clocks pass."""

    @pytest.fixture
    def kernel(self, clock):
        kernel = Kernel(clock)
        yield kernel
        kernel.close()

    def test_time_never_goes_back(self, clock: Clock):
        times = [clock.read() for _ in range(100)]
        assert times == sorted(times)
        assert clock.speed > 0.0

    def test_timers_come_in_order_and_never_early(self, kernel):
        begin, seen = kernel.now_ns, []
        for delay in (30, 10, 20, 10):
            kernel.at(begin + delay * SECOND // 1000, lambda d: seen.append((d, kernel.now_ns - begin)), delay)
        kernel.run(begin + SECOND // 20)
        assert [delay for delay, _ in seen] == [10, 10, 20, 30]
        assert all(passed >= delay * SECOND // 1000 for delay, passed in seen)
        if kernel.virtual:
            assert all(passed == delay * SECOND // 1000 for delay, passed in seen)

    def test_a_run_ends_at_its_time(self, kernel):
        end = kernel.now_ns + SECOND // 50
        kernel.run(end)
        assert kernel.clock.read() >= end
        assert not kernel.virtual or kernel.now_ns == kernel.clock.read() == end

    def test_another_thread_is_received(self, kernel):
        seen = []

        def ask():
            kernel.post(seen.append, "asked")
            kernel.post(kernel.stop)

        thread = threading.Thread(target=ask)
        thread.start()
        self.run_for_a_while(kernel)
        thread.join()
        assert seen == ["asked"]

    def test_a_socket_is_received(self, kernel):
        here, there = socket.socketpair()
        seen = []

        def hear():
            seen.append(here.recv(10))
            kernel.stop()

        with here, there:
            kernel.watch(here, hear)
            there.send(b"hello")
            self.run_for_a_while(kernel)
            kernel.unwatch(here)
        assert seen == [b"hello"]

    def run_for_a_while(self, kernel):
        """Two seconds of the clock, of which a virtual one that does not wait is made to take some real time."""
        begin = kernel.now_ns
        for number in range(1, 100):
            kernel.at(begin + number * SECOND // 50, time.sleep, 0.001)
        kernel.run(begin + 2 * SECOND)
