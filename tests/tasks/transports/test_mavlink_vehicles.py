"""Shipped vehicles at the command of a ground station: they hold where they are, and their health is what it is."""

import math
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest
from lean import BLIND, UNLOGGED

import imc
from imc.discovery import Service, Services
from runtime import State
from runtime.kernel import parse_clock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.missions import parse_plan, prepare
from tasks.transports.mavlink import MAVLink
from tests.outside import ALONE, free_port
from tests.repeats import all_but

PATIENCE = 60.0
FAR = "origin: 41.185°, -8.7062°\nplan: far\nspeed: {speed} m/s\nmaneuvers:\n"
PLANS = {
    "lauv-noptilus-1": FAR.format(speed=1.2) + "  - goto: {north: 300, depth: 2}",
    "otter": FAR.format(speed=1.2) + "  - goto: {north: 300, depth: 0}",
    "caravel": FAR.format(speed=1.2) + "  - goto: {north: 300, depth: 0}",
    "hexa-00": FAR.format(speed=5) + "  - takeoff: {altitude: 15}\n  - goto: {north: 600, altitude: 15}",
}
HOLD_AT, END = 60.0, 150.0  # s
CURRENT = "Simulators.StreamVelocity:Default Speed East="
# how far it may be from the place (m) after so long (s), in still water and in a current of 0.3 m/s, or some wind
NEAR = {
    ("lauv-noptilus-1", 0.0): (5.0, 15.0),
    ("lauv-noptilus-1", 0.3): (7.0, 15.0),
    ("otter", 0.0): (5.0, 0.0),
    ("otter", 0.3): (7.5, 0.0),
    ("caravel", 0.0): (25.0, 0.0),
    ("hexa-00", 0.3): (5.0, 15.0),
}


class Commanded:
    """A vehicle that executes its plan until a ground station tells it to hold."""

    def __init__(self, profile, folder, *, autostart=False, current=0.1, clock=None, **options):
        flat = ["Bathymetry:Data=", BLIND] if profile == "lauv-noptilus-1" else []
        loaded = load_profile(profile, overrides=[*ALONE, UNLOGGED, f"{CURRENT}{current}", *flat])
        loaded.override(f"Plan.Autostart:Enabled={'Simulation' if autostart else 'Never'}")
        made = build(
            loaded,
            loaded.parse_modes(["Simulation"]),
            clock=clock or parse_clock("virtual", loaded.start_time_ns),
            log_root=folder / "log",
            state_folder=folder / "db",
        )
        self.vehicle = made.vehicle
        kind = {"lauv-noptilus-1": "submarine", "hexa-00": "hexacopter"}.get(profile, "boat")
        links = [f"udpin:127.0.0.1:{free_port()}:px4"]
        options = {"hold_radius": float(loaded.value("Transports.MAVLink", "Hold Radius", "0")), **options}
        self.link = self.vehicle.add(MAVLink, "Transports.MAVLink", links=links, vehicle_kind=kind, **options)
        self.truths, self.modes, self.log = [], [], []
        self.vehicle.observe(imc.SimulatedState, self.truths.append)
        self.vehicle.observe(imc.LogBookEntry, lambda entry: self.log.append(entry.text))
        self.vehicle.observe(imc.VehicleState, lambda _: self.modes.append(self.link.endpoint.model.mode.name))

    def say(self, message):
        packet = imc.encode_with_header(message, self.vehicle.kernel.now_ns / 1e9, 0x4000, 1, self.vehicle.system, 0xFF)
        self.vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)

    def begin(self, plan):
        self.say(imc.PlanControl(plan_id=plan.plan_id, arg=plan, request_id=1))

    def hold(self):
        self.link.endpoint.control.hold(self.link.now)

    def until(self, condition, seconds):
        """Run until a condition holds, or so long."""
        for _ in range(round(seconds)):
            if condition():
                return
            self.vehicle.run(1.0)


@contextmanager
def commanded(profile, folder):
    """A vehicle that has run for 15 s and has no plan."""
    found = Commanded(profile, folder)
    found.profile = profile
    found.vehicle.start()
    found.vehicle.run(15.0)
    yield found
    found.vehicle.close()


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(
    ("profile", "current"), all_but([("lauv-noptilus-1", 0.3), ("otter", 0.0), ("hexa-00", 0.3)], NEAR)
)
def test_hold_means_to_stay_there(profile, current, tmp_path):
    flown = Commanded(profile, tmp_path, current=current)
    kernel = flown.vehicle.kernel
    flown.vehicle.start()
    kernel.after(15.0, flown.begin, parse_plan(PLANS[profile]))
    kernel.after(HOLD_AT, flown.hold)
    flown.vehicle.run(HOLD_AT)
    held = flown.truths[-1]
    assert flown.modes[-1] == "MISSION"
    flown.vehicle.run(END - HOLD_AT)
    flown.vehicle.close()
    near, settled = NEAR[profile, current]
    later = [truth for truth in flown.truths if truth.timestamp > held.timestamp + settled]
    assert max(math.hypot(t.x - held.x, t.y - held.y) for t in later) < near
    assert flown.modes[-1] == "HOLD"
    assert all(abs(t.z - held.z) < 0.5 for t in later), "at its depth or height: an aircraft does not land"


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("profile", all_but(["lauv-noptilus-1", "hexa-00"], PLANS))
def test_the_first_hold_ends_the_plan_that_began_by_itself(profile, tmp_path):
    flown = Commanded(profile, tmp_path, autostart=True)
    flown.vehicle.start()
    flown.vehicle.run(HOLD_AT)
    assert flown.modes[-1] == "MISSION"
    depth = flown.truths[-1].z
    flown.hold()
    flown.vehicle.run(END - HOLD_AT)
    flown.vehicle.close()
    assert set(flown.modes[-200:]) == {"HOLD"}
    assert flown.link.endpoint.model.active_guided_plan_id == "hold"
    assert not [text for _, text in flown.link.endpoint.model.notices if text.startswith("Cannot hold")]
    assert all(abs(truth.z - depth) < (1.5 if profile == "hexa-00" else 0.7) for truth in flown.truths[-3000:])


@pytest.mark.heavy
def test_a_vehicle_that_cannot_keep_station_stops(tmp_path):
    flown = Commanded("lauv-noptilus-1", tmp_path)
    flown.vehicle.start()
    flown.vehicle.kernel.after(15.0, flown.begin, parse_plan(PLANS["lauv-noptilus-1"]))
    flown.vehicle.run(30.0)
    flown.link.hold_speed = math.nan  # the vehicle refuses such a plan
    flown.hold()
    flown.vehicle.run(5.0)
    assert flown.modes[-1] == "HOLD"
    assert flown.vehicle.task("Supervisors.Vehicle").entity.state == State.NORMAL
    assert not flown.link.endpoint.model.armed_or_moving
    words = [text for _, text in flown.link.endpoint.model.notices if text.startswith("Cannot hold, stopping: ")]
    flown.vehicle.close()
    assert len(words) == 1


@pytest.mark.parametrize(("profile", "speed"), [("lauv-noptilus-1", 1.2), ("otter", 1.2), ("hexa-00", 5.0)])
def test_orders_without_a_speed_have_that_of_the_profile(profile, speed, tmp_path):
    given = load_profile(profile).value("Transports.MAVLink", "Guided Speed")
    flown = Commanded(profile, tmp_path, **({"guided_speed": float(given)} if given else {}))
    flown.vehicle.start()
    flown.vehicle.run(1.0)
    assert flown.link.endpoint.model.guided_speed == speed
    flown.link.guided_speed = 1.7
    assert flown.link.endpoint.model.guided_speed == 1.7
    flown.vehicle.close()


def test_another_vehicle_with_the_same_id_is_named(tmp_path):
    flown = Commanded("lauv-noptilus-1", tmp_path)
    flown.vehicle.start()
    flown.vehicle.run(1.0)
    long = "lauv-twin-" + "x" * 5000
    other = imc.Announce(sys_name="lauv-twin", sys_type=imc.SystemType.UUV, src=0x421A)
    packet = imc.encode_with_header(other, flown.vehicle.kernel.now_ns / 1e9, 0x421A, 0, 0xFFFF, 0xFF)
    for _ in range(2):
        flown.vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)
    told = Services.from_system_info([Service("mavlink+info", "10.0.0.7", path="/system/27")])
    for name, source, services in (
        ("lauv-other", 0x431A, str(told)),
        ("lauv-told", 0x431B, str(told).replace("7", "6")),
        (long, 0x441A, ""),
    ):
        heard = other.replace(sys_name=name, services=services)
        packet = imc.encode_with_header(heard, flown.vehicle.kernel.now_ns / 1e9, source, 0, 0xFFFF, 0xFF)
        flown.vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)
    flown.vehicle.run(1.0)
    flown.vehicle.close()
    assert [text for text in flown.log if "MAVLink id" in text][1:] == [
        "MAVLink id 26 is also that of lauv-told (0x431b): set System Id",
        f"MAVLink id 26 is also that of {long[:63]}… (0x441a): set System Id",
    ]
    assert [text for text in flown.log if "lauv-twin (0x421a): set System Id" in text] == [
        "MAVLink id 26 is also that of lauv-twin (0x421a): set System Id"
    ]


@pytest.mark.heavy
@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter", "hexa-00"])
def test_mavsdk_finds_a_shipped_vehicle_well(profile, tmp_path):
    port = free_port()
    links = f"Transports.MAVLink:Links=udpout:127.0.0.1:{port}:px4"
    folders = {"log_root": tmp_path / "log", "state_folder": tmp_path / "db"}
    vehicle = prepare(profile, clock="4x", overrides=[links], **folders).vehicle
    vehicle.start()
    thread = threading.Thread(target=vehicle.run, daemon=True)
    thread.start()
    try:
        command = [sys.executable, str(Path(__file__).with_name("mavsdk_health_client.py")), str(port)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    finally:
        vehicle.kernel.post(vehicle.stop)
        thread.join(PATIENCE)
        vehicle.close()
    assert done.stdout == "well\n", done.stderr
