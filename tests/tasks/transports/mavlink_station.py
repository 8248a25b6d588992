"""A ground station by pymavlink, and vehicles with MAVLink to talk to."""

import itertools
import math
import os
import socket
import tty

import imc
from mavlink import StreamSplitter, encode, load_dialect, split
from runtime import ParameterError, Task, param
from runtime.testing import simulate
from tasks.transports.mavlink import MAVLink

DIALECT = load_dialect()
HOST = "127.0.0.1"
FAST = 5.0
STATE = imc.EstimatedState(lat=math.radians(41.185), lon=math.radians(-8.706), depth=2.0, z=2.0)


class Winch(Task):
    """Has a parameter that depends on another."""

    speed: float = param(1.0, "m/s", "Speed.", minimum=0, maximum=5)
    limit: float = param(2.0, "m/s", "Limit of the speed.", minimum=0, maximum=5)

    def configure(self) -> None:
        if self.speed > self.limit:
            raise ParameterError("Speed", f"is above the limit of {self.limit:g} m/s")


class Station:
    """The socket of a ground station."""

    def __init__(self, script, port=0, system=255, host=HOST):
        self.script = script
        self.socket = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((host, port))
        self.socket.setblocking(False)
        self.port = self.socket.getsockname()[1]
        self.system, self.count = system, itertools.count()
        self.vehicle = None
        self.inbox = []
        self.sequence = []

    def send(self, name, **fields):
        self.transmit(self.frame(name, **fields))

    def frame(self, name, sequence=None, **fields):
        definition = DIALECT.by_name[name]
        sequence = next(self.count) % 256 if sequence is None else sequence
        return encode(definition, definition.pack(fields), sequence, self.system, 190)

    def transmit(self, data):
        self.socket.sendto(data, self.vehicle)

    def order(self, command, *params, target=26):
        named = {f"param{i}": value for i, value in enumerate(params, 1)}
        self.send("COMMAND_LONG", target_system=target, target_component=1, command=command, **named)

    def take(self):
        """Read all received messages."""
        while True:
            try:
                frame, self.vehicle = self.socket.recvfrom(2048)
            except BlockingIOError:
                return self.inbox
            self.sequence.append(frame[4])
            self.inbox += split(frame, DIALECT)[0]

    async def expect(self, name, where=lambda values: True, seconds=20.0):
        """The values of the next message of a name; earlier messages are dropped."""
        end = self.script.now + seconds
        while self.script.now < end:
            self.take()
            while self.inbox:
                message = self.inbox.pop(0)
                if message.name == name and where(message.values):
                    return message.values
            await self.script.sleep(0.01)
        raise AssertionError(f"no {name}")

    async def meet(self, vehicle=None):
        """Wait for the vehicle, or contact it, until both know each other."""
        self.vehicle = vehicle or self.vehicle
        if self.vehicle is None:
            await self.expect("HEARTBEAT")
        self.send("HEARTBEAT", type=6)
        await self.expect("HEARTBEAT")

    async def quiet(self, seconds):
        """The messages received within a time."""
        self.take()
        self.inbox.clear()
        for _ in range(100):
            await self.script.sleep(seconds / 100)
        return self.take()


class StreamStation(Station):
    """A ground station at the other end of a stream of bytes; subclasses `read` and `transmit`."""

    def __init__(self, script, system=255):
        self.script = script
        self.system, self.count = system, itertools.count()
        self.vehicle = "connected"
        self.inbox = []
        self.sequence = []
        self.splitter = StreamSplitter(DIALECT)
        self.damages = 0

    def take(self):
        while data := self.read():
            messages, damages = self.splitter.feed(data)
            self.damages += damages
            self.inbox += messages
            self.sequence += [message.sequence for message in messages]
        return self.inbox


class TcpStation(StreamStation):
    """A ground station that connects, or takes a socket that is connected; its system keeps `room` bytes for it."""

    def __init__(self, script, place, system=255, room=0):
        super().__init__(script, system)
        if isinstance(place, socket.socket):
            self.socket = place
        else:
            self.socket = socket.socket(socket.AF_INET6 if ":" in place[0] else socket.AF_INET)
            if room:
                self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, room)
            self.socket.connect(place)
        self.socket.setblocking(False)
        self.ended = False

    def read(self):
        try:
            data = self.socket.recv(4096)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        self.ended |= not data
        return data

    def transmit(self, data):
        self.socket.sendall(data)


class SerialStation(StreamStation):
    """A ground station at the end of a line, which the vehicle knows by a path."""

    def __init__(self, script, path, system=255):
        super().__init__(script, system)
        self.path = path
        self.plug()

    def plug(self):
        self.end, own = os.openpty()
        tty.setraw(own)
        os.set_blocking(self.end, False)
        self.path.unlink(missing_ok=True)
        self.path.symlink_to(os.ttyname(own))
        os.close(own)

    def unplug(self):
        os.close(self.end)
        self.path.unlink()

    def read(self):
        try:
            return os.read(self.end, 4096)
        except OSError:
            return b""

    def transmit(self, data):
        os.write(self.end, data)


def sail(script, *links, tasks=(), seconds=120.0, clock=None, **parameters):
    """Run the task with links and a script that must finish; in virtual time by default."""
    done = []

    async def through(control):
        await script(control)
        done.append(True)
        control.task.vehicle.stop()

    fleet = [(MAVLink, {"links": list(links), **parameters}), *tasks]
    run = simulate(fleet, seconds=seconds, script=through, clock=clock)
    assert done, "the script did not get through"
    return run


def mavlink(script):
    return script.task.vehicle.task_by_label("MAVLink")


async def until(control, what, seconds=10.0):
    for _ in range(round(seconds / 0.02)):
        if found := what():
            return found
        await control.sleep(0.02)
    raise AssertionError("it did not come")


async def greet(station):
    """Order something, and get the answer."""
    station.order(512, 148)
    assert (await station.expect("COMMAND_ACK"))["result"] == 0


def deliver(task, session, message):
    """Give a message to a task, as a link does."""
    session.numbers = getattr(session, "numbers", itertools.count())
    message.sequence = next(session.numbers) % 256
    if not task.endpoint.receive(session, message, task.now):
        task.after(0.0, task.send_due_messages)


def told(run):
    """The log book, without what a slow computer adds."""
    return [line for line in run.log if "in one handler" not in line]
