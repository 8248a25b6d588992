"""A vehicle that is not there, and a ground station without a socket that talks to it: bytes in, bytes out."""

import itertools
import math
from types import MappingProxyType

import imc
from mavlink import FLAVORS, KINDS, encode, load_dialect, split
from mavlink.vehicle import (
    FileEntry,
    LinkTraits,
    VehicleEndpoint,
    VehicleEquipment,
    VehicleIdentity,
    VehicleModel,
    is_addressed,
)
from mavlink.vehicle.files import no_such_file

DIALECT = load_dialect()
BOOT = 1000.0
SYSTEM = 0x1E
State = imc.EntityState.State


class Options:
    """What the profile sets."""

    rates = MappingProxyType({"ATTITUDE": 10.0, "SYS_STATUS": 2.0})
    hold_speed, guided_speed, hold_radius, takeoff_altitude = 1.2, 0.0, 0.0, 10.0
    gcs_timeout, gcs_action, clock_speed = 0.0, "Hold", 1.0
    detection_markers = False


class Entity:
    """A part of the vehicle."""

    def __init__(self, label):
        self.label, self.state, self.description, self.stateful = label, State.BOOT, "initializing", False


class Number:
    """A parameter of an entity, with its declaration: a number within limits."""

    is_list, editable, visibility, choices, unit, description = False, True, "developer", (), "1", "A number."

    def __init__(self, label, name, value, minimum=0, maximum=1000):
        self.label, self.name, self.default, self.type = label, name, value, type(value)
        self.minimum, self.maximum, self.section, self.declaration = minimum, maximum, label, self

    def value(self):
        return self.default

    def text(self):
        return str(self.default)

    def check(self, value):
        if value > self.maximum:
            raise ValueError(f"{value:g} is above the maximum")
        return value

    def format(self, value):
        return f"{value:g}"

    def parse(self, text):
        return self.check(self.type(text))


class Folder:
    """A store of files with the folder `logs`, in which are files by path."""

    def __init__(self, **files):
        self.files = {tuple(path.encode().split(b"/")): content for path, content in files.items()}

    def roots(self):
        return [b"logs"] if self.files else []

    def list_entry_names(self, path):
        depth, path = len(path), tuple(path)
        found = {(each[depth], len(each) > depth + 1) for each in self.files if each[:depth] == path}
        if not found:
            raise no_such_file()
        return sorted(found)

    def entries(self, path, names):
        kinds = dict(self.list_entry_names(path))
        for name in names:
            size = len(self.files.get((*path, name), b""))
            yield FileEntry(name, is_folder=kinds[name], size=size)

    def open(self, path):
        raise no_such_file()


class Pictures:
    """No pictures."""

    def usage(self):
        return 0.0, 0.0, 0.0

    def has(self, file):
        return False

    def shrink(self, file, side, quality, then):
        raise AssertionError(file)


class Desk:
    """One session and the messages sent on it; it is also the port to a vehicle that obeys.

    `ask` lets the autopilot answer a message; `send` takes bytes as a link does.
    """

    imc_id = SYSTEM

    def __init__(self, flavor="px4", kind="submarine", system=26, files=None):
        self.options, self.lamp, self.wishes, self.warnings = Options(), Entity("Lamp"), [], []
        self.stops, self.holds, self.requests, self.answers, self.plans = 0, [], [], True, {}
        self.frames, self.numbers, self.now = [], itertools.count(), BOOT
        numbers = [Number("Lamp", name, value) for name, value in (("Blinks", 3), ("Red", 1.0), ("Green", 1.0))]
        numbers += [Number("Lamp", "Power", 0.5, maximum=10), *(Number("Lamp", f"Level {n}", 1.0) for n in range(6))]
        identity = VehicleIdentity("lauv-noptilus-1", system, KINDS[kind], BOOT)
        model = VehicleModel(identity, self, self.options, lambda: [self.lamp])
        equipment = VehicleEquipment(numbers, files or Folder(), Pictures())
        self.endpoint = VehicleEndpoint(DIALECT, model, self, equipment, warn=self.warnings.append)
        self.traits = LinkTraits(FLAVORS[flavor])
        self.session = self.endpoint.connect(self.traits, self.frames.append, BOOT)

    def age(self, time):
        return self.now - time

    def profile_limit(self, option):
        return math.inf

    def set_parameter(self, entity, name, text):
        self.wishes.append((self.endpoint.parameters.find_entity_parameter(entity, name).id, text))

    def publish(self, request):
        """Take a request to the vehicle, and answer it."""
        if isinstance(request, imc.OperationalLimits):
            self.endpoint.update_state(request, "Limits", self.now)
            return
        if isinstance(request, imc.PlanControl) and request.op == imc.PlanControl.Op.STOP:
            self.stops += 1
        elif isinstance(request, imc.PlanControl) and request.plan_id == "hold":
            self.holds.append(request.arg.maneuvers[0].data)
        self.requests.append(request)
        if self.answers:
            kind = imc.PlanControl.Type
            found = self.plans.get(request.plan_id, request.arg)
            self.endpoint.plans.receive(request.replace(type=kind.SUCCESS, src=SYSTEM, dst=SYSTEM, arg=found))

    def locate(self, **fields):
        fields = {"lat": 0.7, "lon": -0.15, "depth": 3.0, "timestamp": self.now} | fields
        self.endpoint.update_state(imc.EstimatedState(**fields), "Navigation", self.now)

    def frame(self, name, **fields):
        """What a ground station sends."""
        definition = DIALECT.by_name[name]
        return encode(definition, definition.pack(fields), next(self.numbers) % 256, 255, 190)

    def send(self, name, **fields):
        """Send a message as a link does; what was ignored, and the answers."""
        ignored = self.endpoint.receive(self.session, self.frame(name, **fields), self.now)
        return ignored, self.said()

    def ask(self, name, **fields):
        """Send a message as a ground station; returns the answers."""
        (message,), _ = split(self.frame(name, **fields), DIALECT)
        self.said()
        if is_addressed(message, 26):
            self.session.note_contact(self.now)
            self.endpoint.dispatch(self.session, message, self.now)
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
        """Run the endpoint for this time; returns the messages with a name."""
        end, found = self.now + seconds, []
        while True:
            self.endpoint.poll(self.now)
            due = self.endpoint.next_deadline
            found += self.said()
            if due > end:
                self.now = end
                return [m for m in found if name in ("", m.name)]
            assert due > self.now or not found or len(found) < 10000
            self.now = due

    def run(self, seconds):
        """Run the endpoint for this time; returns the names of the messages sent."""
        return [m.name for m in self.listen(seconds, "")]


def open_session(endpoint, flavor, transmit, now):
    """The session of a station that hears nothing but what is sent to it alone."""
    session = endpoint.connect(LinkTraits(FLAVORS[flavor]), transmit, now)
    endpoint.sessions.remove(session)
    return session
