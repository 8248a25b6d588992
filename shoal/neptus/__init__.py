"""The files that Neptus needs for a vehicle: its definition and the list of its parameters."""

from shoal.neptus.parameter_file import parameter_list
from shoal.neptus.vehicle_file import unplannable_maneuvers, vehicle_definition

__all__ = ["parameter_list", "unplannable_maneuvers", "vehicle_definition"]
