"""The stand-in, told what was told to ArduPilot 4.5.5 in its simulator, answers and moves as ArduPilot did.

The recordings: times (s), what the companion sent (`>`), what the autopilot answered (`<`), where it was (`=`: m north,
east and up, m/s). `stand_in_sources.md` names them for each answer.
"""

import json
import math
import os
import re
from functools import cache
from pathlib import Path

import pytest

os.environ["MAVLINK20"] = "1"
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from tests.tasks.control.autopilot import stand_in_commands
from tests.tasks.control.autopilot.stand_in import StandIn
from tests.tasks.control.autopilot.stand_in_hand import parse_options

RECORDINGS = Path(__file__).parents[3] / "data" / "mavlink"
SOURCES = Path(__file__).with_name("stand_in_sources.md")
KINDS = ("copter", "rover", "submarine")
COMPARED = ("COMMAND_ACK", "HEARTBEAT", "STATUSTEXT", "AUTOPILOT_VERSION", "HOME_POSITION", "GPS_GLOBAL_ORIGIN")
TICK = 0.05  # s


class Line:
    """Where the stand-in writes; `said` has the times and what it said."""

    def __init__(self):
        self.parser, self.said, self.now, self.beat = mavlink.MAVLink(None), [], 0.0, None

    def write(self, data):
        for message in self.parser.parse_buffer(data) or ():
            name, m = message.get_type(), message
            if name == "HEARTBEAT":
                beat = m.type, m.autopilot, m.base_mode, m.custom_mode, m.system_status
                if beat == self.beat:
                    continue
                self.beat, words = beat, beat
            else:
                words = {"COMMAND_ACK": ("command", "result"), "STATUSTEXT": ("severity", "text")}.get(name, ())
                words = tuple(getattr(m, word) for word in words)
            if name in COMPARED:
                self.said.append((self.now, name, *words))


@cache
def conversation(kind):
    """What is recorded, and the answers and places (m, m/s) of the stand-in that was told the same."""
    rows = [json.loads(line) for line in (RECORDINGS / f"sitl_{kind}.jsonl").read_text().splitlines()]
    line, places = Line(), []
    body = StandIn(parse_options(["0", "--kind", kind, "--system", "1"]), line)
    companion = mavlink.MAVLink(None, srcSystem=1, srcComponent=191)
    for time, direction, name, *words in rows:
        while line.now + TICK <= time:
            line.now += TICK
            body.advance(line.now)
        if direction == "=":
            places.append((time, *body.motion.at, math.hypot(*body.motion.velocity[:2])))
        elif direction == ">":
            if name == "COMMAND_LONG":
                numbers = [*words[1:], *[0.0] * (8 - len(words))]
                message = mavlink.MAVLink_command_long_message(1, 1, words[0], 0, *numbers)
            else:
                message = mavlink.MAVLink_set_position_target_global_int_message(
                    0, 1, 1, 6, 0x0DF8, *words[:2], words[2], *[0.0] * 8
                )
            if not (kind == "submarine" and name == "COMMAND_LONG" and words[:2] == [511, 168.0]):
                body.receive(message.pack(companion))
    return rows, line.said, [[time, "=", "STAND_IN", *place] for time, *place in places]


@pytest.mark.parametrize("kind", KINDS)
def test_its_answers_are_those_of_the_recording_in_the_same_order(kind):
    rows, said, _ = conversation(kind)
    recorded = [(name, *words) for _, direction, name, *words in rows if direction == "<"]
    for names in (("COMMAND_ACK", "AUTOPILOT_VERSION"), ("HEARTBEAT",), COMPARED[2:], ("COMMAND_ACK", "HEARTBEAT")):
        ours = [tuple(words) for _, *words in said if words[0] in names]
        theirs = [words for words in recorded if words[0] in names]
        assert ours == theirs


@pytest.mark.parametrize("kind", KINDS)
def test_a_new_mode_is_in_a_heartbeat_at_once_and_arming_in_the_next(kind):
    _, said, _ = conversation(kind)
    for index, (time, name, *words) in enumerate(said):
        if name == "COMMAND_ACK" and words[0] == 176:
            assert said[index + 1][:2] == (time, "HEARTBEAT")


def test_the_first_leg_of_a_copter_is_as_fast_as_in_the_recording():
    rows, _, places = conversation("copter")
    fastest = [max(speed for *_, speed in found) for found in (_between(rows, 48, 57), _between(places, 48, 57))]
    assert fastest[0] == pytest.approx(7.2, abs=0.1), "4 m/s were asked for, and accepted, before the first target"
    assert fastest[1] == pytest.approx(fastest[0], abs=1.5)


def test_the_first_leg_of_a_rover_is_as_fast_as_in_the_recording():
    rows, _, places = conversation("rover")
    fastest = [max(speed for *_, speed in found) for found in (_between(rows, 40, 52), _between(places, 40, 52))]
    assert fastest[0] == pytest.approx(5.1, abs=0.1), "2 m/s were refused before the first target"
    assert fastest[1] == pytest.approx(fastest[0], abs=1.0)


@pytest.mark.parametrize(
    ("kind", "begin", "end", "middle"), [("copter", 70, 102, (40, 40)), ("rover", 70, 98, (40, 30))]
)
def test_its_circles_are_as_wide_as_in_the_recording(kind, begin, end, middle):
    rows, _, places = conversation(kind)
    radii = []
    for found in (_between(rows, begin, end), _between(places, begin, end)):
        away = [math.dist(at[:2], middle) for at in found]
        radii.append(sum(away) / len(away))
    assert radii[1] == pytest.approx(radii[0], abs=0.6)
    assert radii[0] > 12.5, "12 m were wanted: the targets were outside"


def test_a_submarine_does_not_move_while_targets_come_at_5_hz():
    rows, _, places = conversation("submarine")
    for found in (_between(rows, 41, 76), _between(places, 41, 76)):
        assert math.dist(found[-1][:2], found[0][:2]) < 3.0


def test_a_submarine_that_is_asked_for_wind_ends():
    body = StandIn(parse_options(["0", "--kind", "submarine", "--system", "1"]), Line())
    wind = mavlink.MAVLink_command_long_message(1, 1, 511, 0, 168.0, 1e6, 0, 0, 0, 0, 0)
    with pytest.raises(SystemExit, match="PANIC"):
        body.receive(wind.pack(mavlink.MAVLink(None, srcSystem=1, srcComponent=191)))


def test_the_list_of_sources_has_each_answer_and_each_recording():
    """A line without a recording or a public source says so: `none`."""
    rows = re.findall(r"^\| (.+?) \| (.+?) \| (.+?) \|$", SOURCES.read_text(), re.M)[2:]
    listed = {int(number) for answer, *_ in rows for number in re.findall(r"`[A-Z_0-9]+` (\d+)", answer)}
    messages = {int(word.removeprefix("tell_")) for word in dir(StandIn) if re.fullmatch(r"tell_\d+", word)}
    assert set(stand_in_commands.COMMANDS) | messages <= listed
    for answer, _, source in rows:
        named = re.findall(r"`(sitl_\w+\.jsonl)`", source)
        assert named or "none" in source or re.search(r"`\S+\.(cpp|tlog)`", source), answer
        assert all((RECORDINGS / name).exists() for name in named), answer


def _between(found, begin, end):
    """North, east, up and speed between two times, of a recording or of the stand-in."""
    return [row[3:] for row in found if row[1] == "=" and begin <= row[0] <= end]
