"""Each shipped vehicle and a strict ground station, also at 20 % loss, with 5 % of all doubled and others overtaken."""

import contextlib
import math
import threading
import time
from itertools import product

import pytest

from mavlink import mavlink_system_id
from mavlink.missions import MissionCommand
from mavlink.vehicle.files.ftp_messages import FtpErrorCode, FtpOpcode, checksum
from shoal.missions import prepare
from tests.outside import free_port
from tests.repeats import all_but
from tests.tasks.transports.afloat import LOG, Afloat, earlier
from tests.tasks.transports.mavlink_files import request
from tests.tasks.transports.strict_peer import PATIENCE, PIECE, Line, NoAnswer, Peer

BAD = {"loss": 0.2, "twice": 0.05, "overtaken": 0.2, "late": 0.1}
TRIES = 4
ACCEPTED, DENIED, CANCELLED = 0, 14, 15
ORDER_DENIED, ORDER_UNSUPPORTED, BAD_Z = 2, 3, 12
MISSION, FENCE = 0, 1
REAL32 = 9
LAT, LON = 411_850_000, -87_062_000


def waypoint(number, **fields):
    fields = {
        "frame": 6,
        "command": MissionCommand.NAV_WAYPOINT,
        "autocontinue": 1,
        "param4": math.nan,
        "z": -2.0,
        **fields,
    }
    return {"x": LAT + 900 * number, "y": LON + 700 * number, **fields}


FENCED = [
    {"frame": 0, "command": 5001, "param1": 4.0, "x": LAT + x, "y": LON + y, "z": 0.0, "autocontinue": 1}
    for x, y in ((-90_000, -90_000), (90_000, -90_000), (90_000, 90_000), (-90_000, 90_000))
]


@pytest.fixture
def afloat(tmp_path):
    found = Afloat(tmp_path)
    yield found
    found.vehicle.close()


def same(sent, got):
    return [[item[name] for name in ("frame", "command", "x", "y", "z")] for item in sent] == [
        [item[name] for name in ("frame", "command", "x", "y", "z")] for item in got
    ]


def patient(transfer, *args):
    """What a transfer gives; of one in twenty the retries of the protocol are not enough, and its user tries again."""
    for _ in range(TRIES - 1):
        with contextlib.suppress(NoAnswer):
            found = transfer(*args)
            if not isinstance(found, dict) or found["type"] != CANCELLED:
                return found
        transfer.__self__.wait(1.0)  # what was overtaken
    return transfer(*args)


TAKEOFF = {"frame": 6, "command": MissionCommand.NAV_TAKEOFF, "autocontinue": 1, "param4": math.nan, "x": 0, "y": 0}
ONCE = [
    ("lauv-noptilus-1", "px4", "bad"),
    ("otter", "ardupilot", "good"),
    ("caravel", "px4", "good"),
    ("hexa-00", "px4", "good"),
    ("hexa-00", "ardupilot", "bad"),
]
HEIGHTS = {"lauv-noptilus-1": -2.0, "otter": 0.0, "caravel": 0.0, "hexa-00": 20.0}


def mission(profile, flavor, count=12):
    """Items for a vehicle; those of an ArduPilot begin with its home."""
    z = HEIGHTS[profile]
    items = [waypoint(number, z=z) for number in range(1, count + 1)]
    if profile == "hexa-00":
        items.insert(0, {**TAKEOFF, "z": z})
    return [waypoint(0, frame=0, z=0.0), *items] if flavor == "ardupilot" else items


def converse(peer, speed, items, flavor="px4", under_way=0.0):
    """All that a strict station does; the number of parameters.

    `speed` is the name of one, and `under_way` s are from the start of the mission to its pause.
    """
    own = flavor == "ardupilot"  # the first item is the home of the vehicle, whatever was sent
    ack = patient(peer.upload, items)
    assert ack["type"] == ACCEPTED
    back, id = patient(peer.download)
    assert same(items[own:], back[own:])
    assert len(back) == len(items)
    assert id == ack["opaque_id"] != 0
    assert patient(peer.upload, FENCED, FENCE)["type"] == ACCEPTED
    assert len(patient(peer.download, FENCE)[0]) == 4
    parameters = peer.parameters()
    assert speed in {values["param_id"].rstrip(b"\0") for values in parameters.values()}
    assert peer.set_parameter(speed, 1.25, REAL32) == 1.25
    assert peer.order(400, 1, 21196) == ACCEPTED
    assert peer.order(300) == ACCEPTED
    peer.wait(under_way)
    assert peer.order(193, 0) == ACCEPTED
    data = b""
    size = int.from_bytes(peer.ask_for_file(FtpOpcode.OPEN, b"/general.json"), "little")
    while (piece := peer.ask_for_file(FtpOpcode.READ, offset=len(data), size=PIECE)) != FtpErrorCode.END:
        data += piece
    assert len(data) == size > 100
    assert peer.ask_for_file(FtpOpcode.TERMINATE) == b""
    assert int.from_bytes(peer.ask_for_file(FtpOpcode.CHECKSUM, b"/general.json"), "little") == checksum(data)
    assert peer.ask_for_file(FtpOpcode.OPEN, b"/nothing") == FtpErrorCode.NOT_FOUND
    first = min(logs := peer.logs())
    assert (first, logs[first]["size"]) == (int(own), len(LOG))
    assert peer.log(first, len(LOG)) == LOG
    return len(parameters)


@pytest.mark.heavy
@pytest.mark.parametrize("seed", all_but([0], range(3)))
def test_everything_gets_through_a_bad_line(afloat, seed):
    peer = afloat.peer(**BAD, seed=seed)
    table = afloat.task.endpoint.parameters
    speed = table.find_entity_parameter("MAVLink", "Hold Speed").id.encode()
    assert converse(peer, speed, mission("lauv-noptilus-1", "px4")) == len(table)
    assert afloat.task.hold_speed == 1.25
    assert afloat.plans.count("mavlink") == 1, "an order is carried out once"
    assert afloat.plans.count("hold") == 1
    assert peer.line.out.lost > 20


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("profile", "flavor", "line"), all_but(ONCE, product(HEIGHTS, ["px4", "ardupilot"], ["good", "bad"]))
)
def test_each_shipped_vehicle_satisfies_a_strict_station(profile, flavor, line, tmp_path):
    found = Afloat(tmp_path, f"udpin://127.0.0.1:{{port}}?flavor={flavor}", profile)
    try:
        peer, items = found.peer(**(BAD if line == "bad" else {})), mission(profile, flavor)
        table = found.task.endpoint.parameters
        speed = table.find_entity_parameter("MAVLink", "Hold Speed").id.encode()
        climb = 10.0 if profile == "hexa-00" else 0.0
        assert converse(peer, speed, items, flavor, climb) == len(table)
        assert found.plans == ["mavlink", "hold"], "an order is carried out once"
        assert peer.order(193, 1) == ACCEPTED
        assert peer.order(176, 1, 99) == ORDER_DENIED
        assert peer.order(9999) == ORDER_UNSUPPORTED
        ack = patient(peer.upload, [*items[:-1], waypoint(12, z=math.nan)])
        assert ack["type"] == BAD_Z
        assert same(items[flavor == "ardupilot" :], patient(peer.download)[0][flavor == "ardupilot" :])
        assert peer.order(20) == ACCEPTED
        assert found.plans[3:] == ["return"]
    finally:
        found.vehicle.close()


@pytest.mark.heavy
def test_a_multirotor_that_was_paused_before_it_had_left_the_ground_takes_off_when_it_continues(tmp_path):
    found = Afloat(tmp_path, profile="hexa-00")
    try:
        peer = found.peer()
        assert peer.upload(mission("hexa-00", "px4"))["type"] == ACCEPTED
        assert (peer.order(400, 1), peer.order(300)) == (ACCEPTED, ACCEPTED)
        while not found.task.endpoint.model.latest.motors_running:
            peer.wait(0.1)
        assert peer.order(193, 0) == ACCEPTED
        peer.wait(3.0)
        assert peer.order(193, 1) == ACCEPTED
        assert peer.wait(20.0, "GLOBAL_POSITION_INT", where=lambda values: values["relative_alt"] > 10_000)
    finally:
        found.vehicle.close()


@pytest.mark.heavy
def test_everything_gets_through_in_real_time(tmp_path):
    port = free_port()
    overrides = [f"Transports.MAVLink:Links=udpin://127.0.0.1:{port}?flavor=px4", "Plan.Autostart:Enabled=Never"]
    folders = {"log_root": tmp_path / "log", "state_folder": tmp_path / "db"}
    earlier(tmp_path)
    vehicle = prepare("lauv-noptilus-1", clock="2x", overrides=overrides, **folders).vehicle
    vehicle.start()
    thread = threading.Thread(target=vehicle.run, daemon=True)
    thread.start()
    line = Line(port, lambda: time.sleep(0.002), time.monotonic, **BAD)
    try:
        peer = Peer(line, mavlink_system_id(vehicle.system))
        peer.ask(1.0, ("HOME_POSITION",), "HEARTBEAT", retries=60, type=6)
        table = vehicle.task_by_label("MAVLink").endpoint.parameters
        speed = table.find_entity_parameter("MAVLink", "Hold Speed").id.encode()
        assert converse(peer, speed, mission("lauv-noptilus-1", "px4")) == len(table)
    finally:
        vehicle.kernel.post(vehicle.stop)
        thread.join()
        vehicle.close()


def test_a_fence_can_be_read_back_as_it_came_once_it_is_acknowledged(afloat):
    peer = afloat.peer()
    for corners in (FENCED, FENCED[::-1], [*FENCED[2:], *FENCED[:2]]):
        assert peer.upload(corners, FENCE)["type"] == ACCEPTED
        assert same(corners, peer.download(FENCE)[0])


def asked_for(peer, since):
    """When (s after a time) which items were asked for, and how the upload ended."""
    heard = [(at - since, name, values) for at, name, values in peer.heard if at > since]
    requests = [(round(at, 1), v["seq"]) for at, name, v in heard if name == "MISSION_REQUEST_INT"]
    return requests, [v["type"] for _, name, v in heard if name == "MISSION_ACK"]


@pytest.mark.parametrize("step", [0, 1, 3])
@pytest.mark.parametrize("kind", [MISSION, FENCE])
def test_a_station_that_falls_silent_in_an_upload(afloat, step, kind):
    items = FENCED if kind == FENCE else [waypoint(number) for number in range(1, 5)]
    peer = afloat.peer()
    assert peer.upload(items, kind)["type"] == ACCEPTED
    before = peer.download(kind)
    peer.upload(items[::-1], kind, until=step)
    silent = afloat.vehicle.kernel.now_ns / 1e9
    peer.silent = False  # it listens, but does not answer
    assert peer.wait(3.0, "MISSION_ACK").values["type"] == CANCELLED
    requests, results = asked_for(peer, silent)
    assert requests == [(pytest.approx(0.25 * number, abs=0.06), step) for number in range(1, 6)]
    assert results == [CANCELLED]
    assert peer.wait(5.0, "MISSION_REQUEST_INT", "MISSION_ACK") is None, "it has ended"
    assert str(peer.download(kind)) == str(before), "the old items stay"
    assert peer.upload(items[::-1], kind)["type"] == ACCEPTED


@pytest.mark.heavy
def test_a_station_that_falls_silent_elsewhere_leaves_nothing_open(afloat):
    peer = afloat.peer()
    assert peer.upload([waypoint(1)])["type"] == ACCEPTED
    peer.ask(PATIENCE, ("MISSION_COUNT",), "MISSION_REQUEST_LIST")  # and asks for no item
    peer.send("LOG_REQUEST_DATA", id=0, ofs=0, count=len(LOG))
    peer.send("PARAM_REQUEST_LIST")
    assert int.from_bytes(peer.ask_for_file(FtpOpcode.OPEN, b"/general.json"), "little") > 100
    peer.silent = True
    afloat.vehicle.run(70.0)
    peer.line.pass_time()  # what has been sent meanwhile
    peer.wait(0.0)
    peer.silent = False
    assert peer.wait(2.0, "MISSION_ACK", "MISSION_ITEM_INT", "PARAM_VALUE", "LOG_DATA") is None
    assert peer.ask_for_file(FtpOpcode.READ, size=10) == FtpErrorCode.SESSION, "the file was closed"
    assert peer.upload([waypoint(2)])["type"] == ACCEPTED


def test_a_doubled_datagram_is_obeyed_once(afloat):
    peer = afloat.peer(twice=1.0, overtaken=1.0, late=0.1)
    for number in range(4):
        assert peer.upload([waypoint(number + 1), waypoint(number + 2)])["type"] == ACCEPTED
        peer.wait(0.2)  # copies of the answer, which could be taken for the next one
    assert peer.order(300) == ACCEPTED
    assert peer.order(193, 0) == ACCEPTED
    peer.wait(0.5)  # copies of answers
    assert peer.wait(3.0, "MISSION_ACK", "MISSION_REQUEST_INT") is None
    assert afloat.plans[-2:] == ["mavlink", "hold"], "the copy of the first order comes after the second one"
    assert afloat.task.link_set.drop_counts["doubled"] > 3


def test_two_stations_at_one_port_and_one_vanishes(afloat):
    line = afloat.line()
    first, second = afloat.peer(line, system=255), afloat.peer(line, system=250)
    mission = [waypoint(number) for number in range(1, 9)]
    first.upload([waypoint(20), waypoint(21), waypoint(22)], until=1)
    began = afloat.vehicle.kernel.now_ns / 1e9
    assert second.upload(mission)["type"] == DENIED, "while the other one uploads"
    assert second.upload(FENCED, FENCE)["type"] == ACCEPTED
    assert len(second.parameters()) == len(afloat.task.endpoint.parameters)
    while (ack := second.upload(mission))["type"] == DENIED:
        second.wait(0.5)
    assert ack["type"] == ACCEPTED
    assert second.download()[1] == ack["opaque_id"]
    assert same(mission, second.download()[0])
    assert afloat.vehicle.kernel.now_ns / 1e9 - began < 5.0
    assert [values["type"] for _, name, values in first.heard if name == "MISSION_ACK"] == []
    first.silent = False
    assert same(mission, first.download()[0])


@pytest.mark.heavy
def test_two_stations_at_one_port_at_once(afloat):
    line = afloat.line(**BAD)
    first, second = afloat.peer(line, system=255), afloat.peer(line, system=250)
    mission = [waypoint(number) for number in range(1, 7)]
    assert patient(first.upload, mission)["type"] == ACCEPTED
    for _ in range(3):  # one asks while answers to the other are on their way
        first.send("PARAM_REQUEST_LIST")
        second.send("MISSION_REQUEST_LIST")
        first.send("FILE_TRANSFER_PROTOCOL", payload=request(FtpOpcode.CHECKSUM, b"/general.json", sequence=70))
        assert same(mission, patient(second.download)[0])
        assert second.order(520, 1) == ACCEPTED
    assert not [name for _, name, _ in second.heard if name == "FILE_TRANSFER_PROTOCOL"]
    assert not [name for _, name, _ in first.heard if name == "MISSION_ITEM_INT"]
    assert len(first.parameters()) == len(afloat.task.endpoint.parameters)
