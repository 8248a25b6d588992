"""The vehicle's parameters in MAVLink: their names, values and descriptions, and how stations set them."""

from mavlink.vehicle.parameters.extended_table import ExtendedParameter, ExtendedParameterTable
from mavlink.vehicle.parameters.metadata import ComponentMetadata
from mavlink.vehicle.parameters.names import parameter_ids
from mavlink.vehicle.parameters.server import ParameterServer
from mavlink.vehicle.parameters.table import INT32, REAL32, ParameterTable, is_valid_mavlink_parameter

__all__ = [
    "INT32",
    "REAL32",
    "ComponentMetadata",
    "ExtendedParameter",
    "ExtendedParameterTable",
    "ParameterServer",
    "ParameterTable",
    "is_valid_mavlink_parameter",
    "parameter_ids",
]
