"""Several processes that belong together: those of one vehicle, or of a fleet."""

from shoal.fleet.fleet_config import FleetConfig, FleetVehicle, load_fleet
from shoal.fleet.fleet_file import FleetFileError
from shoal.fleet.monitor import FleetMonitor, VehicleSummary
from shoal.fleet.parent_process import stop_with_parent
from shoal.fleet.ports import SYSTEM_ID, mavlink_id
from shoal.fleet.running_fleets import find_running_fleets, register_fleet, stop_fleet
from shoal.fleet.shared_process import run_shared_process
from shoal.fleet.supervisor import ManagedProcess, Supervisor

__all__ = [
    "SYSTEM_ID",
    "FleetConfig",
    "FleetFileError",
    "FleetMonitor",
    "FleetVehicle",
    "ManagedProcess",
    "Supervisor",
    "VehicleSummary",
    "find_running_fleets",
    "load_fleet",
    "mavlink_id",
    "register_fleet",
    "run_shared_process",
    "stop_fleet",
    "stop_with_parent",
]
