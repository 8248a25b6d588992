"""The modes that are offered are those that can be chosen, and CURRENT_MODE says which one is and was meant."""

import pytest

from mavlink import CUSTOM_MODE, FLAVORS, KINDS, encode, load_dialect, split
from tests.mavlink.vehicle.desk import open_session
from tests.tasks.transports.mavlink_station import deliver
from tests.tasks.transports.test_mavlink_vehicles import Commanded

DIALECT = load_dialect()
ACCEPTED, NOT_SELECTABLE = 0, 2
HOLD, RETURN = 1, 5  # MAV_STANDARD_MODE
AVAILABLE_MODES, MONITOR, CURRENT_MODE = 435, 437, 436
REPOSITION, SET_MODE, SET_STANDARD_MODE, REQUEST = 192, 176, 262, 512


class Watcher:
    """A station without a socket."""

    def __init__(self, flown, flavor):
        self.link, self.frames, self.flown = flown.link, [], flown
        self.session = open_session(self.link.endpoint, flavor, self.frames.append, self.link.now)
        flown.link.endpoint.sessions[:] = [self.session]

    def say(self, name, **fields):
        definition = DIALECT.by_name[name]
        packet = encode(definition, definition.pack({"target_system": 26, **fields}), 0, 255, 190)
        deliver(self.link, self.session, split(packet, DIALECT)[0][0])

    def order(self, command, *params, seconds=1.0):
        self.say("COMMAND_LONG", command=command, **{f"param{n}": float(value) for n, value in enumerate(params, 1)})
        self.flown.vehicle.run(seconds)
        (ack,) = [m for m in self.heard if m.name == "COMMAND_ACK" and m.values["result"] != 5][-1:]
        return ack.values["result"]

    @property
    def heard(self):
        return [message for frame in self.frames for message in split(frame, DIALECT)[0] if message.component == 1]

    def last(self, name):
        return [m.values for m in self.heard if m.name == name][-1]


@pytest.fixture
def flown(tmp_path):
    made = Commanded("lauv-noptilus-1", tmp_path)
    made.vehicle.start()
    made.vehicle.run(15.0)
    yield made
    made.vehicle.close()


@pytest.mark.parametrize("flavor", FLAVORS)
def test_modes_are_listed_once_all_or_one_and_the_last_one_ends_the_list(flown, flavor):
    station = Watcher(flown, flavor)
    assert station.order(REQUEST, AVAILABLE_MODES, 0) == ACCEPTED
    listed = [m.values for m in station.heard if m.name == "AVAILABLE_MODES"]
    assert [mode["mode_index"] for mode in listed] == [*range(1, len(listed) + 1)]
    assert {mode["number_modes"] for mode in listed} == {len(listed)}
    assert len({mode["custom_mode"] for mode in listed}) == len(listed)
    for mode in listed:
        assert mode["mode_name"].isascii()
        assert not mode["properties"] & NOT_SELECTABLE
    station.frames.clear()
    assert station.order(REQUEST, AVAILABLE_MODES, 2) == ACCEPTED
    assert [m.values for m in station.heard if m.name == "AVAILABLE_MODES"] == [listed[1]]
    station.frames.clear()
    assert station.order(REQUEST, AVAILABLE_MODES, len(listed) + 1) != ACCEPTED


def test_only_an_aircraft_is_not_steered_by_hand():
    for name, kind in KINDS.items():
        hidden = [mode.name for mode in kind.modes if kind.mode_properties(mode) & NOT_SELECTABLE]
        assert hidden == ([] if kind.afloat else ["TELEOPERATION"]), name


@pytest.mark.heavy
@pytest.mark.parametrize("flavor", FLAVORS)
def test_the_monitor_is_streamed_and_stays_the_same_while_the_modes_do(flown, flavor):
    station = Watcher(flown, flavor)
    for _ in range(40):
        station.say("HEARTBEAT", type=6)
        flown.vehicle.run(1.0)
    numbers = [m.values["seq"] for m in station.heard if m.name == "AVAILABLE_MODES_MONITOR"]
    assert 11 <= len(numbers) <= 14
    assert len(set(numbers)) == 1
    before, flown.link.endpoint.model.kind = numbers[0], KINDS["boat"]
    station.frames.clear()
    assert station.order(REQUEST, MONITOR) == ACCEPTED
    changed = station.last("AVAILABLE_MODES_MONITOR")["seq"] != before
    assert changed == (flavor == "ardupilot"), "PX4's modes are the same for all vehicles that stay afloat"


@pytest.mark.parametrize("flavor", ["ardupilot", "px4"])
def test_current_mode_is_that_of_the_heartbeat_at_once(flown, flavor):
    station = Watcher(flown, flavor)
    number = FLAVORS[flavor].custom_mode(KINDS["submarine"], flown.link.endpoint.model.mode)
    main, sub = (number, 0) if flavor == "ardupilot" else (4, 5)
    wanted = {"ardupilot": 9, "px4": 4 << 16 | 5 << 24}[flavor]
    station.say("HEARTBEAT", type=6)
    assert station.order(SET_MODE, CUSTOM_MODE, 9 if flavor == "ardupilot" else main, sub) == ACCEPTED
    names = [m.name for m in station.heard if m.values.get("custom_mode") == wanted]
    assert {"HEARTBEAT", "CURRENT_MODE"} <= set(names)
    current = station.last("CURRENT_MODE")
    assert current == {"standard_mode": RETURN, "custom_mode": wanted, "intended_custom_mode": wanted}
    assert station.order(SET_STANDARD_MODE, HOLD) == ACCEPTED
    assert station.last("CURRENT_MODE")["standard_mode"] == HOLD
    assert station.last("CURRENT_MODE")["custom_mode"] == station.last("HEARTBEAT")["custom_mode"]


@pytest.mark.heavy
def test_a_mode_that_was_left_without_stations_is_still_the_intended_one(flown):
    flown.link.gcs_timeout, flown.link.gcs_action = 20.0, "Return"
    station = Watcher(flown, "ardupilot")
    place = dict(x=round(41.19 * 1e7), y=round(-8.706 * 1e7), z=-3.0, frame=6)
    station.say("COMMAND_INT", command=REPOSITION, param1=-1.0, **place)
    for _ in range(10):
        flown.vehicle.run(1.0)
        station.say("HEARTBEAT", type=6)
    assert flown.modes[-1] == "GUIDED"
    flown.vehicle.run(30.0)
    current = station.last("CURRENT_MODE")
    assert current == {"standard_mode": RETURN, "custom_mode": 9, "intended_custom_mode": 4}
    assert station.order(SET_STANDARD_MODE, HOLD) == ACCEPTED
    current = station.last("CURRENT_MODE")
    assert current["intended_custom_mode"] == current["custom_mode"]
