"""What every clock keeps, also one that an outside simulator steps."""

import json
import math
import socket
import threading

import pytest

import imc
from runtime import State, Task, periodic
from runtime.kernel import SECOND, Kernel, LivelockError, ScaledClock, VirtualClock, WallClock
from runtime.profile import load_profile
from runtime.testing import START, simulate
from runtime.vehicle import build
from tests.runtime.kernel.clock_contract import ClockContract

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


class TestWallClock(ClockContract):
    @pytest.fixture
    def clock(self):
        return WallClock()


class TestScaledClock(ClockContract):
    @pytest.fixture
    def clock(self):
        return ScaledClock(3.0, START * SECOND)


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


def test_a_clock_that_steps_without_events_still_lets_sockets_be_heard():
    class Stepping(VirtualClock):
        def advance(self, target, wait):
            return super().advance(min(target, self.read() + STEP), wait)

    kernel, seen = Kernel(Stepping(0)), []
    here, there = socket.socketpair()
    with here, there:
        kernel.watch(here, lambda: seen.append((here.recv(10), kernel.now_ns)))
        kernel.at(SECOND // 2, there.send, b"hello")
        kernel.run(SECOND)
        kernel.close()
    ((data, when),) = seen
    assert data == b"hello"
    assert SECOND // 2 <= when <= SECOND // 2 + STEP


def test_a_clock_that_stands_still_is_a_livelock():
    class Stuck(VirtualClock):
        def advance(self, target, wait):
            return self.read()

    kernel = Kernel(Stuck(0))
    kernel.livelock_events = 100
    kernel.at(SECOND, print)
    with pytest.raises(LivelockError, match="Stuck"):
        kernel.run()
    kernel.close()


@pytest.mark.parametrize("base", [WallClock, VirtualClock])
def test_a_clock_says_that_no_time_will_ever_pass(base):
    class Ended(base):
        def advance(self, target, wait):
            return None

    kernel = Kernel(Ended())
    kernel.at(kernel.now_ns + 3600 * SECOND, print)
    kernel.run()
    kernel.close()


def swim(clock, folder):
    """The log of five seconds of a shipped vehicle."""
    profile = load_profile("lauv-noptilus-1")
    vehicle = build(profile, profile.parse_modes("Simulation"), clock=clock, log_root=folder).vehicle
    vehicle.start()
    vehicle.run(5.0)
    vehicle.close()
    return [path.read_bytes() for path in sorted(folder.rglob("Data.lsf.gz"))]


def test_a_shipped_vehicle_in_lock_step_writes_the_log_of_a_virtual_run(tmp_path):
    start = load_profile("lauv-noptilus-1").start_time_ns
    simulator = Simulator(start, start + 100 * SECOND)
    clock = LockStepClock(simulator, start)
    try:
        logs = swim(clock, tmp_path / "steps")
    finally:
        clock.close()
        simulator.close()
    assert logs == swim(VirtualClock(start), tmp_path / "virtual")
    assert sum(map(len, logs)) > 10_000


def test_a_shipped_vehicle_ends_its_log_in_order_when_its_simulator_is_killed(tmp_path):
    start = load_profile("lauv-noptilus-1").start_time_ns
    simulator = Simulator(start, start + SECOND)
    clock = LockStepClock(simulator, start)
    try:
        swim(clock, tmp_path)
    finally:
        clock.close()
        simulator.close()
    (path,) = tmp_path.rglob("Data.lsf.gz")
    log = imc.Log(path.parent)
    last = list(log.messages("LoggingControl"))[-1]
    assert (last.op, log.losses) == (imc.LoggingControl.Op.STOPPED, [])
    assert last.timestamp == pytest.approx(start / SECOND + 1.0, abs=STEP / SECOND)
