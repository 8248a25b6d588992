"""Sources of the autopilot's messages."""

from collections.abc import Sequence
from dataclasses import dataclass

from mavlink.vehicle.mission import MissionStore
from mavlink.vehicle.model import VehicleModel
from mavlink.vehicle.parameters import ComponentMetadata
from mavlink.vehicle.telemetry.named_value_option import NamedValue


@dataclass(frozen=True, slots=True)
class TelemetryContext:
    """The vehicle, its mission, and what the profile adds."""

    model: VehicleModel
    mission: MissionStore
    metadata: ComponentMetadata
    named_values: Sequence[NamedValue] = ()
