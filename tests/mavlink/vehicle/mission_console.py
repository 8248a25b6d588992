"""A ground station that speaks the mission protocol to a vehicle without a socket."""

import math

import imc
from mavlink import encode, load_dialect, split
from tests.mavlink.vehicle.desk import open_session

DIALECT = load_dialect()
ACCEPTED, ERROR, BAD_FRAME, UNSUPPORTED, NO_SPACE, INVALID = range(6)
INVALID_5, INVALID_7, BAD_SEQUENCE, DENIED, CANCELLED = 10, 12, 13, 14, 15
MISSION, FENCE, RALLY, ALL = 0, 1, 2, 255
LAT, LON = 401_000_000, -86_000_000


def waypoint(seq, **fields):
    """A waypoint 10 m under water."""
    usual = dict(frame=6, command=16, autocontinue=1, x=LAT + 1000 * seq, y=LON, z=-10.0, param4=math.nan)
    return {"seq": seq, "target_system": 26, "target_component": 1, **usual, **fields}


def read(said):
    """The texts in messages, their pieces put together."""
    texts = {}
    for number, message in enumerate(m for m in said if m.name == "STATUSTEXT"):
        key = message.values["id"] or -number
        texts[key] = texts.get(key, "") + message.values["text"].decode()
    return list(texts.values())


class Console:
    """A ground station of the desk's vehicle, in its own session."""

    def __init__(self, desk, flavor="px4", system=255):
        self.desk, self.system, self.frames = desk, system, []
        self.session = open_session(desk.endpoint, flavor, self.frames.append, desk.now)
        self.session.contact = True

    def say(self, name, **fields):
        definition = DIALECT.by_name[name]
        packet = encode(
            definition, definition.pack({"target_system": 26, "target_component": 1, **fields}), 0, self.system, 190
        )
        (message,), _ = split(packet, DIALECT)
        self.desk.endpoint.dispatch(self.session, message, self.desk.now)
        return self.heard()

    def heard(self):
        found = [m for frame in self.frames for m in split(frame, DIALECT)[0]]
        self.frames.clear()
        assert all(m.values.get("target_system", self.system) == self.system for m in found)
        return found

    def upload(self, items, kind=MISSION):
        """Upload items as a station without losses; the ACK and the texts."""
        said = self.say("MISSION_COUNT", count=len(items), mission_type=kind)
        while requests := [m for m in said if m.name == "MISSION_REQUEST_INT"]:
            (request,) = requests
            assert request.values["mission_type"] == kind
            said = self.say("MISSION_ITEM_INT", **items[request.values["seq"]], mission_type=kind)
        (ack,) = [m for m in said if m.name == "MISSION_ACK"]
        assert ack.values["mission_type"] == kind
        return ack.values, read(said)

    def download(self, kind=MISSION, name="MISSION_REQUEST_INT"):
        (count,) = self.say("MISSION_REQUEST_LIST", mission_type=kind)
        items = [self.say(name, seq=n, mission_type=kind)[0] for n in range(count.values["count"])]
        assert self.say("MISSION_ACK", type=0, mission_type=kind) == []
        return count.values, [m.values for m in items]

    def current(self):
        (message,) = [m for m in self.say("COMMAND_LONG", command=512, param1=42) if m.name == "MISSION_CURRENT"]
        return message.values


def follow(desk, state, man="", outcome=0, plan="mavlink"):
    kind = imc.PlanControlState
    desk.endpoint.update_state(
        kind(state=state, plan_id=plan, man_id=man, last_outcome=outcome), "Plan Engine", desk.now
    )
