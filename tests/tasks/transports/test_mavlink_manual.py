"""Steering by hand over MAVLink: shipped vehicles do what the stick says, and stop when it falls silent."""

import math

import pytest

import imc
from imc import coordinates
from mavlink import encode, load_dialect, split
from tests.mavlink.vehicle.desk import open_session
from tests.tasks.transports.mavlink_station import deliver
from tests.tasks.transports.test_mavlink_vehicles import Commanded, commanded

DIALECT = load_dialect()


class Helmsman:
    """A ground station in a session of its own."""

    def __init__(self, flown, flavor="ardupilot", system=255):
        self.flown, self.system, self.frames = flown, system, []
        self.session = open_session(flown.link.endpoint, flavor, self.frames.append, flown.link.now)
        self.session.contact = True
        self.mine = flown.link.endpoint.model.system

    def say(self, name, **fields):
        definition = DIALECT.by_name[name]
        packet = encode(definition, definition.pack(fields), 0, self.system, 190)
        self.flown.link.endpoint.dispatch(self.session, split(packet, DIALECT)[0][0], self.flown.link.now)

    def heard(self, name):
        found = [m for frame in self.frames for m in split(frame, DIALECT)[0] if m.name == name]
        self.frames.clear()
        return found

    def texts(self):
        return [m.values["text"].decode() for m in self.heard("STATUSTEXT")]

    def steer(self, seconds, **axes):
        for _ in range(int(seconds * 5)):
            self.say("MANUAL_CONTROL", target=self.mine, **axes)
            self.flown.vehicle.run(0.2)

    def order(self, *params, command=176):
        self.say(
            "COMMAND_LONG",
            target_system=self.mine,
            command=command,
            **{f"param{n}": p for n, p in enumerate(params, 1)},
        )
        self.flown.vehicle.run(1.0)
        (ack,) = self.heard("COMMAND_ACK")
        return ack.values["result"]


@pytest.fixture(params=["lauv-noptilus-1", "otter"])
def flown(request, tmp_path):
    with commanded(request.param, tmp_path) as found:
        yield found


@pytest.mark.heavy
@pytest.mark.computing
def test_the_vehicle_follows_the_stick(flown):
    console = Helmsman(flown)
    console.steer(1.0, x=1000, z=500)
    assert flown.modes[-1] == "MANUAL", "nobody has asked to steer"
    assert console.texts() == ["Stick ignored: choose TELEOPERATION to steer"]
    assert console.order(1, 0 if flown.profile == "lauv-noptilus-1" else 3) == 0
    assert flown.modes[-1] == "TELEOPERATION"
    console.steer(20.0, x=1000, z=500)
    before = flown.truths[-1]
    assert math.hypot(before.u, before.v) > 0.5
    console.steer(5.0, x=1000, z=500, r=500)
    turned = math.remainder(flown.truths[-1].psi - before.psi, math.tau)
    assert 0.2 < turned < math.pi
    if flown.profile == "lauv-noptilus-1":
        console.steer(15.0, x=1000, z=0)
        assert flown.truths[-1].z > 1.0, "the stick is down"
    flown.vehicle.run(20.0)
    assert math.hypot(flown.truths[-1].u, flown.truths[-1].v) < 0.3, "silence is neutral"
    assert console.order(1, 19 if flown.profile == "lauv-noptilus-1" else 0) == 0
    assert flown.modes[-1] == "MANUAL"


def test_only_one_station_steers(flown):
    first, second = Helmsman(flown), Helmsman(flown, system=254)
    first.order(1, 0 if flown.profile == "lauv-noptilus-1" else 3)
    actions = []
    flown.vehicle.observe(imc.RemoteActions, lambda message: actions.append(message.actions))
    first.steer(0.4, x=100, z=500)
    second.steer(0.4, x=-900, z=500)
    assert all("Thrust=13" in text for text in actions)
    assert [m.values["text"] for m in second.heard("STATUSTEXT")][-1:] == [b"Another ground station steers"]
    flown.vehicle.run(2.5)
    second.steer(0.4, x=-900, z=500)
    assert "Thrust=-114" in actions[-1]


def test_channels_and_unused_axes(flown):
    console, actions = Helmsman(flown), []
    dives = flown.profile == "lauv-noptilus-1"
    console.order(1, 0 if dives else 3)
    flown.vehicle.observe(imc.RemoteActions, lambda message: actions.append(message.actions))
    console.say(
        "RC_CHANNELS_OVERRIDE",
        target_system=console.mine,
        chan1_raw=1100,
        chan3_raw=1700,
        chan4_raw=1900,
        chan5_raw=1300,
    )
    console.say("MANUAL_CONTROL", target=console.mine, x=32767, y=32767, z=32767, r=32767)
    console.say("MANUAL_CONTROL", target=console.mine + 1, x=1000)
    flown.vehicle.run(0.1)
    expected = ["Heading=127;Thrust=-64;Pitch=64", "Heading=0;Thrust=0;Pitch=0"]
    assert actions == (expected if dives else ["Heading=-127;Thrust=64", "Heading=0;Thrust=0"])


def test_an_aircraft_is_not_steered(tmp_path):
    flown = Commanded("hexa-00", tmp_path)
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    console, modes = Helmsman(flown), flown.modes.copy()
    assert console.order(1, 1) == 2
    console.texts()
    console.steer(2.0, x=0, y=0, z=0, r=0)
    assert console.texts() == [], "the stick is released"
    console.steer(4.0, x=0, y=500, z=500, r=0)
    console.say("RC_CHANNELS_OVERRIDE", target_system=console.mine, chan1_raw=1800)
    assert console.texts() == ["Stick ignored: an aircraft is not steered by hand"]
    other = Helmsman(flown)
    other.steer(0.2, x=600, z=500)
    assert other.texts() == ["Stick ignored: an aircraft is not steered by hand"], "most stations have the id 255"
    console.steer(21.0, x=600, z=500)
    assert console.texts() == ["Stick ignored: an aircraft is not steered by hand"]
    assert flown.modes[-1] == modes[-1]
    flown.vehicle.close()


@pytest.mark.heavy
@pytest.mark.parametrize("action", ["Hold", "Return", "Land", "Stop"])
def test_a_vehicle_that_has_lost_its_stations_does_what_its_profile_says(action, tmp_path):
    flown = Commanded("lauv-noptilus-1", tmp_path)
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    flown.link.gcs_timeout, flown.link.gcs_action = 10.0, action
    state = flown.link.endpoint.model.latest.state
    lat, lon = (math.degrees(angle) for angle in coordinates.absolute_position(state)[:2])
    console = Helmsman(flown)
    link, session = flown.link, console.session

    def say(name, **fields):
        definition = DIALECT.by_name[name]
        packet = encode(definition, definition.pack(fields), 0, 255, 190)
        deliver(link, session, split(packet, DIALECT)[0][0])

    place = dict(x=round((lat + 0.01) * 1e7), y=round(lon * 1e7), z=-3.0, frame=6)
    say("COMMAND_INT", target_system=26, command=192, param1=-1.0, **place)
    for _ in range(20):
        flown.vehicle.run(1.0)
        say("HEARTBEAT", type=6)
    assert flown.modes[-1] == "GUIDED"
    flown.vehicle.run(13.0)
    assert flown.modes[-1] == {"Hold": "HOLD", "Return": "RETURN", "Land": "LAND", "Stop": "MANUAL"}[action]
    assert flown.log.count(f"no ground station for 10 s: {action}") == 1
    flown.vehicle.run(25.0)
    assert flown.log.count(f"no ground station for 10 s: {action}") == 1
    flown.vehicle.close()


def test_the_uploaded_mission_is_there_again_after_a_restart(tmp_path):
    """The database of a vehicle at real time is a file; the task finds its mission there."""
    flown = Commanded("lauv-noptilus-1", tmp_path)
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    goto = imc.PlanManeuver(maneuver_id="Goto0", data=imc.Goto(lat=0.7188, lon=-0.152, z=3.0, z_units=1, speed=1.2))
    plan = imc.PlanSpecification(plan_id="mavlink", start_man_id="Goto0", maneuvers=(goto,))
    flown.say(imc.PlanDB(op=imc.PlanDB.Op.SET, plan_id="mavlink", arg=plan, dst=flown.vehicle.system))
    flown.vehicle.run(1.0)
    flown.link.start()
    assert flown.link.endpoint.mission.plan is None
    flown.link.restore_uploaded_mission(imc.PlanDBState(plans_info=(imc.PlanDBInformation(plan_id="mavlink"),)))
    flown.vehicle.run(1.0)
    flown.vehicle.close()
    assert flown.link.endpoint.mission.plan.plan_id == "mavlink"
