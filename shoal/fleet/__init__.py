"""Several processes that belong together: those of one vehicle, or of a fleet."""

from shoal.fleet.fleet_config import FleetConfig, FleetVehicle, load_fleet
from shoal.fleet.fleet_file import FleetFileError
from shoal.fleet.keeper import Child, Keeper
from shoal.fleet.monitor import FleetMonitor, VehicleSummary
from shoal.fleet.ports import SYSTEM_ID, mavlink_id
from shoal.fleet.running_fleets import find_running, registered, stop_fleet
from shoal.fleet.shared_process import run_shared_process

__all__ = [
    "SYSTEM_ID",
    "Child",
    "FleetConfig",
    "FleetFileError",
    "FleetMonitor",
    "FleetVehicle",
    "Keeper",
    "VehicleSummary",
    "find_running",
    "load_fleet",
    "mavlink_id",
    "registered",
    "run_shared_process",
    "stop_fleet",
]
