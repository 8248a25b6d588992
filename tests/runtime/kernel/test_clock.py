"""What every clock keeps, also one that an outside simulator steps."""

import json
import math
import socket
import threading
import time

import pytest

import imc
from runtime import State, Task, periodic
from runtime.kernel import SECOND, Clock, Kernel, VirtualClock, WallClock
from runtime.testing import START, simulate

STEP = SECOND // 250


class Simulator:
    """A program with a time of its own, behind a socket: it advances one step per line, and then says its time.

    In each step it measures a depth.
    """

    def __init__(self, start, end):
        self.near, far = socket.socketpair()
        self._thread = threading.Thread(target=self._serve, args=(far, start, end))
        self._thread.start()

    def _serve(self, far, now, end):
        with far, far.makefile("rw") as file:
            for _ in file:
                if now >= end:
                    return
                now += STEP
                file.write(json.dumps({"time": now, "depth": now % SECOND / SECOND}) + "\n")
                file.flush()

    def close(self):
        self.near.close()
        self._thread.join()


class LockStepClock:
    """Time passes as an outside simulator says, and the kernel waits for it. `deliver` gets what a step measured."""

    virtual = True
    speed = math.inf

    def __init__(self, simulator, start):
        self._file = simulator.near.makefile("rw")
        self._now = start
        self._ahead = None
        self.deliver = lambda found: None

    def read(self):
        return self._now

    def advance(self, target, wait):
        if self._ahead is None:
            self._file.write("step\n")
            self._file.flush()
            line = self._file.readline()
            if not line:
                return None
            self._ahead = json.loads(line)
        if target is not None and target < self._ahead["time"]:
            self._now = target
        else:
            found, self._ahead = self._ahead, None
            self._now = found["time"]
            self.deliver(found)
        return self._now

    def close(self):
        self._file.close()


class ClockContract:
    """The tests that all clocks pass; a subclass makes `clock`."""

    @pytest.fixture
    def kernel(self, clock):
        kernel = Kernel(clock)
        yield kernel
        kernel.close()

    def test_it_is_a_clock(self, clock: Clock):
        assert isinstance(clock.virtual, bool)
        assert clock.speed > 0.0
        assert clock.read() <= clock.read()

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

    def test_another_thread_is_heard(self, kernel):
        begin, seen = kernel.now_ns, []

        def ask():
            time.sleep(0.01)
            kernel.post(seen.append, "asked")

        thread = threading.Thread(target=ask)
        thread.start()
        for number in range(1, 40):
            kernel.at(begin + number * SECOND // 1000, time.sleep, 0.001)
        kernel.run(begin + SECOND)
        thread.join()
        kernel.run(kernel.now_ns + SECOND // 100)
        assert seen == ["asked"]

    def test_a_socket_is_heard(self, kernel):
        here, there = socket.socketpair()
        seen = []
        with here, there:
            kernel.watch(here, lambda: seen.append(here.recv(10)))
            there.send(b"hello")
            begin = kernel.now_ns
            for number in range(1, 100):
                kernel.at(begin + number * SECOND // 10_000, lambda: None)
            kernel.run(begin + SECOND // 50)
            kernel.discard(None)
            kernel.unwatch(here)
        assert seen == [b"hello"]


class TestWallClock(ClockContract):
    @pytest.fixture
    def clock(self):
        return WallClock()


class TestScaledClock(ClockContract):
    @pytest.fixture
    def clock(self):
        return WallClock(speed=3.0, start=START * SECOND)


class TestVirtualClock(ClockContract):
    @pytest.fixture
    def clock(self):
        return VirtualClock(START * SECOND)


class TestLockStepClock(ClockContract):
    @pytest.fixture
    def clock(self):
        simulator = Simulator(START * SECOND, (START + 100) * SECOND)
        clock = LockStepClock(simulator, START * SECOND)
        yield clock
        clock.close()
        simulator.close()


class Diver(Task):
    """Counts ticks, and the steps of the simulator."""

    def start(self):
        self.ticks, self.depths = [], []
        self.vehicle.kernel.clock.deliver = lambda found: self.vehicle.kernel.post(self.measure, found)
        self.set_entity_state(State.NORMAL, "active")

    def measure(self, found):
        self.depths.append((self.now_ns, found["time"]))
        self.publish(imc.Depth(value=found["depth"]))

    @periodic(100.0)
    def tick(self):
        self.ticks.append(self.now_ns)


def dive(seconds):
    simulator = Simulator(START * SECOND, (START + 2) * SECOND)
    clock = LockStepClock(simulator, START * SECOND)
    try:
        run = simulate(Diver, seconds=seconds, clock=clock)
    finally:
        clock.close()
        simulator.close()
    return run


def test_an_outside_simulator_steps_a_vehicle():
    run = dive(1.0)
    task = run.task
    assert [tick - START * SECOND for tick in task.ticks] == [n * SECOND // 100 for n in range(100)]
    assert len(task.depths) == SECOND // STEP - 1, "what the last step measured comes after the run"
    assert all(handled == measured for handled, measured in task.depths)
    assert run.packets == dive(1.0).packets


def test_a_run_ends_when_the_outside_simulator_does():
    task = dive(10.0).task
    assert task.ticks[-1] <= (START + 2) * SECOND
    assert len(task.depths) == 2 * SECOND // STEP
