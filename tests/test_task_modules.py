"""Each module of `tasks` is a task, a part of one task, or is shared by tasks that are listed here."""

import ast
import inspect
import re
import sys
from pathlib import Path

import pytest

from runtime import Task
from tests.test_house import ROOT, SOURCES, TASKS, imports, module_of

SHARED = {  # what several tasks share in `tasks`: the tasks, and why it is there
    "tasks.transports.imc_links": (
        ("announce", "console", "discovery", "ftp", "logging", "udp", "tcp.client", "tcp.server"),
        "sockets, peers and packets of all transports of IMC",
    ),
    "tasks.control.remote_operation_task": (
        ("asv.remote_operation", "auv.remote_operation"),
        "how an operator steers by RemoteActions",
    ),
    "tasks.control.asv.boat_control": (
        ("conventional.heading", "conventional.speed", "heading_and_speed"),
        "loops, references and supervision of all boats",
    ),
    "tasks.maneuver.maneuver_task": (("goto", "loiter", "rows", "yo_yo"), "how each maneuver begins, reports and ends"),
    "tasks.maneuver.yo_yo_limits": (("compass_calibration", "yo_yo"), "how deep a zigzag may go"),
    "tasks.maneuver.circle_timer": (("loiter", "station_control"), "circles around a place"),
    "tasks.maneuver.survey_row_following": (("rows", "rows_coverage"), "rows that cover an area"),
    "tasks.maneuver.hover_control": (("loiter", "station_keeping"), "staying at a place in the air"),
    "tasks.maneuver.depth_spiral": (("elevator", "pop_up", "scheduled_goto"), "changes of depth on the spot"),
    "tasks.maneuver.station_control": (("pop_up", "station_keeping"), "staying at a place in the water"),
    "tasks.simulators.powered_device": (("motor", "servos", "uav", "vsim"), "what a battery does to actuators"),
    "tasks.simulators.true_state_sensor": (
        ("barometer", "depth_sensor", "dvl", "environment", "gaussian"),
        "the true state that sensors measure",
    ),
    "tasks.simulators.fixed_steps": (("uav", "vsim"), "the steps in which bodies move"),
    "tasks.control.desired_path": (("path.path_follower", "uav.path"), "when a path begins, and is reported"),
    "tasks.control.path.path_follower": (("pure_pursuit", "vector_field"), "how a path is followed and reported"),
    "tasks.plan.duplicate_requests": (("db", "replies"), "the answer to a request that comes twice"),
    "tasks.plan.outgoing_requests": (("engine", "generator"), "requests to database and supervisor"),
    "tasks.plan.replies": (("db", "engine", "generator"), "how requests about plans are answered"),
    "tasks.vision.airsim_api": (("airsim",), "the simulator's remote procedure calls"),
    "tasks.vision.cameras": (
        ("airsim", "camera", "device", "fisheye_camera", "recording"),
        "mounting, calibration, rendering and files of all cameras",
    ),
    "tasks.transports.mavlink_links": (("mavlink", "mavlink_replay"), "sockets, serial lines and files of MAVLink"),
    "tasks.transports.replayed_log": (("mavlink_replay", "replay"), "a log that is played"),
    "tasks.simulated_world": (
        ("simulators.dvl", "simulators.imu", "vision.fisheye_camera"),
        "the one world of a vehicle",
    ),
    "tasks.true_motion": (("simulators.uav", "simulators.vsim", "vision.airsim"), "the true motion as a message"),
    "tasks.pose_history": (("simulators.mug_detection_camera", "vision.airsim"), "where a vehicle is for its cameras"),
}
SERVING = {  # a part that stands beside the one task that it serves, since the task is not a folder
    "tasks.control.autopilot.autopilot_connection_url": "tasks.control.autopilot.mavlink",
    "tasks.control.autopilot.autopilot_parameters": "tasks.control.autopilot.mavlink",
    "tasks.control.uav.multirotor_parameters": "tasks.control.uav.autopilot",
    "tasks.plan.actions": "tasks.plan.engine",
    "tasks.plan.execution_progress": "tasks.plan.engine",
    "tasks.plan.plan_check": "tasks.plan.engine",
    "tasks.plan.plan_lines": "tasks.plan.engine",
    "tasks.plan.store": "tasks.plan.db",
    "tasks.sensors.gnss_parser": "tasks.sensors.gps",
    "tasks.supervisors.maneuver_launcher": "tasks.supervisors.vehicle",
    "tasks.supervisors.required_messages": "tasks.supervisors.failsafe",
    "tasks.transports.ftp_server": "tasks.transports.ftp",
    "tasks.transports.log_folder": "tasks.transports.logging",
    "tasks.transports.log_series": "tasks.transports.logging",
    "tasks.vision.detection_function": "tasks.vision.mug_detector",
}


@pytest.fixture(scope="module")
def trees():
    return {path: ast.parse(path.read_text()) for path in SOURCES if path.is_relative_to(ROOT / "tasks")}


def test_each_module_of_tasks_is_the_task_that_its_path_names_or_tells_whom_it_serves():
    modules = {module_of(path) for path in SOURCES if path.is_relative_to(ROOT / "tasks") and path.stem != "__init__"}
    tasks = {cls.__module__ for cls in TASKS.values()}
    known = {*tasks, *SHARED, *SERVING}  # and what is in a folder with such a name
    assert not {one for one in modules if not any(one == each or one.startswith(f"{each}.") for each in known)}


def test_a_part_serves_its_task_and_no_other(trees):
    tasks = {cls.__module__: ROOT / Path(*cls.__module__.split(".")).with_suffix(".py") for cls in TASKS.values()}
    users = {
        name: {found for module, names in imports(trees[path]) for found in (module, *(f"{module}.{n}" for n in names))}
        for name, path in tasks.items()
    }
    assert {part: [task for task, used in users.items() if part in used] for part in SERVING} == {
        part: [task] for part, task in SERVING.items()
    }


def test_what_tasks_share_has_those_users(trees):
    for shared, (users, _) in SHARED.items():
        beside = shared.rpartition(".")[0]
        for user in users:
            tree = trees[ROOT / Path(*f"{beside}.{user}".split(".")).with_suffix(".py")]
            told = {found for module, names in imports(tree) for found in (module, *(f"{module}.{n}" for n in names))}
            assert any(each == shared or each.startswith(f"{shared}.") for each in told), (
                f"{user} does not use {shared}"
            )


def test_a_task_that_commands_actuators_leaves_a_safe_command_as_it_ends():
    """Also by a failure: else the last command stays until another task detects the silence."""
    commands = re.compile(r"imc\.(SetThrusterActuation|SetServoPosition|SetControlSurfaceDeflection)\(")
    found = {}
    for name, cls in TASKS.items():
        in_simulation = cls.__module__.startswith("tasks.simulators.")
        if not in_simulation and commands.search(inspect.getsource(sys.modules[cls.__module__])):
            found[name] = cls.stop is not Task.stop
    assert len(found) >= 7
    assert all(found.values()), [name for name, stops in found.items() if not stops]
