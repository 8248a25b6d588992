"""Missions in an autopilot's memory: the dialogue, what is compared, what a plan becomes, what is refused."""

import math

import pytest

import imc
from mavlink.missions import Item, MissionCommand, MissionResult
from shoal.missions import parse_plan
from support.wgs84 import displace, displacement
from tasks.control.autopilot.kinds import ARDUPILOT, PX4, body_of
from tasks.control.autopilot.leg import Leg, Whereabouts
from tasks.control.autopilot.memory import PATIENCE, TRIES, Memory, Phase, difference_of
from tasks.control.autopilot.mission import Approach, Writer, approach, first_of, item_of

HERE = Whereabouts(math.radians(41.185), math.radians(-8.7062), amsl=40.0, above_home=10.0, psi=1.0)
FINAL = Approach(400.0, 30.0, math.radians(90.0))
ITEMS = [Item(6, MissionCommand.NAV_WAYPOINT, x=411850000 + n, y=-87062000, z=float(n)) for n in range(3)]


def write(text, kind=2, autopilot=ARDUPILOT, **more):
    plan = parse_plan("plan: p\norigin: 41.185°, -8.7062°\nspeed: 5 m/s\naltitude: 20\nmaneuvers:\n" + text)
    return Writer(body_of(autopilot, kind), HERE, 54.6, FINAL, **more).write(plan)


def commands(items):
    return [MissionCommand(item.command).name.removeprefix("NAV_") for item in items]


class Talk:
    """A memory, and what it sends."""

    def __init__(self, first=0):
        self.sent = []
        self.memory = Memory(lambda name, fields: self.sent.append((name, dict(fields))), first)

    def hear(self, name, now=0.0, **values):
        usual = {"mission_type": 0, "opaque_id": 0, "type": 0}
        self.memory.hear(name, {**usual, **values}, now)

    def upload(self, request="MISSION_REQUEST_INT"):
        self.memory.write(ITEMS, 0.0)
        for seq in range(len(ITEMS)):
            self.hear(request, seq=seq)
        self.hear("MISSION_ACK", opaque_id=9)

    def read_back(self, items=ITEMS):
        self.hear("MISSION_COUNT", count=len(items))
        for seq, item in enumerate(items):
            self.hear("MISSION_ITEM_INT", **item.fields(seq))


@pytest.mark.parametrize("request_name", ["MISSION_REQUEST", "MISSION_REQUEST_INT"])
def test_a_mission_is_written_and_read_back(request_name):
    talk = Talk()
    talk.upload(request_name)
    assert talk.sent[0] == ("MISSION_COUNT", {"count": 3})
    assert [fields["seq"] for name, fields in talk.sent if name == "MISSION_ITEM_INT"] == [0, 1, 2]
    assert not talk.memory.ready
    talk.read_back()
    assert talk.memory.ready
    assert talk.sent[-1] == ("MISSION_ACK", {"type": MissionResult.ACCEPTED})


def test_what_was_lost_is_sent_again_and_silence_ends_it():
    talk = Talk()
    talk.memory.write(ITEMS, 0.0)
    talk.hear("MISSION_REQUEST_INT", seq=0, now=1.0)
    talk.hear("MISSION_REQUEST_INT", seq=0, now=1.2)  # our item was lost
    assert [name for name, _ in talk.sent] == ["MISSION_COUNT", *["MISSION_ITEM_INT"] * 2]
    for tick in range(10, 140):
        talk.memory.look_after(tick / 10.0)
    assert len(talk.sent) == 2 + TRIES
    assert talk.memory.phase is Phase.FAILED
    assert f"no answer for {PATIENCE * TRIES:g} s" in talk.memory.error


def test_a_mission_whose_acknowledgment_was_lost_is_read_back_after_silence():
    talk = Talk()
    talk.memory.write(ITEMS, 0.0)
    for seq in range(len(ITEMS)):
        talk.hear("MISSION_REQUEST_INT", seq=seq)
    for tick in range(80):
        talk.memory.look_after(tick / 10.0)
    assert [name for name, _ in talk.sent[-2:]] == ["MISSION_ITEM_INT", "MISSION_REQUEST_LIST"]
    talk.read_back()
    assert talk.memory.ready


def test_a_repeated_last_item_that_is_refused_may_have_been_taken_before():
    """As ArduPilot and PX4 do after the end of an upload."""
    for items, ready in ((ITEMS, True), (ITEMS[:2], False)):
        talk = Talk()
        talk.memory.write(ITEMS, 0.0)
        for seq in range(len(ITEMS)):
            talk.hear("MISSION_REQUEST_INT", seq=seq)
        talk.memory.look_after(PATIENCE)
        talk.hear("MISSION_ACK", type=MissionResult.INVALID_SEQUENCE, now=PATIENCE + 0.1)
        talk.hear("MISSION_ACK", type=MissionResult.INVALID_SEQUENCE, now=PATIENCE + 0.2)  # to one that came late
        talk.read_back(items)
        assert talk.memory.ready is ready
        assert ready or "2 items instead of 3" in talk.memory.error


def test_a_refusal_tells_the_result():
    talk = Talk()
    talk.memory.write(ITEMS, 0.0)
    talk.hear("MISSION_ACK", type=MissionResult.NO_SPACE)
    assert talk.memory.error == "the mission was refused: no space"


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ([*ITEMS, ITEMS[0]], "it has 4 items instead of 3"),
        ([ITEMS[0], ITEMS[1]._replace(x=1), ITEMS[2]], "item 1 has another position"),
        ([ITEMS[0], ITEMS[1], ITEMS[2]._replace(z=3.0)], "item 2 has another height"),
        ([ITEMS[0]._replace(frame=0), *ITEMS[1:]], "item 0 has another frame"),
        ([ITEMS[0]._replace(command=17), *ITEMS[1:]], "item 0 has another command"),
    ],
)
def test_another_mission_read_back_is_no_mission(changed, words):
    talk = Talk()
    talk.upload()
    talk.read_back(changed)
    assert talk.memory.phase is Phase.FAILED
    assert words in talk.memory.error


def test_what_autopilots_round_is_the_same():
    ours = Item(6, MissionCommand.NAV_WAYPOINT, param1=10.4, param2=3.0, param4=math.nan, x=5, y=6, z=12.3456)
    assert not difference_of(ours, ours._replace(frame=3, param1=10.0, param2=0.0, param4=0.0, z=12.35))
    speed = Item(2, MissionCommand.DO_CHANGE_SPEED, param1=1.0, param2=1.5)
    assert difference_of(speed, speed._replace(param2=1.9)) == "param2"


def test_other_missions_of_the_link_and_of_fences_do_not_count():
    talk = Talk()
    talk.upload()
    talk.hear("MISSION_COUNT", count=9, mission_type=1)
    talk.read_back()
    talk.hear("MISSION_CURRENT", seq=0, total=2, mission_id=9)
    assert talk.memory.ready
    talk.hear("MISSION_CURRENT", seq=0, total=2, mission_id=10)
    assert not talk.memory.ready


def test_an_item_of_an_earlier_mission_is_not_taken_for_progress():
    talk = Talk()
    talk.upload()
    talk.read_back()
    talk.hear("MISSION_CURRENT", seq=2, total=2, mission_id=0)  # where ArduPilot was in the mission before
    assert not talk.memory.is_past(0)
    assert not talk.memory.recall(0, 1.0)
    assert talk.sent[-1] == ("MISSION_SET_CURRENT", {"seq": 0})
    talk.hear("MISSION_CURRENT", seq=0, total=2, mission_id=0)
    assert talk.memory.recall(0, 1.1)
    talk.hear("MISSION_CURRENT", seq=1, total=2, mission_id=0)
    assert talk.memory.is_past(0)


def test_a_flight_of_a_copter():
    items = write("""
  - takeoff: {altitude: 6, speed: 2 m/s}
  - goto: {north: 20, height: 104.6}
  - station_keeping: {north: 20, duration: 30}
  - loiter: {north: 0, radius: 10, duration: 60, direction: CCLOCKW}
  - land: {north: 5}
""")
    assert commands(items) == [
        "WAYPOINT", "TAKEOFF", "DO_CHANGE_SPEED", "WAYPOINT", "LOITER_TIME", "LOITER_TURNS", "LAND",
    ]  # fmt: skip
    home, up, speed, there, stay, turns, down = items
    assert (home.frame, home.z) == (0, 30.0)
    assert (up.frame, up.z) == (6, 6.0)
    assert (speed.param1, speed.param2) == (1.0, 5.0)
    assert there.z == pytest.approx(20.0)  # 104.6 m above the ellipsoid, geoid 54.6 m, home 30 m
    assert stay.param1 == 40.0  # longer than Shoal stays
    assert (turns.param1, turns.param3) == (6.0, -10.0)
    assert down.z == 0.0


def test_px4_has_no_home_as_its_first_item_and_a_submarine_goes_down():
    assert commands(write("  - goto: {north: 20}\n", autopilot=PX4)) == ["DO_CHANGE_SPEED", "WAYPOINT"]
    assert write("  - goto: {north: 20, depth: 4}\n", kind=12)[-1].z == -4.0


def test_a_plane_lands_on_its_course():
    items = write("  - takeoff: {altitude: 30}\n  - land: {north: 0, east: 0}\n", kind=1)
    assert commands(items)[-3:] == ["LOITER_TO_ALT", "WAYPOINT", "LAND"]
    begin, passing, end = items[-3:]
    spots = [(math.radians(item.x / 1e7), math.radians(item.y / 1e7)) for item in (begin, passing, end)]
    north, east, _ = displacement(*spots[2], 0.0, *spots[0], 0.0)
    assert (north, east) == pytest.approx((0.0, -400.0), abs=0.1)
    assert (begin.z, passing.z, end.z) == (30.0, 18.0, 0.0)
    assert first_of(items, len(items) - 1) == len(items) - 3


@pytest.mark.parametrize(
    ("wind", "course"),
    [((-4.0, 0.0), 0.0), ((0.0, 3.0), -math.pi / 2), ((0.1, 0.1), HERE.psi), (None, HERE.psi)],
)
def test_a_plane_lands_against_the_wind(wind, course):
    blows = imc.EstimatedStreamVelocity(x=wind[0], y=wind[1]) if wind else None
    assert approach(400.0, 30.0, None, blows, HERE).course == pytest.approx(course)
    assert approach(400.0, 30.0, 2.0, blows, HERE).course == 2.0


@pytest.mark.parametrize(
    ("text", "kind", "autopilot", "words"),
    [
        ("  - loiter: {north: 0, radius: 9, duration: 9, type: EIGHT, length: 30}\n", 2, 3, "figures of eight"),
        ("  - loiter: {north: 0, radius: 9, duration: 9}\n", 2, 12, "PX4 has no circles"),
        ("  - loiter: {north: 0, radius: 9, duration: 0}\n", 11, 3, "circle without end"),
        ("  - idle: {duration: 0}\n", 2, 3, "a wait without end"),
        ("  - idle: {duration: 5}\n", 1, 3, "a plane cannot wait"),
        ("  - goto: {north: 5, depth: 3}\n", 2, 3, "cannot go to a depth"),
        ("  - goto: {north: 5, depth: 3}\n", 11, 3, "cannot dive"),
        ("  - goto: {north: 5, speed: 900 rpm}\n", 2, 3, "must be in m/s"),
        ("  - yo_yo: {north: 5, depth: 3, amplitude: 1, pitch: 10}\n", 12, 3, "does not know YoYo"),
    ],
)
def test_what_no_item_says_is_refused_with_the_maneuver(text, kind, autopilot, words):
    text = text if "depth" in text or kind != 11 else text.replace("duration", "depth: 0, duration")
    with pytest.raises(ValueError, match=r"\d: .*" + words):
        write(text, kind, autopilot)


def test_conditions_are_refused():
    text = "  - goto: {north: 5}\n    then:\n      - {to: Goto1, when: FuelLevel.value < 20}\n      - Goto2\n"
    with pytest.raises(ValueError, match="conditions"):
        write(text + "  - goto: {north: 9}\n")


def leg(north, **flags):
    lat, lon, _ = displace(HERE.lat, HERE.lon, 0.0, north, 0.0)
    path = imc.DesiredPath(end_lat=lat, end_lon=lon, speed=3.0, speed_units=imc.SpeedUnits.METERS_PS, **flags)
    return Leg(path, HERE, 20.0)


def test_a_leg_finds_its_item():
    items = write("  - takeoff: {altitude: 6}\n" + "".join(f"  - goto: {{north: {n}}}\n" for n in (20, 0, 20)))
    found = item_of(leg(20), items, 1)
    assert found is not None
    assert item_of(leg(20), items, found + 1) == found + 2
    assert item_of(leg(5), items, 1) is None
    assert items[item_of(leg(7, flags=imc.DesiredPath.Flags.TAKEOFF), items, 1)].command == MissionCommand.NAV_TAKEOFF
