"""The parts that lead an autopilot: addresses, commands, its clock, legs."""

import math

import pytest

import imc
from support.wgs84 import displace, displacement
from tasks.control.autopilot.address import parse_place
from tasks.control.autopilot.clock import RemoteClock
from tasks.control.autopilot.leg import Leg, Reach, Whereabouts, height_above_home
from tasks.control.autopilot.orders import DROPPED, MOST, SILENT, Orders, in_words

HERE = Whereabouts(lat=0.7188, lon=-0.1519, amsl=40.0, above_home=10.0)
Units = imc.ZUnits


def path(**values):
    return imc.DesiredPath(
        **{"end_lat": HERE.lat, "end_lon": HERE.lon, "end_z": 10.0, "end_z_units": Units.ALTITUDE, "speed": 3.0,
           "speed_units": imc.SpeedUnits.METERS_PS, **values}
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("udpin://127.0.0.1:14560", ("udpin", "127.0.0.1", 14560, "", 57600)),
        ("udpout://[::1]:14550", ("udpout", "::1", 14550, "", 57600)),
        ("tcpout://sitl.local:5760", ("tcpout", "sitl.local", 5760, "", 57600)),
        ("serial:///dev/ttyAMA0?baud=921600", ("serial", "", 0, "/dev/ttyAMA0", 921600)),
    ],
)
def test_addresses(text, found):
    place = parse_place(text)
    assert (place.scheme, place.host, place.port, place.device, place.baud) == found


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("127.0.0.1:14560", "is not udpin://"),
        ("udpinn://127.0.0.1:1", "did you mean 'udpin'"),
        ("udpin://127.0.0.1", "a port from 1 to 65535"),
        ("udpin://127.0.0.1:99999", "a port from 1 to 65535"),
        ("serial://?baud=9600", "names no device"),
        ("serial:///dev/tty1?baud=fast", "'fast' is not a baud rate"),
        ("serial:///dev/tty1?speed=9600", "'speed' is not an option"),
    ],
)
def test_wrong_addresses_are_named(text, reason):
    with pytest.raises(ValueError, match="^.*" + reason.replace("?", "[?]")):
        parse_place(text)


class Line:
    """Records what is sent, and the results."""

    def __init__(self):
        self.sent, self.results = [], []
        self.orders = Orders(lambda _, fields: self.sent.append((fields["command"], fields.get("confirmation"))))

    def give(self, command, now, **how):
        self.orders.give("COMMAND_LONG", {"command": command}, lambda r: self.results.append((command, r)), now, **how)


def test_a_command_is_repeated_until_it_is_acknowledged_and_only_its_own_answer_counts():
    line = Line()
    line.give(400, 0.0)
    line.give(176, 0.0)
    line.orders.look_after(1.0)
    line.orders.hear(176, 0, 1.1)
    line.orders.hear(400, 5, 1.1)
    line.orders.look_after(5.0)
    assert line.sent == [(400, 0), (400, 1)]
    line.orders.hear(400, 2, 6.0)
    line.orders.hear(176, 0, 6.1)
    assert line.results == [(400, 2), (176, 0)]
    assert line.sent[2:] == [(176, 0)]


def test_a_command_without_an_answer_is_given_up_and_urgent_ones_overtake():
    line = Line()
    for command in (1, 2):
        line.give(command, 0.0)
    line.give(3, 0.0, urgent=True)
    for tenth in range(80):
        line.orders.look_after(tenth / 10.0)
    assert line.results == [(3, SILENT)]
    assert [command for command, _ in line.sent] == [1, *[3] * 6, 1, 1]


@pytest.mark.parametrize("urgent", [False, True])
def test_a_command_that_is_dropped_since_too_many_wait_is_answered_with_the_reason(urgent):
    line = Line()
    for command in range(MOST + 1):  # the first is sent, the others wait
        line.give(command, 0.0)
    assert line.results == []
    line.give(1000, 0.0, urgent=urgent)
    assert line.results == [(MOST, DROPPED)]
    assert in_words(DROPPED) == "not sent: 64 other commands wait"
    for command in (0, *range(1, MOST), 1000) if not urgent else (1000, *range(MOST)):
        line.orders.hear(command, 0, 1.0)
    assert [command for command, result in line.results if result == 0].count(1000) == 1
    assert len(line.results) == MOST + 2
    assert not line.orders.busy


def test_the_clock_of_the_autopilot():
    clock = RemoteClock()
    clock.hear(10.0, 1010.3)
    clock.hear(11.0, 1011.1)  # a faster message
    assert clock.time(12.0, 1013.0) == pytest.approx(1012.1, abs=1e-3)
    clock.compare(1013.0, 12.96, 1013.02)  # 10 ms each way: its clock is 1000.05 s behind
    assert clock.time(13.0, 1013.5) == pytest.approx(1013.05)
    clock.compare(1014.0, 20.0, 1014.6)  # too slow to believe
    assert clock.time(13.0, 1013.5) == pytest.approx(1013.05)
    assert clock.time(1.0, 1013.5) == 1013.5, "a stamp that is too old is not believed"
    assert clock.hear(0.5, 1020.0)
    assert clock.time(0.5, 1020.0) == 1020.0


@pytest.mark.parametrize(
    ("values", "flies", "dives", "height"),
    [
        ({"end_z": 25.0}, True, False, 25.0),
        ({"end_z": 25.0, "end_z_units": Units.NONE}, True, False, 10.0),
        ({"end_z": 104.6, "end_z_units": Units.HEIGHT}, True, False, 20.0),
        ({"end_z": 4.0, "end_z_units": Units.DEPTH}, False, True, -4.0),
        ({"end_z": 0.0, "end_z_units": Units.DEPTH}, False, False, 0.0),
        ({"end_z": 4.0, "end_z_units": Units.DEPTH}, False, False, "cannot dive"),
        ({"end_z": 4.0, "end_z_units": Units.DEPTH}, True, False, "cannot go to a depth"),
        ({"end_z": 4.0}, False, True, "cannot go to an altitude"),
    ],
)
def test_heights(values, flies, dives, height):
    if isinstance(height, str):
        with pytest.raises(ValueError, match=height):
            height_above_home(path(**values), HERE, 54.6, flies=flies, dives=dives)
    else:
        assert height_above_home(path(**values), HERE, 54.6, flies=flies, dives=dives) == pytest.approx(height)


@pytest.mark.parametrize(
    "wrong",
    [{"speed": 0.0}, {"speed_units": imc.SpeedUnits.RPM}, {"end_lat": math.nan}, {"end_lat": 2.0}, {"end_lon": 0.5}],
)
def test_a_leg_that_cannot_be_followed_is_refused(wrong):
    with pytest.raises(ValueError, match=r"speed|position|longer"):
        Leg(path(**wrong), HERE, 10.0)


@pytest.mark.parametrize("flags", [0, imc.DesiredPath.Flags.CCLOCKW])
@pytest.mark.parametrize("away", [2.0, 20.0, 60.0])
def test_who_heads_for_the_target_ends_on_the_circle(flags, away):
    leg = Leg(path(lradius=20.0, flags=flags), HERE, 10.0)
    north, east, turned = away, 0.0, 0.0
    for _ in range(1200):
        lat, lon, _ = displace(HERE.lat, HERE.lon, 0.0, north, east)
        to = displacement(lat, lon, 0.0, *leg.target(Whereabouts(lat, lon, 40.0, 10.0)), 0.0)
        before, length = math.atan2(east, north), math.hypot(*to[:2])
        north, east = north + 0.3 * to[0] / length, east + 0.3 * to[1] / length
        turned += math.remainder(math.atan2(east, north) - before, math.tau)
    assert math.hypot(north, east) == pytest.approx(20.0, abs=0.3)
    assert turned * (-1.0 if flags else 1.0) > 6.0
    assert leg.advance(Whereabouts(lat, lon, 40.0, 10.0), Reach(2.0, 0.4))
    assert leg.loitering
