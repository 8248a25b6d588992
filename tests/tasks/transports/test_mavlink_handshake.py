"""How ground stations connect, step by step and byte by byte, on a stream to a shipped vehicle.

The steps are those of QGroundControl's state machine at connection, and of Mission Planner; each is answered at once.
"""

import contextlib
import json
import lzma
import math
import select
import socket
from pathlib import Path

import pytest

from mavlink import StreamSplitter, split
from mavlink.vehicle.files.ftp_messages import checksum
from tests.outside import until
from tests.tasks.transports.afloat import Afloat
from tests.tasks.transports.lossy import HOST
from tests.tasks.transports.mavlink_station import DIALECT
from tests.tasks.transports.strict_peer import Peer

ACCEPTED, REJECTED, DENIED, UNSUPPORTED = range(4)
AT_ONCE = 0.5  # s
REQUEST_MESSAGE, SET_INTERVAL, BANNER = 512, 511, 42428
CAMERA = 100
DATA = Path(__file__).parents[2] / "data" / "mavlink"
FILES, FENCE, RALLY = 32, 16384, 32768  # MAV_PROTOCOL_CAPABILITY


class ByteLine:
    """A connection on which each byte comes alone, `pause` (s) after the one before."""

    pause = 0.001

    def __init__(self, vehicle, port):
        self.vehicle, self.peers, self.splitter = vehicle, [], StreamSplitter(DIALECT)
        self.socket = until(lambda: self.connect(port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.setblocking(False)

    def connect(self, port):
        """Connect, or let the vehicle run: it tries again if its port was taken."""
        self.vehicle.run(0.05)
        with contextlib.suppress(ConnectionRefusedError):
            return socket.create_connection((HOST, port))
        return None

    def clock(self):
        return self.vehicle.kernel.now_ns / 1e9

    def send(self, frame):
        assert len(split(frame, DIALECT)[0]) == 1
        for byte in frame:
            self.socket.send(bytes((byte,)))
            self.vehicle.run(self.pause)
            self.receive()

    def pass_time(self):
        self.vehicle.run(0.005)
        select.select([self.socket], [], [], 0.001)  # a busy computer delivers bytes later than virtual time passes
        self.receive()

    def receive(self):
        try:
            data = self.socket.recv(1 << 16)
        except BlockingIOError:
            return
        found, damages = self.splitter.feed(data)
        assert not damages
        for message in found:
            for peer in self.peers:
                peer.hear(message)


class Client(Peer):
    """A peer that never has to ask twice, and gets each answer at once."""

    def ask(self, seconds, names, name, where=lambda values: True, *, retries=0, **fields):
        return super().ask(AT_ONCE, names, name, where, retries=0, **fields)

    def command(self, command, *params):
        """The result of an order, and what came before it."""
        named = {f"param{number}": value for number, value in enumerate(params, 1)}
        self.wait(0.0)
        self.heard.clear()
        ack = self.ask(
            AT_ONCE, ("COMMAND_ACK",), "COMMAND_LONG", lambda v: v["command"] == command, command=command, **named
        )
        return ack.values["result"], [(name, values) for _, name, values in self.heard]

    def request(self, name, *params):
        """The messages with a name that are sent for REQUEST_MESSAGE."""
        result, before = self.command(REQUEST_MESSAGE, DIALECT.by_name[name].id, *params)
        assert result == ACCEPTED
        return [values for known, values in before if known == name]

    def beat(self):
        self.send("HEARTBEAT", type=6, autopilot=8)


def test_a_frame_that_comes_slowly_is_taken(afloat):
    """Each of its bytes comes 0.3 s after the one before: the vehicle gives up one that is not continued for 1 s."""
    line = ByteLine(afloat.vehicle, afloat.port)
    client = Client(line, afloat.task.endpoint.model.system)
    line.pause = 0.3
    assert client.command(REQUEST_MESSAGE, DIALECT.by_name["AUTOPILOT_VERSION"].id)[0] == ACCEPTED


def frames(recorded):
    """The messages in bytes of MAVLink 2, and their frames."""
    while recorded:
        size = 12 + recorded[1] + 13 * (recorded[2] & 1)
        (message,), _ = split(recorded[:size], DIALECT)
        yield message, recorded[:size]
        recorded = recorded[size:]


def text(values):
    return bytes(values).rstrip(b"\0").decode()


def connect_as_qgroundcontrol(client):
    """Its steps, in its order; what it knows then."""
    client.beat()
    (version,) = client.request("AUTOPILOT_VERSION")
    modes = client.request("AVAILABLE_MODES", 0)
    (about,) = client.request("COMPONENT_METADATA")
    general = client.fetch(text(about["uri"]).removeprefix("mftp://").encode())
    assert checksum(general) == about["file_crc"]
    described = {}
    for entry in json.loads(general)["metadataTypes"]:
        packed = client.fetch(entry["uri"].removeprefix("mftp://").encode())
        assert checksum(packed) == entry["fileCrc"]
        described[entry["type"]] = json.loads(lzma.decompress(packed) if entry["uri"].endswith(".xz") else packed)
    parameters = client.parameters()
    capable = version["capabilities"]
    mission = client.download(0)[0]
    fence = client.download(1)[0] if capable & FENCE else []
    rally = client.download(2)[0] if capable & RALLY else []
    return version, modes, described, parameters, (mission, fence, rally)


@pytest.fixture(autouse=True)
def unlimited_work(monkeypatch):
    monkeypatch.setattr("runtime.devices.device.MOST_WORK", math.inf)  # in a second, and virtual ones are short


@pytest.fixture(params=["px4", "ardupilot"])
def afloat(request, tmp_path):
    found = Afloat(tmp_path, f"tcpin://127.0.0.1:{{port}}?flavor={request.param}")
    yield found
    found.vehicle.close()


def test_qgroundcontrol(afloat):
    line = ByteLine(afloat.vehicle, afloat.port)
    client = Client(line, afloat.task.endpoint.model.system)
    began = line.clock()
    version, modes, described, parameters, lists = connect_as_qgroundcontrol(client)
    assert line.clock() - began < 10.0
    assert version["capabilities"] & FILES
    assert [mode["mode_index"] for mode in modes] == list(range(1, len(modes) + 1)), "the last one ends the list"
    assert {mode["number_modes"] for mode in modes} == {len(modes)}
    assert all(text(mode["mode_name"]) for mode in modes)
    named = {entry["name"] for entry in described[1]["parameters"]}  # 1: COMP_METADATA_TYPE_PARAMETER
    assert named == {text(values["param_id"]) for values in parameters.values()}
    assert lists == ([], [], [])
    for group, rate in ((1, 2), (2, 2), (3, 2), (6, 3), (10, 20), (11, 10), (12, 3)):  # of ArduPilot's
        client.send("REQUEST_DATA_STREAM", req_stream_id=group, req_message_rate=rate, start_stop=1)
    for number in (242, 245):
        assert client.command(SET_INTERVAL, number, 1e6)[0] == ACCEPTED
    client.heard.clear()
    client.wait(2.0)
    names = [name for _, name, _ in client.heard]
    assert 36 <= names.count("ATTITUDE") <= 44
    assert 1 <= names.count("HOME_POSITION") <= 3


def test_qgroundcontrol_asks_a_camera(afloat):
    line = ByteLine(afloat.vehicle, afloat.port)
    Client(line, afloat.task.endpoint.model.system).beat()
    camera = Client(line, afloat.task.endpoint.model.system, of=CAMERA)
    assert camera.wait(2.0, "HEARTBEAT").values["type"] == 30
    began = line.clock()
    (about,) = camera.request("CAMERA_INFORMATION")
    assert text(about["model_name"])
    for name in ("CAMERA_SETTINGS", "STORAGE_INFORMATION", "CAMERA_CAPTURE_STATUS"):
        assert len(camera.request(name, 1)) == 1
    for older in (521, 522, 525, 527):
        result, before = camera.command(older, 1)
        assert (result, bool(before)) == (ACCEPTED, True)
    for video in ((REQUEST_MESSAGE, 269), (REQUEST_MESSAGE, 270), (2504,), (2505, 1)):
        assert camera.command(*video)[0] in (REJECTED, UNSUPPORTED), "it has none, and says so"
    first = camera.ask(AT_ONCE, ("PARAM_EXT_VALUE",), "PARAM_EXT_REQUEST_LIST").values
    found = {first["param_index"]}
    while len(found) < first["param_count"]:
        found.add(camera.wait(AT_ONCE, "PARAM_EXT_VALUE").values["param_index"])
    assert line.clock() - began < 5.0


@pytest.mark.heavy
def test_mission_planner(afloat):
    line = ByteLine(afloat.vehicle, afloat.port)
    client = Client(line, afloat.task.endpoint.model.system)
    began = line.clock()
    client.beat()
    assert client.wait(1.5, "HEARTBEAT").system == client.wait(1.5, "HEARTBEAT").system
    assert len(client.request("AUTOPILOT_VERSION")) == 1
    assert client.command(BANNER)[0] == ACCEPTED
    assert b"@PARAM" not in client.fetch(b"@PARAM/param.pck?withdefaults=1")
    for group, rate in ((10, 4), (11, 2), (12, 2), (6, 2), (1, 2), (3, 2)):
        client.send("REQUEST_DATA_STREAM", req_stream_id=group, req_message_rate=rate, start_stop=1)
    client.heard.clear()
    client.wait(2.0)
    assert 7 <= [name for _, name, _ in client.heard].count("ATTITUDE") <= 9
    assert line.clock() - began < 10.0


def test_a_recorded_connection(tmp_path):
    """What QGroundControl said to an ArduSub, from a log of the project ardusub_log_tools."""
    recorded = (DATA / "qgroundcontrol.bin").read_bytes()
    afloat = Afloat(tmp_path, "tcpin://127.0.0.1:{port}", system_id=1)
    line = ByteLine(afloat.vehicle, afloat.port)
    client = Client(line, 1)
    for message, frame in frames(recorded):
        line.send(frame)
        if message.name == "COMMAND_LONG" and message.values["target_component"] == 1:
            assert client.wait(AT_ONCE, "COMMAND_ACK").values["command"] == message.values["command"]
    client.wait(2.0)
    counts = afloat.task.link_set.drop_counts
    afloat.vehicle.close()
    heard = [(name, values) for _, name, values in client.heard]
    names = [name for name, _ in heard]
    assert (names.count("AUTOPILOT_VERSION"), names.count("MISSION_COUNT")) == (2, 2)
    indexes = [values["param_index"] for name, values in heard if name == "PARAM_VALUE"]
    assert indexes == list(range(len(afloat.task.endpoint.parameters)))
    assert names.count("ATTITUDE") > 10
    assert counts.total() == 0
