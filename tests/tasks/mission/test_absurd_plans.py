"""Plans with numbers that no vehicle can carry out, on shipped vehicles, from files and from consoles."""

import pytest
from lean import BLIND, UNLOGGED

import imc
from shoal import fly
from shoal.missions import Mission, parse_plan, prepare

LAUV = "lauv-noptilus-1"
HEAD = "plan: absurd\norigin: 41.185°, -8.7062°\nspeed: 1.2 m/s\n"
CCU = 0x4000


def plan(maneuver, head=""):
    return parse_plan(f"{HEAD}{head}maneuvers:\n  - {maneuver}\n    id: M\n")


@pytest.mark.parametrize(
    ("profile", "maneuver", "reason"),
    [
        (LAUV, "loiter: {north: 40, depth: 2, radius: 1e9, duration: 30}", "radius 1e+09 m is more than 25000 m"),
        (LAUV, "station_keeping: {north: 9, depth: 0, radius: 1e9}", "radius 1e+09 m is more than 25000 m"),
        (LAUV, "elevator: {north: 9, end_z: 2, radius: 1e9}", "radius 1e+09 m is more than"),
        (LAUV, "pop_up: {north: 9, depth: 2, radius: 1e9}", "radius 1e+09 m is more than 25000 m"),
        (LAUV, "loiter: {north: 9, depth: 2, type: EIGHT, length: 1e9}", "length 1e+09 m is more than 25000 m"),
        (LAUV, "loiter: {north: 9, depth: 2, type: EIGHT, bearing: 1e300}", "bearing 1e+300 rad is more than 1000 rad"),
        (
            LAUV,
            "follow_path: {north: 9, depth: 2, points: [[9, 0, -1e9]]}",
            "point 0: z -1e+09 m is less than -11000 m",
        ),
        (LAUV, "follow_path: {north: 9, altitude: 2, points: [[9, 0, 1e9]]}", "point 0: z 1e+09 m is more than 11000"),
        (LAUV, "follow_path: {north: 9, depth: 2, points: [[1, 1], [1, 1e9]]}", "point 1: y 1e+09 m is more than 1000"),
        (LAUV, "goto: {north: 40, depth: 2, speed: 1e9 rpm}", "speed 1e+09 rpm is more than 20000 rpm"),
        (LAUV, "goto: {north: 40, depth: 2, speed: 1e9 m/s}", "a speed of 1e+09 m/s is above the vehicle's 2 m/s"),
        (LAUV, "goto: {north: 40, altitude: 1e9}", "z 1e+09 m is more than 11000 m"),
        (LAUV, "goto: {north: 40, height: 5}", "z is neither a depth nor an altitude"),
        (LAUV, "elevator: {north: 40, end_z: 5, end_z_units: NONE}", "end_z is neither a depth nor an altitude"),
        (LAUV, "rows: {north: 9, depth: 2, width: 9, length: 9, hstep: 1e12}", "hstep 1e+12 m is more than 25000 m"),
        (LAUV, "rows: {north: 9, depth: 2, width: 1e12, length: 9, hstep: 9}", "width 1e+12 m is more than 1000000 m"),
        (LAUV, "yo_yo: {north: 9, altitude: 6, amplitude: 1e9, pitch: 9°}", "amplitude 1e+09 m is more than 25000 m"),
        (LAUV, "yo_yo: {north: 9, depth: 3, amplitude: 1, pitch: 720°}", "pitch 12.5664 rad is more than 1.58 rad"),
        (LAUV, "dislodge: {rpm: -1.0e+9}", "rpm -1e+09 rpm is less than -20000 rpm"),
        (LAUV, "follow_reference: {timeout: 1.0e+9}", "timeout 1e+09 s is more than 1000000 s"),
        ("otter", "goto: {north: 40, speed: 1e9 m/s}", "a speed of 1e+09 m/s is above the vehicle's 3 m/s"),
        ("otter", "goto: {north: 40, height: -1e9}", "z -1e+09 m is less than -11000 m"),
        ("hexa-00", "takeoff: {altitude: 1e9, speed: 2}", "z 1e+09 m is more than 11000 m"),
    ],
)
def test_an_absurd_number_is_refused_with_its_field_and_the_limit(profile, maneuver, reason):
    report = fly(plan(maneuver), profile, limit=60)
    assert (report.outcome, report.maneuvers) == ("FAILURE", [])
    assert report.reason.startswith(f"M: {reason}")
    assert len(report.reason) < 80


@pytest.mark.parametrize("arrival", [1e300, -1e300, 1.7e308])
def test_an_absurd_time_from_the_database_is_refused(tmp_path, arrival):
    made = prepare(LAUV, log_root=tmp_path / "log", state_folder=tmp_path / "db")
    goto = plan("scheduled_goto: {north: 40, depth: 2, travel_z: 2, travel_z_units: DEPTH}").maneuvers[0].data
    step = imc.PlanManeuver(maneuver_id="M", data=goto.replace(arrival_time=arrival))
    stored = imc.PlanSpecification(plan_id="stored", start_man_id="M", maneuvers=[step])
    vehicle, heard = made.vehicle, []
    vehicle.observe(imc.PlanControl, heard.append)

    def say(message):
        packet = imc.encode_with_header(message, vehicle.kernel.now_ns * 1e-9, CCU, 3, vehicle.system, 0xFF)
        vehicle.bus.deliver_and_send(imc.decode(packet), packet, None)

    later = vehicle.kernel.now_ns
    requests = imc.PlanDB(op=imc.PlanDB.Op.SET, plan_id="stored", arg=stored), imc.PlanControl(plan_id="stored")
    for second, request in zip((5, 6), requests, strict=True):
        vehicle.kernel.at(later + second * 10**9, say, request)
    Mission(vehicle, plan("idle: {duration: 20}")).fly(15.0)
    (told,) = [m.info for m in heard if m.dst == CCU]
    assert told.startswith(f"M: arrival_time {arrival:g} s is ")


@pytest.mark.parametrize(
    "maneuver",
    [
        "rows: {north: 9, depth: 0, width: 10, length: 20, hstep: 500, coff: 0}",
        "scheduled_goto: {north: 40, depth: 0, travel_z_units: DEPTH}",
        "goto: {north: 40, depth: 0, speed: 3000 rpm, yaw: 360 rad}",
        "elevator: {end_z: 0, end_z_units: NONE, flags: [CURR_POS]}",
        "elevator: {end_z: 1, radius: 8, flags: [CURR_POS]}",
        "station_keeping: {north: 9, depth: 0, radius: 0, duration: 5}",
    ],
)
def test_what_dune_carries_out_is_no_absurd_number(maneuver):
    assert fly(plan(maneuver), limit=200, overrides=[UNLOGGED, BLIND]).reason == "plan completed"


@pytest.mark.parametrize(("profile", "head"), [(LAUV, "depth: 0\n"), ("otter", "")])
def test_a_circle_of_which_most_is_missing_fails(profile, head):
    report = fly(
        plan("loiter: {north: 20, radius: 1000, duration: 20}", head), profile, limit=200, overrides=[UNLOGGED]
    )
    assert report.outcome == "FAILURE"
    assert report.reason.startswith("Loiter maneuver error: radius ")
    assert report.reason.endswith(" m instead of 1000 m")
