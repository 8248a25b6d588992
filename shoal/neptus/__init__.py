"""The files that Neptus needs to know a vehicle: its definition and the list of its parameters."""

from shoal.neptus.parameter_file import parameter_list
from shoal.neptus.vehicle_file import left_out, vehicle_definition

__all__ = ["left_out", "parameter_list", "vehicle_definition"]
