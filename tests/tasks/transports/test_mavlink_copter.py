"""A multirotor seen by ground stations; MAVSDK watches a flight of the profile hexa-00 at four times real time."""

import json
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import imc
from shoal.missions import parse_plan, prepare
from tests.outside import free_port

PATIENCE = 60.0
DENIED = 2
Mode = imc.VehicleState.OpMode
ARMED, DISARMED = imc.ArmingState.State.ARMED, imc.ArmingState.State.DISARMED
PLAN = parse_plan("plan: hop\nmaneuvers:\n  - takeoff: {altitude: 6, speed: 1.5 m/s}")


def beat(desk):
    desk.session.build_and_send("HEARTBEAT", desk.now)
    return desk.said()[-1].values


def landed(desk):
    desk.session.build_and_send("EXTENDED_SYS_STATE", desk.now)
    return desk.said()[-1].values["landed_state"]


@pytest.mark.parametrize(("kind", "number"), [("submarine", 12), ("boat", 11), ("copter", 2), ("hexacopter", 13)])
def test_each_kind_has_its_type(open_desk, kind, number):
    assert beat(open_desk(kind=kind))["type"] == number


PX4_MODES = tuple(main << 16 | sub << 24 for main, sub in ((1, 0), (4, 4), (4, 3), (4, 2), (4, 6), (4, 6)))


@pytest.mark.parametrize(("flavor", "numbers"), [("ardupilot", (0, 3, 5, 4, 9, 9)), ("px4", PX4_MODES)])
def test_modes_of_a_copter(open_desk, flavor, numbers):
    desk = open_desk(flavor, "copter")
    hear, found = desk.endpoint.update_state, []

    def show(**vehicle):
        desk.endpoint.update_state(imc.VehicleState(**vehicle), "", desk.now)
        found.append(beat(desk)["custom_mode"])

    show(op_mode=Mode.SERVICE)
    hear(imc.ArmingState(state=ARMED), "", desk.now)
    plan = imc.PlanControlState
    desk.endpoint.update_state(plan(state=plan.State.EXECUTING), "", desk.now)
    show(op_mode=Mode.MANEUVER, maneuver_type=imc.Takeoff.ID)
    desk.endpoint.update_state(plan(state=plan.State.READY), "", desk.now)
    show(op_mode=Mode.SERVICE, maneuver_type=0xFFFF)
    show(op_mode=Mode.MANEUVER, maneuver_type=imc.Takeoff.ID)
    show(op_mode=Mode.MANEUVER, maneuver_type=imc.Land.ID)
    hear(imc.AutopilotMode(mode="LAND"), "", desk.now)
    show(op_mode=Mode.SERVICE, maneuver_type=0xFFFF)
    assert tuple(found) == numbers


def test_what_is_done_is_over(open_desk):
    desk = open_desk("ardupilot", "copter")
    for maneuver, state, mode in ((imc.Takeoff, ARMED, 5), (imc.Goto, ARMED, 5), (imc.Land, DISARMED, 0)):
        desk.endpoint.update_state(imc.ArmingState(state=state), "", desk.now)
        done = imc.VehicleState.Flags.MANEUVER_DONE
        desk.endpoint.update_state(
            imc.VehicleState(op_mode=Mode.MANEUVER, maneuver_type=maneuver.ID, flags=done), "", desk.now
        )
        assert beat(desk)["custom_mode"] == mode


def test_landed_state_follows_motors_and_maneuver(open_desk):
    desk = open_desk(kind="copter")
    hear, vehicle = desk.endpoint.update_state, imc.VehicleState(op_mode=Mode.MANEUVER)
    hear(imc.VehicleMedium(medium=imc.VehicleMedium.Medium.AIR), "", desk.now)
    assert landed(desk) == 2
    hear(imc.ArmingState(state=DISARMED), "", desk.now)
    assert landed(desk) == 1
    hear(imc.ArmingState(state=ARMED), "", desk.now)
    assert landed(desk) == 2
    for maneuver, state in ((imc.Takeoff, 3), (imc.Goto, 2), (imc.Land, 4)):
        desk.endpoint.update_state(vehicle.replace(maneuver_type=maneuver.ID), "", desk.now)
        assert landed(desk) == state


def test_motors_that_run_are_armed_and_not_disarmed_in_the_air(open_desk):
    desk = open_desk(kind="copter")
    desk.endpoint.update_state(imc.ArmingState(state=ARMED), "", desk.now)
    assert beat(desk)["base_mode"] & 128
    result, rest = desk.command(400, 0)
    assert result == desk.command(400, 0, 21196)[0] == DENIED
    assert rest[0].values["text"].startswith(b"Disarming denied: the vehicle is in the air")
    assert desk.command(176, 1, 1)[0] == DENIED
    assert desk.command(176, 1, 4, 3)[0] == 0
    desk.endpoint.update_state(imc.ArmingState(state=DISARMED), "", desk.now)
    assert not beat(desk)["base_mode"] & 128


def test_arming_from_the_ground_station_ends_with_the_flight(open_desk):
    desk = open_desk(kind="copter")
    assert desk.command(400, 1)[0] == 0
    for state in (ARMED, DISARMED):
        assert beat(desk)["base_mode"] & 128
        desk.endpoint.update_state(imc.ArmingState(state=state), "", desk.now)
    assert not beat(desk)["base_mode"] & 128


def test_a_submarine_stays_as_it_was(desk):
    desk.endpoint.update_state(imc.VehicleMedium(medium=imc.VehicleMedium.Medium.UNDERWATER), "", desk.now)
    desk.endpoint.update_state(imc.ArmingState(state=DISARMED), "", desk.now)
    assert landed(desk) == 2
    assert beat(desk)["custom_mode"] == 1 << 16


class Pilot:
    """Starts the plan on command, and lands the vehicle with an Abort a while after its end."""

    def __init__(self, vehicle):
        self.vehicle = vehicle
        self.landing = False
        vehicle.observe(imc.PlanControlState, self.follow)

    def publish(self, message):
        packet = imc.encode_with_header(
            message, self.vehicle.kernel.now_ns / 1e9, 0x4000, 0xFF, self.vehicle.system, 0xFF
        )
        self.vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)

    def begin(self):
        self.publish(imc.PlanControl(op=imc.PlanControl.Op.START, plan_id=PLAN.plan_id, arg=PLAN, request_id=1))

    def follow(self, state):
        if state.last_outcome == imc.PlanControlState.LastOutcome.SUCCESS and not self.landing:
            self.landing = True
            self.vehicle.kernel.after(5.0, self.publish, imc.Abort())


@pytest.mark.heavy
def test_mavsdk_watches_a_flight(tmp_path):
    port = free_port()
    links = f"Transports.MAVLink:Links=udpout:127.0.0.1:{port}:px4"
    patient = [f"Control.UAV.Autopilot:{name} Timeout=10" for name in ("State", "Reference")]
    patient += ["Navigation.UAV.Navigation:Euler timeout=10", "Monitors.Entities:Report Timeout=60"]
    folders = {"log_root": tmp_path / "log", "state_folder": tmp_path / "db"}
    vehicle = prepare("hexa-00", clock="4x", overrides=[links, *patient], **folders).vehicle
    pilot = Pilot(vehicle)
    vehicle.start()
    thread = threading.Thread(target=vehicle.run, daemon=True)
    thread.start()
    command = [sys.executable, str(Path(__file__).with_name("mavsdk_copter_client.py")), str(port)]
    client = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    watchdog = threading.Timer(PATIENCE, client.kill)
    watchdog.start()
    try:
        for line in client.stdout:
            if line.startswith("ready"):
                vehicle.kernel.post(pilot.begin)
            if line.startswith("{"):
                seen = json.loads(line)
    finally:
        watchdog.cancel()
        client.kill()
        client.wait()
        vehicle.kernel.post(vehicle.stop)
        thread.join(PATIENCE)
        vehicle.close()

    assert seen["modes"] == ["MANUAL", "MISSION", "HOLD", "LAND", "MANUAL"]
    assert seen["landed"] == ["ON_GROUND", "TAKING_OFF", "IN_AIR", "LANDING", "ON_GROUND"]
    assert seen["armed"] == [False, True, False]
    assert (seen["start"]["latitude_deg"], seen["start"]["longitude_deg"]) == pytest.approx((41.185, -8.7062), abs=2e-5)
    assert max(relative for relative, _ in seen["positions"]) == pytest.approx(6.0, abs=4.0)
    relative, absolute = seen["positions"][-1]
    assert relative == pytest.approx(0.0, abs=2.0)
    assert absolute - relative == pytest.approx(30.0, abs=2.0)
