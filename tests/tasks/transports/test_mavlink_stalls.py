"""A computer that stands still: stations, programs and tasks were not silent, although nothing of them was read."""

import math

import pytest

from mavlink import encode, split
from runtime.kernel import SECOND
from tests.tasks.mission.stalling_clock import StallingClock
from tests.tasks.transports.mavlink_station import DIALECT, deliver
from tests.tasks.transports.test_mavlink_vehicles import Commanded

START = 1_750_000_000 * SECOND
CRITICAL = 5  # MAV_STATE
OFFBOARD = 6  # main mode of PX4
STALLS = [(25.3, 5.0), (37.6, 4.0)]


class Program:
    """A program on a ground station, without a socket, that steers by headings."""

    def __init__(self, flown):
        self.flown, self.frames, self.count = flown, [], 0
        self.link = flown.link.link_set.links[0]
        self.session = self.link.sessions["station", 1] = flown.link.connect_peer(self.link, self.frames.append)

    def say(self, name, **fields):
        definition = DIALECT.by_name[name]
        self.count = (self.count + 1) % 256
        (message,), _ = split(encode(definition, definition.pack(fields), self.count, 255, 190), DIALECT)
        deliver(self.flown.link, self.session, message)

    def heard(self, name):
        return [m.values for frame in self.frames for m in split(frame, DIALECT)[0] if m.name == name]


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter"])
def test_a_stall_is_no_silence_of_a_station_a_program_or_a_task(profile, tmp_path):
    clock = StallingClock(START, STALLS)
    clock.speed = 1.0  # by which timeouts of the network are multiplied
    flown = Commanded(profile, tmp_path, clock=clock, gcs_timeout=3.0, peer_timeout=3.0)
    flown.vehicle.start()
    flown.vehicle.run(15.0)
    program, mine = Program(flown), flown.link.endpoint.model.system
    target = {"target_system": mine, "type_mask": 0x07, "thrust": 0.5}
    target["q"] = [math.cos(math.pi / 4.0), 0.0, 0.0, math.sin(math.pi / 4.0)]
    program.say("SET_ATTITUDE_TARGET", **target)
    program.say("COMMAND_LONG", target_system=mine, command=176, param1=1, param2=OFFBOARD)
    program.frames.clear()
    modes = set()
    while clock.time < START + 50 * SECOND:
        program.say("HEARTBEAT", type=6)
        program.say("SET_ATTITUDE_TARGET", **target)
        flown.vehicle.run(0.5)
        modes.add(flown.modes[-1] if clock.time > START + 20 * SECOND else "OFFBOARD")
    notices = [words for _, words in flown.link.endpoint.model.notices]
    beats, kept = program.heard("HEARTBEAT"), program.link.sessions.get(("station", 1))
    flown.vehicle.close()
    assert not clock.stalls
    assert not [text for text in (*flown.log, *notices) if "no ground station" in text or "No more targets" in text]
    assert modes == {"OFFBOARD"}
    assert len(beats) > 20
    assert CRITICAL not in {beat["system_status"] for beat in beats}
    assert kept is program.session
    assert kept.contact
