"""Rejects starts for which the world of a vehicle has no room."""

import math
from collections.abc import Sequence

from runtime.vehicle import Vehicle
from shoal.scenarios.option_shorthands import BOTTOM
from shoal.scenarios.scenario import ScenarioFileError, ScenarioSetting
from tasks.simulators.gps import GPS
from tasks.simulators.vsim import VSIM

START_OPTIONS = ("Initial Depth", "Initial Position", "Tide Level", "Sounding Radius", "Out Of Bounds Depth")
"""The options that decide whether the water is deep enough, the likeliest to be wrong first."""


def check_start_depth(vehicle: Vehicle, settings: Sequence[ScenarioSetting]) -> None:
    """Reject settings of a scenario that start a vehicle, built and not started, deeper than the water there allows.

    Raises ScenarioFileError. The vehicle reports to its log book what is wrong in the profile alone.
    """
    receivers = [task for task in vehicle.tasks if isinstance(task, GPS) and task.initial_position]
    for task in vehicle.tasks:
        if not receivers or not isinstance(task, VSIM) or not task.initial_depth:
            continue
        lat, lon = map(math.radians, receivers[0].initial_position)
        concerned = (task.name, receivers[0].name, "World")
        about = [setting for setting in settings if setting.section in concerned and setting.option in START_OPTIONS]
        about.sort(key=lambda setting: START_OPTIONS.index(setting.option))
        about += [setting for setting in settings if setting.section == BOTTOM]
        if about and task.initial_depth > (deepest := task.max_depth_at(lat, lon)):
            water = max(0.0, task.water_depth_at(lat, lon))
            raise ScenarioFileError(
                f"{vehicle.name} cannot start at a depth of {task.initial_depth:g} m: "
                f"the water there is {water:.1f} m deep, of which its hull needs {water - max(0.0, deepest):.1f} m",
                about[0].where,
            )
