"""A MAVLink ground station over UDP keeps a shipped vehicle in reach until it is silent: LostComms and Emergency."""

import pytest

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.monitors.emergency import Emergency
from tasks.transports.mavlink import MAVLink
from tests.outside import free_port
from tests.tasks.transports.mavlink_station import HOST, Station

GCS, ON_BOARD = 6, 18  # MAV_TYPE
STEP = 0.5  # s
CONSOLE = 0x4001


class Vehicle:
    """A vehicle in virtual time with a link to a station, which sends HEARTBEAT twice a second when it is asked to."""

    def __init__(self, profile, folder, consoles=""):
        loaded = load_profile(profile, overrides=[f"General:Consoles={consoles}"])
        self.vehicle = build(
            loaded,
            loaded.parse_modes("Simulation"),
            clock=VirtualClock(loaded.start_time_ns),
            log_root=folder / "log",
            state_folder=folder / "db",
        ).vehicle
        port = free_port()
        self.vehicle.add(MAVLink, "Transports.MAVLink", links=[f"udpin://{HOST}:{port}"])
        self.station = Station(None)
        self.station.vehicle = (HOST, port)
        self.links, self.lines, self.texts = [], [], []

    def start(self):
        self.vehicle.start()
        self.vehicle.observe(imc.VehicleLinks, self.links.append)
        self.vehicle.observe(imc.LogBookEntry, lambda entry: self.lines.append(entry.text))
        self.vehicle.observe(imc.Sms, lambda sms: self.texts.append(sms.contents))

    def run(self, seconds, kind=None):
        for _ in range(round(seconds / STEP)):
            if kind is not None:
                self.station.send("HEARTBEAT", type=kind)
            self.vehicle.run(STEP)

    def give(self, message):
        vehicle = self.vehicle
        packet = imc.encode_with_header(message, vehicle.kernel.now_ns / 1e9, CONSOLE, 0, vehicle.system, 0xFF)
        vehicle.bus.deliver(vehicle.bus.decode(packet), packet)

    def close(self):
        self.station.socket.close()
        self.vehicle.close()


@pytest.fixture
def sail(tmp_path):
    made = []

    def make(*args):
        made.append(Vehicle(*args[:1], tmp_path / str(len(made)), *args[1:]))
        return made[-1]

    yield make
    for each in made:
        each.close()


def wait_after_failure(vehicle):
    """Let the AUV wait at the surface after a plan that has failed, with a plan for lost communications."""
    task = vehicle.vehicle.task_by_label("Lost Communications")
    task.lost_comms_timeout = 20.0
    vehicle.start()
    vehicle.run(10.0)
    maneuver = imc.PlanManeuver(maneuver_id="1", data=imc.IdleManeuver(duration=5))
    plan = imc.PlanSpecification(plan_id="lostcomms", start_man_id="1", maneuvers=(maneuver,))
    vehicle.give(imc.PlanDB(op=imc.PlanDB.Op.SET, plan_id="lostcomms", arg=plan))
    vehicle.give(imc.PlanControl(op=imc.PlanControl.Op.STOP, request_id=7))
    for _ in range(200):
        vehicle.run(1.0)
        if task.entity.description == "no console in reach":
            return
    raise AssertionError(task.entity.description)


def is_started(vehicle):
    return "no console for 20 s: starting lostcomms" in vehicle.lines


@pytest.mark.heavy
@pytest.mark.computing
def test_a_ground_station_keeps_an_auv_in_reach_until_it_is_silent(sail):
    vehicle = sail("lauv-noptilus-1")
    wait_after_failure(vehicle)
    vehicle.run(60.0, GCS)
    assert not is_started(vehicle)
    names = {(link.sys_name, link.sys_type) for links in vehicle.links for link in links.links}
    assert names == {("mavlink:255", imc.SystemType.CCU)}
    vehicle.run(20.0)
    assert not is_started(vehicle)
    assert vehicle.links[-1].links == ()
    vehicle.run(8.0)
    assert is_started(vehicle)


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(("kind", "consoles"), [(ON_BOARD, ""), (GCS, "0x4001, mavlink:250")])
def test_a_program_on_board_and_a_station_that_may_not_command_keep_nothing_in_reach(sail, kind, consoles):
    vehicle = sail("lauv-noptilus-1", consoles)
    wait_after_failure(vehicle)
    vehicle.run(22.0, kind)
    assert is_started(vehicle), vehicle.lines[-9:]
    assert not vehicle.links


@pytest.mark.heavy
@pytest.mark.computing
def test_a_ground_station_holds_the_messages_of_a_multirotor_back_until_it_is_silent(sail):
    vehicle = sail("hexa-00")
    options = {"active": True, "sms_recipient_number": "+351000000000", "lost_communications_timeout": 60.0}
    vehicle.vehicle.add(Emergency, "Monitors.Emergency", **options)
    vehicle.start()
    vehicle.run(130.0, GCS)
    assert not vehicle.texts
    vehicle.run(60.0)
    assert not vehicle.texts
    vehicle.run(8.0)
    assert [text.partition(" /")[0][:13] for text in vehicle.texts] == ["(T) (hexa-00)"]
