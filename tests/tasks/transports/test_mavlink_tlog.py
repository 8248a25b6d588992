"""The recording of MAVLink links in the folder of the log: read by pymavlink, and imported."""

import shutil
from collections import Counter

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as mavlink

import imc
from mavlink import FLAVORS, Tlog, encode, load_dialect, split
from runtime.kernel import parse_clock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from shoal.logs.edit.tlog_import import import_tlog
from tasks.transports.logging import Logging
from tasks.transports.mavlink import MAVLink
from tasks.transports.mavlink_links.telemetry_log import MOST_WAITING, TelemetryLogs
from tests.outside import free_ports, largest_file
from tests.tasks.transports.mavlink_station import DIALECT, HOST, STATE, Station
from tests.tasks.transports.mavlink_tcp_lines import ConnectedVehicle

ARMED = 128
SIGNED, ARDUPILOT = 0x01, FLAVORS["ardupilot"]
Op = imc.LoggingControl.Op


def frame(number=0):
    definition = DIALECT.by_name["HEARTBEAT"]
    return encode(definition, definition.pack({"type": 12, "autopilot": 3}), number % 256, 26, 1)


def theirs(path):
    """What pymavlink reads: names by the system that sent them, and times."""
    file, names, times = mavutil.mavlink_connection(str(path)), Counter(), []
    while (message := file.recv_msg()) is not None:
        names[message.get_srcSystem(), message.get_type()] += 1
        times.append(message._timestamp)
    return names, times


@pytest.fixture
def sail(tmp_path):
    def run(script, *links, seconds=30.0, **parameters):
        async def through(control):
            await script(control)
            control.task.vehicle.stop()

        tasks = [(Logging, {"flush_interval": 1.0}), (MAVLink, {"links": list(links), "tlog": True, **parameters})]
        return simulate(tasks, [STATE], seconds=seconds, log_root=tmp_path, script=through)

    return run


def test_all_frames_of_both_sides_are_recorded_and_can_be_read_and_imported(sail, tmp_path):
    async def script(control):
        await station.meet_with(control)
        station.order(400, 1, target=26)
        await station.expect("COMMAND_ACK")
        await control.sleep(3.0)
        received.update((m.system, m.name) for m in station.all)

    class Noting(Station):
        def __init__(self):
            super().__init__(None, port)
            self.all = []

        async def meet_with(self, control):
            self.script = control
            await self.meet()

        def take(self):
            before = len(self.inbox)
            super().take()
            self.all += self.inbox[before:]
            return self.inbox

    port, other = free_ports(2)
    received, station = Counter(), Noting()
    sail(script, f"udpout:{HOST}:{port}:ardupilot", f"udpout:{HOST}:{other}:px4")
    station.socket.close()
    (path,) = tmp_path.rglob("Data.tlog")
    names, times = theirs(path)
    (system,) = {system for system, _ in received}
    known = {message.msgname for message in mavlink.mavlink_map.values()}  # pymavlink lacks CURRENT_MODE
    wrong = {key: (names[key], n) for key, n in received.items() if key[1] in known and not 0 <= names[key] - n <= 30}
    assert not wrong, "recorded and received"
    assert (names[255, "HEARTBEAT"], names[255, "COMMAND_LONG"], names[system, "COMMAND_ACK"]) == (1, 1, 1)
    assert not any(name == "BAD_DATA" for _, name in names)
    assert times == sorted(times)
    assert (path.parent / "Data-px4.tlog").stat().st_size > 1000
    (tmp_path / "again").mkdir()
    done = import_tlog(path, tmp_path / "again")
    assert (done.lost, list(done.messages)) == (0, [f"mavlink-{system}"])
    assert imc.Log(tmp_path / "again").counts()["EstimatedState"] > 20


@pytest.mark.parametrize(("profile", "kind"), [("lauv-noptilus-1", 12), ("otter", 11), ("hexa-00", 13)])
def test_a_shipped_vehicle_leaves_a_recording_beside_its_log(profile, kind, tmp_path):
    loaded = load_profile(profile)
    clock = parse_clock("virtual", loaded.start_time_ns)
    selected = loaded.parse_modes(["Simulation"])
    vehicle = build(loaded, selected, clock=clock, log_root=tmp_path / "log", state_folder=tmp_path / "db").vehicle
    names = {12: "submarine", 11: "boat", 13: "hexacopter"}
    links = [f"udpout:{HOST}:{free_ports(1)[0]}:ardupilot"]
    vehicle.add(MAVLink, "Transports.MAVLink", links=links, vehicle_kind=names[kind], tlog=True)
    vehicle.start()
    vehicle.run(5.0)
    vehicle.close()
    paths = sorted(tmp_path.rglob("Data.lsf.gz"))  # two of those that begin a plan by themselves
    assert sorted(tmp_path.rglob("Data.tlog")) == [path.with_name("Data.tlog") for path in paths]
    path = max((path.with_name("Data.tlog") for path in paths), key=lambda path: path.stat().st_size)
    (tmp_path / "again").mkdir()
    import_tlog(path, tmp_path / "again", system=profile)
    log = imc.Log(tmp_path / "again")
    (announce,) = log.messages("Announce")
    types = {12: imc.SystemType.UUV, 11: imc.SystemType.USV, 13: imc.SystemType.UAV}
    assert (announce.sys_name, announce.sys_type) == (profile, types[kind])
    assert log.counts()["Heartbeat"] >= 4


def test_each_log_has_its_own_recording(sail, tmp_path):
    async def script(control):
        await control.sleep(3.5)
        control.task.publish(imc.LoggingControl(op=Op.REQUEST_START, name="dive"))
        await control.sleep(3.0)
        control.task.publish(imc.LoggingControl(op=Op.REQUEST_STOP))
        await control.sleep(3.0)

    sail(script, f"udpout:{HOST}:{free_ports(1)[0]}:px4")
    first, second = sorted(tmp_path.rglob("Data.tlog"))
    assert second.parent.name.endswith("_dive")
    ends = [[time for time, _ in Tlog(path, DIALECT).read(frozenset({"HEARTBEAT"}))] for path in (first, second)]
    assert [len(times) for times in ends] == [4, 3]
    assert ends[0][-1] < ends[1][0]


ORDERS = (
    (192, {"x": 411_851_000, "y": -87_062_000, "z": 12.0}),
    (192, {"x": 411_850_000, "y": -87_061_000, "z": 14.0}),
)


@pytest.mark.heavy
@pytest.mark.computing
def test_one_flight_is_one_recording_however_many_orders_it_has(tmp_path):
    flown = ConnectedVehicle("hexa-00", tmp_path, tlog=True)
    station = flown.connect()
    for command, place in ORDERS:
        station.send("COMMAND_INT", command=command, frame=6, **place)
        flown.vehicle.run(5.0)
    items = [(16, 411_850_000, -87_062_000, 15.0), (16, 411_850_000, -87_061_000, 15.0), (21, 0, 0, 0.0)]
    station.send("MISSION_COUNT", count=len(items))
    for seq, (command, x, y, z) in enumerate(items):
        station.send("MISSION_ITEM_INT", seq=seq, frame=6, command=command, autocontinue=1, x=x, y=y, z=z)
    flown.vehicle.run(1.0)
    station.send("COMMAND_LONG", command=300)
    beats = []
    while not beats or beats[-1].values["base_mode"] & ARMED:
        flown.vehicle.run(1.0)
        beats += [m for m in station.read() if m.name == "HEARTBEAT" and m.component == 1]
        assert len(beats) < 400
    flown.vehicle.run(5.0)
    flown.close()
    logs = sorted(path.parent.name for path in tmp_path.rglob("Data.lsf.gz"))
    assert {"goto", "mavlink-rest"} <= {name.partition("_")[2] for name in logs}
    flights = {}
    for path in sorted(tmp_path.rglob("Data.tlog")):
        beats = [m.values["base_mode"] & ARMED for _, m in Tlog(path, DIALECT).read(frozenset({"HEARTBEAT"}))]
        flights[path.parent.name] = sum(beat > 0 for beat in beats)
    names = [name for name, beats in flights.items() if beats > 1]
    assert [name.partition("_")[2] for name in names] == ["flight"], (logs, flights)
    assert flights[names[0]] > 30


def test_a_recording_whose_folder_is_removed_in_flight_continues_in_the_present_log(tmp_path):
    made = TelemetryLogs(load_dialect(), tmp_path, told.append, lambda: True)
    send = made.recording_transmit(ARDUPILOT, lambda sent: sent, lambda: 1.7e9)
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        made.on_logging_control(imc.LoggingControl(op=Op.STOPPED, name=name))
        made.on_logging_control(imc.LoggingControl(op=Op.STARTED, name=name))
        send(frame())
        made.flush()
    assert not (tmp_path / "second/Data.tlog").exists()
    shutil.rmtree(tmp_path / "first")
    made.flush()
    send(frame())
    made.flush()
    made.close()
    assert theirs(tmp_path / "second/Data.tlog")[0] == {(26, "HEARTBEAT"): 1}


def test_nothing_is_recorded_unless_it_is_asked_for(sail, tmp_path):
    async def script(control):
        await control.sleep(3.0)

    sail(script, f"udpout:{HOST}:{free_ports(1)[0]}:px4", tlog=False)
    assert not list(tmp_path.rglob("*.tlog"))


@pytest.fixture
def logs(tmp_path):
    made = TelemetryLogs(load_dialect(), tmp_path, told.append, lambda: False)
    told.clear()
    yield made
    made.close()


told = []


def test_a_full_disk_is_reported_once_survived_and_costs_no_frame(logs, tmp_path):
    send = logs.recording_transmit(ARDUPILOT, lambda sent: sent, lambda: 1.7e9)
    logs.set_folder(tmp_path)
    with largest_file() as limit:
        for number in range(300):
            if number == 100:
                logs.flush()
                limit((tmp_path / "Data.tlog").stat().st_size + 50)
            if number == 200:
                limit(None)
            send(frame(number))
            logs.flush()
    log = Tlog(tmp_path / "Data.tlog", DIALECT)
    assert [m.sequence for _, m in log.read(frozenset({"HEARTBEAT"}))] == [number % 256 for number in range(300)]
    assert log.lost == 0
    assert [words.split(":")[0] for words in told] == [
        "MAVLink is not recorded",
        "MAVLink is recorded again; 0 frames were lost",
    ]


@pytest.mark.heavy
def test_what_waits_for_a_folder_that_is_not_there_is_bounded(logs, tmp_path):
    send = logs.recording_transmit(ARDUPILOT, lambda sent: sent, lambda: 1.7e9)
    logs.set_folder(tmp_path / "nowhere")
    many = MOST_WAITING // (len(frame()) + 8) + 10
    for number in range(many):
        send(frame(number))
    (tmp_path / "nowhere").mkdir()
    logs.flush()
    assert (tmp_path / "nowhere/Data.tlog").stat().st_size <= MOST_WAITING
    assert "10 frames were lost" in told[-1]


@pytest.mark.parametrize("name", ["../../outside", "/tmp/outside"])
def test_the_name_of_a_log_leads_nowhere_else(logs, tmp_path, name):
    send = logs.recording_transmit(ARDUPILOT, lambda sent: sent, lambda: 1.7e9)
    logs.on_logging_control(imc.LoggingControl(op=Op.STARTED, name=name))
    send(frame())
    logs.flush()
    assert (told, list(tmp_path.parent.glob("outside*"))) == ([], [])


def test_signatures_and_keys_are_not_recorded(logs, tmp_path):
    link = mavlink.MAVLink(None, srcSystem=26, srcComponent=1)
    link.signing.secret_key, link.signing.sign_outgoing, link.signing.link_id = b"k" * 32, True, 0
    signed = mavlink.MAVLink_heartbeat_message(12, 3, 81, 0, 4, 3).pack(link)
    assert signed[2] == SIGNED
    send = logs.recording_transmit(ARDUPILOT, lambda sent: sent, lambda: 1.7e9)
    logs.set_folder(tmp_path)
    assert send(signed) == signed
    secret = mavlink.MAVLink_setup_signing_message(26, 1, b"secret" * 5 + b"xy", 1).pack(mavlink.MAVLink(None))
    (received,) = split(secret, DIALECT)[0]
    logs.record_received(ARDUPILOT, received, 1.7e9)
    logs.flush()
    assert theirs(tmp_path / "Data.tlog")[0] == {(26, "HEARTBEAT"): 1}
    assert b"secret" not in (tmp_path / "Data.tlog").read_bytes()
