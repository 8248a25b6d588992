"""Ground stations for tests: a MAVLink session without a socket, and consoles on the bus of shipped vehicles."""

import math

import pytest

import imc
from mavlink import FLAVORS, KINDS, encode, load_dialect, split
from runtime import Task, param
from runtime.testing import simulate
from tasks.transports.mavlink_protocol.parameters import ParameterTable
from tasks.transports.mavlink_protocol.services import serve
from tasks.transports.mavlink_protocol.session import Session, addressed
from tasks.transports.mavlink_protocol.system import MavlinkSystem
from tests.tasks.transports.console import PROFILES, Console
from tests.tasks.transports.mavlink_dive import Dive

DIALECT = load_dialect()
BOOT = 1000.0
SYSTEM = 0x1E


class Lamp(Task):
    """A task with parameters."""

    power: float = param(0.5, "W", "Power.", minimum=0, maximum=10)
    blinks: int = param(3, "1", "Blinks.", minimum=0, maximum=1000)
    red: float = param(1.0, "1", "Red.")
    green: float = param(1.0, "1", "Green.")
    blue: float = param(1.0, "1", "Blue.")


class Desk:
    """One session and the messages sent on it."""

    def __init__(self, flavour="px4", kind="submarine", system=26):
        self.vehicle = simulate(Lamp, seconds=0.0, section="Lamp").vehicle
        self.wishes = []
        self.stops, self.holds, self.requests, self.answers, self.plans = 0, [], [], True, {}
        self.frames = []
        self.autopilot = MavlinkSystem(
            DIALECT,
            name="lauv-noptilus-1",
            system=system,
            kind=KINDS[kind],
            boot=BOOT,
            undulation=0.0,
            rates=lambda: {"ATTITUDE": 10.0, "SYS_STATUS": 2.0},
            parameters=ParameterTable(self.vehicle.tasks),
            entities=lambda: self.vehicle.entities,
            set_parameter=lambda entry, text: self.wishes.append((entry.id, text)),
            imc_id=SYSTEM,
            publish=self.steer,
            say=lambda severity, words: self.session.say(severity, words, self.now),
            speed=lambda: 1.2,
        )
        self.session = Session(self.autopilot, FLAVORS[flavour], self.frames.append, BOOT)
        self.now = BOOT

    def steer(self, request):
        """Take a request to the vehicle, and answer it."""
        if isinstance(request, imc.OperationalLimits):
            self.autopilot.hear(request, "Limits", self.now)
            return
        if isinstance(request, imc.PlanControl) and request.op == imc.PlanControl.Op.STOP:
            self.stops += 1
        elif isinstance(request, imc.PlanControl) and request.plan_id == "hold":
            self.holds.append(request.arg.maneuvers[0].data)
        self.requests.append(request)
        if self.answers:
            kind = imc.PlanControl.Type
            found = self.plans.get(request.plan_id, request.arg)
            self.autopilot.helm.hear(request.replace(type=kind.SUCCESS, src=SYSTEM, dst=SYSTEM, arg=found))

    def locate(self, **fields):
        fields = {"lat": 0.7, "lon": -0.15, "depth": 3.0, "timestamp": self.now} | fields
        self.autopilot.hear(imc.EstimatedState(**fields), "Navigation", self.now)

    def ask(self, name, **fields):
        """Send a message as a ground station; returns the answers."""
        definition = DIALECT.by_name[name]
        (message,), _ = split(encode(definition, definition.pack(fields), 0, 255, 190), DIALECT)
        self.said()
        if addressed(message, 26):
            self.session.hear(message, self.now)
            serve(self.session, message, self.now)
        return self.said()

    def command(self, number, *params, **more):
        named = dict(zip([f"param{i}" for i in range(1, 8)], params, strict=False))
        fields = {"target_system": 26, "target_component": 1, "command": number, **named, **more}
        answers = self.ask("COMMAND_LONG", **fields)
        (ack,) = [m for m in answers if m.name == "COMMAND_ACK"]
        assert (ack.values["command"], ack.values["target_system"], ack.values["target_component"]) == (
            number,
            255,
            190,
        )
        return ack.values["result"], [m for m in answers if m.name != "COMMAND_ACK"]

    def said(self):
        messages = [m for f in self.frames for m in split(f, DIALECT)[0]]
        self.frames.clear()
        return messages

    def listen(self, seconds, name):
        """Run the session for this time; returns the messages with a name."""
        end, found = self.now + seconds, []
        while True:
            due = self.session.pump(self.now)
            found += self.said()
            if due > end:
                self.now = end
                return [m for m in found if name in ("", m.name)]
            assert due > self.now or not found or len(found) < 10000
            self.now = due

    def run(self, seconds):
        """Run the session for this time; returns the names of the messages sent."""
        return [m.name for m in self.listen(seconds, "")]


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


@pytest.fixture
def afloat(desk):
    desk.locate(lat=math.radians(40.1), lon=math.radians(-8.6))
    return desk
