"""The mission in an autopilot's memory: the dialogue, what is compared, what is progress."""

import math

import pytest

from mavlink.autopilot.mission_client import PATIENCE, TRIES, MissionClient, MissionPhase, difference_of
from mavlink.missions import Item, MissionCommand, MissionResult

ITEMS = [Item(6, MissionCommand.NAV_WAYPOINT, x=411850000 + n, y=-87062000, z=float(n)) for n in range(3)]


class Talk:
    """A memory, and what it sends."""

    def __init__(self, first=0):
        self.sent = []
        self.memory = MissionClient(lambda name, fields: self.sent.append((name, dict(fields))), first)

    def hear(self, name, now=0.0, **values):
        usual = {"mission_type": 0, "opaque_id": 0, "type": 0}
        self.memory.receive(name, {**usual, **values}, now)

    def upload(self, request="MISSION_REQUEST_INT"):
        self.memory.upload(ITEMS, 0.0)
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
    talk.memory.upload(ITEMS, 0.0)
    talk.hear("MISSION_REQUEST_INT", seq=0, now=1.0)
    talk.hear("MISSION_REQUEST_INT", seq=0, now=1.2)  # our item was lost
    assert [name for name, _ in talk.sent] == ["MISSION_COUNT", *["MISSION_ITEM_INT"] * 2]
    for tick in range(10, 140):
        talk.memory.tick(tick / 10.0)
    assert len(talk.sent) == 2 + TRIES
    assert talk.memory.phase is MissionPhase.FAILED
    assert f"no answer for {PATIENCE * TRIES:g} s" in talk.memory.error


def test_a_mission_whose_acknowledgment_was_lost_is_read_back_after_silence():
    talk = Talk()
    talk.memory.upload(ITEMS, 0.0)
    for seq in range(len(ITEMS)):
        talk.hear("MISSION_REQUEST_INT", seq=seq)
    for tick in range(80):
        talk.memory.tick(tick / 10.0)
    assert [name for name, _ in talk.sent[-2:]] == ["MISSION_ITEM_INT", "MISSION_REQUEST_LIST"]
    talk.read_back()
    assert talk.memory.ready


def test_a_repeated_last_item_that_is_refused_may_have_been_taken_before():
    """As ArduPilot and PX4 do after the end of an upload."""
    for items, ready in ((ITEMS, True), (ITEMS[:2], False)):
        talk = Talk()
        talk.memory.upload(ITEMS, 0.0)
        for seq in range(len(ITEMS)):
            talk.hear("MISSION_REQUEST_INT", seq=seq)
        talk.memory.tick(PATIENCE)
        talk.hear("MISSION_ACK", type=MissionResult.INVALID_SEQUENCE, now=PATIENCE + 0.1)
        talk.hear("MISSION_ACK", type=MissionResult.INVALID_SEQUENCE, now=PATIENCE + 0.2)  # to one that came late
        talk.read_back(items)
        assert talk.memory.ready is ready
        assert ready or "2 items instead of 3" in talk.memory.error


def test_a_refusal_tells_the_result():
    talk = Talk()
    talk.memory.upload(ITEMS, 0.0)
    talk.hear("MISSION_ACK", type=MissionResult.NO_SPACE)
    assert talk.memory.error == "the mission was rejected: no space"


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
    assert talk.memory.phase is MissionPhase.FAILED
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
    assert not talk.memory.head_for(0, 1.0)
    assert talk.sent[-1] == ("MISSION_SET_CURRENT", {"seq": 0})
    talk.hear("MISSION_CURRENT", seq=0, total=2, mission_id=0)
    assert talk.memory.head_for(0, 1.1)
    talk.hear("MISSION_CURRENT", seq=1, total=2, mission_id=0)
    assert talk.memory.is_past(0)
