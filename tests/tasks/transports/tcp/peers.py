"""The other end of a TCP connection, and a vehicle with a task that speaks and hears."""

import socket
import time

import imc
from runtime import Task, consume, periodic
from runtime.kernel import WallClock
from runtime.testing import simulate
from tasks.transports.tcp.server import Server
from tests.outside import PATIENCE

HOST, VEHICLE, CONSOLE = "127.0.0.1", 0x001A, 0x4000
SILENT_FOR = 0.4  # s, in place of 2.5 s


def packet(message, source=CONSOLE, order="little", target=VEHICLE):
    return imc.encode(message.replace(src=source, src_ent=0, dst=target, timestamp=1.0), order)


class Peer:
    """One end of a connection, in the hands of a test."""

    def __init__(self, opened):
        self.socket = opened
        self.socket.setblocking(False)
        self.parser = imc.StreamParser()
        self.heard, self.closed = [], False

    @classmethod
    def of(cls, port):
        return cls(socket.create_connection((HOST, port)))

    def send(self, data):
        self.socket.setblocking(True)
        self.socket.sendall(data)
        self.socket.setblocking(False)

    def take(self):
        try:
            while data := self.socket.recv(1 << 16):
                self.heard += self.parser.feed(data)
            self.closed = True
        except BlockingIOError:
            pass
        except OSError:
            self.closed = True
        return self.heard

    def of_type(self, kind):
        return [message for message in self.take() if isinstance(message, kind)]


class Depths(Task):
    """Publishes its depth, and counts how late it is."""

    def start(self):
        self.count, self.times, self.heard = 0, [], []

    @periodic(100.0)
    def tell(self):
        self.count += 1
        self.times.append(time.monotonic())
        self.publish(imc.Depth(value=float(self.count)))

    @consume(others=True)
    def hear(self, message: imc.Abort | imc.PlanControl | imc.Heartbeat):
        if message.src != self.system:
            self.heard.append(message)


def run(test, task=Server, clock=None, **parameters):
    """Run a task with Depths, by default on a wall clock, until the coroutine `test(script, task, depths)` ends."""
    clock = clock or WallClock()
    errors = []

    async def guarded(script):
        vehicle = script.task.vehicle
        try:
            await test(script, vehicle.task(f"Transports.TCP.{task.__name__}"), vehicle.tasks[1])
        except BaseException as error:
            errors.append(error)
        vehicle.stop()

    place = {"port": 0} if task is Server else {}
    wanted = [Depths, (task, {**place, "transports": ["Depth"], **parameters})]
    done = simulate(wanted, clock=clock, seconds=4.0 * PATIENCE * clock.speed, script=guarded)
    if errors:
        raise errors[0]
    return done


async def until(script, condition, seconds=PATIENCE):
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, "it does not happen"
        await script.sleep(0.005)
    return found
