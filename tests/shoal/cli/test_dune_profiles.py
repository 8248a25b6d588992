"""Profiles in the way of DUNE's own: many maneuvers in one section, boats of type ASV, options that Shoal lacks."""

import re

import pytest

from runtime.kernel import VirtualClock
from runtime.profile import dune_section_names, load_profile
from runtime.vehicle import build, find_task
from shoal.missions import Mission, parse_plan, prepare
from shoal.simulated_motion import FIXED_WING
from tasks.simulators.uav import UAV
from tests.command import shoal

# DUNE has the maneuvers of a vehicle in one section, common/maneuvers.ini, and options that Shoal has not.
MANEUVERS = """[Maneuver.Multiplexer]
Enabled                                 = Always
Entity Label                            = Multiplexer Maneuver
Activation Time                         = 0
Execution Priority                      = 10
Entity Label -- IdleManeuver            = Idle Maneuver
Entity Label -- Goto                    = Goto Maneuver
Loiter -- Minimum Radius                = 20
YoYo -- Check Path Errors               = false
YoYo -- Maximum Course Error            = 15
Takeoff -- Something                    = 1
Loitre -- Minimum Radius                = 10
"""
VEHICLE = """[Require auv/basic.ini]
[Require auv/simulation.ini]
[Require auv/navigation.ini]
[Require auv/control.ini]
[Require common/maneuvers.ini]
[Require auv/plans.ini]
[Require auv/supervisors.ini]
[Require auv/monitors.ini]
[Require common/transports.ini]
[General]
Vehicle = lauv-dune-1
[Plan.Autostart]
Enabled = Never
[Control.AUV.Attitude]
Coarse Altitude -- Enabled = true
Coarse Altitude -- Period = 30
Depth Offset = 0
Pitch PID Gain = 1, 1, 1
[Transports.UDP]
Contact Refresh Periodicity = 5.0
Custom Service Type = survey
"""
BOAT = """[Require otter.ini]
[General]
Vehicle = swordfish
Vehicle Type = asv
[Monitors.Medium]
Vehicle Type = ASV
[VSIM/Model/asv]
Type = ASV
Mass = 300
Buoyancy = 0, 0, -0.017
Volume = 4, 2, 1
Inertial Matrix = 250, 400, 1000, 1, 1, 1
Linear Drag Coefficients = 0.3, 0, 0, 0, 0, 0.9427, 0, 0, 0, 0
Quadratic Drag Coefficients = -0.0165, 0, 0, 0, 0, 0, 0, 0, 0, 0
Fin Count = 0
Engine Count = 2
Engine Parameters 0 = 0.9, 10.7, 2500
Engine Position 0 = -1, -1, 0
Engine Orientation 0 = 0, 0
Engine Parameters 1 = 0.9, 10.7, 2500
Engine Position 1 = -1, 1, 0
Engine Orientation 1 = 0, 0
Engine Max Force = 12
Integration Method = false
"""
PLAN = """plan: p
origin: 41.185°, -8.7062°
speed: 1.4 m/s
maneuvers:
  - goto: {north: 40, DEPTH}
  - loiter: {north: 60, east: 20, radius: 12, duration: 20s, DEPTH}
"""


@pytest.fixture
def tree(tmp_path, monkeypatch):
    """The folder with the profiles, which is the current one."""
    (tmp_path / "common").mkdir()
    (tmp_path / "common/maneuvers.ini").write_text(MANEUVERS)
    (tmp_path / "lauv-dune-1.ini").write_text(VEHICLE)
    (tmp_path / "swordfish.ini").write_text(BOAT)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def fly(profile, depth, tree):
    made = prepare(profile, log_root=tree / "log")
    return Mission(made.vehicle, parse_plan(PLAN.replace("DEPTH", depth))).fly(900)


@pytest.mark.heavy
def test_the_maneuvers_of_one_section_of_dune_are_carried_out(tree):
    report = fly("lauv-dune-1", "depth: 1", tree)
    assert (report.outcome, report.reason) == ("SUCCESS", "plan completed")
    assert report.maneuvers == ["Goto1", "Loiter2"]
    assert report.legs[1].distance > 20 * 1.4  # on a circle of the radius that the section sets


def test_the_sections_keep_their_labels_lines_and_options(tree):
    profile = load_profile("lauv-dune-1")
    assert profile.value("Maneuver.Idle", "Entity Label") == "Idle Maneuver"
    assert profile.value("Maneuver.ScheduledGoto", "Entity Label") == "ScheduledGoto Maneuver"  # DUNE's default
    radius = profile.config.option("Maneuver.Loiter", "Minimum Radius")
    assert radius is not None
    assert (radius.value, str(radius.origin)) == ("20", "common/maneuvers.ini:8")
    names = list(profile.config.sections)
    assert names[names.index("Maneuver.Multiplexer") + 1] == "Maneuver.Idle"
    assert "Maneuver.Takeoff" not in names  # only an aircraft takes off
    assert "common/maneuvers.ini:8" in shoal("explain", "lauv-dune-1", "Maneuver.Loiter").output


def test_an_override_of_the_one_section_reaches_the_task(tree):
    wanted = ["Maneuver.Multiplexer:Loiter -- Minimum Radius=33", "Maneuver.Multiplexer:Enabled=Simulation"]
    profile = load_profile("lauv-dune-1", overrides=wanted)
    made = build(profile, {"Simulation"}, clock=VirtualClock(profile.start_time_ns))
    try:
        loiter = next(task for task in made.vehicle.tasks if task.name == "Maneuver.Loiter")
        assert loiter.minimum_radius == 33.0
        assert "Maneuver.Multiplexer" not in str(made.skipped)
    finally:
        made.vehicle.close()


def test_a_maneuver_with_a_section_of_its_own_stays_as_it_is(tree):
    with (tree / "lauv-dune-1.ini").open("a") as file:
        file.write("[Maneuver.Loiter]\nEnabled = Never\n[Maneuver.YoYo]\nMinimum Altitude Reference = 7\n")
    profile = load_profile("lauv-dune-1")
    assert profile.value("Maneuver.Loiter", "Enabled") == "Never"
    assert profile.value("Maneuver.Loiter", "Minimum Radius") == ""
    assert profile.value("Maneuver.YoYo", "Enabled") == "Always"
    assert profile.value("Maneuver.YoYo", "Minimum Altitude Reference") == "7"


def test_options_that_shoal_lacks_are_one_warning_per_task(tree):
    lines = shoal("check", "lauv-dune-1", "-p", "Simulation").output.splitlines()
    attitude = [line for line in lines if "[Control.AUV.Attitude]" in line]
    others = "'Coarse Altitude -- Enabled', 'Coarse Altitude -- Period', 'Depth Offset' are not parameters"
    assert attitude == [
        f"lauv-dune-1.ini:15: warning: [Control.AUV.Attitude] {others} of Control.AUV.Attitude in Shoal, and "
        "are ignored (shoal explain lists those of Control.AUV.Attitude)",
        "lauv-dune-1.ini:18: warning: [Control.AUV.Attitude] 'Pitch PID Gain' is not a parameter of "
        "Control.AUV.Attitude (did you mean 'Pitch PID Gains'?)",
    ]
    yoyo = "[Maneuver.YoYo] 'Check Path Errors', 'Maximum Course Error' are not parameters of Maneuver.YoYo"
    assert any(line.startswith(f"common/maneuvers.ini:9: warning: {yoyo}") for line in lines)
    text = "[Maneuver.Multiplexer] 'Loitre -- Minimum Radius': 'Loitre' is not one of its maneuvers"
    assert f"common/maneuvers.ini:12: warning: {text} (did you mean 'Loiter'?)" in ("\n".join(lines))
    udp = "[Transports.UDP] 'Contact Refresh Periodicity', 'Custom Service Type' are not parameters of Transports.UDP"
    assert any(line.startswith(f"lauv-dune-1.ini:20: warning: {udp} in Shoal, and are ignored") for line in lines)
    assert lines[-1].endswith("5 warnings")


def test_an_option_of_a_maneuver_with_a_section_of_its_own_has_no_effect_and_is_reported(tree):
    with (tree / "lauv-dune-1.ini").open("a") as file:
        file.write("[Maneuver.Loiter]\nEnabled = Always\n")
    text = "[Maneuver.Multiplexer] 'Loiter -- Minimum Radius' has no effect: [Maneuver.Loiter] has its own Enabled"
    said = shoal("check", "lauv-dune-1", "-p", "Simulation").output
    assert f"common/maneuvers.ini:8: warning: {text} (set it in [Maneuver.Loiter])" in said
    assert said.count("has no effect: ") == 1


@pytest.mark.heavy
def test_a_boat_of_dune_flies_a_plan(tree):
    checked = shoal("check", "swordfish", "-p", "Simulation")
    assert checked.exit_code == 0, checked.output
    assert "DUNE's model of a boat is estimated from Mass and Volume; nothing reads 'Buoyancy'" in checked.output
    report = fly("swordfish", "depth: 0", tree)
    assert (report.outcome, report.reason) == ("SUCCESS", "plan completed")
    assert report.cross_track < 3.0


@pytest.mark.parametrize(
    "option",
    [
        "Transports.Announce:System Type=UAV",
        "Transports.Logging:System Type=USV",
        "Monitors.Medium:Vehicle Type=Asv",
        "Plan.DB:Debug Level=debug",
        "Simulators.StreamVelocity:Stream Velocity Source=gauss-markov",
    ],
)
def test_choices_are_accepted_in_any_letter_case(tree, option):
    done = shoal("check", "otter", "-p", "Simulation", "--set", option)
    assert (done.exit_code, done.output) == (0, "otter: nothing wrong\n")


def test_a_boat_without_height_and_a_power_model_of_one_value_load(tree):
    model = BOAT.replace("Volume = 4, 2, 1", "Volume = 4, 2, 0") + "[Simulators.Battery]\nEnabled = Simulation\n"
    power = "[General]\nPower Model -- Conversion - Watt = 50\nPower Model -- Conversion - RPM = 1000.0\n"
    (tree / "wave.ini").write_text(model + power)
    checked = shoal("check", "wave", "-p", "Simulation")
    assert checked.exit_code == 0, checked.output
    run = shoal("run", "wave", "-p", "Simulation", "--clock", "virtual", "--for", "2s", "--log-dir", str(tree / "log"))
    assert run.exit_code == 0, run.output


@pytest.mark.parametrize("option", ["Transports.UDP:Local Port=99999", "Transports.UDP:Address=nowhere"])
@pytest.mark.parametrize("clock", ["real", "virtual"])
def test_run_rejects_what_check_rejects_on_any_clock(tree, option, clock):
    assert shoal("check", "otter", "-p", "Simulation", "--set", option).exit_code == 1
    done = shoal("run", "otter", "-p", "Simulation", "--clock", clock, "--for", "1s", "--set", option)
    assert done.exit_code == 2 or done.exit_code == 1
    assert option.partition(":")[2].partition("=")[0] in done.output


def test_every_maneuver_of_the_table_is_a_task_or_not_in_shoal():
    missing = {name for name in dune_section_names.MULTIPLEXED.values() if find_task(name) is None}
    assert missing == {"Maneuver.Drop", "Maneuver.Sample", "Maneuver.StationKeepingExtended"}


WING = "[Require hexa-00.ini]\n[General]\nVehicle = wing\n"


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        (
            "[Simulators.UAV]\nBank Time Constant = 1\nSimulation type = 4DOF_bank\n",
            "[Simulators.UAV] Bank Time Constant: that is a fixed wing of DUNE; Simulators.UAV here is a multirotor",
        ),
        (
            "[Simulators.UAV]\nEnabled = Never\n[Simulators.LBL]\nEnabled = Simulation\n",
            "nothing simulates the motion of wing: Simulators.LBL cannot run here",
        ),
    ],
)
def test_a_simulated_vehicle_that_nothing_moves_or_that_is_another_one_does_not_run(more, reason, tmp_path):
    (tmp_path / "wing.ini").write_text(WING + more)
    (tmp_path / "p.yaml").write_text("plan: p\nmaneuvers:\n- idle: {duration: 1}\n")
    log = ["--log-dir", str(tmp_path / "log")]
    words = ["run", str(tmp_path / "wing.ini"), "-p", "Simulation", "--clock", "virtual", "--for", "1s", *log]
    mission = ["mission", str(tmp_path / "wing.ini"), str(tmp_path / "p.yaml"), *log]
    for command in (words, mission):
        result = shoal(*command)
        assert result.exit_code == 2
        assert reason in result.output
    for modes in ([], ["-p", "Simulation"]):
        result = shoal("check", str(tmp_path / "wing.ini"), *modes)
        assert result.exit_code == 1
        assert re.search(rf"wing\.ini:\d+: error: {re.escape(reason)}", result.output)


def test_a_fixed_wing_is_reported_beside_other_mistakes(tmp_path):
    """Also in scenarios, and where the profile has an error of its own."""
    text = WING + "[Simulators.UAV]\nBank Time Constant = 1\n[Nothing.Known]\nEnabled = Always\n"
    (tmp_path / "wing.ini").write_text(text)
    result = shoal("check", str(tmp_path / "wing.ini"), "-p", "Simulation")
    assert "[Nothing.Known]" in result.output
    assert "error: [Simulators.UAV] Bank Time Constant: that is a fixed wing of DUNE" in result.output
    (tmp_path / "wing.ini").write_text(text[: text.index("[Nothing")])
    scenario = "scenario: s\nvehicle: {profile: wing.ini}\nlimit: 5 s\nexpect: [{always: EstimatedState.z < 9 m}]\n"
    (tmp_path / "s.scenario.yaml").write_text(scenario)
    result = shoal("test", str(tmp_path / "s.scenario.yaml"))
    assert result.exit_code != 0
    assert "that is a fixed wing of DUNE" in result.output


def test_commands_agree_on_a_vehicle_without_a_simulator(tmp_path):
    (tmp_path / "wing.ini").write_text(WING + "[Simulators.UAV]\nEnabled = Never\n")
    (tmp_path / "p.yaml").write_text("plan: p\nmaneuvers:\n- idle: {duration: 1}\n")
    path, log = str(tmp_path / "wing.ini"), ["--log-dir", str(tmp_path / "log")]
    for command in (
        ["check", path],
        ["check", path, "-p", "Simulation"],
        ["run", path, "-p", "Simulation", "--clock", "virtual", "--for", "1s", *log],
        ["mission", path, str(tmp_path / "p.yaml"), *log],
    ):
        result = shoal(*command)
        assert "warning: nothing simulates the motion of wing" in result.output, command


@pytest.mark.parametrize("option", sorted(FIXED_WING))
def test_any_option_of_the_fixed_wing_of_dune_is_known_and_none_is_of_a_multirotor(option, tmp_path):
    (tmp_path / "wing.ini").write_text(f"{WING}[Simulators.UAV]\n{option.title()} = 1\n")
    result = shoal("check", str(tmp_path / "wing.ini"), "-p", "Simulation")
    assert f"[Simulators.UAV] {option.title()}: that is a fixed wing of DUNE" in result.output
    assert option not in {name.casefold() for name in UAV.parameters()}


def test_a_vehicle_in_simulation_without_a_simulator_is_reported(tmp_path):
    words = ["run", "hexa-00", "-p", "Simulation", "--clock", "virtual", "--for", "1s"]
    words += ["--log-dir", str(tmp_path / "log")]
    assert "nothing simulates" not in shoal(*words).output
    result = shoal(*words, "--set", "Simulators.UAV:Enabled=Never")
    text = "warning: nothing simulates the motion of hexa-00: no task of mode Simulation"
    assert text in result.output
    checked = shoal("check", "hexa-00", "-p", "Simulation", "--set", "Simulators.UAV:Enabled=Never")
    assert checked.exit_code == 0
    assert text in checked.output
