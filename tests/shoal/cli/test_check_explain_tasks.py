"""`shoal check`, `explain`, `tasks` and `message`."""

import json
import re
from pathlib import Path

import pytest

from mavlink.vehicle.parameters.table import ParameterTable
from runtime.kernel import VirtualClock
from runtime.profile import load_profile, own_etc
from runtime.vehicle import build
from support.durations import parse_duration
from tasks.transports.mavlink_links.parameters_and_cameras import task_parameters
from tests.outside import NO_FILE


def test_check_finds_nothing_in_our_profiles(shoal):
    result = shoal("check", "lauv-noptilus-1", "-p", "Simulation")
    assert (result.exit_code, result.output) == (0, "lauv-noptilus-1: nothing wrong\n")


def test_check_names_file_line_and_fix_and_fails(shoal, tmp_path):
    gps = "[Simulators.GPS]\nEnabled = Simulation\nHDPO = 1\nHACC = -2\n"
    (tmp_path / "mine.ini").write_text(f"[General]\nVehicle = mine\n\n{gps}")
    result = shoal("check", "mine")
    assert result.exit_code == 1
    assert "mine.ini:6: warning" in result.output
    assert "did you mean 'HDOP'?" in result.output
    assert "mine.ini:7: error" in result.output
    assert "below the minimum" in result.output


def test_check_asks_the_tasks_what_they_think_of_their_values(shoal, tmp_path):
    (tmp_path / "mine.ini").write_text(
        "[Require lauv-noptilus-1.ini]\n[Simulators.MUGDetectionCamera]\nMUGs = 1.0\n"
        "[Vision.FisheyeCamera]\nField of View = 400\n"
    )
    result = shoal("check", "mine")
    assert result.exit_code == 1
    assert "mine.ini:3: error" in result.output
    assert "mine.ini:5: error" in result.output
    assert result.output.endswith("2 errors\n")
    assert "mine.ini:5" not in shoal("check", "mine", "-p", "Simulation").output


def test_check_is_strict_where_asked(shoal, tmp_path):
    (tmp_path / "mine.ini").write_text("[Require lauv-noptilus-1.ini]\n[Simulators.GPS]\nHDPO = 1\n")
    assert shoal("check", "mine").exit_code == 0
    assert shoal("check", "mine", "--strict").exit_code == 1


def test_a_deprecated_option_of_a_link_is_listed_with_its_line(shoal, tmp_path):
    link = "udpin://127.0.0.1:14551?flavour=px4"
    (tmp_path / "mine.ini").write_text(f"[Require lauv-noptilus-1.ini]\n[Transports.MAVLink]\nLinks = {link}\n")
    result = shoal("check", "mine", "-p", "Simulation")
    assert result.exit_code == 0
    assert "mine.ini:3: warning: [Transports.MAVLink] udpin://127.0.0.1:14551: flavour is deprecated" in result.output


def test_a_module_that_cannot_be_imported_is_named_with_its_line(shoal, tmp_path):
    (tmp_path / "broken_module.py").write_text("import nothing_like_it\n")
    (tmp_path / "mine.ini").write_text("[General]\nVehicle = mine\n\n[broken_module.Task]\nEnabled = Always\n")
    result = shoal("check", "mine")
    assert result.exit_code == 1
    assert "mine.ini:4: error" in result.output


def test_a_task_that_is_declared_wrong_is_one_problem_with_its_line(shoal, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "odd_drums.py").write_text(
        "from runtime import Task, param\n\n\nclass Drum(Task):\n    beat: float = param('a', 'Hz', 'Beat.')\n"
    )
    (tmp_path / "mine.ini").write_text("[General]\nVehicle = mine\n\n[odd_drums.Drum]\nEnabled = Always\n")
    result = shoal("check", "mine")
    assert result.exit_code == 1
    assert "mine.ini:4: error: [odd_drums.Drum]: odd_drums.Drum has an invalid declaration" in result.output
    listing = shoal("explain", "mine")
    assert (listing.exit_code, "has an invalid declaration" in listing.output) == (0, True)
    alone = shoal("tasks", "odd_drums.Drum")
    assert (alone.exit_code, alone.output.count("\n")) == (2, 1)


def test_check_looks_into_texts_that_name_links_and_messages(shoal, tmp_path):
    (tmp_path / "mine.ini").write_text(
        "[Require lauv-noptilus-1.ini]\n[Transports.Logging]\nTransports = EstimatedStat, GpsFix\n"
        "[Transports.MAVLink]\nLinks = udpin:127.0.0.1:14550:px5, udpout:127.0.0.1:14540:px4\n"
    )
    result = shoal("check", "mine", "-p", "Kinematic")
    assert "mine.ini:3: warning: [Transports.Logging] Transports: there is no message 'EstimatedStat'" in result.output
    assert "did you mean EstimatedState?" in result.output
    assert "mine.ini:5: warning: [Transports.MAVLink] Links: 'udpin:127.0.0.1:14550:px5': 'px5'" in result.output
    assert "did you mean 'px4'?" in result.output


def test_check_tries_the_keys_of_links_and_nobody_shows_them(shoal, tmp_path):
    key, raw = tmp_path / "mavlink.key", "0123456789abcdef" * 4
    key.write_text("sardines\n")
    (tmp_path / "mine.ini").write_text(
        "[Require lauv-noptilus-1.ini]\n[Transports.MAVLink]\n"
        f"Links = udpin://?key={key}, tcpin://?key={tmp_path}/none, udpin://?key={raw}\n"
    )
    result = shoal("check", "mine", "-p", "Kinematic")
    start = "mine.ini:3: warning: [Transports.MAVLink] Links: "
    assert f"{start}tcpin://: the key {tmp_path}/none cannot be used: {NO_FILE}" in result.output
    assert f"{start}'udpin://?key=...': 'key' is the path of a file that holds the key, not the key" in result.output
    assert result.output.count("Links") == 2
    assert raw not in result.output
    assert "sardines" not in result.output + shoal("explain", "mine", "Transports.MAVLink").output


def test_check_names_entities_that_nobody_has_and_options_of_a_model_that_nobody_reads(shoal, tmp_path):
    (tmp_path / "mine.ini").write_text(
        "[Require otter.ini]\n[Monitors.Entities]\nDefault Monitoring = Navigaton, GPS\n"
        "[VSIM/Model/otter]\nYaw Inertai = 3\n"
    )
    result = shoal("check", "mine", "-p", "Simulation")
    assert "mine.ini:3: warning: [Monitors.Entities] Default Monitoring: no running task" in result.output
    assert "'Navigaton'; the mode becomes ERROR (did you mean 'Navigation'?)" in result.output
    assert "mine.ini:5: warning: [VSIM/Model/otter] nothing reads 'Yaw Inertai' (did you mean 'Yaw Inertia'?)" in (
        result.output
    )
    assert result.output.endswith("2 warnings\n")


def test_check_goes_on_where_own_messages_are_missing(shoal, tmp_path):
    (tmp_path / "mine.ini").write_text(
        "[Require otter.ini]\n[General]\nMessages = missing.yaml\n[Zenoh]\nHear = Abort\n[Simulators.GPS]\nHDPO = 1\n"
    )
    result = shoal("check", "mine")
    assert result.exit_code == 1
    assert result.output.count("missing.yaml") == 1
    assert "'HDPO'" in result.output


def test_check_refuses_two_vehicles_with_one_mavlink_id(shoal, tmp_path):
    for name, address, number in (("lauv-a", 0x421A, 0), ("lauv-b", 0x4330, 26), ("lauv-c", 0x4331, 27)):
        start = f"[Require {own_etc()}/lauv-noptilus-1.ini]\n[General]\nVehicle = {name}\n"
        own = f"[IMC Addresses]\n{name} = {address:#x}\n[Transports.MAVLink]\nSystem Id = {number}\n"
        (tmp_path / f"{name}.ini").write_text(start + own)
    folder = ("-d", str(tmp_path))
    assert shoal("check", "lauv-a", "lauv-c", *folder).exit_code == 0
    done = shoal("check", "lauv-a", "lauv-b", *folder)
    assert done.exit_code == 1
    words = "lauv-b.ini:7: error: lauv-a and lauv-b have the same MAVLink id 26 (set [Transports.MAVLink] System Id of"
    assert words in done.output
    assert shoal("check", "lauv-a", "lauv-b", "--set", "Transports.MAVLink:Enabled=Never", *folder).exit_code == 0


def test_all_shipped_profiles_are_right(shoal):
    done = shoal("check")
    assert done.exit_code == 0, done.output
    assert "error" not in done.output
    assert "have the same MAVLink id" not in done.output


def test_two_profiles_that_are_not_named_together_may_share_a_mavlink_id(shoal, tmp_path):
    for name, address in (("lauv-a", 0x421A), ("lauv-b", 0x431A)):
        start = f"[Require {own_etc()}/lauv-noptilus-1.ini]\n[General]\nVehicle = {name}\n"
        (tmp_path / f"{name}.ini").write_text(f"{start}[IMC Addresses]\n{name} = {address:#x}\n")
    done = shoal("check", "-d", str(tmp_path))
    assert done.exit_code == 0, done.output
    assert "note: lauv-a and lauv-b have the same MAVLink id 26" in done.output
    assert shoal("check", "lauv-a", "lauv-b", "-d", str(tmp_path)).exit_code == 1


def test_a_folder_is_no_profile(shoal, tmp_path):
    (tmp_path / "boat.ini").mkdir()
    assert "boat" not in shoal("check").output


def test_explain_calls_unknown_options_so(shoal, tmp_path):
    (tmp_path / "mine.ini").write_text("[General]\nVehicel = mine\n[Simulators.GPS]\nHDPO = 1\nZzz = 2\n")
    rows = {line.split()[0]: line for line in shoal("explain", "mine", "Simulators.GPS").output.splitlines()}
    assert rows["HDPO"].rstrip().endswith("unknown: not a parameter of this task; did you mean 'HDOP'?")
    assert rows["Zzz"].rstrip().endswith("unknown: not a parameter of this task")
    assert "unknown; did you mean 'Vehicle'?" in shoal("explain", "mine", "General").output


def test_a_mistake_in_a_shared_section_is_reported_once(shoal, tmp_path):
    world = "[World]\nGilders = 1 2\nWave Height = -3\n"
    (tmp_path / "mine.ini").write_text(f"[Require lauv-noptilus-1.ini]\n{world}[Bathymetry]\nLatitude = 4\n")
    lines = shoal("check", "mine").output.splitlines()
    assert "mine.ini:3: warning: [World] nothing reads 'Gilders' (did you mean 'Gliders'?)" in lines[0]
    assert "mine.ini:6: warning: [Bathymetry] nothing reads 'Latitude'" in lines[1]
    (tmp_path / "mine.ini").write_text("[Require lauv-noptilus-1.ini]\n[World]\nWave Height = -3\n")
    result = shoal("check", "mine")
    assert result.exit_code == 1
    assert "mine.ini:3: error: [World] Wave Height = -3 is not within 0 and 30" in result.output
    assert result.output.endswith("\n1 error\n")


def test_a_wrong_value_is_reported_once_beside_other_mistakes(shoal, tmp_path):
    values = "[Transports.UDP]\nLocal Port = 99999999\n[Nothing.Known]\nEnabled = Always\n"
    (tmp_path / "mine.ini").write_text(f"[Require lauv-noptilus-1.ini]\n{values}")
    lines = shoal("check", "mine").output.splitlines()
    assert [line.partition(": error: ")[0] for line in lines[:-1]] == ["mine.ini:3", "mine.ini:4"]
    assert lines[-1] == "2 errors"


def test_explain_lists_the_options_of_a_shared_section(shoal, tmp_path):
    (tmp_path / "mine.ini").write_text("[General]\nVehicle = mine\n[World]\nGilders = 1 2\nTide Level = 0.5\n")
    rows = {line.split("  ")[0]: line for line in shoal("explain", "mine", "World").output.splitlines()}
    assert rows["Tide Level"].split()[2:4] == ["0.5", "m"]
    assert "default" in rows["Water Visibility"]
    assert "did you mean 'Gliders'?" in rows["Gilders"]
    assert "Track" in shoal("explain", "mine", "World/Tug").output
    assert "there is no section" in shoal("explain", "mine", "Earth").output


def test_explain_names_files_as_they_are_found_from_here(shoal, tmp_path):
    (tmp_path / "mine.ini").write_text("[Require lauv-noptilus-1.ini]\n[Simulators.GPS]\nHACC = 4\n")
    assert " mine.ini:3 (overrides etc/auv/simulation.ini:" in shoal("explain", "mine.ini", "Simulators.GPS").output


def test_explain_says_who_set_what(shoal):
    section = "Simulators.EstimatedState"
    text = shoal("explain", "lauv-noptilus-1", section, "--set", f"{section}:Depth=5").output
    row = next(line for line in text.splitlines() if line.startswith("Depth "))
    assert row.split()[1:3] == ["5", "m"]
    assert "command line (overrides etc/auv/kinematic.ini:" in row
    assert "Simulators.GPS" in shoal("explain", "lauv-noptilus-1").output


@pytest.mark.parametrize("section", ["Simulators.IMU/AHRS", "Navigation.AUV.Navigation", "Supervisors.Failsafe"])
def test_explain_shows_the_names_that_ground_stations_show(shoal, tmp_path, section):
    profile = load_profile("lauv-noptilus-1")
    vehicle = build(profile, profile.parse_modes("Simulation"), clock=VirtualClock(0), log_root=tmp_path).vehicle
    names = {
        entry.declaration.name: entry.id
        for entry in ParameterTable(task_parameters(vehicle.tasks))
        if entry.view.section == section
    }
    lines = shoal("explain", "lauv-noptilus-1", section).stdout.splitlines()
    place = lines[1].index("MAVLink")
    shown = {line[: line.index("  ")]: line[place:].split("  ")[0] for line in lines[2:] if not line.startswith(" ")}
    assert {option: name for option, name in shown.items() if name} == names


def test_explain_shows_no_names_of_a_vehicle_without_mavlink(shoal, tmp_path):
    (tmp_path / "mine.ini").write_text("[General]\nVehicle = mine\n[Simulators.GPS]\nHDOP = 1\n")
    assert "MAVLink" not in shoal("explain", "mine", "Simulators.GPS").output
    (tmp_path / "mine.ini").write_text(
        "[General]\nVehicle = mine\n[Transports.MAVLink]\nEnabled = Always\n"
        "[Simulators.GPS]\nHDOP {editable: false} = 1\n"
    )
    lines = shoal("explain", "mine", "Simulators.GPS").output.splitlines()
    assert "GPS_DEBUG_LEVEL" in next(line for line in lines if line.startswith("Debug Level"))
    assert "GPS_HDOP" not in next(line for line in lines if line.startswith("HDOP"))


def test_explain_names_the_nearest_section(shoal):
    result = shoal("explain", "lauv-noptilus-1", "Simulators.GSP")
    assert result.exit_code == 2
    assert "Simulators.GPS" in result.output


def test_tasks_are_listed_and_described(shoal):
    assert "Vision.FisheyeCamera" in shoal("tasks").output
    assert "Activation Depth" in shoal("tasks", "gps").output
    assert "did you mean Simulators.GPS" in shoal("tasks", "Simulators.GSP").output


def test_tasks_are_found_by_a_word_or_by_an_input(shoal):
    def found(*words):
        return {task["task"] for task in json.loads(shoal("tasks", *words, "--json").stdout)}

    assert {"Simulators.DepthSensor", "Control.AUV.Allocator"}.isdisjoint(found("multirotor"))
    assert "Simulators.UAV" in found("multirotor")
    assert "Navigation.AUV.Navigation" in found("eulerangles")
    assert "Simulators.Battery" in found("voltage curve")
    assert shoal("tasks", "zebra").exit_code == 2
    assert "Simulators.UAV" in shoal("tasks", "multirotor").output


def test_messages_are_found_by_name_and_id(shoal):
    assert shoal("message", "2001").output == shoal("message", "estimatedmugstate").output
    assert "EstimatedMugState, id 2001" in shoal("message", "2001").output
    assert "did you mean EstimatedState" in shoal("message", "EstimatedStat").output
    assert shoal("message", "12345").exit_code == 2


@pytest.mark.parametrize(
    ("profile", "lacks"),
    [
        ("lauv-noptilus-1", "navigation, control, attitude, depth, actuators"),
        ("otter", "navigation, control, attitude, actuators"),
        ("hexa-00", "navigation, control, position, attitude, barometric height, actuators"),
        ("autopilot-sub", ""),
    ],
)
def test_check_names_the_parts_that_a_plan_lacks_on_hardware(shoal, profile, lacks):
    result = shoal("check", profile, "-p", "Hardware")
    assert result.exit_code == 0
    assert (f"maneuvers, {lacks}\n" in result.output) if lacks else ("nothing wrong" in result.output)


def test_a_task_of_the_user_may_do_the_part_that_is_missing(shoal, tmp_path):
    assert shoal("new", "driver", "DepthCell").exit_code == 0
    (tmp_path / "mine.ini").write_text(
        "[Require lauv-noptilus-1.ini]\n[depth_cell.DepthCell]\nEnabled = Hardware\n"
        "Serial Port - Device = /dev/ttyUSB0\n"
    )
    result = shoal("check", "mine", "-p", "Hardware")
    assert "depth, actuators, unless depth_cell.DepthCell does it\n" in result.output


@pytest.mark.parametrize(
    ("text", "seconds"), [("90", 90), ("90s", 90), ("10min", 600), ("1h30min", 5400), ("500ms", 0.5), (" 1.5 h ", 5400)]
)
def test_durations(text, seconds):
    assert parse_duration(text) == seconds


@pytest.mark.parametrize("text", ["", "ten", "10 parsecs", "-5s", "5s!", "9" * 400, "nan"])
def test_other_texts_are_no_durations(text):
    with pytest.raises(ValueError, match="is not a duration"):
        parse_duration(text)


def test_the_files_that_explain_names_can_be_opened(shoal, tmp_path):
    """Shown as etc/... with the place of that folder; with its parent where the working folder has an etc/, too."""
    found = shoal("explain", "lauv-noptilus-1", "General").output
    (place,) = [line.removeprefix("etc/ is ") for line in found.splitlines() if line.startswith("etc/ is ")]
    shown = set(re.findall(r"\S+\.ini(?=:\d)", found))
    assert {"etc/lauv-noptilus-1.ini", "etc/auv/basic.ini"} <= shown
    assert all((Path(place).parent / name).is_file() for name in shown)

    (tmp_path / "etc").mkdir()
    parent = f"{Path(place).parent.name}/etc"
    found = shoal("explain", "lauv-noptilus-1", "General").output
    assert f" {parent}/lauv-noptilus-1.ini:" in found
    assert f"{parent}/ is {place}" in found

    (tmp_path / parent).mkdir(parents=True)
    found = shoal("explain", "lauv-noptilus-1", "General").output
    assert f"{place}/lauv-noptilus-1.ini:" in found
    assert "etc/ is " not in found
